// Articulations and static bodies of a recording, as descriptions for the engine, and coarser levels of them.
import type {
  Articulation as Body, ArticulationDesc, ConvexPart, LodDesc, Poses as PosesDesc, SkinDesc, StaticDesc,
} from 'cab-collision';
import {RecordingError} from '../recording/error.js';
import {
  type Articulation, FLOATS_PER_POSE, type Input, type Part, type Poses, type Recording, type Skin, type StaticBodies,
} from '../recording/types.js';

/** Frames, evenly over the recording, whose poses say how far joints are from their links. */
const FRAMES_FOR_REACH = 16;
/** Instances of each of them. */
const INSTANCES_FOR_REACH = 8;

const partOf = ({kind, position, rotation, size, vertices}: Part): ConvexPart =>
    ({kind, position, rotation, size, vertices});

const posesOf = ({format, hasScale, values}: Poses): PosesDesc => ({format, hasScale, data: values});

export function descOf(articulation: Articulation): ArticulationDesc {
  const {linkParents, linkJoints, leaves, ignoredPairs, ignoredHops, restPose, skin} = articulation;
  const pairs = Array.from({length: ignoredPairs.length / 2},
                           (_, i) => ({a: ignoredPairs[2 * i]!, b: ignoredPairs[2 * i + 1]!}));
  return {
    linkParents,
    linkJoints,
    leaves: leaves.map(({link, box, parts, triangles}) =>
      triangles.length > 0 ? {link, triangles} : {link, box, parts: parts.map(partOf)}),
    ignoredPairs: pairs,
    ignoredHops,
    ...(restPose && {restPose: posesOf(restPose)}),
    ...(skin && {skin: skinDescOf(skin)}),
  };
}

const skinDescOf = ({inverseBind, ...skin}: Skin): SkinDesc => ({...skin, ...(inverseBind && {inverseBind})});

/** A level that the recording has. `of`: what it is a level of. */
export function lodDescOf(articulation: Articulation, of: Body): LodDesc {
  const {kind, maxLeaves, leaves, restPoses, jointPlay} = articulation.level!;
  return {of, kind, maxLeaves, leaves, jointPlay, ...(restPoses && {restPoses: posesOf(restPoses)})};
}

export function staticDescOf({bodies, vertices, triangles, origin}: StaticBodies): StaticDesc {
  return {
    bodies: bodies.map(({parts, ...body}) => ({...body, parts: parts.map(partOf)})),
    vertices,
    triangles,
    origin,
  };
}

/** Poses of an articulation at moments of the recording; null if none can be read. */
export function posesForReach(recording: Recording, articulation: number): PosesDesc | null {
  const links = recording.articulations[articulation]!.linkParents.length;
  const frames = Math.min(FRAMES_FOR_REACH, recording.frameCount);
  const found: Poses[] = [];
  for (let i = 0; i < frames; ++i) {
    const index = frames === 1 ? 0 : Math.floor(i * (recording.frameCount - 1) / (frames - 1));
    found.push(...posesOfFrame(recording, index, articulation, links));
  }
  const first = found[0];
  if (first === undefined) return null;
  // A description has one format.
  const alike = found.filter(({format, hasScale}) => format === first.format && hasScale === first.hasScale);
  const data = new Float32Array(alike.reduce((sum, {values}) => sum + values.length, 0));
  let at = 0;
  for (const {values} of alike) {
    data.set(values, at);
    at += values.length;
  }
  return {format: first.format, hasScale: first.hasScale, data};
}

// Poses of one instance each.
function posesOfFrame(recording: Recording, index: number, articulation: number, links: number): Poses[] {
  const poses: Poses[] = [];
  for (const {batch, poses: given, count, instances, masked} of inputsOfFrame(recording, index)) {
    if (given === null || recording.batches[batch]!.articulation !== articulation) continue;
    const floats = links * FLOATS_PER_POSE[given.format], isMasked = new Set(masked);
    const all = instances ?? Array.from({length: Math.min(count, INSTANCES_FOR_REACH)}, (_, i) => i);
    for (const instance of all.slice(0, INSTANCES_FOR_REACH)) {
      if (isMasked.has(instance)) continue;
      poses.push({...given, values: given.values.subarray(floats * instance, floats * (instance + 1))});
    }
  }
  return poses;
}

// A frame that is lost has none.
function inputsOfFrame(recording: Recording, index: number): readonly Input[] {
  try {
    return recording.frame(index).inputs;
  } catch (error) {
    if (error instanceof RecordingError) return [];
    throw error;
  }
}
