// What touches when, over all frames of a recording: hits per frame, and for each pair of links its intervals.
import type {Frame, Recording} from '../recording/types.js';
import {depthAt, type Hit, hitAt, hitCount} from '../scene/hits.js';
import {inSlices, type Progress} from './slices.js';

export interface PairHistory {
  hit: Hit;
  /** Indices of batches. */
  batchA: number;
  batchB: number;
  /** First and last frame of each interval. */
  intervals: number[];
  /** The deepest frame of each interval; without depths its first. */
  worst: {frame: number; depth: number | null}[];
  frames: number;
  /** Null: no contacts are recorded. */
  worstDepth: number | null;
  worstFrame: number;
}

export class ContactIndex {
  readonly hitsPerFrame: Uint32Array;
  readonly times: Float64Array;
  /** How many pairs of links begin to touch, per frame. */
  readonly begins: Uint32Array;
  /** 1 per frame that cannot be read. */
  readonly damaged: Uint8Array;
  readonly #pairs = new Map<string, PairHistory>();
  readonly #recording: Recording;

  constructor(recording: Recording) {
    this.#recording = recording;
    this.hitsPerFrame = new Uint32Array(recording.frameCount);
    this.begins = new Uint32Array(recording.frameCount);
    this.times = new Float64Array(recording.frameCount);
    this.damaged = new Uint8Array(recording.frameCount);
  }

  get pairs(): PairHistory[] {
    return [...this.#pairs.values()];
  }

  /** Reads all frames. */
  async scan(onProgress: (progress: Progress) => void, signal: AbortSignal): Promise<void> {
    await inSlices(this.#recording.frameCount, (index) => this.#read(index), onProgress, signal);
  }

  #read(index: number): void {
    let frame: Frame;
    try {
      frame = this.#recording.frame(index);
    } catch {
      // The recording's problems say what is wrong with it.
      this.damaged[index] = 1;
      this.times[index] = Number.NaN;
      return;
    }
    this.times[index] = frame.time;
    this.hitsPerFrame[index] = hitCount(frame.hits);
    const batchOfSlot = new Map(frame.inputs.map(({batch}) => [this.#recording.batches[batch]!.slot, batch]));
    for (let i = 0; i < hitCount(frame.hits); ++i) {
      this.#add(hitAt(frame.hits, i), batchOfSlot, index, frame.contacts ? depthAt(frame.contacts, i) : null);
    }
  }

  /** What is known of a hit's links so far, between instances of these batches. */
  pairOf(batchA: number, hit: Hit, batchB: number): PairHistory | undefined {
    return this.#pairs.get(keyOf(batchA, hit, batchB));
  }

  #add(hit: Hit, batchOfSlot: ReadonlyMap<number, number>, frame: number, depth: number | null): void {
    const batchA = batchOfSlot.get(hit.slotA) ?? -1;
    const batchB = batchOfSlot.get(hit.slotB) ?? -1;
    const key = keyOf(batchA, hit, batchB);
    const known = this.#pairs.get(key);
    if (!known) {
      this.#pairs.set(key, {hit, batchA, batchB, intervals: [frame, frame], worst: [{frame, depth}], frames: 1,
                            worstDepth: depth, worstFrame: frame});
      ++this.begins[frame]!;
      return;
    }
    const {intervals, worst} = known;
    ++known.frames;
    const last = worst[worst.length - 1]!;
    if (intervals[intervals.length - 1] === frame - 1) {
      intervals[intervals.length - 1] = frame;
      if (depth !== null && depth > (last.depth ?? -Infinity)) Object.assign(last, {frame, depth});
    } else {
      intervals.push(frame, frame);
      worst.push({frame, depth});
      ++this.begins[frame]!;
    }
    if (depth !== null && depth > (known.worstDepth ?? -Infinity)) {
      known.worstDepth = depth;
      known.worstFrame = frame;
    }
  }

  /** The next frame behind `frame`, or the last one before it, in which a pair begins to touch; -1: there is none. */
  contactFrom(frame: number, forward: boolean): number {
    const step = forward ? 1 : -1;
    for (let i = frame + step; i >= 0 && i < this.begins.length; i += step) {
      if (this.begins[i]! > 0) return i;
    }
    return -1;
  }
}

const keyOf = (batchA: number, {instanceA, linkA, instanceB, linkB}: Hit, batchB: number): string =>
  `${batchA} ${instanceA} ${linkA} ${batchB} ${instanceB} ${linkB}`;

/** The interval of a pair that a frame is in; null: it does not touch there. */
export function intervalAt({intervals}: PairHistory, frame: number): {first: number; last: number} | null {
  for (let i = 0; i < intervals.length; i += 2) {
    if (intervals[i]! <= frame && frame <= intervals[i + 1]!) return {first: intervals[i]!, last: intervals[i + 1]!};
  }
  return null;
}

/** As contactFrom(), of one pair of links. */
export function contactOfPair({intervals}: PairHistory, frame: number, forward: boolean): number {
  const firsts = intervals.filter((_, i) => i % 2 === 0);
  return (forward ? firsts.find((first) => first > frame) : firsts.reverse().find((first) => first < frame)) ?? -1;
}
