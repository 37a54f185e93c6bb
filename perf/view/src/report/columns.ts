// The columns of the tables of intervals, pairs and files.
import {count} from '../ui/format.js';
import {hasStates, hasStatesAlone} from './events.js';
import {baseName, depthText, momentText, pointText, severityText, shareText} from './texts.js';
import type {Report, ReportFile, ReportInterval, ReportPair, Row} from './types.js';

/** What rows are sorted by. Null stands last in either order. */
export type SortKey = number | string | null;

export interface Column<R> {
  readonly title: string;
  /** What the number means, in words. */
  readonly meaning: string;
  /** Words are cut off where they are long, a sentence is not. */
  readonly kind: 'words' | 'sentence' | 'number';
  /** Whether it is shown where there is little room. */
  readonly isKey: boolean;
  readonly key: (row: R) => SortKey;
  readonly text: (row: R) => string;
}

type Described = readonly [title: string, meaning: string];

function words<R>([title, meaning]: Described, text: (row: R) => string): Column<R> {
  return {title, meaning, kind: 'words', isKey: true, key: text, text};
}

function numbers<R>([title, meaning]: Described, key: (row: R) => number | null, text: (row: R) => string): Column<R> {
  return {title, meaning, kind: 'number', isKey: false, key, text};
}

/** Sorts rows by a column; rows of the same key keep their order. */
export function sortRows<R>(rows: readonly R[], column: Column<R>, ascends: boolean): R[] {
  const keyed = rows.map((row) => ({row, key: column.key(row)}));
  const compare = (a: SortKey, b: SortKey): number => {
    if (a === null || b === null) return a === b ? 0 : a === null ? 1 : -1;
    const order = typeof a === 'string' || typeof b === 'string' ?
      String(a).localeCompare(String(b), 'en', {numeric: true}) : a - b;
    return ascends ? order : -order;
  };
  return keyed.sort((a, b) => compare(a.key, b.key)).map(({row}) => row);
}

export function linkColumns<R extends Row>(names: readonly string[]): Column<R>[] {
  const columns: Column<R>[] = [
    words(['Character', 'the first character'], (row) => row.character_a),
    words(['Link', 'the link of the first character'], (row) => row.link_a),
    words(['Other', 'the second character'], (row) => row.character_b),
    words(['Its link', 'the link of the second character'], (row) => row.link_b),
  ];
  if (names.length > 1) columns.unshift(words(['File', 'the recording'], (row) => names[row.file] ?? ''));
  return columns;
}

/** What is known of the worst frames of some rows: columns that would be empty are left out. */
function worstColumns<R extends Row>(report: Report, rows: readonly R[]): Column<R>[] {
  const columns: Column<R>[] = [];
  const hasTriangles = rows.some(({worst_triangles: triangles}) => triangles !== null);
  if (!hasTriangles || rows.some(({worst_depth: depth}) => depth !== null)) {
    columns.push(numbers(['Worst depth', 'how deep the deepest contact is'], (row) => row.worst_depth,
      (row) => depthText(row.worst_depth, report.files[row.file])));
  }
  if (hasTriangles) {
    columns.push(numbers(['Triangles', 'how many pairs of triangles touch in the worst frame'],
      (row) => row.worst_triangles,
      ({worst_triangles: triangles}) => triangles === null ? '\u2013' : count(triangles)));
  }
  const isState = (row: R): boolean => hasStates(report.files[row.file]);
  columns.push(hasStatesAlone(report) ?
    numbers(['State', 'in which state the worst contact is'], (row) => row.worst_frame,
      (row) => count(row.worst_frame)) :
    numbers(['At', 'when the worst contact is'], (row) => row.worst_frame,
      (row) => momentText(row.worst_frame, isState(row) ? null : row.worst_seconds)));
  return columns.map((column) => ({...column, isKey: true}));
}

function placeColumns<R extends Row>(report: Report, rows: readonly R[]): Column<R>[] {
  if (rows.every(({worst_point: point}) => point === null)) return [];
  return [{...words<R>(['Place', 'where the worst contact is in the world, x y z'],
    (row) => pointText(row.worst_point, report.files[row.file])), kind: 'number', isKey: false}];
}

export function intervalColumns(report: Report, names: readonly string[]): Column<ReportInterval>[] {
  return [
    ...worstColumns(report, report.intervals),
    ...linkColumns<ReportInterval>(names),
    numbers(['First', 'the first frame in contact'], (row) => row.first, (row) => count(row.first)),
    numbers(['Last', 'the last frame in contact'], (row) => row.last, (row) => count(row.last)),
    numbers(['Frames', 'how many frames it lasts'], (row) => row.frames, (row) => count(row.frames)),
    ...placeColumns(report, report.intervals),
  ];
}

export function pairColumns(report: Report, names: readonly string[]): Column<ReportPair>[] {
  return [
    ...worstColumns(report, report.pairs),
    ...linkColumns<ReportPair>(names),
    numbers(['Share', 'the share of all frames in contact'], (row) => row.share, (row) => shareText(row.share)),
    ...(hasStatesAlone(report) ? [
      numbers<ReportPair>(['States', 'in how many states they are in contact'], (row) => row.frames,
        (row) => count(row.frames)),
    ] : [
      numbers<ReportPair>(['Frames', 'how many frames are in contact'], (row) => row.frames,
        (row) => count(row.frames)),
      numbers<ReportPair>(['Intervals', 'how many intervals of contact there are'], (row) => row.intervals,
        (row) => count(row.intervals)),
      numbers<ReportPair>(['Longest', 'frames of the longest interval'], (row) => row.longest,
        (row) => count(row.longest)),
    ]),
    ...placeColumns(report, report.pairs),
  ];
}

/** A recording and the worst of its intervals, if it has one. */
export interface FileRow {
  readonly file: ReportFile;
  readonly name: string;
  readonly worst: ReportInterval | undefined;
}

export function fileColumns(): Column<FileRow>[] {
  return [
    words(['File', 'the recording'], (row) => row.name),
    words(['Title', 'what the recording says of itself'], (row) => row.file.title),
    numbers(['Frames', 'frames that could be read'], (row) => row.file.frames_read,
      (row) => count(row.file.frames_read)),
    numbers(['Worst depth', 'how deep the deepest contact is'], (row) => row.worst?.worst_depth ?? null,
      (row) => row.worst ? severityText(row.worst, row.file) : '\u2013'),
    {
      ...words<FileRow>(['Problems', 'what could not be read'], (row) => row.file.problems.join('. ')),
      kind: 'sentence',
    },
  ];
}

/** Files with a problem first, then in their order. */
export function fileRows(report: Report, names: readonly string[]): FileRow[] {
  const worst = new Map<number, ReportInterval>();
  for (const interval of report.intervals) if (!worst.has(interval.file)) worst.set(interval.file, interval);
  const rows = report.files.map((file, index) =>
    ({file, name: names[index] ?? baseName(file.name), worst: worst.get(index)}));
  const hasProblem = (row: FileRow): number => row.file.problems.length > 0 ? 0 : 1;
  return rows.sort((a, b) => hasProblem(a) - hasProblem(b));
}
