// A small scene of tests: arms of two links, crates of one, and a floor, with made-up hits.
import type {
  Articulation, Batch, Box, Header, Input, Part, Poses, Settings, Stats,
} from '../../perf/view/src/recording/types.js';
import type {Contents, WrittenFrame} from './write_recording.js';

export const HEADER: Header = {
  library: '1.2.3',
  title: 'Arms and crates',
  secondsPerFrame: 1 / 32,
  metresPerUnit: 0.5,
  up: 'z',
  isa: 'avx512',
  threads: 4,
  poseStep: 0,
  notes: ['made up', 'for tests'],
};

export const boxOf = (center: number[], half: number[]): Box => ({
  center: Float32Array.from(center),
  axis: new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1]),
  half: Float32Array.from(half),
});

const partOf = (kind: Part['kind'], position: number[], size: number[], vertices: number[] = []): Part => ({
  kind,
  position: Float32Array.from(position),
  rotation: new Float32Array([0, 0, 0, 1]),
  size: Float32Array.from(size),
  vertices: Float32Array.from(vertices),
});

export const posesOf = (values: ArrayLike<number>, format: Poses['format'] = 'quaternion_translation'): Poses =>
    ({format, hasScale: false, values: Float32Array.from(values)});

/** Of leaves without triangles. */
export const NONE = new Uint32Array(0);

const bone = boxOf([0.5, 0, 0], [0.5, 0.125, 0.125]);

export const ARM: Articulation = {
  name: 'arm',
  linkNames: ['upper', 'lower'],
  linkParents: new Int16Array([-1, 0]),
  linkJoints: new Float32Array(6),
  leaves: [
    {link: 0, box: bone, parts: [], triangles: NONE},
    {
      link: 1,
      box: bone,
      parts: [partOf('capsule', [0.5, 0, 0], [0.0625, 0.03125, 0]), partOf('sphere', [0.25, 0, 0], [0.0625, 0, 0])],
      triangles: NONE,
    },
  ],
  ignoredPairs: new Uint16Array([0, 1]),
  ignoredHops: 1,
  restPose: posesOf([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]),
  level: null,
  skin: null,
};

export const CRATE: Articulation = {
  name: 'crate',
  linkNames: ['link 0'],
  linkParents: new Int16Array([-1]),
  linkJoints: new Float32Array(3),
  leaves: [{
    link: 0,
    box: boxOf([0, 0, 0], [0.5, 0.5, 0.5]),
    parts: [partOf('convex_hull', [0, 0, 0], [0, 0, 0], [-0.5, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5])],
    triangles: NONE,
  }],
  ignoredPairs: new Uint16Array(0),
  ignoredHops: 0,
  restPose: null,
  level: null,
  skin: null,
};

/** A square along x and y, of two triangles, that bends along x between two links. */
export const CLOTH: Articulation = {
  name: 'cloth',
  linkNames: ['hem', 'end'],
  linkParents: new Int16Array([-1, 0]),
  linkJoints: new Float32Array(6),
  leaves: [{
    link: 0, box: boxOf([0, 0, 0], [0, 0, 0]), parts: [], triangles: new Uint32Array([0, 1, 2, 1, 3, 2]),
  }],
  ignoredPairs: new Uint16Array(0),
  ignoredHops: 0,
  restPose: null,
  level: null,
  skin: {
    vertices: new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0]),
    influenceCount: 2,
    influenceLinks: new Uint32Array([0, 1, 0, 1, 0, 1, 0, 1]),
    influenceWeights: new Float32Array([1, 0, 0.25, 0.75, 1, 0, 0.25, 0.75]),
    inverseBind: null,
  },
};
export const CLOTHS: Batch =
    {slot: 7, articulation: 0, instanceCount: 2, name: 'cloths', instanceNames: [], staticBodies: null};

export const ARMS: Batch = {
  slot: 3,
  articulation: 0,
  instanceCount: 3,
  name: 'arms',
  instanceNames: ['ann', 'bob', 'cid'],
  staticBodies: null,
};
export const CRATES: Batch =
    {slot: 1, articulation: 1, instanceCount: 2, name: 'crates', instanceNames: [], staticBodies: null};
export const FLOOR: Batch = {
  slot: 2,
  articulation: -1,
  instanceCount: 3,
  name: 'floor',
  instanceNames: [],
  staticBodies: {
    bodies: [{
      origin: new Float64Array([0, 0, -0.75]),
      rotation: new Float32Array([0, 0, 0, 1]),
      box: boxOf([0, 0, 0], [8, 8, 0.25]),
      parts: [partOf('half_space', [0, 0, 0.25], [0, 0, 0])],
    }],
    vertices: new Float32Array([0, 0, 0, 1, 0, 0, 1, 1, 0.5, 0, 1, 0]),
    triangles: new Uint32Array([0, 1, 2, 0, 2, 3]),
    origin: new Float64Array([2, 0, 0]),
  },
};

export const POLICIES = {refit: 'cab', strategy: 'auto', exact: 'none', extents: 'children', sat: 'all_15'};

export const SETTINGS: Settings = {
  policies: POLICIES,
  margin: 0,
  minDepth: 0,
  report: 'hits',
  containment: true,
  contacts: false,
  rules: [{a: 0, b: 0, pairing: 'between'}, {a: 0, b: 1, pairing: 'between'}, {a: 0, b: 2, pairing: 'between'}],
};

export const NO_STATS: Stats = {
  candidates: 0, boxTests: 0, leafPairs: 0, exactTests: 0, falsePositives: 0, instancesMasked: 0, secondsTotal: 0,
};

/** Multiples of 2^-15 from -1 to 1. */
export class Numbers {
  #state: number;

  constructor(seed: number) { this.#state = seed >>> 0; }

  next(): number {
    this.#state = (Math.imul(this.#state, 1664525) + 1013904223) >>> 0;
    return ((this.#state >>> 16) - 32768) / 32768;
  }

  /** A whole number below `end`. */
  below(end: number): number { return Math.min(end - 1, Math.floor((this.next() + 1) / 2 * end)); }
}

export const inputOf = (batch: number, more: Partial<Input> = {}): Input => ({
  batch,
  poses: null,
  origins: null,
  orientations: null,
  scales: null,
  layers: null,
  layerMasks: null,
  margins: null,
  count: 0xffffffff,
  instances: null,
  masked: new Uint32Array(0),
  ...more,
});

/** Poses of so many chains of two links, bent at random about z. */
export function armPoses(count: number, numbers: Numbers): Float32Array {
  const values = new Float32Array(14 * count);
  for (let at = 0; at < values.length; at += 14) {
    const [first, second] = [numbers.next(), numbers.next()];
    values.set([0, 0, Math.sin(first), Math.cos(first), 0, 0, 0], at);
    values.set([0, 0, Math.sin(second), Math.cos(second), Math.cos(2 * first), Math.sin(2 * first), 0], at + 7);
  }
  return values;
}

/** Frame `index` of the scene; its hits are made up. */
export function frameOf(index: number): WrittenFrame {
  const numbers = new Numbers(index + 1);
  const hits = Uint32Array.from([
    [1, index % 2, 3, 1, 0x10000, 0x10000],
    [3, 0, 3, 2, 1, 1],
  ].slice(0, index % 3).flat());
  const contacts = index % 3 === 0 ? null : Float32Array.from({length: 11 * (index % 3)}, () => numbers.next());
  return {
    index,
    time: index / 32,
    settings: SETTINGS,
    inputs: [
      inputOf(0, {
        poses: posesOf(armPoses(3, numbers)),
        origins: Float64Array.from({length: 9}, () => 4 * numbers.next()),
        layers: new Uint32Array([1, 2, 3]),
        count: 3,
        instances: index % 4 === 3 ? new Uint32Array([0, 2]) : null,
        masked: index % 5 === 4 ? new Uint32Array([2]) : new Uint32Array(0),
      }),
      inputOf(1, {poses: posesOf([0, 0, 0, 1, index, 0, 0, 0, 0, 0, 1, 0, index, 0]), count: 2}),
      inputOf(2, {count: 3}),
    ],
    hits,
    contacts,
    hash: BigInt(index) * 0x123456789abcdefn,
    stats: {...NO_STATS, candidates: index, boxTests: 2 ** 40, secondsTotal: 0.25},
  };
}

export const DEFINITIONS: Contents =
    {header: HEADER, articulations: [ARM, CRATE], batches: [ARMS, CRATES, FLOOR]};
