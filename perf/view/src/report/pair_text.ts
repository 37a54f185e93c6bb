// A pair of links as the page's fragment has it: `&pair=0.0.12-1.0.7`, slot, instance and link of each side.
import type {LinkRef, PairRef} from './types.js';

export function pairText(pair: PairRef): string {
  return `${pair.a.join('.')}-${pair.b.join('.')}`;
}

/** The pair of a text, or null if it is none. */
export function readPair(text: string): PairRef | null {
  const match = /^(\d+)\.(\d+)\.(\d+)-(\d+)\.(\d+)\.(\d+)$/.exec(text);
  if (!match) return null;
  const numbers = match.slice(1).map(Number);
  const link = (first: number): LinkRef => [numbers[first] ?? 0, numbers[first + 1] ?? 0, numbers[first + 2] ?? 0];
  return {a: link(0), b: link(3)};
}
