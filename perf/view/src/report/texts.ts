// The words and numbers of a report.
import {count, length, plural, seconds} from '../ui/format.js';
import {hasMetres} from './filter.js';
import type {Report, ReportFile, ReportPair, Row} from './types.js';

/** A depth of a file. Depths of files whose unit is known are in metres. */
export function depthText(depth: number | null, file: ReportFile | undefined): string {
  if (depth === null) return '\u2013';
  const text = length(Math.abs(depth), file !== undefined && file.metres_per_unit > 0 ? 1 : 0);
  return depth < 0 ? `${text} apart` : text;
}

/** How bad the worst frame of a row is: its depth, or how many triangles touch. */
export const severityText = (row: Row, file: ReportFile | undefined): string =>
  row.worst_depth === null && row.worst_triangles !== null ? plural(row.worst_triangles, 'triangle') :
    depthText(row.worst_depth, file);

/** A point in the world. In metres where the unit is known. */
export const pointText = (point: Row['worst_point'], file: ReportFile | undefined): string =>
  point === null ? '\u2013' :
    point.map((x) => x.toFixed(2)).join(', ') + (file !== undefined && file.metres_per_unit > 0 ? ' m' : '');

/** A frame and when it is. */
export const momentText = (frame: number, time: number | null): string =>
  time === null ? count(frame) : `${count(frame)} (${seconds(time)})`;

export function shareText(share: number): string {
  const percent = 100 * share;
  if (percent === 0 || percent >= 99.95) return `${percent.toFixed(0)} %`;
  return percent < 0.1 ? 'under 0.1 %' : `${percent.toFixed(1)} %`;
}

/** The last part of a path. */
export const baseName = (path: string): string => path.replace(/^.*[\\/](?=.)/, '');

/** A name for each file: the last part of its path, or all of it where two would have the same name. */
export function fileNames(files: readonly ReportFile[]): string[] {
  const uses = new Map<string, number>();
  for (const {name} of files) uses.set(baseName(name), (uses.get(baseName(name)) ?? 0) + 1);
  return files.map(({name}) => uses.get(baseName(name)) === 1 ? baseName(name) : name);
}

export const linkText = (character: string, link: string): string => `${character}: ${link}`;

export const pairTitle = (row: Row): string =>
  `${linkText(row.character_a, row.link_a)} \u2013 ${linkText(row.character_b, row.link_b)}`;

/** All that a report knows of a pair, in a sentence. */
export function pairSentence(pair: ReportPair, file: ReportFile | undefined): string {
  const depth = pair.worst_depth === null && pair.worst_triangles === null ? '' :
    `, at worst ${severityText(pair, file)}${(pair.worst_depth ?? -1) < 0 ? '' : ' deep'} in frame ` +
    count(pair.worst_frame);
  return `${pairTitle(pair)}: ${plural(pair.frames, 'frame')} (${shareText(pair.share)}) in ` +
    `${plural(pair.intervals, 'interval')}${depth}`;
}

/** What filters the command had, and what the page leaves out. */
export function notesOf(report: Report): string[] {
  const notes: string[] = [];
  if (report.min_depth !== null)
    notes.push(`Only intervals at least ${length(report.min_depth, hasMetres(report) ? 1 : 0)} deep are in it.`);
  if (report.min_frames > 1) notes.push(`Only intervals of at least ${plural(report.min_frames, 'frame')} are in it.`);
  const rest = (shown: number, all: number, what: string, where: string): void => {
    if (shown < all) notes.push(`The worst ${count(shown)} of ${count(all)} ${what} are here; ${where}.`);
  };
  rest(report.intervals.length, report.interval_count, 'intervals',
    report.csv === '' ? '`cab report --csv` writes all' : `${report.csv} has all`);
  rest(report.pairs.length, report.pair_count, 'pairs', '`cab report --pairs` writes all');
  return notes;
}

/** Why a row of a file opens nothing. */
export function notEmbeddedText(file: ReportFile): string {
  return file.frames === 0 ? 'The recording cannot be read' : `Not in this page: cab view ${file.name}`;
}
