// What the dial is set to, and what comes of it.
import type {Dial, RunResult} from '../engine/types.js';
import {type Frame, WORDS_PER_HIT} from '../recording/types.js';
import {hitCount} from '../scene/hits.js';

export const isAsRecorded = (dial: Dial): boolean => Object.values(dial).every((value) => value === undefined);

/** Whether links that are apart may be hits of a frame, as a dial runs it. */
export const hasMargin = ({settings, inputs}: Frame, dial: Dial): boolean =>
  (dial.margin ?? settings.margin) > 0 || inputs.some(({margins}) => margins?.some((margin) => margin > 0));

/** The dial with some fields set to others; undefined sets one back to what was recorded. */
export function changed(dial: Dial, change: {[K in keyof Dial]?: Dial[K] | undefined}): Dial {
  const next: Record<string, string | number> = {};
  for (const [name, value] of Object.entries({...dial, ...change})) {
    if (value !== undefined) next[name] = value;
  }
  return next;
}

export interface Verdict {
  kind: 'same' | 'other_settings' | 'different';
  text: string;
}

/** What the two hashes say. */
export function verdictOf(frame: Frame, result: RunResult, dial: Dial): Verdict {
  if (result.hash === frame.hash) {
    return {
      kind: 'same',
      text: isAsRecorded(dial) ? 'Same bits in your browser.' :
                                 'Same bits in your browser: these settings find the same hits.',
    };
  }
  const recorded = keysOf(frame.hits);
  const here = keysOf(result.hits);
  const lost = [...recorded].filter((key) => !here.has(key)).length;
  const added = [...here].filter((key) => !recorded.has(key)).length;
  if (isAsRecorded(dial)) {
    return {
      kind: 'different',
      text: `Different bits: ${lost} recorded hits are not found here, ${added} are found here alone.`,
    };
  }
  const same = lost === 0 && added === 0;
  return {
    kind: 'other_settings',
    text: same ? 'Other settings, the same pairs of links; leaves or contacts differ, so the hash does.' :
                 `Other settings, other hits: ${added} more, ${lost} fewer than recorded. So the hash differs.`,
  };
}

function keysOf(words: Uint32Array): Set<string> {
  const keys = new Set<string>();
  for (let i = 0; i < hitCount(words); ++i) {
    const at = i * WORDS_PER_HIT;
    keys.add(words.subarray(at, at + 5).join(' '));
  }
  return keys;
}

/** The first entry of so many words that two lists do not share, as an index; -1: they share all. */
export function firstDifference(a: Uint32Array, b: Uint32Array, words = WORDS_PER_HIT): number {
  const most = Math.max(a.length, b.length);
  for (let i = 0; i < most; ++i) {
    if (a[i] !== b[i]) return Math.floor(i / words);
  }
  return -1;
}
