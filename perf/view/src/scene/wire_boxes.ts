// Boxes as wires: leaf boxes and inner boxes of hierarchies.
import type * as THREE from 'three';
import {unitBoxEdges} from './geometries.js';
import {COPY, Instances, PATTERN} from './instances.js';
import {ROWS} from './transforms.js';

const FLOATS_OF_BOX = 15;

export class WireBoxes {
  readonly #boxes = new Instances(unitBoxEdges(), 'wire');
  #count = 0;

  get object(): THREE.Object3D {
    return this.#boxes.object;
  }

  get count(): number {
    return this.#count;
  }

  begin(most: number): void {
    this.#boxes.reserve(most);
    this.#count = 0;
  }

  /** Box `index` of values: centre, axes, half extents, relative to `origin`. */
  addBox(values: Float32Array, index: number, origin: ArrayLike<number>, originAt: number, rgb: number): void {
    const from = index * FLOATS_OF_BOX;
    const at = this.#count * COPY;
    const {data} = this.#boxes;
    for (let row = 0; row < 3; ++row) {
      for (let k = 0; k < 3; ++k) data[at + row * 4 + k] = values[from + 3 + k * 3 + row]! * values[from + 12 + k]!;
      data[at + row * 4 + 3] = values[from + row]! + origin[originAt + row]!;
    }
    this.#boxes.setPaint(this.#count++, rgb, PATTERN.plain);
  }

  /** An axis-aligned cube. */
  addCube(center: ArrayLike<number>, half: number, rgb: number): void {
    const at = this.#count * COPY;
    const {data} = this.#boxes;
    data.fill(0, at, at + ROWS);
    for (let k = 0; k < 3; ++k) {
      data[at + k * 5] = half;
      data[at + k * 4 + 3] = center[k]!;
    }
    this.#boxes.setPaint(this.#count++, rgb, PATTERN.plain);
  }

  end(): void {
    this.#boxes.count = this.#count;
    this.#boxes.changed();
  }

  dispose(): void {
    this.#boxes.dispose();
  }
}
