// What stands in the scene: batches, static triangles, boxes, contacts and a grid. It shows one frame at a time.
import * as THREE from 'three';
import type {Frame, Input, Recording} from '../recording/types.js';
import {WORDS_PER_TRIANGLES} from '../engine/types.js';
import {Bounds} from './bounds.js';
import {COLORS} from './colors.js';
import {ContactMarks} from './contact_marks.js';
import {DrawnBatch, type Picked} from './drawn_batch.js';
import {DrawnTriangles} from './drawn_triangles.js';
import {type Hit, hitAt, hitCount, isSamePair} from './hits.js';
import {MARK} from './marks.js';
import {type Axis, upAxis} from './up_axis.js';
import {WireBoxes} from './wire_boxes.js';

export interface Selection {
  /** A character; null: none. */
  instance: {batch: number; instance: number} | null;
  /** A pair of links; null: none. */
  pair: Hit | null;
}

/** A frame, and what is to be shown with it. */
export interface Picture {
  frame: Frame;
  hits: Uint32Array;
  /** Null: none are drawn. */
  contacts: Float32Array | null;
  falsePositives: Uint32Array | null;
  /** As EngineInPage.touchingTriangles has them, of `hits`. Null: they are not known, so that links are marked. */
  triangles: Uint32Array | null;
  selection: Selection;
  /** Where the camera is. */
  eye: THREE.Vector3;
}

/** Boxes of the nodes of some instances of a batch. */
export interface BoxSet {
  batch: number;
  /** As EngineInPage.boxes writes them, of all instances. */
  values: Float32Array;
  nodeCount: number;
  leafCount: number;
  instances: readonly number[];
  /** Which nodes, and whether they are drawn as leaves. */
  nodes: readonly number[];
}

/** What a person can read about an instance that is masked, and where. */
export interface MaskedPlace {
  batch: number;
  instance: number;
  position: THREE.Vector3;
}

const MOST_BOXES = 200_000;
const MOST_CONTACTS = 400;
// As many characters as tell a crowd from a few.
const SOME = 4;
// From how many characters on shapes are drawn coarsely.
const CROWD = 32;

export class Stage {
  readonly scene = new THREE.Scene();
  readonly up: Axis;
  readonly #recording: Recording;
  readonly #center = new Float64Array(3);
  readonly #batches = new Map<number, DrawnBatch>();
  readonly #triangles = new Map<number, DrawnTriangles>();
  readonly #contacts = new ContactMarks();
  readonly #boxes = new WireBoxes();
  readonly #mirrored: boolean;
  #inputs = new Map<number, Input>();
  #batchOfSlot = new Map<number, number>();
  #characterSize = 1;
  readonly #sampled = new Bounds();
  #masked: MaskedPlace[] = [];

  /** Takes the scene's centre and size from some frames of the recording, at least one. */
  constructor(recording: Recording, samples: readonly Frame[]) {
    const first = samples[0]!;
    this.#recording = recording;
    this.#center.set(centerOf(recording, first));
    this.#mirrored = first.inputs.some(({poses}) => poses !== null && poses.format !== 'quaternion_translation');
    this.scene.add(this.#contacts.object, this.#boxes.object);
    for (const frame of [...samples].reverse()) {
      this.#place(frame, new THREE.Vector3());
      this.#sampled.add(this.bounds());
    }
    const bounds = this.#sampled;
    const characters = this.#someCharacters(first);
    this.up = upAxis(recording.header, characters, bounds);
    this.#characterSize = 2 * (characters[0]?.radius ?? 0) || bounds.radius || 1;
    this.scene.add(makeGrid(bounds, this.up, recording.header.metresPerUnit));
  }

  /** Bounds of everything, in some frames of the recording. */
  get sampled(): Bounds {
    return this.#sampled;
  }

  /** About how large a character is. */
  get characterSize(): number {
    return this.#characterSize;
  }

  /** How many skins are too many to draw. */
  get skinsLeftOut(): number {
    let count = 0;
    for (const {object, skinsLeftOut} of this.#batches.values()) if (object.visible) count += skinsLeftOut;
    return count;
  }

  get masked(): readonly MaskedPlace[] {
    return this.#masked;
  }

  // Bounds of the first few characters, each by itself.
  #someCharacters(frame: Frame): Bounds[] {
    const found: Bounds[] = [];
    for (const {batch} of frame.inputs) {
      const drawn = this.#batches.get(batch);
      if (!drawn || drawn.isStatic) continue;
      for (let i = 0; i < drawn.instanceCount && found.length < SOME; ++i) {
        const bounds = new Bounds();
        drawn.addBounds(bounds, i);
        if (!bounds.empty) found.push(bounds);
      }
    }
    return found;
  }

  #drawn(batch: number): DrawnBatch {
    const known = this.#batches.get(batch);
    if (known) return known;
    const input = this.#inputs.get(batch);
    const fineness = input && countIn(this.#recording, input) > CROWD ? 'coarse' : 'fine';
    const made = new DrawnBatch(this.#recording, batch, this.#center, fineness, this.#mirrored);
    this.#batches.set(batch, made);
    this.scene.add(made.object);
    const bodies = this.#recording.batches[batch]?.staticBodies;
    if (bodies && bodies.triangles.length > 0) {
      const triangles = new DrawnTriangles(bodies, this.#center);
      this.#triangles.set(batch, triangles);
      this.scene.add(triangles.object);
    }
    return made;
  }

  #place(frame: Frame, eye: THREE.Vector3): void {
    this.#inputs = new Map(frame.inputs.map((input) => [input.batch, input]));
    this.#batchOfSlot = new Map(frame.inputs.map(({batch}) => [this.#recording.batches[batch]!.slot, batch]));
    for (const input of frame.inputs) this.#drawn(input.batch).place(input, this.#center, eye);
    for (const [index, drawn] of this.#batches) {
      drawn.object.visible = this.#inputs.has(index);
      const triangles = this.#triangles.get(index);
      if (triangles) triangles.object.visible = this.#inputs.has(index);
    }
  }

  /** Returns how many contacts are left out, since they are too many. */
  show({frame, hits, contacts, falsePositives, triangles: touching, selection, eye}: Picture): number {
    this.#place(frame, eye);
    for (const triangles of this.#triangles.values()) triangles.clearMarks();
    if (falsePositives) this.#markAll(falsePositives, () => MARK.falsePositive, null);
    const {pair, instance} = selection;
    this.#markAll(hits, (hit) => pair && isSamePair(hit, pair) ? MARK.selected : MARK.hit, touching);
    for (const [index, drawn] of this.#batches) {
      if (!drawn.object.visible) continue;
      drawn.marks.selectedInstance = instance?.batch === index ? instance.instance : -1;
      drawn.paint();
    }
    for (const triangles of this.#triangles.values()) triangles.paint();
    this.#findMasked(frame);
    return this.#showContacts(hits, contacts, selection);
  }

  #showContacts(hits: Uint32Array, contacts: Float32Array | null, {pair, instance}: Selection): number {
    const all = contacts ? hitCount(hits) : 0;
    const isOfSelected = (hit: Hit): boolean => (pair !== null && isSamePair(hit, pair)) || (instance !== null &&
      ((this.#batchOfSlot.get(hit.slotA) === instance.batch && hit.instanceA === instance.instance) ||
       (this.#batchOfSlot.get(hit.slotB) === instance.batch && hit.instanceB === instance.instance)));
    const indices: number[] = [];
    for (let i = 0; i < all; ++i) {
      if (all <= MOST_CONTACTS || isOfSelected(hitAt(hits, i))) indices.push(i);
    }
    const size = 0.1 * this.#characterSize;
    this.#contacts.show(contacts ?? new Float32Array(0), indices, (i, out) => this.#originOfHit(hits, i, out),
                        (i) => pair === null ? size : isSamePair(hitAt(hits, i), pair) ? 1.5 * size : 0.5 * size);
    return all - indices.length;
  }

  // Of skins triangles are marked; the whole links of hits of which no triangles are known.
  #markAll(words: Uint32Array, valueOf: (hit: Hit) => number, triangles: Uint32Array | null): void {
    let next = 0;
    for (let i = 0; i < hitCount(words); ++i) {
      const hit = hitAt(words, i);
      const value = valueOf(hit);
      const first = next;
      for (; triangles && triangles[next] === i; next += WORDS_PER_TRIANGLES) {
        const leaves = triangles[next + 1]!;
        this.#batchAt(hit.slotA)?.markTriangle(hit.instanceA, leaves & 0xffff, triangles[next + 2]!, value);
        this.#batchAt(hit.slotB)?.markTriangle(hit.instanceB, leaves >>> 16, triangles[next + 3]!, value);
      }
      this.#mark(hit.slotA, hit.instanceA, hit.linkA, value, next === first);
      this.#mark(hit.slotB, hit.instanceB, hit.linkB, value, next === first);
    }
  }

  #batchAt(slot: number): DrawnBatch | undefined {
    return this.#batches.get(this.#batchOfSlot.get(slot) ?? -1);
  }

  #mark(slot: number, instance: number, link: number, value: number, bySkin: boolean): void {
    const drawn = this.#batchAt(slot);
    drawn?.markLink(instance, link, value);
    if (bySkin) drawn?.markSkin(instance, link, value);
    if (drawn) this.#triangles.get(drawn.index)?.markInstance(instance, value);
  }

  // Contacts are relative to the origin of the first instance. Of a triangle that is the origin of the mesh.
  #originOfHit(hits: Uint32Array, index: number, out: Float32Array): void {
    const {slotA, instanceA} = hitAt(hits, index);
    const batch = this.#batchOfSlot.get(slotA);
    const origin = batch === undefined ? null : this.#originOf(batch, instanceA);
    for (let k = 0; k < 3; ++k) out[k] = (origin?.[k] ?? 0) - this.#center[k]!;
  }

  /** The origin of an instance in the world. */
  #originOf(batch: number, instance: number): [number, number, number] {
    const bodies = this.#recording.batches[batch]?.staticBodies;
    const values = bodies ? bodies.bodies[instance]?.origin ?? bodies.origin :
                            this.#inputs.get(batch)?.origins?.subarray(instance * 3, instance * 3 + 3);
    return [values?.[0] ?? 0, values?.[1] ?? 0, values?.[2] ?? 0];
  }

  #findMasked(frame: Frame): void {
    this.#masked = [];
    for (const {batch, masked} of frame.inputs) {
      for (const instance of masked) {
        const origin = this.#originOf(batch, instance).map((value, k) => value - this.#center[k]!);
        if (!origin.every(Number.isFinite)) continue;
        this.#masked.push({batch, instance, position: new THREE.Vector3(...origin)});
      }
    }
  }

  /** Draws boxes as wires, and a cube about each masked instance's origin. Returns how many were left out. */
  showBoxes(sets: readonly BoxSet[]): number {
    const wanted = sets.reduce((sum, {instances, nodes}) => sum + instances.length * nodes.length, 0);
    this.#boxes.begin(Math.min(wanted, MOST_BOXES) + this.#masked.length);
    const origin = [0, 0, 0];
    let left = MOST_BOXES;
    for (const {batch, values, nodeCount, leafCount, instances, nodes} of sets) {
      for (const instance of instances) {
        if (left < nodes.length) break;
        left -= nodes.length;
        this.#originOf(batch, instance).forEach((value, k) => (origin[k] = value - this.#center[k]!));
        for (const node of nodes) {
          this.#boxes.addBox(values, instance * nodeCount + node, origin, 0,
                             node < leafCount ? COLORS.leafBox : COLORS.innerBox);
        }
      }
    }
    const drawn = this.#boxes.count;
    for (const {position} of this.#masked) {
      this.#boxes.addCube(position.toArray(), 0.25 * this.#characterSize, COLORS.masked);
    }
    this.#boxes.end();
    return wanted - drawn;
  }

  /** Bounds of everything. */
  bounds(): Bounds {
    const bounds = new Bounds();
    for (const drawn of this.#batches.values()) {
      if (drawn.object.visible) drawn.addBounds(bounds);
    }
    for (const triangles of this.#triangles.values()) triangles.addBounds(bounds);
    return bounds;
  }

  /** Bounds of the selected pair, else of the selected character, else of everything. */
  boundsOf({pair, instance}: Selection): Bounds {
    const bounds = new Bounds();
    if (pair) {
      this.#addLink(bounds, pair.slotA, pair.instanceA, pair.linkA);
      this.#addLink(bounds, pair.slotB, pair.instanceB, pair.linkB);
    } else if (instance) {
      const drawn = this.#batches.get(instance.batch);
      if (drawn?.isStatic) drawn.addBounds(bounds, 0, instance.instance);
      else drawn?.addBounds(bounds, instance.instance);
    }
    return bounds.empty ? this.bounds() : bounds;
  }

  #addLink(bounds: Bounds, slot: number, instance: number, link: number): void {
    const drawn = this.#batches.get(this.#batchOfSlot.get(slot) ?? -1);
    if (drawn?.isStatic) drawn.addBounds(bounds, 0, instance);
    else drawn?.addBounds(bounds, instance, link);
  }

  /** Instances of a batch whose middle is at most `distance` from a point. */
  near(batch: number, point: THREE.Vector3, distance: number): number[] {
    const drawn = this.#batches.get(batch);
    if (!drawn || drawn.isStatic) return [];
    const found: number[] = [];
    for (let i = 0; i < drawn.instanceCount; ++i) {
      if (drawn.present[i] === 0) continue;
      const middle = this.middleOf(batch, i);
      if (middle && middle.distanceTo(point) <= distance) found.push(i);
    }
    return found;
  }

  /** The instances of a batch that take part. */
  presentInstances(batch: number): number[] {
    const drawn = this.#batches.get(batch);
    return drawn ? [...drawn.present.keys()].filter((i) => drawn.present[i] === 1) : [];
  }

  /** The first character that takes part. */
  firstCharacter(): Selection['instance'] {
    for (const [batch, drawn] of this.#batches) {
      const instance = drawn.present.indexOf(1);
      if (!drawn.isStatic && drawn.object.visible && instance >= 0) return {batch, instance};
    }
    return null;
  }

  /** Where an instance's first link is; of static bodies, the body. Null: it takes no part. */
  middleOf(batch: number, instance: number): THREE.Vector3 | null {
    const drawn = this.#batches.get(batch);
    if (!drawn) return null;
    if (drawn.isStatic) return drawn.isLink(0, instance) ? new THREE.Vector3(...drawn.positionOf(0, instance)) : null;
    if (drawn.present[instance] !== 1 || drawn.marks.masked[instance] === 1) return null;
    return new THREE.Vector3(...drawn.positionOf(instance, 0));
  }

  /** Where a link of a hit is. */
  linkPosition(slot: number, instance: number, link: number): THREE.Vector3 | null {
    const batch = this.#batchOfSlot.get(slot) ?? -1;
    const drawn = this.#batches.get(batch);
    if (!drawn || drawn.isStatic) return this.middleOf(batch, instance);
    return drawn.isLink(instance, link) ? new THREE.Vector3(...drawn.positionOf(instance, link)) : null;
  }

  batchOfSlot(slot: number): number | undefined {
    return this.#batchOfSlot.get(slot);
  }

  pick(ray: THREE.Ray): Picked | null {
    let best: Picked | null = null;
    for (const drawn of this.#batches.values()) {
      if (!drawn.object.visible) continue;
      const picked = drawn.pick(ray);
      if (picked && picked.distance < (best?.distance ?? Infinity)) best = picked;
    }
    return best;
  }

  dispose(): void {
    for (const drawn of this.#batches.values()) drawn.dispose();
    for (const triangles of this.#triangles.values()) triangles.dispose();
    this.#contacts.dispose();
    this.#boxes.dispose();
  }
}

/** How many instances of a batch a frame has. */
export function countIn(recording: Recording, {batch, instances, count}: Input): number {
  const {instanceCount} = recording.batches[batch]!;
  return instances ? instances.length : Math.min(count, instanceCount);
}

// The mean of all finite origins, so that floats relative to it are small.
function centerOf(recording: Recording, frame: Frame): Float64Array {
  const sum = new Float64Array(3);
  let count = 0;
  const add = (origins: Float64Array, at: number): void => {
    const [x, y, z] = [origins[at]!, origins[at + 1]!, origins[at + 2]!];
    if (!Number.isFinite(x + y + z)) return;
    sum[0]! += x;
    sum[1]! += y;
    sum[2]! += z;
    ++count;
  };
  for (const {batch, origins} of frame.inputs) {
    for (let at = 0; origins && at + 2 < origins.length; at += 3) add(origins, at);
    const bodies = recording.batches[batch]?.staticBodies;
    for (const {origin} of bodies?.bodies ?? []) add(origin, 0);
  }
  return sum.map((value) => value / Math.max(count, 1));
}

// Lines on the lowest plane: 10 to 50 cells, of 1, 2 or 5 times a power of ten metres, or units if those are unknown.
function makeGrid(bounds: Bounds, up: Axis, metresPerUnit: number): THREE.Object3D {
  const width = Math.max(2 * bounds.radius, 1e-6) * 1.5;
  const unit = metresPerUnit > 0 ? 1 / metresPerUnit : 1;
  const power = 10 ** Math.floor(Math.log10(width / unit / 10));
  const cell = unit * power * (width / unit / power > 50 ? 5 : width / unit / power > 20 ? 2 : 1);
  const cells = Math.max(2, Math.ceil(width / cell));
  const grid = new THREE.GridHelper(cells * cell, cells, COLORS.grid, COLORS.grid);
  if (up === 0) grid.rotation.z = Math.PI / 2;
  if (up === 2) grid.rotation.x = Math.PI / 2;
  if (!bounds.empty) {
    const place = bounds.center();
    place[up] = bounds.low[up]! - 1e-3 * bounds.radius;
    grid.position.set(...place);
  }
  return grid;
}
