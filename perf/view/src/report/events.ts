// What a reader of a report looks for: events, in which two characters touch for a while, by whichever of their links.
import type {LinkRef, Report, ReportFile, ReportInterval} from './types.js';

export interface ReportEvent {
  /** Index of the file. */
  readonly file: number;
  readonly first: number;
  readonly last: number;
  readonly firstSeconds: number | null;
  readonly lastSeconds: number | null;
  /** The worst first: in the order of the report. */
  readonly intervals: readonly ReportInterval[];
  /** How many pairs of links touch. */
  readonly pairs: number;
}

/** The worst interval of an event. */
export const worstOf = ({intervals}: ReportEvent): ReportInterval => intervals[0]!;

/** Whether the frames of a file are states, which do not follow each other in time. */
export const hasStates = (file: ReportFile | undefined): boolean => file !== undefined && file.seconds_per_frame === 0;

/** Whether all files of a report that could be read are of states. */
export const hasStatesAlone = ({files}: Report): boolean => {
  const read = files.filter(({frames_read: frames}) => frames > 0);
  return read.length > 0 && read.every(hasStates);
};

const idOf = ([slot, instance]: LinkRef): string => `${slot}.${instance}`;
const charactersOf = ({file, a, b}: ReportInterval): string => `${file}:${idOf(a)}:${idOf(b)}`;
const linksOf = ({a, b}: ReportInterval): string => `${a[2]}-${b[2]}`;

/**
 * Events, the worst first. Intervals of the same two characters are one event where they overlap or follow each other.
 * Of states an event is a pair of links, with all states in which it touches.
 */
export function eventsOf(report: Report, intervals: readonly ReportInterval[]): ReportEvent[] {
  const order = new Map(intervals.map((interval, i) => [interval, i]));
  const groups = new Map<string, ReportInterval[]>();
  for (const interval of intervals) {
    const isState = hasStates(report.files[interval.file]);
    const id = isState ? `${charactersOf(interval)}:${linksOf(interval)}` : charactersOf(interval);
    const known = groups.get(id);
    if (known) known.push(interval);
    else groups.set(id, [interval]);
  }
  const events: ReportEvent[] = [];
  for (const group of groups.values()) {
    if (hasStates(report.files[group[0]!.file])) {
      events.push(eventOf(group, order));
      continue;
    }
    const byTime = [...group].sort((x, y) => x.first - y.first);
    let begin = 0, last = -1;
    byTime.forEach((interval, i) => {
      if (i > begin && interval.first > last + 1) {
        events.push(eventOf(byTime.slice(begin, i), order));
        begin = i;
        last = -1;
      }
      last = Math.max(last, interval.last);
    });
    events.push(eventOf(byTime.slice(begin), order));
  }
  return events.sort((x, y) => order.get(worstOf(x))! - order.get(worstOf(y))!);
}

function eventOf(group: readonly ReportInterval[], order: ReadonlyMap<ReportInterval, number>): ReportEvent {
  const intervals = [...group].sort((x, y) => order.get(x)! - order.get(y)!);
  const first = group.reduce((least, one) => one.first < least.first ? one : least);
  const last = group.reduce((most, one) => one.last > most.last ? one : most);
  return {
    file: first.file, first: first.first, last: last.last, firstSeconds: first.first_seconds,
    lastSeconds: last.last_seconds, intervals, pairs: new Set(group.map(linksOf)).size,
  };
}

/** In how many frames the event touches, at least one pair of it. */
export function framesOf({intervals}: ReportEvent): number {
  const byTime = [...intervals].sort((x, y) => x.first - y.first);
  let frames = 0, end = -1;
  for (const {first, last} of byTime) {
    frames += Math.max(0, last - Math.max(first, end + 1) + 1);
    end = Math.max(end, last);
  }
  return frames;
}
