// The times in which links touch as CSV: the columns of `cab report --csv` (docs/report.md), for other programs.
import type {Frame, Recording} from '../recording/types.js';
import {WORDS_PER_CONTACT} from '../recording/types.js';
import {hitAt, hitCount, isSamePair} from '../scene/hits.js';
import type {PairHistory} from './contact_index.js';
import type {Names} from './names.js';

const COLUMNS = [
  'file', 'character_a', 'link_a', 'character_b', 'link_b', 'first_frame', 'last_frame', 'frames', 'first_seconds',
  'last_seconds', 'worst_depth', 'worst_triangles', 'worst_frame', 'worst_seconds', 'worst_x', 'worst_y', 'worst_z',
  'problem',
];

const NUMBER = /^[+-]?\d+(\.\d*)?(e[+-]?\d+)?$/i;

// No text is a formula of a spreadsheet: docs/command.md has the rule.
const field = (value: string | number | null): string => {
  const plain = value === null || (typeof value === 'number' && !Number.isFinite(value)) ? '' : String(value);
  const text = /^[=+\-@'\t\r\n]/.test(plain) && !NUMBER.test(plain) ? `'${plain}` : plain;
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};

/** One row per interval of each pair, by the time in which it begins. */
export function markersOf(recording: Recording, file: string, names: Names, pairs: readonly PairHistory[],
                          times: Float64Array): string {
  const metres = recording.header.metresPerUnit > 0 ? recording.header.metresPerUnit : 1;
  const rows = pairs.flatMap((pair) => pair.worst.map(({frame, depth}, i) => {
    const [first, last] = [pair.intervals[2 * i]!, pair.intervals[2 * i + 1]!];
    const {hit, batchA, batchB} = pair;
    const point = pointOf(recording, recording.frame(frame), pair);
    return {first, fields: [
      file, names.instance(batchA, hit.instanceA), names.link(batchA, hit.linkA), names.instance(batchB, hit.instanceB),
      names.link(batchB, hit.linkB), first, last, last - first + 1, times[first]!, times[last]!,
      depth === null ? null : Math.fround(metres * depth), null, frame, times[frame]!,
      ...(point?.map((x) => metres * x) ?? [null, null, null]), null,
    ]};
  }));
  rows.sort((a, b) => a.first - b.first);
  return [COLUMNS, ...rows.map(({fields}) => fields)].map((line) => `${line.map(field).join(',')}\n`).join('');
}

// The middle of a contact's two points in the world; null: there is none.
function pointOf(recording: Recording, frame: Frame, {hit, batchA}: PairHistory): number[] | null {
  const {contacts, hits} = frame;
  if (!contacts) return null;
  let at = 0;
  while (at < hitCount(hits) && !isSamePair(hitAt(hits, at), hit)) ++at;
  if (at === hitCount(hits)) return null;
  const bodies = recording.batches[batchA]?.staticBodies;
  const input = frame.inputs.find(({batch}) => batch === batchA);
  const origin = bodies ? bodies.bodies[hit.instanceA]?.origin ?? bodies.origin :
    input?.origins?.subarray(3 * hit.instanceA, 3 * hit.instanceA + 3);
  const from = WORDS_PER_CONTACT * at;
  return [0, 1, 2].map((k) => (origin?.[k] ?? 0) + (contacts[from + 4 + k]! + contacts[from + 7 + k]!) / 2);
}
