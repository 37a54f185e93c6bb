// The contacts of a frame: both points, and the normal as an arrow from a to b.
import * as THREE from 'three';
import {WORDS_PER_CONTACT} from '../recording/types.js';
import {COLORS} from './colors.js';
import {unitArrow, unitBall} from './geometries.js';
import {COPY, Instances, PATTERN} from './instances.js';
import {ROWS} from './transforms.js';

/** The radius of points, in thousandths of the picture's height. */
const POINT_SIZE = 6;

export class ContactMarks {
  readonly object = new THREE.Group();
  readonly #arrows = new Instances(unitArrow(), 'over');
  readonly #points = new Instances(unitBall('coarse'), 'over');

  constructor() {
    this.object.add(this.#arrows.object, this.#points.object);
  }

  /**
   * `hits` are the contacts that are drawn. `originOf` writes the origin of a hit's first instance, relative to the
   * scene's centre. `size`: how long arrows are, in thousandths of the picture's height.
   */
  show(contacts: Float32Array, hits: readonly number[], originOf: (hit: number, out: Float32Array) => void,
       size: number): void {
    const count = hits.length;
    this.#arrows.reserve(count);
    this.#points.reserve(2 * count);
    this.#arrows.count = count;
    this.#points.count = 2 * count;
    const origin = new Float32Array(3);
    for (const [drawn, hit] of hits.entries()) {
      originOf(hit, origin);
      const at = hit * WORDS_PER_CONTACT;
      writeArrow(contacts, at, origin, size, this.#arrows.data, drawn * COPY);
      this.#arrows.setPaint(drawn, COLORS.contact, PATTERN.plain);
      for (const [k, from] of [4, 7].entries()) {
        const copy = 2 * drawn + k;
        writeBall(contacts, at + from, origin, POINT_SIZE, this.#points.data, copy * COPY);
        this.#points.setPaint(copy, COLORS.contact, PATTERN.plain);
      }
    }
    this.#arrows.changed();
    this.#points.changed();
  }

  dispose(): void {
    this.#arrows.dispose();
    this.#points.dispose();
  }
}

function writeBall(contacts: Float32Array, from: number, origin: Float32Array, radius: number, out: Float32Array,
                   at: number): void {
  out.fill(0, at, at + ROWS);
  for (let k = 0; k < 3; ++k) {
    out[at + k * 5] = radius;
    out[at + k * 4 + 3] = origin[k]! + contacts[from + k]!;
  }
}

const normal = new THREE.Vector3();
const side = new THREE.Vector3();
const other = new THREE.Vector3();

function writeArrow(contacts: Float32Array, from: number, origin: Float32Array, length: number, out: Float32Array,
                    at: number): void {
  normal.set(contacts[from]!, contacts[from + 1]!, contacts[from + 2]!);
  side.set(Math.abs(normal.x) < 0.7 ? 1 : 0, Math.abs(normal.x) < 0.7 ? 0 : 1, 0).cross(normal).normalize();
  other.copy(normal).cross(side);
  for (let k = 0; k < 3; ++k) {
    out[at + k * 4] = side.getComponent(k) * length;
    out[at + k * 4 + 1] = other.getComponent(k) * length;
    out[at + k * 4 + 2] = normal.getComponent(k) * length;
    out[at + k * 4 + 3] = origin[k]! + contacts[from + 4 + k]!;
  }
}
