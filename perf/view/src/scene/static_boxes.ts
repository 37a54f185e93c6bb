// The boxes of static bodies as EngineInPage.boxes gives those of characters: 15 floats each, centre, axes and half
// extents, relative to the body's origin along the world's axes.
import type {StaticBody} from '../recording/types.js';
import {ROWS, writeRotation} from './transforms.js';

export function boxesOfBodies(bodies: readonly StaticBody[]): Float32Array {
  const values = new Float32Array(15 * bodies.length);
  const rotation = new Float32Array(ROWS);
  bodies.forEach((body, i) => {
    writeRotation(body.rotation, 0, 1, rotation, 0);
    const turn = (from: Float32Array, fromAt: number, at: number): void => {
      for (let row = 0; row < 3; ++row) {
        for (let k = 0; k < 3; ++k) values[at + row]! += rotation[row * 4 + k]! * from[fromAt + k]!;
      }
    };
    turn(body.box.center, 0, 15 * i);
    for (let axis = 0; axis < 9; axis += 3) turn(body.box.axis, axis, 15 * i + 3 + axis);
    values.set(body.box.half, 15 * i + 12);
  });
  return values;
}
