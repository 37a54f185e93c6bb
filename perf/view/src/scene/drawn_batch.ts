// One batch in the scene: characters, or static bodies, which are drawn as the links of a single character.
import * as THREE from 'three';
import type {Input, Recording, StaticBody} from '../recording/types.js';
import type {Bounds} from './bounds.js';
import {characterColor, COLORS, shaded} from './colors.js';
import {DrawnSkin} from './drawn_skin.js';
import type {Fineness} from './geometries.js';
import {COPY, Instances, PATTERN} from './instances.js';
import {clearMarks, makeMarks, mark, MARK, type Marks} from './marks.js';
import {characterPieces, linkCountOf, type PieceGroup, staticPieces} from './pieces.js';
import {SkinShape} from './skin_shape.js';
import {findPresent, isDrawable, multiply, placeLinks, ROWS, writeRotation} from './transforms.js';

interface DrawnGroup extends PieceGroup {
  instances: Instances;
}

export interface Picked {
  batch: number;
  instance: number;
  link: number;
  distance: number;
}

export class DrawnBatch {
  readonly object = new THREE.Group();
  readonly index: number;
  readonly isStatic: boolean;
  readonly linkCount: number;
  /** How many instances there is room for: those of frames, of which a batch may claim far more. */
  instanceCount = 0;
  marks: Marks = makeMarks(0, 0);
  /** From link to world, relative to the scene's centre: by instance, then by link. */
  linkRows = new Float32Array(0);
  /** 1 per instance that takes part, as hits number them: static bodies, then triangles. */
  present = new Uint8Array(0);
  /** How many instances have a skin that is not drawn. */
  skinsLeftOut = 0;
  readonly #groups: DrawnGroup[];
  readonly #skin: DrawnSkin | null;
  readonly #bodies: readonly StaticBody[];
  /** The instances that take part, in the order in which they are drawn: the nearest first, which hide others. */
  #order: number[] = [];
  #distances = new Float32Array(0);
  readonly #claimed: number;

  /** `mirrored`: whether poses may mirror links. */
  constructor(recording: Recording, index: number, center: Float64Array, fineness: Fineness, mirrored: boolean) {
    const batch = recording.batches[index]!;
    const bodies = batch.staticBodies?.bodies;
    this.#bodies = bodies ?? [];
    this.index = index;
    this.isStatic = bodies !== undefined;
    this.linkCount = bodies ? bodies.length : linkCountOf(recording.articulations, batch);
    this.#claimed = batch.instanceCount;
    if (bodies) this.#makeRoom(1, batch.instanceCount);
    const groups = bodies ? staticPieces(bodies) : characterPieces(recording.articulations, batch, fineness);
    this.#groups = groups.map((group) => {
      const instances = new Instances(group.geometry, group.look, group.endless || mirrored);
      this.object.add(instances.object);
      return {...group, instances};
    });
    const shape = SkinShape.of(recording.articulations[batch.articulation]);
    this.#skin = shape && new DrawnSkin(shape);
    if (this.#skin) this.object.add(this.#skin.object);
  }

  // Static bodies are one instance here, and take part each by itself.
  #makeRoom(count: number, present = count): void {
    this.instanceCount = count;
    this.linkRows = new Float32Array(count * this.linkCount * ROWS);
    this.present = new Uint8Array(present);
    this.#distances = new Float32Array(count);
    this.marks = makeMarks(count, this.linkCount);
  }

  #placeBodies(input: Input, center: Float64Array): void {
    findPresent(input, input.count, this.present);
    this.linkRows.fill(0);
    this.#bodies.forEach(({origin, rotation}, i) => {
      if (this.present[i] === 0) return;
      writeRotation(rotation, 0, 1, this.linkRows, i * ROWS);
      for (let k = 0; k < 3; ++k) this.linkRows[i * ROWS + k * 4 + 3] = origin[k]! - center[k]!;
    });
    this.#order = [0];
    this.#placePieces();
  }

  /** Moves all links to where a frame has them, seen from `eye`, and takes all marks away. */
  place(input: Input, center: Float64Array, eye: THREE.Vector3): void {
    clearMarks(this.marks);
    if (this.isStatic) {
      this.#placeBodies(input, center);
      return;
    }
    const {instances, count} = input;
    const needed = Math.min(this.#claimed, instances ? (instances.at(-1) ?? -1) + 1 : count);
    if (needed > this.instanceCount) this.#makeRoom(Math.min(this.#claimed, Math.max(needed, 2 * this.instanceCount)));
    placeLinks(input, this.linkCount, center, this.linkRows, this.present);
    for (const instance of input.masked) {
      if (instance < this.instanceCount) this.#mask(instance);
    }
    this.#sort(eye);
    this.#placePieces();
    this.skinsLeftOut = this.#skin?.place(this.#order, this.linkRows, this.linkCount) ?? 0;
  }

  // What is drawn of a masked instance are those links whose poses are numbers.
  #mask(instance: number): void {
    this.marks.masked[instance] = 1;
    for (let link = 0; link < this.linkCount; ++link) {
      const at = (instance * this.linkCount + link) * ROWS;
      if (!isDrawable(this.linkRows, at)) this.linkRows.fill(0, at, at + ROWS);
    }
  }

  #sort(eye: THREE.Vector3): void {
    const distances = this.#distances;
    this.#order.length = 0;
    for (let i = 0; i < this.instanceCount; ++i) {
      if (this.present[i] === 0) continue;
      const [x, y, z] = this.positionOf(i, 0);
      distances[i] = (x - eye.x) ** 2 + (y - eye.y) ** 2 + (z - eye.z) ** 2;
      this.#order.push(i);
    }
    this.#order.sort((a, b) => distances[a]! - distances[b]!);
  }

  #placePieces(): void {
    for (const {instances, pieces} of this.#groups) {
      instances.reserve(this.#order.length * pieces.length);
      let at = 0;
      for (const i of this.#order) {
        const first = i * this.linkCount;
        for (const {link, local} of pieces) {
          multiply(this.linkRows, (first + link) * ROWS, local, 0, instances.data, at);
          at += COPY;
        }
      }
      instances.count = at / COPY;
    }
  }

  /** `instance` and `link` as hits have them. */
  markLink(instance: number, link: number, value: number): void {
    mark(this.marks, this.isStatic ? instance : instance * this.linkCount + link, value);
  }

  /** Marks what a skin has of a link. */
  markSkin(instance: number, link: number, value: number): void {
    this.#skin?.markLink(instance, link, value);
  }

  /** `leaf` and `triangle` as EngineInPage.touchingTriangles has them. */
  markTriangle(instance: number, leaf: number, triangle: number, value: number): void {
    this.#skin?.markTriangle(instance, leaf, triangle, value);
  }

  // The colour of what is not marked, and its pattern.
  #paintOf(instance: number): readonly [rgb: number, pattern: number] {
    const {masked, selectedInstance, looksAtPair} = this.marks;
    if (masked[instance]) return [COLORS.masked, PATTERN.crosses];
    const own = this.isStatic ? COLORS.statics : characterColor(this.index, instance);
    return [instance === selectedInstance ? shaded(own, 1.25) : own, looksAtPair ? PATTERN.ghost : PATTERN.plain];
  }

  // The triangles of the pair that one looks at are marked, and the skin about them is seen through.
  #paintOfSkin(instance: number): readonly [rgb: number, pattern: number] {
    const [rgb, pattern] = this.#paintOf(instance), {links} = this.marks;
    const first = instance * this.linkCount;
    const isOfPair = pattern === PATTERN.ghost && links.subarray(first, first + this.linkCount).some((value) =>
      value >= MARK.glass);
    return [rgb, isOfPair ? PATTERN.glass : pattern];
  }

  /** Colours all pieces as the marks say. A floor without end in red would hide all other red. */
  paint(): void {
    const {links} = this.marks;
    this.#skin?.paint((instance) => this.#paintOfSkin(instance));
    for (const {instances, pieces, endless} of this.#groups) {
      let copy = 0;
      for (const i of this.#order) {
        const [base, plain] = this.#paintOf(i);
        for (const {link} of pieces) {
          const value = links[i * this.linkCount + link]!;
          if (endless) {
            instances.setPaint(copy, value < MARK.hit ? COLORS.floor : COLORS.floorHit, PATTERN.plain);
          } else if (value === MARK.none) {
            instances.setPaint(copy, link % 2 === 0 ? base : shaded(base, 0.88), plain);
          } else if (value === MARK.falsePositive) {
            instances.setPaint(copy, COLORS.falsePositive, PATTERN.stripes);
          } else if (value === MARK.glass) {
            instances.setPaint(copy, base, PATTERN.glass);
          } else {
            instances.setPaint(copy, COLORS.hit, PATTERN.plain);
          }
          ++copy;
        }
      }
      instances.changed();
    }
  }

  /** Adds the pieces that stand; -1: those of all instances, of all links. */
  addBounds(bounds: Bounds, onlyInstance = -1, onlyLink = -1): void {
    this.#skin?.addBounds(bounds, onlyInstance, onlyLink);
    for (const {instances, pieces, half, endless} of this.#groups) {
      if (endless) continue;
      let copy = 0;
      for (const i of this.#order) {
        const isOfWanted = !this.marks.masked[i] && (onlyInstance < 0 || onlyInstance === i);
        for (const {link} of pieces) {
          const at = COPY * copy++;
          const isWanted = isOfWanted && (onlyLink < 0 || onlyLink === link) && this.stands(i, link);
          if (isWanted) bounds.addRows(instances.data, at, half);
        }
      }
    }
  }

  /** Whether there is such a link, or static body, and it takes part. */
  stands(instance: number, link: number): boolean {
    return link < this.linkCount && this.present[this.isStatic ? link : instance] === 1;
  }

  /** Adds a triangle of a skin. */
  addTriangle(bounds: Bounds, instance: number, leaf: number, triangle: number): void {
    this.#skin?.addTriangle(bounds, instance, leaf, triangle);
  }

  /** Where a link's frame is. */
  positionOf(instance: number, link: number): [number, number, number] {
    const at = (instance * this.linkCount + link) * ROWS;
    return [this.linkRows[at + 3]!, this.linkRows[at + 7]!, this.linkRows[at + 11]!];
  }

  /** The nearest piece that a ray meets, by the boxes about pieces, or the nearest triangle of a skin. */
  pick(ray: THREE.Ray): Picked | null {
    const onSkin = this.#skin?.pick(ray) ?? null;
    let best: Picked | null = onSkin && {batch: this.index, ...onSkin};
    for (const {instances, pieces, half, endless} of this.#groups) {
      if (endless) continue;
      let copy = 0;
      for (const i of this.#order) {
        for (const {link} of pieces) {
          const distance = meetBox(ray, instances.data, copy * COPY, half);
          if (distance < (best?.distance ?? Infinity)) {
            best = this.isStatic ? {batch: this.index, instance: link, link: 0, distance} :
                                   {batch: this.index, instance: i, link, distance};
          }
          ++copy;
        }
      }
    }
    return best;
  }

  dispose(): void {
    this.#skin?.dispose();
    for (const {instances, geometry} of this.#groups) {
      instances.dispose();
      geometry.dispose();
    }
  }
}

// Where a ray enters a box, as a distance; Infinity if it does not.
function meetBox(ray: THREE.Ray, rows: Float32Array, at: number, half: readonly number[]): number {
  let enter = 0;
  let leave = Infinity;
  const {origin, direction} = ray;
  const dx = origin.x - rows[at + 3]!;
  const dy = origin.y - rows[at + 7]!;
  const dz = origin.z - rows[at + 11]!;
  for (let k = 0; k < 3; ++k) {
    const x = rows[at + k]!;
    const y = rows[at + 4 + k]!;
    const z = rows[at + 8 + k]!;
    const square = x * x + y * y + z * z;
    if (square === 0) return Infinity;
    const from = (dx * x + dy * y + dz * z) / square;
    const step = (direction.x * x + direction.y * y + direction.z * z) / square;
    const one = (-half[k]! - from) / step;
    const other = (half[k]! - from) / step;
    enter = Math.max(enter, Math.min(one, other));
    leave = Math.min(leave, Math.max(one, other));
  }
  return enter <= leave ? enter : Infinity;
}
