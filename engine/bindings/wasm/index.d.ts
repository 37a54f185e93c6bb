/**
 * cab for JavaScript: which links of many articulated characters touch.
 *
 * Names are those of the C++ API in camel case: `link_parents` is `linkParents`, `run_frame` is `runFrame`. Values of
 * enumerations are strings: `Refit::kCabSum` is `'cab_sum'`. What the headers of the C++ API say about units,
 * frames, handedness and defaults holds here: all lengths are in one unit of your choice, quaternions are x y z w,
 * indices count from 0. A member that is left out has the default of the C++ API, and one that a call does not know is
 * a TypeError. Members may be inherited, or getters of a class, whose methods are not read.
 *
 * Arrays of a batch and lists of hits are views of the memory of the module. They are not copies, and they end:
 * the memory may grow in any call of the module, a world or a history, and where an array of a batch is asked for the
 * first time, and then every view from before has length 0. So ask for a view when you need it (`batch.poses()` costs
 * next to nothing), and do not keep it over such a call. With `load({checkViews: true})` a view that was kept throws.
 */

/** Three numbers x y z. */
export type Vec3 = readonly [number, number, number];
/** A quaternion x y z w. */
export type Quaternion = readonly [number, number, number, number];
/**
 * Numbers that a call reads: copied, so any array will do; typed arrays are the fastest. Views of the module's memory
 * are read before the call lets it grow, but for `Batch.instances` by calls about pairs or moments, which throw then.
 */
export type Numbers = ArrayLike<number>;

/** What went wrong, by the name of the C++ API's `Status` without its k: `Status::kBadPoses` is `'bad_poses'`. */
export type StatusName =
    'out_of_memory' | 'busy' | 'isa_not_available' | 'no_links' | 'too_many_links' | 'no_leaves' | 'too_many_leaves' |
    'bad_parent' | 'bad_joint' | 'bad_leaf_link' | 'bad_leaf_box' | 'bad_leaf_axes' | 'bad_shape' |
    'shape_outside_leaf_box' | 'bad_vertices' | 'bad_ignored_pair' | 'bad_rest_pose' | 'unknown_articulation' |
    'unknown_batch' | 'articulation_in_use' | 'bad_batch_kind' | 'no_instances' | 'bad_static_body' | 'bad_triangles' |
    'too_many_instances' | 'batch_given_twice' | 'bad_poses' | 'bad_states' | 'static_input' | 'bad_origins' |
    'bad_scales' |
    'bad_count' | 'bad_instances' | 'bad_margins' | 'bad_pair_rule' | 'pair_rule_given_twice' | 'exact_not_built' |
    'bad_margin' | 'bad_min_depth' | 'contacts_need_exact' | 'bad_lod' | 'too_few_leaves' | 'lod_leaf_too_small' |
    'lod_without_shapes' | 'bad_instance' | 'bad_query' | 'bad_skin' | 'bad_leaf_triangles' | 'too_many_influences' |
    'skin_not_taken' | (string & {});

/** A call that the engine refused. The world is as it was before the call. */
export declare class CabError extends Error {
  readonly name: 'CabError';
  /** The status by its name. `message` has it in words. */
  readonly status: StatusName;
  /** The status by its number in the C API. */
  readonly code: number;
  /** The index of the link, leaf, pair, body or query at fault, for statuses that have one. */
  readonly element: number | undefined;
}

/** Whether this JavaScript engine runs WebAssembly with SIMD. */
export declare function hasSimd(): boolean;

/** Where the module comes from: at most one of these. Both modules give the same bits. */
export interface LoadOptions {
  /** Which of the two beside this file: with SIMD or without. Default: with SIMD where it runs. */
  simd?: boolean;
  /** The address of `cab_simd.wasm` or `cab_scalar.wasm`, such as a bundler hands out; relative to the page. */
  url?: string | URL;
  /** The contents of one of the two files. */
  bytes?: ArrayBuffer | ArrayBufferView;
  /** One of the two, compiled already, as a worker may be sent it. */
  module?: WebAssembly.Module;
}

export interface CheckOptions {
  /**
   * For development: whether views throw an Error when they are read or written after a call in which the memory may
   * grow, whether or not it did, after their batch is removed, or after their hits are replaced. Views are then proxies
   * of typed arrays, many times slower: `ArrayBuffer.isView` is false of them, and WebGL takes no proxy. Default: they
   * are typed arrays, and nothing is checked.
   */
  checkViews?: boolean;
}

/**
 * Loads the module: from beside this file unless told otherwise, by `fetch`, or in node by reading it. Each call makes
 * a module with a memory of its own, of up to 2 GB. `cab-collision/inline` has a `load` that needs no file.
 */
export declare function load(options?: LoadOptions & CheckOptions): Promise<Cab>;

/** The instruction set of a world's kernels. All give the same bits. */
export type Isa = 'auto' | 'scalar' | 'wasm128';

/** The module. */
export declare class Cab {
  /** The calls of the C API, `cab_run_frame` and so on, with `malloc` and `free`: for what this module leaves out. */
  readonly exports: Readonly<Record<string, CallableFunction>>;
  readonly memory: WebAssembly.Memory;
  /** Which instruction sets there are: `['scalar', 'wasm128']`, or `['scalar']`. */
  readonly instructionSets: readonly Isa[];
  /** The version of the library, such as `'1.0.0'`. */
  readonly version: string;

  /**
   * Makes an empty world. Its memory lies in that of the module, so no garbage collector gives it back: call
   * `destroy()`.
   */
  createWorld(desc?: {isa?: Isa}): World;

  /** An oriented box about points: x y z of each, in the frame of a link. Too slow for every frame. */
  fitBox(vertices: Numbers): {center: number[]; axis: number[]; half: number[]};
}

// ------------------------------------------------------------------------------------------------------- description

/** An oriented box, in the frame of its link. */
export interface Box {
  /** Default: the origin of the frame. */
  center?: Vec3 | Numbers;
  /** Three axes, each x y z: orthonormal and right-handed. Default: those of the frame. */
  axis?: readonly [Vec3, Vec3, Vec3] | Numbers;
  /** Half extents along the axes, 0 or more. Default: 0. */
  half?: Vec3 | Numbers;
}

export type ShapeKind = 'box' | 'ellipsoid' | 'capsule' | 'convex_hull' | 'sphere' | 'cylinder' | 'half_space';

/** One convex part of a leaf's exact shape, in a frame of its own within the link's. It lies within the leaf's box. */
export interface ConvexPart {
  kind?: ShapeKind;
  position?: Vec3 | Numbers;
  rotation?: Quaternion | Numbers;
  /** Box: half extents. Ellipsoid: radii. Capsule, cylinder: radius, half the length along z. Sphere: radius. */
  size?: Vec3 | Numbers;
  /** Convex hull: x y z of each vertex. */
  vertices?: Numbers;
}

/** A rigid body on one link. */
export interface RigidLeaf {
  link: number;
  box: Box;
  /** The exact shape, a union of convex parts. Left out: the box itself. */
  parts?: readonly ConvexPart[];
}

/** A part of the articulation's skin. The library makes its box, in every frame. */
export interface SkinnedLeaf {
  /** The link with most of the triangles' weight. */
  link: number;
  /** Three indices of vertices each: some 50 to 200 triangles that are next to each other. */
  triangles: Numbers;
}

export type Leaf = RigidLeaf | SkinnedLeaf;

/** Vertices that several links move by a linear blend, as glTF and three.js have it (`SkinnedMesh`). */
export interface SkinDesc {
  /** x y z per vertex, in the skin's own frame. */
  vertices: Numbers;
  /** How many links move a vertex at most. Default: 4. */
  influenceCount?: number;
  /** The index of each link that moves a vertex, influenceCount per vertex: `skinIndex` of three.js. */
  influenceLinks: Numbers;
  /** Its weight, 0 (no effect) or more; those of a vertex are divided by their sum: `skinWeight` of three.js. */
  influenceWeights: Numbers;
  /** 16 numbers by columns per link, from the skin to the link. Default: links have its frame; poses are a palette. */
  inverseBind?: Numbers;
}

/**
 * How a pose is stored: 7 floats x y z w x y z, a quaternion and a translation; 12 floats by rows; or 16 floats by
 * columns, as in glTF and three.js (`Matrix4.elements`).
 */
export type PoseFormat = 'quaternion_translation' | 'matrix3x4_rows' | 'matrix4x4_columns';

/** Poses of all links of one instance or several, from link to instance: instances by rows, then links. Copied. */
export interface Poses {
  /** Default: `'quaternion_translation'`. */
  format?: PoseFormat;
  /** Whether matrices hold a uniform scale. Default: they are rotations. */
  hasScale?: boolean;
  data: Numbers;
}

export interface ArticulationDesc {
  /** The index of each link's parent, lower than its own, or -1 for the root of a tree. 1 to 1024 links. */
  linkParents: Numbers;
  /** x y z per link: the joint with the parent, in the link's own frame. Left out: at the origins of the links. */
  linkJoints?: Numbers;
  /** 1 to 1024 leaves, in any order. */
  leaves: readonly Leaf[];
  /** Pairs of links of one instance that are never reported against each other. */
  ignoredPairs?: readonly {a: number; b: number}[];
  /** Links at most this many joints apart are not reported against each other: with 1, a link and its parent. */
  ignoredHops?: number;
  /** The pose of one instance. Links whose leaf boxes touch in it are not reported against each other. */
  restPose?: Poses;
  /** The vertices of leaves with triangles. */
  skin?: SkinDesc;
}

/** Shapes that do not change, shared by all instances of a batch. */
export interface Articulation {
  readonly id: bigint;
  readonly linkCount: number;
  readonly leafCount: number;
  readonly nodeCount: number;
}

/** A leaf of a coarser level: a box on one link that stands for several links. */
export interface LodLeaf {
  link: number;
  box: Box;
  links: Numbers;
}

/** A coarser level of an articulation: the same links with fewer leaves. `LodDesc` of the C++ API. */
export interface LodDesc {
  /** What it is a level of; no level itself. */
  of: Articulation;
  /**
   * `'reach'`: boxes on links, with room for whatever their links can reach. `'nodes'`: nodes of the hierarchy, made in
   * every frame from all leaves, without shapes. Default: `'reach'`.
   */
  kind?: 'reach' | 'nodes';
  /** How many leaves there may be, if the library makes them. Default: 1. */
  maxLeaves?: number;
  /** Leaves that the caller makes, for `'reach'` only. Default: the library makes them. */
  leaves?: readonly LodLeaf[];
  /** For `'reach'`: poses that say how far joints are from their links. There may be those of several instances. */
  restPoses?: Poses;
  /** For `'reach'`: how much farther away a joint may be. Default: 0. */
  jointPlay?: number;
}

/** One merge of a hierarchy. Step s makes node leafCount + s from two nodes. */
export interface MergeStep {
  left: number;
  right: number;
  /** The link whose joint the two share, or null. */
  jointLink: number | null;
}

/** A body that never moves. */
export interface StaticBody {
  origin?: Vec3 | Numbers;
  rotation?: Quaternion | Numbers;
  box: Box;
  parts?: readonly ConvexPart[];
}

/** Bodies that never move, then the triangles of a mesh; each is an instance of the batch. */
export interface StaticDesc {
  bodies?: readonly StaticBody[];
  /** x y z per vertex. */
  vertices?: Numbers;
  /** Three indices of vertices per triangle. */
  triangles?: Numbers;
  /** What vertices are relative to. */
  origin?: Vec3 | Numbers;
}

/** Characters may touch each other; of sequences frame f may touch frame f of others. */
export type BatchKind = 'characters' | 'sequence';

export interface BatchOptions {
  kind?: BatchKind;
  format?: PoseFormat;
  /** Whether matrices hold a uniform scale. Default: they are rotations. */
  hasScale?: boolean;
}

// ------------------------------------------------------------------------------------------------------------ batches

/**
 * Instances of one articulation that are posed together. Its arrays are views of the module's memory, to be written
 * into: see the top of this file. All but the poses are made when they are first asked for, with values that change
 * nothing, and are given to the engine from then on.
 */
export declare class Batch {
  private constructor();
  /** The id in the C API. Null once the batch is removed. */
  readonly id: bigint | null;
  /** What stands for the batch in `Hits.words()`. Once it is removed, the next batch may take it. */
  readonly slot: number;
  /** Null for static bodies. */
  readonly articulation: Articulation | null;
  /** How many instances there is room for. */
  readonly size: number;
  readonly format: PoseFormat | null;
  readonly hasScale: boolean;
  /** How many instances take part, the first ones. Default: all. */
  count: number;
  /**
   * The numbers of those that take part, ascending and below `count`. Characters only. Default: null, all of them. An
   * empty array: none. A view of memory that has grown since is a `TypeError`.
   */
  instances: Numbers | null;

  /** The pose of each link of each instance, from link to instance ("model space"): instances by rows, then links. */
  poses(): Float32Array;
  /** x y z per instance: its origin in the world. At first 0. */
  origins(): Float64Array;
  /** A quaternion x y z w per instance. */
  orientations(): Float32Array;
  /** A scale per instance, 1e-3 to 1e3. */
  scales(): Float32Array;
  /** Bits of the layers that an instance is on, and of those that it is tested against. At first all bits. */
  layers(): Uint32Array;
  layerMasks(): Uint32Array;
  /** A margin per instance. */
  margins(): Float32Array;
  /** 0 states that an instance is what it was in the last frame. At first 1. */
  moved(): Uint8Array;
  /** Written by `runFrame`, once asked for: why an instance is masked, as bits. 1: not finite. 2: not rigid. */
  flags(): Uint8Array;
  /** Written by `runFrame`, once asked for: 1 if the instance is in a hit. */
  inContact(): Uint8Array;
  /** Where all instances are now: a copy, which lasts, of count, instances, poses, origins and the like. */
  moment(): Moment;
}

/** Where the instances of a batch were when `Batch.moment` was called. */
export declare class Moment {
  private constructor();
  readonly batch: Batch;
}

/** The poses that a batch had at its last moments, for queries with a `time`. `World.addHistory` makes it. */
export declare class History {
  private constructor();
  readonly batch: Batch;
  /** The id in the C API. Null once the history is removed. */
  readonly id: bigint | null;
  /**
   * Copies the poses that the batch has now, or had at a moment. The time is in seconds, or whatever you count in, and
   * above that of the call before. The earliest moment goes once there are as many as there is room for.
   */
  record(time: number, moment?: Moment): void;
  /** How many moments there are, and the times of the earliest and the latest. */
  readonly span: {ticks: number; first: number; last: number};
  /** Gives its memory back. */
  remove(): void;
}

// ------------------------------------------------------------------------------------------------------------- frames

export type Refit = 'cab' | 'best3' | 'cab_sum' | 'covariance' | 'aabb_hull' | 'aabb_vertices';
export type Strategy = 'tree' | 'rows' | 'links' | 'brute' | 'auto';
export type Extents = 'children' | 'leaves';
/** `'none'`: boxes are the answer. `'convex'`: exact shapes decide. `'surface'`: the same, and triangles of skins. */
export type Exact = 'none' | 'convex' | 'surface';
export type Sat = 'all_15' | 'faces_6';
export type Preset = 'balanced' | 'tight' | 'paper';

export interface Policies {
  refit?: Refit;
  strategy?: Strategy;
  exact?: Exact;
  extents?: Extents;
  sat?: Sat;
}

/** What is tested against what. */
export interface PairRule {
  a: Batch;
  /** Default: a. */
  b?: Batch;
  /** Links of different instances, or of each instance. Default: `'between'`. */
  pairing?: 'between' | 'within';
  /** What is done with the hits of two instances that rest. */
  resting?: 'reported' | 'skipped';
}

export interface FrameJob {
  rules: readonly PairRule[];
  /** Which batches take part. Default: those that rules name. */
  batches?: readonly Batch[];
  /** How boxes are made and tested, or the name of a preset. */
  policies?: Policies | Preset;
  /** Links at most this far apart are reported too. */
  margin?: number;
  /** Drops hits that are less deep; needs `exact: 'convex'`. */
  minDepth?: number;
  /** `'in_contact'`: only `Batch.inContact()`. `'distances'`: of every two instances the nearest links. */
  report?: 'hits' | 'in_contact' | 'distances';
  /** With `exact: 'surface'`: whether what is wholly inside a closed part of a skin is a hit. Default: it is. */
  containment?: boolean;
  /** Whether each hit gets a contact; needs `exact: 'convex'`. */
  contacts?: boolean;
}

/** How two links touch. Points are relative to the origin of instance a, along the world's axes. */
export interface Contact {
  /** A unit vector from a to b. */
  normal: number[];
  /** How far b must move along the normal to be free. Below 0: minus the gap. */
  depth: number;
  pointA: number[];
  pointB: number[];
  leafA: number;
  leafB: number;
}

/** Two links. A `Hit` is one, too. All members are needed, and those that no hit has are refused. */
export interface LinkPair {
  batchA: Batch;
  instanceA: number;
  linkA: number;
  batchB: Batch;
  instanceB: number;
  linkB: number;
}

/**
 * Pairs of links: what `runFrame` found, which is not copied, objects, or words of hits. `Hits.words()`, its parts by
 * `subarray` and copies by `slice` know of which hits they are, so a slot means the batch that it had then, even if a
 * later batch has taken it; so write no later hits into such a copy. Other copies only have slots: a slot that several
 * batches of the world have had is a TypeError there. Only `diffHits` takes pairs whose batch has been removed.
 */
export type Pairs = Hits | readonly LinkPair[] | Uint32Array;

/** Two links that began or ceased to touch. A batch that has been removed since is null, though its slot be taken. */
export interface ChangedHit {
  batchA: Batch | null;
  instanceA: number;
  linkA: number;
  leafA: number;
  batchB: Batch | null;
  instanceB: number;
  linkB: number;
  leafB: number;
}

/** Two links that touch. */
export interface Hit {
  batchA: Batch;
  instanceA: number;
  linkA: number;
  leafA: number;
  batchB: Batch;
  instanceB: number;
  linkB: number;
  leafB: number;
  /** With `FrameJob.contacts`. */
  contact?: Contact;
}

/** Counts and seconds of a frame: `FrameStats` of the C++ API. */
export interface FrameStats {
  candidates: number;
  boxTests: number;
  leafPairs: number;
  exactTests: number;
  falsePositives: number;
  /** Instances that took no part; `World.whyMasked` says why. */
  instancesMasked: number;
  secondsTotal: number;
  [member: string]: number;
}

/** What all lists of hits have. They lie in the module's memory and last until the next call of the same sort. */
export interface List<T, S> extends Iterable<T> {
  readonly length: number;
  readonly stats: S;
  /** One hit as an object. */
  at(i: number): T;
  /** All hits as objects, which last. */
  toArray(): T[];
  /** The hits as the C API has them, `wordsPerHit` words each: a view, for the fastest loops. */
  words(): Uint32Array;
  readonly wordsPerHit: number;
}

/**
 * The hits of a frame, sorted by batchA, instanceA, batchB, instanceB, linkA, then linkB, batches by their slots. Loop
 * over them for objects, or read single numbers of hit i, which makes no objects.
 */
export declare class Hits implements List<Hit, FrameStats> {
  private constructor();
  readonly length: number;
  readonly stats: FrameStats;
  readonly wordsPerHit: number;
  at(i: number): Hit;
  toArray(): Hit[];
  words(): Uint32Array;
  [Symbol.iterator](): Iterator<Hit>;
  batchA(i: number): Batch;
  batchB(i: number): Batch;
  instanceA(i: number): number;
  instanceB(i: number): number;
  linkA(i: number): number;
  linkB(i: number): number;
  leafA(i: number): number;
  leafB(i: number): number;
  /** With `FrameJob.contacts`. */
  contact(i: number): Contact;
  depth(i: number): number;
  /** The contacts as the C API has them, `wordsPerContact` words each, ten floats and leaves: a view. */
  contactWords(): Uint32Array;
  readonly wordsPerContact: number;
}

/** Two triangles of skins that touch. */
export interface TouchingPair {
  /** Index of the two links in the pairs that were asked for. */
  pair: number;
  leafA: number;
  leafB: number;
  /** Which triangle of leaf a, and of leaf b: an index in `SkinnedLeaf.triangles`, over 3. */
  triangleA: number;
  triangleB: number;
}

/** Sorted by pair, leaves, then triangles. `words()` has `wordsPerHit` each: pair, both leaves, both triangles. */
export declare class TouchingTriangles implements List<TouchingPair, undefined> {
  private constructor();
  readonly length: number;
  readonly stats: undefined;
  readonly wordsPerHit: number;
  at(i: number): TouchingPair;
  toArray(): TouchingPair[];
  words(): Uint32Array;
  [Symbol.iterator](): Iterator<TouchingPair>;
}

/** What `boxLines` draws. */
export interface BoxLinesOptions {
  /** How many merges below the root, which is 0; or the leaves. Default: `'leaves'`. */
  level?: number | 'leaves';
  /** Whether leaves are drawn as their exact shapes. Half spaces and leaves with triangles stay boxes. */
  shapes?: boolean;
  /** Boxes of links in these hits are marked. Default: none. */
  hits?: Pairs;
  /** The contact of each of the hits: a line joins its points, if instance a is of the batch. Default: none. */
  contacts?: readonly Contact[];
  /** Where lines are relative to, such as the camera. Default: 0. */
  origin?: Vec3 | Numbers;
  /** How boxes are made. */
  policies?: Policies | Preset;
}

/** Edges of boxes, twelve each, or of shapes, by instance and node, then contacts. Arrays are copies, which last. */
export interface BoxLines {
  readonly count: number;
  /** Six numbers per line, both ends: the positions of `LineSegments` in three.js. */
  readonly positions: Float32Array;
  /** Per line the instance, the node in the hierarchy, and the link of a leaf or 65535. */
  readonly instances: Uint32Array;
  readonly nodes: Uint16Array;
  readonly links: Uint16Array;
  /** Per line 1 if a link of its box is in one of the hits. */
  readonly isHit: Uint8Array;
}

/** All boxes of a batch, relative to the origin of their instance, along the world's axes. */
export interface BatchBoxes {
  /** How many boxes each instance has: leaves first, the root last. */
  readonly nodeCount: number;
  readonly leafCount: number;
  /** 15 floats per box, by instance, then by node: centre, three axes, half extents. 0 for instances left out. */
  readonly values: Float32Array;
}

// ------------------------------------------------------------------------------------------------------------ queries

export type QueryKind = 'ray' | 'sphere' | 'box' | 'capsule' | 'point' | 'region';

/** One side of a region: points p with dot(normal, p - position) <= offset. */
export interface QueryPlane {
  normal: Vec3 | Numbers;
  offset: number;
}

/** One query. Members that its kind does not name are not read. */
export interface Query {
  /** Default: `'ray'`. */
  kind?: QueryKind;
  /** Whether there is any link, the first one, or all. Default: `'closest'`. */
  want?: 'any' | 'closest' | 'all';
  /** Where a ray begins, the centre of a shape, or the point; in the world. */
  position: Vec3 | Numbers;
  /** Ray: its direction, of any length. */
  direction?: Vec3 | Numbers;
  /** Ray: how far it goes. Point: the largest distance. May be Infinity. */
  length?: number;
  /** Sphere, capsule: the radius. Ray: that of a sphere which is moved along it. */
  radius?: number;
  /** Box: half extents. Capsule: [2] is half its length along z. */
  half?: Vec3 | Numbers;
  /** Box, capsule: from the shape's frame to the world's axes. */
  orientation?: Quaternion | Numbers;
  /** Region: its planes. */
  planes?: readonly QueryPlane[];
  /** Sphere, box, capsule: whether hits say how deep. */
  withDepth?: boolean;
  /** With `want: 'all'`: the most hits. */
  maxHits?: number;
  layerMask?: number;
  /** When it is asked, of `QueryJob.histories`. Default: Infinity, now. */
  time?: number;
  /** An instance that is left out, such as the shooter. */
  ignoredBatch?: Batch;
  ignoredInstance?: number;
}

export interface QueryJob {
  queries: readonly Query[];
  /** Whose links are asked for; no sequences. Default: those of all batches but sequences. */
  batches?: readonly Batch[];
  /** Whose links are asked for by queries with a time of their own. */
  histories?: readonly History[];
  /** Whether exact shapes decide. Default: boxes. */
  exact?: Exact;
  /** States that poses are those of the last frame. */
  reuseBounds?: boolean;
  /** Whether hits of rays say where on the triangles of a skin they are; with `exact: 'surface'`. */
  surfacePoints?: boolean;
}

/** A point on a triangle of a skin. */
export interface SurfacePoint {
  /** Which triangle of the hit's leaf: an index in `SkinnedLeaf.triangles`, over 3. */
  triangle: number;
  /** Of its three corners: 0 to 1, and they add to 1 but for rounding. */
  weights: number[];
}

/** A link that a query found. */
export interface QueryHit {
  query: number;
  batch: Batch;
  instance: number;
  link: number;
  leaf: number;
  /** Along a ray, from a point, or minus the depth. */
  distance: number;
  /** Relative to the query's position. */
  point: number[];
  normal: number[];
  /** Whether a ray begins, or a point is, inside the link. */
  inside: boolean;
  /** With `QueryJob.surfacePoints`. Null: the hit is not on triangles. */
  surfacePoint?: SurfacePoint | null;
}

export interface QueryStats {
  instances: number;
  secondsTotal: number;
  [member: string]: number;
}

/** The hits of queries, sorted by query and distance. */
export declare class QueryHits implements List<QueryHit, QueryStats> {
  private constructor();
  readonly length: number;
  readonly stats: QueryStats;
  readonly wordsPerHit: number;
  /** Per query 1 if it found a link, else 0. */
  readonly found: Uint8Array;
  at(i: number): QueryHit;
  toArray(): QueryHit[];
  words(): Uint32Array;
  [Symbol.iterator](): Iterator<QueryHit>;
  /** With `QueryJob.surfacePoints`. Null: the hit is not on triangles. */
  surfacePoint(i: number): SurfacePoint | null;
}

// -------------------------------------------------------------------------------------------------------------- world

/** Why an instance is masked: `MaskReason` of the C++ API. */
export interface MaskReason {
  flag: 'instance_ok' | 'instance_not_finite' | 'instance_not_rigid';
  cause: 'none' | 'pose_number' | 'orientation_number' | 'quaternion_length' | 'orientation_length' | 'matrix' |
      'scale' | 'joint' | 'box';
  link: number;
  index: number;
  value: number;
  limit: number;
}

/** Bytes that a world holds in the memory of the module. */
export interface EngineMemory {
  articulations: number;
  batches: number;
  workers: number;
  broadPhase: number;
  hits: number;
  queries: number;
  histories: number;
  total: number;
}

/** Owns articulations and batches. One world does not know of another. Calls throw a `CabError` for what is refused. */
export declare class World {
  private constructor();
  /** The instruction set of its kernels, never `'auto'`. */
  readonly isa: Isa;

  addArticulation(desc: ArticulationDesc): Articulation;
  /** Adds a coarser level. Its batches take the poses of all links; hits name its leaves. */
  addLod(desc: LodDesc): Articulation;
  /** The order in which boxes are merged, from the leaves to the root. */
  mergeSteps(articulation: Articulation): MergeStep[];
  /** Makes room for `size` instances. All poses are the identity at first. */
  addBatch(articulation: Articulation, size: number, options?: BatchOptions): Batch;
  addStaticBatch(desc: StaticDesc): Batch;
  /** Removes a batch, or an articulation that no batch uses. Views of its arrays must not be used any more. */
  remove(what: Batch | Articulation): void;
  /** Makes room beforehand. */
  reserve(desc: {batches?: number; characters?: number; queries?: number; hits?: number}): void;

  /** Poses all instances, and finds the links that touch. Hits last until the next `runFrame`. */
  runFrame(job: FrameJob): Hits;
  /** Answers rays, shapes, points and regions. Hits last until the next `runQueries`. */
  runQueries(job: QueryJob): QueryHits;
  /** Poses all instances of a batch, and gives the boxes that `runFrame` tests. Of masked ones `half` is 0. */
  computeBoxes(batch: Batch, policies?: Policies | Preset): BatchBoxes;
  /**
   * Which hits began and which ended between two lists, such as those of two frames. The next `runFrame` replaces
   * hits: keep `hits.words().slice()`. Hits of a batch that was removed ended, though another batch has its slot now.
   */
  diffHits(previous: Pairs, current: Pairs): {began: ChangedHit[]; ended: ChangedHit[]};
  /**
   * How deep two links touch, or how far they are apart at any distance, by exact shapes, for each pair. Of masked
   * links the depth is -Infinity.
   */
  computeContacts(pairs: Pairs): Contact[];
  /**
   * The triangles of skins that touch, for each pair: none of links without triangles (`SkinnedLeaf`). The list lasts
   * until the next `findTouchingTriangles`.
   */
  findTouchingTriangles(pairs: Pairs): TouchingTriangles;
  /**
   * A margin per instance for `Batch.margins()`, so that the next frame finds all links that may have touched since
   * the moment.
   */
  sweepMargins(last: Moment): Float32Array;
  /**
   * For each pair the first moment between two frames, 0 to 1, at which its shapes touch; 2: never. Both are proven,
   * not sampled. `last`: a moment of each batch of the pairs that is not static. `resolution`: a length; what passes
   * nearer than that may have a moment too. Links turn along the straight line between two quaternions: 0.9 degrees
   * off an even turn of 90, 8 of 180.
   */
  findTouchingMoments(job: {last: readonly Moment[]; pairs: Pairs; resolution: number}): Float32Array;
  /** What is wrong with a job in words, or what may not be meant: a remark per line; else `nothing is wrong`. */
  explainJob(job: FrameJob): string;
  /** The edges of boxes or shapes, and contacts, for a debug draw. */
  boxLines(batch: Batch, options?: BoxLinesOptions): BoxLines;
  /** The numbers of a batch's instances so that neighbours in the list are near each other in the world. */
  spatialOrder(batch: Batch): Uint32Array;
  /** Makes room for the poses of a batch at its last `ticks` moments, 1 to 65536. */
  addHistory(batch: Batch, ticks: number): History;
  /** Why `runFrame` masks an instance: which link, which number, how far off. */
  whyMasked(batch: Batch, instance: number): MaskReason;
  memory(): EngineMemory;

  /** Gives all memory back to the module. The world, its batches and its hits must not be used any more. */
  destroy(): void;
}
