// Words of hits and floats of contacts, as recordings have them, by name.
import {WORDS_PER_CONTACT, WORDS_PER_HIT} from '../recording/types.js';

export interface Hit {
  slotA: number;
  instanceA: number;
  linkA: number;
  slotB: number;
  instanceB: number;
  linkB: number;
}

export const hitCount = (words: Uint32Array): number => words.length / WORDS_PER_HIT;

export function hitAt(words: Uint32Array, i: number): Hit {
  const at = i * WORDS_PER_HIT;
  const links = words[at + 4]!;
  return {
    slotA: words[at]!,
    instanceA: words[at + 1]!,
    linkA: links & 0xffff,
    slotB: words[at + 2]!,
    instanceB: words[at + 3]!,
    linkB: links >>> 16,
  };
}

export const depthAt = (contacts: Float32Array, i: number): number => contacts[i * WORDS_PER_CONTACT + 3]!;

/** Whether two hits are of the same two links. */
export const isSamePair = (a: Hit, b: Hit): boolean =>
  a.slotA === b.slotA && a.instanceA === b.instanceA && a.linkA === b.linkA && a.slotB === b.slotB &&
  a.instanceB === b.instanceB && a.linkB === b.linkB;
