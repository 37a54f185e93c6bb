// The matrix of two characters of a recording: which link of the one touches which link of the other, and how.
import type {ReportPair} from './types.js';

/** Two characters of one file, and the pairs of their links. */
export interface CharacterPair {
  readonly file: number;
  readonly a: string;
  readonly b: string;
  readonly pairs: readonly ReportPair[];
}

export interface Matrix {
  readonly rows: readonly string[];
  readonly columns: readonly string[];
  /** By row, then by column. */
  readonly cells: readonly (ReportPair | null)[];
  /** Links that touch and are in no row or no column, since there are too many. */
  readonly leftOut: number;
}

const idOf = (slot: number, instance: number): string => `${slot}.${instance}`;

/** Pairs of characters that touch, in the order in which the report names them first. */
export function characterPairs(pairs: readonly ReportPair[]): CharacterPair[] {
  const found = new Map<string, CharacterPair & {pairs: ReportPair[]}>();
  for (const pair of pairs) {
    const id = `${pair.file}:${idOf(pair.a[0], pair.a[1])}:${idOf(pair.b[0], pair.b[1])}`;
    const known = found.get(id);
    if (known) known.pairs.push(pair);
    else found.set(id, {file: pair.file, a: pair.character_a, b: pair.character_b, pairs: [pair]});
  }
  return [...found.values()];
}

// The links that touch, in the order of the skeleton. Of too many those of the most frames are kept.
function linksOf(touches: readonly {link: number; name: string; frames: number}[], most: number):
    {names: string[]; places: Map<number, number>; leftOut: number} {
  const links = new Map<number, {name: string; frames: number}>();
  for (const {link, name, frames} of touches)
    links.set(link, {name, frames: (links.get(link)?.frames ?? 0) + frames});
  const kept = [...links].sort((x, y) => y[1].frames - x[1].frames).slice(0, most).sort((x, y) => x[0] - y[0]);
  return {
    names: kept.map(([, {name}]) => name),
    places: new Map(kept.map(([link], place) => [link, place])),
    leftOut: links.size - kept.length,
  };
}

/** Rows are links of the first character, columns those of the second. Of one character both are, on either side. */
export function makeMatrix({pairs}: CharacterPair, most: number): Matrix {
  const first = pairs[0];
  const isSelf = first !== undefined && idOf(first.a[0], first.a[1]) === idOf(first.b[0], first.b[1]);
  const asRows = pairs.map((pair) => ({link: pair.a[2], name: pair.link_a, frames: pair.frames}));
  const asColumns = pairs.map((pair) => ({link: pair.b[2], name: pair.link_b, frames: pair.frames}));
  const rows = linksOf(isSelf ? [...asRows, ...asColumns] : asRows, most);
  const columns = isSelf ? rows : linksOf(asColumns, most);
  const cells: (ReportPair | null)[] = new Array(rows.names.length * columns.names.length).fill(null);
  const put = (row: number | undefined, column: number | undefined, pair: ReportPair): void => {
    if (row !== undefined && column !== undefined) cells[row * columns.names.length + column] = pair;
  };
  for (const pair of pairs) {
    put(rows.places.get(pair.a[2]), columns.places.get(pair.b[2]), pair);
    if (isSelf) put(rows.places.get(pair.b[2]), columns.places.get(pair.a[2]), pair);
  }
  const leftOut = isSelf ? rows.leftOut : rows.leftOut + columns.leftOut;
  return {rows: rows.names, columns: columns.names, cells, leftOut};
}

export type Measure = 'share' | 'worst';

/** How much a pair touches, or how badly: by its depth, else by its triangles. Null: the measure does not know it. */
export const measureOf = (pair: ReportPair, measure: Measure): number | null =>
  measure === 'share' ? pair.share : pair.worst_depth ?? pair.worst_triangles;

/** The pair that touches the most; undefined: the measure knows nothing of any. */
export function hottest(pairs: readonly ReportPair[], measure: Measure): ReportPair | undefined {
  let best: ReportPair | undefined;
  let most = -Infinity;
  for (const pair of pairs) {
    const value = measureOf(pair, measure) ?? -Infinity;
    if (value <= most) continue;
    best = pair;
    most = value;
  }
  return best;
}

/** From 0, where a pair hardly touches, to 1 for the one that touches the most. Null: the measure knows nothing. */
export function heat(pair: ReportPair, measure: Measure, hottestPair: ReportPair | undefined): number | null {
  const own = measureOf(pair, measure);
  const most = hottestPair && measureOf(hottestPair, measure);
  if (own === null || most === null || most === undefined) return null;
  return most > 0 ? Math.min(Math.max(own / most, 0), 1) : 0;
}
