// The engine in the page: cab compiled to WebAssembly, fed with frames of a recording.
import type {Frame} from '../recording/types.js';

export const WORDS_PER_TRIANGLES = 4;

/** What a person changes about a frame before it runs again. Left out: as it was recorded. */
export interface Dial {
  refit?: string;
  extents?: string;
  strategy?: string;
  sat?: string;
  exact?: string;
  margin?: number;
  /** Articulations are replaced by a level of detail of so many leaves. */
  levelLeaves?: number;
}

export interface RunResult {
  /** As of Frame. */
  hits: Uint32Array;
  contacts: Float32Array | null;
  /** FNV-1a, 64 bits, of the bytes of hits, then of contacts. */
  hash: bigint;
  milliseconds: number;
  boxTests: number;
  leafPairs: number;
  exactTests: number;
  falsePositives: number;
  /** In words: what is not as it was asked for, such as another exact test. Empty: all of it is. */
  notes: string[];
}

/** 15 floats per box: centre, axes, half extents, relative to the instance's origin along the world's axes. */
export interface Boxes {
  /** Per instance: leaves first, the root last. 0 for static bodies. */
  nodeCount: number;
  leafCount: number;
  /** By instance, then by node. 0 for instances left out; of masked ones the half extents are 0. */
  values: Float32Array;
}

/** One merge of a hierarchy: node leafCount + index joins two nodes. */
export interface MergeStep {
  left: number;
  right: number;
}

export interface EngineInPage {
  /** `wasm128` or `scalar`. */
  readonly isa: string;
  readonly version: string;
  /** Runs a frame again. */
  run(frame: Frame, dial: Dial): RunResult;
  /**
   * Pairs of links whose boxes overlap and whose shapes are apart, as words of hits: what the frame's exact test
   * dropped, or what an exact test would drop of a frame without one. None where a level of detail has no shapes.
   */
  falsePositives(frame: Frame, dial: Dial): Uint32Array;
  /**
   * Triangles of skins that touch, of hits of the frame: WORDS_PER_TRIANGLES each, which are the index of the hit, leaf
   * a in the lower half and leaf b, and which triangle of each leaf it is.
   */
  touchingTriangles(frame: Frame, hits: Uint32Array): Uint32Array;
  /** Boxes of all nodes of the instances of a batch. */
  boxes(frame: Frame, batch: number, dial: Dial): Boxes;
  /** The merges of a batch's hierarchy, in order. */
  merges(batch: number, dial: Dial): MergeStep[];
  destroy(): void;
}
