// Which rows of a report a reader wants to see.
import type {Report, ReportInterval, ReportPair, Row} from './types.js';

export interface Filter {
  /** Words, each of which a row's names must contain. */
  readonly text: string;
  /** Index of a file; null: all. */
  readonly file: number | null;
  /** In the unit of the report's depths; null: rows without a depth too. */
  readonly minDepth: number | null;
  readonly minFrames: number;
}

export const NO_FILTER: Filter = {text: '', file: null, minDepth: null, minFrames: 1};

/** Whether all depths of a report are in metres. */
export const hasMetres = (report: Report): boolean =>
  report.files.every(({frames_read: frames, metres_per_unit: unit}) => frames === 0 || unit > 0);

/** All that the words of a filter are looked for in, in lower case. */
function textOf(row: Row, report: Report): string {
  const {name, title} = report.files[row.file] ?? {name: '', title: ''};
  return [row.character_a, row.link_a, row.character_b, row.link_b, name, title].join('\n').toLowerCase();
}

function passes(row: Row, frames: number, filter: Filter, words: readonly string[], report: Report): boolean {
  if (filter.file !== null && row.file !== filter.file) return false;
  if (frames < filter.minFrames) return false;
  if (filter.minDepth !== null && (row.worst_depth === null || row.worst_depth < filter.minDepth)) return false;
  if (words.length === 0) return true;
  const text = textOf(row, report);
  return words.every((word) => text.includes(word));
}

const wordsOf = (text: string): string[] => text.toLowerCase().split(/\s+/).filter((word) => word !== '');

export function filterIntervals(report: Report, filter: Filter): ReportInterval[] {
  const words = wordsOf(filter.text);
  return report.intervals.filter((row) => passes(row, row.frames, filter, words, report));
}

/** A pair has to have an interval that is long enough. */
export function filterPairs(report: Report, filter: Filter): ReportPair[] {
  const words = wordsOf(filter.text);
  return report.pairs.filter((row) => passes(row, row.longest, filter, words, report));
}
