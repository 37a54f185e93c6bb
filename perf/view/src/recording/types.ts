// A recording as the page holds it. Names, units and frames are those of the C++ API (cab/types.h) in camel case:
// quaternions are x y z w, a point p of an instance is at origin + orientation * (scale * p) in the world.

export interface Header {
  library: string;
  title: string;
  /** 0: unknown. */
  secondsPerFrame: number;
  /** 0: unknown. */
  metresPerUnit: number;
  up: '' | 'x' | 'y' | 'z';
  isa: string;
  threads: number;
  /** Above 0: poses are rounded to 16 bits, translations to multiples of it. */
  poseStep: number;
  notes: string[];
}

export type ShapeKind = 'box' | 'ellipsoid' | 'capsule' | 'convex_hull' | 'sphere' | 'cylinder' | 'half_space';

/** In the frame of a link. */
export interface Box {
  center: Float32Array;
  /** Three axes, x y z each. */
  axis: Float32Array;
  half: Float32Array;
}

export interface Part {
  kind: ShapeKind;
  position: Float32Array;
  rotation: Float32Array;
  size: Float32Array;
  vertices: Float32Array;
}

export interface Leaf {
  link: number;
  /** Of a leaf with triangles a point at the link's origin: the engine makes its box. */
  box: Box;
  /** Empty: the box is the shape. */
  parts: Part[];
  /** Three vertices of the articulation's skin each. Empty: the leaf is rigid. */
  triangles: Uint32Array;
}

/** Vertices that several links move by a linear blend. */
export interface Skin {
  vertices: Float32Array;
  influenceCount: number;
  /** influenceCount per vertex, and so are weights. */
  influenceLinks: Uint32Array;
  influenceWeights: Float32Array;
  /** 16 numbers by columns per link. Null: links have the skin's frame. */
  inverseBind: Float32Array | null;
}

export type PoseFormat = 'quaternion_translation' | 'matrix3x4_rows' | 'matrix4x4_columns';

export interface Poses {
  format: PoseFormat;
  hasScale: boolean;
  /** By instance, then by link, without gaps. Rounded poses are floats here already. */
  values: Float32Array;
}

export interface LevelLeaf {
  link: number;
  box: Box;
  links: number[];
}

export interface Level {
  of: number;
  kind: 'reach' | 'nodes';
  maxLeaves: number;
  leaves: LevelLeaf[];
  restPoses: Poses | null;
  restPoseCount: number;
  jointPlay: number;
}

export interface Articulation {
  name: string;
  /** One per link, also where the recording has none: then "link 0" and so on. */
  linkNames: string[];
  linkParents: Int16Array;
  linkJoints: Float32Array;
  leaves: Leaf[];
  /** Two links per pair. */
  ignoredPairs: Uint16Array;
  ignoredHops: number;
  restPose: Poses | null;
  /** Of a level of detail; null for what is none. */
  level: Level | null;
  /** The vertices of leaves with triangles; null: there are none. */
  skin: Skin | null;
}

export interface StaticBody {
  origin: Float64Array;
  rotation: Float32Array;
  box: Box;
  parts: Part[];
}

export interface StaticBodies {
  bodies: StaticBody[];
  vertices: Float32Array;
  triangles: Uint32Array;
  origin: Float64Array;
}

export interface Batch {
  /** What hits call it. */
  slot: number;
  /** Index of the articulation; -1 for static bodies. */
  articulation: number;
  instanceCount: number;
  name: string;
  /** Empty, or one per instance. */
  instanceNames: string[];
  staticBodies: StaticBodies | null;
}

/** What a batch was given in one frame. Null: the default of the C++ API. */
export interface Input {
  /** Index of the batch. */
  batch: number;
  /** Null for static bodies. */
  poses: Poses | null;
  origins: Float64Array | null;
  orientations: Float32Array | null;
  scales: Float32Array | null;
  layers: Uint32Array | null;
  layerMasks: Uint32Array | null;
  margins: Float32Array | null;
  /** How many instances take part, the first ones. */
  count: number;
  instances: Uint32Array | null;
  /** Instances that took no part, since their poses are no poses. */
  masked: Uint32Array;
}

export interface Rule {
  /** Indices of batches. */
  a: number;
  b: number;
  pairing: 'between' | 'within';
}

export interface Settings {
  /** By field of `Policies`: refit, strategy, exact, extents, sat. */
  policies: Record<string, string>;
  margin: number;
  minDepth: number;
  report: 'hits' | 'distances';
  /** With the exact test surface: whether what is wholly inside a closed part of a skin is a hit. */
  containment: boolean;
  contacts: boolean;
  rules: Rule[];
}

export interface Stats {
  candidates: number;
  boxTests: number;
  leafPairs: number;
  exactTests: number;
  falsePositives: number;
  instancesMasked: number;
  secondsTotal: number;
}

export const WORDS_PER_HIT = 6;
export const WORDS_PER_CONTACT = 11;

/** Floats per pose. */
export const FLOATS_PER_POSE: Record<PoseFormat, number> =
    {quaternion_translation: 7, matrix3x4_rows: 12, matrix4x4_columns: 16};

export interface Frame {
  index: number;
  /** Seconds. */
  time: number;
  settings: Settings;
  inputs: Input[];
  /** 6 words per hit: slot a, instance a, slot b, instance b, links, leaves; of the last two a's is the lower half. */
  hits: Uint32Array;
  /** 11 floats per hit, or null: normal 3, depth, point a 3, point b 3, and a word of leaves. */
  contacts: Float32Array | null;
  hash: bigint;
  stats: Stats;
}

export interface Recording {
  readonly header: Header;
  readonly articulations: readonly Articulation[];
  readonly batches: readonly Batch[];
  readonly frameCount: number;
  /** In words: what is cut off or damaged, and which frames that are. Empty if all is well. */
  readonly problems: readonly string[];
  /** Frame `index`, decoded. A few are kept. Throws RecordingError where the frame is damaged. */
  frame(index: number): Frame;
}
