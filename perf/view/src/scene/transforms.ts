// Affine transforms as 12 floats: three rows of four, the translation in the last column. They are written into long
// arrays, so that a frame with thousands of characters allocates nothing.
import {FLOATS_PER_POSE, type Input, type Poses} from '../recording/types.js';

export const ROWS = 12;

/** Writes the rotation of the quaternion at `from`, times a factor, into the first three columns at `at`. */
export function writeRotation(q: ArrayLike<number>, from: number, factor: number, out: Float32Array, at: number): void {
  const x = q[from]!;
  const y = q[from + 1]!;
  const z = q[from + 2]!;
  const w = q[from + 3]!;
  const twice = 2 * factor / (x * x + y * y + z * z + w * w);
  out[at] = factor - twice * (y * y + z * z);
  out[at + 1] = twice * (x * y - z * w);
  out[at + 2] = twice * (x * z + y * w);
  out[at + 4] = twice * (x * y + z * w);
  out[at + 5] = factor - twice * (x * x + z * z);
  out[at + 6] = twice * (y * z - x * w);
  out[at + 8] = twice * (x * z - y * w);
  out[at + 9] = twice * (y * z + x * w);
  out[at + 10] = factor - twice * (x * x + y * y);
}

/** Writes a * b at `at`. */
export function multiply(a: Float32Array, atA: number, b: Float32Array, atB: number, out: Float32Array,
                         at: number): void {
  const b0 = b[atB]!;
  const b1 = b[atB + 1]!;
  const b2 = b[atB + 2]!;
  const b3 = b[atB + 3]!;
  const b4 = b[atB + 4]!;
  const b5 = b[atB + 5]!;
  const b6 = b[atB + 6]!;
  const b7 = b[atB + 7]!;
  const b8 = b[atB + 8]!;
  const b9 = b[atB + 9]!;
  const b10 = b[atB + 10]!;
  const b11 = b[atB + 11]!;
  for (let row = 0; row < ROWS; row += 4) {
    const x = a[atA + row]!;
    const y = a[atA + row + 1]!;
    const z = a[atA + row + 2]!;
    out[at + row] = x * b0 + y * b4 + z * b8;
    out[at + row + 1] = x * b1 + y * b5 + z * b9;
    out[at + row + 2] = x * b2 + y * b6 + z * b10;
    out[at + row + 3] = x * b3 + y * b7 + z * b11 + a[atA + row + 3]!;
  }
}

/** Writes the pose that begins at `from` of values. */
function writePose(poses: Poses, from: number, out: Float32Array): void {
  const {values, format} = poses;
  switch (format) {
    case 'quaternion_translation':
      writeRotation(values, from, 1, out, 0);
      out[3] = values[from + 4]!;
      out[7] = values[from + 5]!;
      out[11] = values[from + 6]!;
      return;
    case 'matrix3x4_rows':
      for (let i = 0; i < ROWS; ++i) out[i] = values[from + i]!;
      return;
    case 'matrix4x4_columns':
      for (let row = 0; row < 3; ++row) {
        for (let column = 0; column < 4; ++column) out[row * 4 + column] = values[from + column * 4 + row]!;
      }
      return;
  }
}

const instanceRows = new Float32Array(ROWS);
const poseRows = new Float32Array(ROWS);

/** Writes where instance i stands, relative to `center`, into `instanceRows`. */
function placeInstance(input: Input, i: number, center: Float64Array): void {
  const {origins, orientations, scales} = input;
  const scale = scales ? scales[i]! : 1;
  if (orientations) {
    writeRotation(orientations, i * 4, scale, instanceRows, 0);
  } else {
    instanceRows.fill(0);
    instanceRows[0] = instanceRows[5] = instanceRows[10] = scale;
  }
  for (let k = 0; k < 3; ++k) instanceRows[k * 4 + 3] = (origins ? origins[i * 3 + k]! : 0) - center[k]!;
}

/** Writes the rows from link to world, relative to `center`, of all links of instance i. */
function placeLinksOf(input: Input, poses: Poses, i: number, linkCount: number, center: Float64Array,
                      out: Float32Array): void {
  placeInstance(input, i, center);
  const floats = FLOATS_PER_POSE[poses.format];
  for (let link = 0; link < linkCount; ++link) {
    const index = i * linkCount + link;
    writePose(poses, index * floats, poseRows);
    multiply(instanceRows, 0, poseRows, 0, out, index * ROWS);
  }
}

/** Writes 1 for each instance that takes part, of the first `count`, and 0 for all others. */
export function findPresent({instances}: Input, count: number, present: Uint8Array): void {
  present.fill(0);
  if (!instances) present.fill(1, 0, count);
  else for (const i of instances) if (i < count) present[i] = 1;
}

/**
 * Writes the rows of all links of all instances that take part. Those of the others become 0, so that what is drawn
 * with them has no size. `present` receives 1 for each instance that takes part.
 */
export function placeLinks(input: Input, linkCount: number, center: Float64Array, out: Float32Array,
                           present: Uint8Array): void {
  const {poses} = input;
  const posed = poses ? Math.floor(poses.values.length / (FLOATS_PER_POSE[poses.format] * linkCount)) : 0;
  findPresent(input, Math.min(input.count, posed), present);
  out.fill(0);
  for (let i = 0; poses && i < present.length; ++i) {
    if (present[i] === 1) placeLinksOf(input, poses, i, linkCount, center, out);
  }
}

/** Whether all 12 numbers are finite and none is beyond what can be drawn. */
export function isDrawable(rows: Float32Array, at: number): boolean {
  for (let i = 0; i < ROWS; ++i) {
    if (!(Math.abs(rows[at + i]!) < 1e12)) return false;
  }
  return true;
}
