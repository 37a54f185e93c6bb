// Poses as floats, also those that are rounded to 16 bits.
import type {Poses as PosesTable} from 'recording-format';
import type {Payload} from './payload.js';
import {FLOATS_PER_POSE, type PoseFormat, type Poses} from './types.js';

const FORMATS: readonly PoseFormat[] = ['quaternion_translation', 'matrix3x4_rows', 'matrix4x4_columns'];
const QUATERNION_STEPS = 32767;

/** How many poses there may be. */
export interface PoseCount {
  least: number;
  most: number;
  /** They come in multiples of this. */
  links: number;
}

export function readPoses(payload: Payload, what: string, table: PosesTable, poseStep: number,
                          {least, most, links}: PoseCount): Poses {
  const format = payload.oneOf(`${what}: the format`, FORMATS, table.format());
  const values = payload.numbers(what, () => table.valuesArray());
  const rounded = payload.numbers(what, () => table.roundedArray());
  if (values !== null && rounded !== null) payload.fail(`${what}: there are floats and rounded numbers`);
  if (rounded !== null && format !== 'quaternion_translation') payload.fail(`${what}: matrices are rounded`);
  if (rounded !== null && !(poseStep > 0)) payload.fail(`${what}: poses are rounded, and their step is not known`);
  const given = values ?? rounded;
  const count = (given?.length ?? 0) / FLOATS_PER_POSE[format];
  if (!(count >= least && count <= most && count % links === 0)) {
    const wanted = least === most ? `${most}` : `${least} to ${most}, by ${links} links,`;
    payload.fail(`${what}: ${given?.length ?? 0} numbers are not the poses that are needed: ${wanted} of ` +
                 `${FLOATS_PER_POSE[format]} numbers`);
  }
  const floats = rounded === null ? values ?? new Float32Array(0) : unrounded(rounded, poseStep);
  return {format, hasScale: table.hasScale(), values: floats};
}

// Both operations round once, to float.
function unrounded(rounded: Int16Array, step: number): Float32Array {
  const floats = new Float32Array(rounded.length);
  for (let pose = 0; pose < rounded.length; pose += 7) {
    for (let c = 0; c < 4; ++c) floats[pose + c] = rounded[pose + c]! / QUATERNION_STEPS;
    for (let c = 4; c < 7; ++c) floats[pose + c] = rounded[pose + c]! * step;
  }
  return floats;
}
