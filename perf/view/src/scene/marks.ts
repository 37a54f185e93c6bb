// What is special about links and instances in one frame.

/**
 * The higher mark wins. Of the pair that one looks at one link is `selected`, and the other one, which may be around
 * it, `glass`.
 */
export const MARK = {none: 0, falsePositive: 1, hit: 2, glass: 3, selected: 4} as const;

export interface Marks {
  /** One MARK per instance and link. */
  links: Uint8Array;
  /** 1 per instance that is masked. */
  masked: Uint8Array;
  /** -1: none. */
  selectedInstance: number;
  /** Whether one looks at a pair: all else is seen through. */
  looksAtPair: boolean;
}

export const makeMarks = (instances: number, links: number): Marks =>
  ({links: new Uint8Array(instances * links), masked: new Uint8Array(instances), selectedInstance: -1,
    looksAtPair: false});

export function clearMarks(marks: Marks): void {
  marks.links.fill(MARK.none);
  marks.masked.fill(0);
  marks.selectedInstance = -1;
  marks.looksAtPair = false;
}

export function mark(marks: Marks, index: number, value: number): void {
  if (index < marks.links.length && marks.links[index]! < value) marks.links[index] = value;
}
