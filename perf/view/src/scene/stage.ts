// What stands in the scene: batches, static triangles, boxes, contacts and a grid. It shows one frame at a time.
import * as THREE from 'three';
import {type Frame, type Input, type Recording, WORDS_PER_CONTACT} from '../recording/types.js';
import {WORDS_PER_TRIANGLES} from '../engine/types.js';
import {Bounds} from './bounds.js';
import {COLORS} from './colors.js';
import {ContactMarks} from './contact_marks.js';
import {DrawnBatch, type Picked} from './drawn_batch.js';
import {DrawnTriangles} from './drawn_triangles.js';
import {type Hit, hitAt, hitCount, isSamePair} from './hits.js';
import {sampled} from './instances.js';
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

/** Where a pair of links is. */
export interface PairPlace {
  center: THREE.Vector3;
  /** How far around there the smaller of both links is seen. */
  radius: number;
  /** Of its contact, from a to b; null: there is none. */
  normal: THREE.Vector3 | null;
  /** The middle of each link. */
  a: THREE.Vector3;
  b: THREE.Vector3;
}

/** What a person can read about an instance that is masked, and where. */
export interface MaskedPlace {
  batch: number;
  instance: number;
  position: THREE.Vector3;
}

const MOST_BOXES = 200_000;
const MOST_CONTACTS = 400;
// The length of a contact's arrow, in thousandths of the picture's height.
const ARROW_SIZE = 60;
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
  #pairPlace: PairPlace | null = null;

  /**
   * Takes the scene's centre and size from some frames of the recording, at least one. `isCrowd`: the picture has one
   * sample per pixel.
   */
  constructor(recording: Recording, samples: readonly Frame[], readonly isCrowd: boolean) {
    const first = samples[0]!;
    sampled.value = !isCrowd;
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
      const triangles = new DrawnTriangles(bodies, made.present.subarray(bodies.bodies.length), this.#center);
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
    if (pair) this.#markPair(pair, hits, touching);
    else this.#markAll(hits, () => MARK.hit, touching);
    this.#pairPlace = pair && this.#placeOf(pair, hits, contacts, touching);
    for (const [index, drawn] of this.#batches) {
      if (!drawn.object.visible) continue;
      drawn.marks.selectedInstance = instance?.batch === index ? instance.instance : -1;
      drawn.marks.looksAtPair = pair !== null;
      drawn.paint();
    }
    for (const triangles of this.#triangles.values()) triangles.paint();
    this.#findMasked(frame);
    return this.#showContacts(hits, contacts, selection);
  }

  // Of a pair that one looks at its contact alone.
  #showContacts(hits: Uint32Array, contacts: Float32Array | null, {pair, instance}: Selection): number {
    const all = contacts ? hitCount(hits) : 0;
    const isOfInstance = (hit: Hit): boolean => instance !== null &&
      ((this.#batchOfSlot.get(hit.slotA) === instance.batch && hit.instanceA === instance.instance) ||
       (this.#batchOfSlot.get(hit.slotB) === instance.batch && hit.instanceB === instance.instance));
    const indices: number[] = [];
    for (let i = 0; i < all; ++i) {
      const hit = hitAt(hits, i);
      if (pair ? isSamePair(hit, pair) : all <= MOST_CONTACTS || isOfInstance(hit)) indices.push(i);
    }
    this.#contacts.show(contacts ?? new Float32Array(0), indices, (i, out) => this.#originOfHit(hits, i, out),
                        pair === null ? ARROW_SIZE : 2 * ARROW_SIZE);
    return pair ? 0 : all - indices.length;
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

  // The smaller link is red, and the other one, which may be around it, seen through; both, if they do not touch.
  #markPair(pair: Hit, hits: Uint32Array, triangles: Uint32Array | null): void {
    const hit = indexOfPair(hits, pair);
    const sizes = [this.#boundsOfLink(pair.slotA, pair.instanceA, pair.linkA).radius,
                   this.#boundsOfLink(pair.slotB, pair.instanceB, pair.linkB).radius] as const;
    const isAround = (own: number, other: number): boolean => hit < 0 || own > other;
    const [a, b] = [isAround(sizes[0], sizes[1]), hit < 0 || sizes[0] <= sizes[1]].map((glass) =>
      glass ? MARK.glass : MARK.selected) as [number, number];
    const ofPair = triangles && hit >= 0 ? trianglesOf(triangles, hit) : new Uint32Array(0);
    for (let at = 0; at < ofPair.length; at += WORDS_PER_TRIANGLES) {
      const leaves = ofPair[at + 1]!;
      this.#batchAt(pair.slotA)?.markTriangle(pair.instanceA, leaves & 0xffff, ofPair[at + 2]!, MARK.selected);
      this.#batchAt(pair.slotB)?.markTriangle(pair.instanceB, leaves >>> 16, ofPair[at + 3]!, MARK.selected);
    }
    const bySkin = hit >= 0 && ofPair.length === 0;
    this.#mark(pair.slotA, pair.instanceA, pair.linkA, a, bySkin && a === MARK.selected);
    this.#mark(pair.slotB, pair.instanceB, pair.linkB, b, bySkin && b === MARK.selected);
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

  #boundsOfLink(slot: number, instance: number, link: number): Bounds {
    const bounds = new Bounds();
    const drawn = this.#batchAt(slot);
    if (drawn?.isStatic) drawn.addBounds(bounds, 0, instance);
    else drawn?.addBounds(bounds, instance, link);
    return bounds;
  }

  // Where a pair touches: at its contact, else in the middle of its triangles, else between its links.
  #placeOf(
    pair: Hit, hits: Uint32Array, contacts: Float32Array | null, triangles: Uint32Array | null,
  ): PairPlace | null {
    const a = this.#boundsOfLink(pair.slotA, pair.instanceA, pair.linkA);
    const b = this.#boundsOfLink(pair.slotB, pair.instanceB, pair.linkB);
    if (a.empty && b.empty) return null;
    const [middleA, middleB] = [a.empty ? b : a, b.empty ? a : b].map((bounds) =>
      new THREE.Vector3(...bounds.center())) as [THREE.Vector3, THREE.Vector3];
    const hit = indexOfPair(hits, pair);
    const center = middleA.clone().add(middleB).divideScalar(2);
    let radius = Math.min(a.empty ? Infinity : a.radius, b.empty ? Infinity : b.radius);
    let normal: THREE.Vector3 | null = null;
    const skin = new Bounds();
    if (hit >= 0 && contacts) {
      const at = WORDS_PER_CONTACT * hit;
      const origin = new Float32Array(3);
      this.#originOfHit(hits, hit, origin);
      normal = new THREE.Vector3(...contacts.subarray(at, at + 3));
      for (let k = 0; k < 3; ++k) {
        center.setComponent(k, origin[k]! + (contacts[at + 4 + k]! + contacts[at + 7 + k]!) / 2);
      }
    } else if (hit >= 0 && triangles) {
      const ofPair = trianglesOf(triangles, hit);
      for (let at = 0; at < ofPair.length; at += WORDS_PER_TRIANGLES) {
        const leaves = ofPair[at + 1]!;
        this.#batchAt(pair.slotA)?.addTriangle(skin, pair.instanceA, leaves & 0xffff, ofPair[at + 2]!);
        this.#batchAt(pair.slotB)?.addTriangle(skin, pair.instanceB, leaves >>> 16, ofPair[at + 3]!);
      }
    } else if (hit < 0) {
      radius = Math.max(radius, middleA.distanceTo(middleB));
    }
    if (!skin.empty) {
      center.set(...skin.center());
      radius = Math.max(0.5 * radius, skin.radius);
    }
    return {center, radius: Math.max(radius, 0.01 * this.#characterSize), normal, a: middleA, b: middleB};
  }

  /** Where the selected pair is in the frame that is shown; null: none is selected, or it takes no part. */
  get pairPlace(): PairPlace | null {
    return this.#pairPlace;
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
      bounds.add(this.#boundsOfLink(pair.slotA, pair.instanceA, pair.linkA));
      bounds.add(this.#boundsOfLink(pair.slotB, pair.instanceB, pair.linkB));
    } else if (instance) {
      const drawn = this.#batches.get(instance.batch);
      if (drawn?.isStatic) drawn.addBounds(bounds, 0, instance.instance);
      else drawn?.addBounds(bounds, instance.instance);
    }
    return bounds.empty ? this.bounds() : bounds;
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
    if (drawn.isStatic) return drawn.stands(0, instance) ? new THREE.Vector3(...drawn.positionOf(0, instance)) : null;
    if (drawn.present[instance] !== 1 || drawn.marks.masked[instance] === 1) return null;
    return new THREE.Vector3(...drawn.positionOf(instance, 0));
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

// Which of the hits is of a pair; -1: none.
function indexOfPair(hits: Uint32Array, pair: Hit): number {
  for (let i = 0; i < hitCount(hits); ++i) if (isSamePair(hitAt(hits, i), pair)) return i;
  return -1;
}

// The words of one hit, which lie together.
function trianglesOf(triangles: Uint32Array, hit: number): Uint32Array {
  let first = 0;
  while (first < triangles.length && triangles[first]! < hit) first += WORDS_PER_TRIANGLES;
  let end = first;
  while (triangles[end] === hit) end += WORDS_PER_TRIANGLES;
  return triangles.subarray(first, end);
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
