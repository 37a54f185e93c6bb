// A world of the engine with the batches of a recording's frames. It is made anew only where a frame has a batch that
// the world lacks, or gives a batch other arrays than before.
import {CabError} from 'cab-collision';
import type {Articulation as Body, Batch, Cab, FrameJob, Hits, Isa, MergeStep, World} from 'cab-collision';
import {type Frame, type Input, type Recording, type Skin, WORDS_PER_HIT} from '../recording/types.js';
import {descOf, lodDescOf, posesForReach, staticDescOf} from './bodies.js';
import type {Choice} from './choice.js';

const ARRAYS = ['origins', 'orientations', 'scales', 'layers', 'layerMasks', 'margins'] as const;

interface Member {
  /** Index in the recording. */
  index: number;
  shape: string;
  batch: Batch;
}

// What of an input is fixed once a batch is made: how poses are stored, and which arrays there are.
function shapeOf(input: Input): string {
  const {poses} = input;
  return [poses?.format, poses?.hasScale, ...ARRAYS.map((name) => input[name] !== null)].join(' ');
}

export class RecordedWorld {
  /** What is not possible at this level of detail, in words. */
  readonly notes: string[] = [];
  #world: World;
  #full = new Map<number, Body>();  // by articulation, at full detail
  #bodies = new Map<number, Body>();  // by articulation, as batches have it
  #hasShapes = true;
  #hasSkins = false;
  #members = new Map<number, Member>();  // by slot of the recording
  #slots: number[] = [];  // by slot of the world: that of the recording

  /** `levelLeaves`: articulations are replaced by levels of so many leaves; null: by none. */
  constructor(readonly cab: Cab, readonly isa: Isa, readonly recording: Recording,
              readonly levelLeaves: number | null) {
    this.#world = cab.createWorld({isa});
  }

  /** The world's own, never `auto`. */
  get isaInUse(): Isa { return this.#world.isa; }

  /** Whether there are shapes for an exact test. Known once frames are given. */
  get hasShapes(): boolean { return this.#hasShapes; }

  /** Whether a batch of the last frame that was given has a skin. */
  get hasSkins(): boolean { return this.#hasSkins; }

  destroy(): void { this.#world.destroy(); }

  /** Gives the engine what the frame has. */
  give(frame: Frame): void {
    const {batches} = this.recording;
    const fits = frame.inputs.every((input) => {
      const member = this.#members.get(batches[input.batch]!.slot);
      return member?.index === input.batch && member.shape === shapeOf(input);
    });
    if (!fits) this.#makeFor(frame);
    for (const input of frame.inputs) this.#fill(this.#batchOf(input.batch), input);
    this.#hasSkins = frame.inputs.some(({batch}) => this.#skinOf(batch) !== null);
  }

  #skinOf(batch: number): Skin | null {
    const {articulations, batches} = this.recording;
    return articulations[batches[batch]?.articulation ?? -1]?.skin ?? null;
  }

  run(frame: Frame, {policies, job}: Choice): Hits {
    const rules: FrameJob['rules'] = frame.settings.rules.map(
        ({a, b, pairing}) => ({a: this.#batchOf(a), b: this.#batchOf(b), pairing}));
    return this.#world.runFrame({
      ...job, policies, rules, batches: frame.inputs.map(({batch}) => this.#batchOf(batch)),
    });
  }

  /**
   * Triangles of skins that touch, of hits with the slots of the recording: four words each, as the engine has them,
   * but the first is the index of the hit.
   */
  touchingTriangles(frame: Frame, hits: Uint32Array): Uint32Array {
    const bySlot = new Map(frame.inputs.map(({batch}) => [this.recording.batches[batch]!.slot, batch]));
    const ownSlot = new Map<number, number>();
    this.#slots.forEach((slot, own) => ownSlot.set(slot, own));
    const hasSkin = (slot: number): boolean => this.#skinOf(bySlot.get(slot) ?? -1) !== null;
    const pairs = new Uint32Array(hits.length), indices = new Uint32Array(hits.length / WORDS_PER_HIT);
    let count = 0;
    for (let at = 0; at < hits.length; at += WORDS_PER_HIT) {
      if (!hasSkin(hits[at]!) || !hasSkin(hits[at + 2]!)) continue;
      pairs.set(hits.subarray(at, at + WORDS_PER_HIT), WORDS_PER_HIT * count);
      for (const side of [0, 2]) pairs[WORDS_PER_HIT * count + side] = ownSlot.get(hits[at + side]!)!;
      indices[count++] = at / WORDS_PER_HIT;
    }
    if (count === 0) return new Uint32Array(0);
    const found = this.#world.findTouchingTriangles(pairs.subarray(0, WORDS_PER_HIT * count));
    const words = found.words().slice();
    for (let at = 0; at < words.length; at += found.wordsPerHit) words[at] = indices[words[at]!]!;
    return words;
  }

  boxes(batch: number, {policies}: Choice): ReturnType<World['computeBoxes']> {
    return this.#world.computeBoxes(this.#batchOf(batch), policies);
  }

  merges(batch: number): MergeStep[] {
    const {articulation} = this.recording.batches[batch]!;
    return this.#world.mergeSteps(this.#bodyOf(articulation));
  }

  /** Words of hits, with the slots of the recording. Both orders of slots are the same. */
  wordsOf(hits: Hits): Uint32Array {
    const words = hits.words().slice();
    if (this.#slots.every((slot, own) => slot === own)) return words;
    for (let at = 0; at < words.length; at += hits.wordsPerHit) {
      words[at] = this.#slots[words[at]!]!;
      words[at + 2] = this.#slots[words[at + 2]!]!;
    }
    return words;
  }

  #batchOf(index: number): Batch { return this.#members.get(this.recording.batches[index]!.slot)!.batch; }

  // Keeps what no batch of the frame takes the place of, so that frames in turns fit one world.
  #makeFor(frame: Frame): void {
    const wanted = new Map([...this.#members].map(([slot, {index, shape}]) => [slot, {index, shape}] as const));
    const inputs = new Map<number, Input>();
    for (const input of frame.inputs) {
      const {slot} = this.recording.batches[input.batch]!;
      wanted.set(slot, {index: input.batch, shape: shapeOf(input)});
      inputs.set(input.batch, input);
    }
    const kept = new Map([...this.#members.values()].map(({index, batch}) => [index, batch] as const));
    const formats = new Map([...kept].map(([index, {format, hasScale}]) => [index, {format, hasScale}] as const));
    this.#world.destroy();
    this.#world = this.cab.createWorld({isa: this.isa});
    this.#full.clear();
    this.#bodies.clear();
    this.#members.clear();
    this.#slots = [];
    this.notes.length = 0;
    this.#hasShapes = true;
    for (const [slot, {index, shape}] of [...wanted].sort(([a], [b]) => a - b)) {
      const how = inputs.get(index)?.poses ?? formats.get(index);
      const batch = this.#add(index, how?.format ? {format: how.format, hasScale: how.hasScale} : {});
      this.#members.set(slot, {index, shape, batch});
      this.#slots[batch.slot] = slot;
    }
  }

  #add(index: number, options: NonNullable<Parameters<World['addBatch']>[2]>): Batch {
    const {articulation, instanceCount, staticBodies, name} = this.recording.batches[index]!;
    return inWords(`batch ${index} ${name}`, () => staticBodies !== null ?
        this.#world.addStaticBatch(staticDescOf(staticBodies)) :
        this.#world.addBatch(this.#bodyOf(articulation), instanceCount, options));
  }

  #fill(batch: Batch, input: Input): void {
    batch.count = input.count;
    batch.instances = input.instances;
    if (input.poses !== null) batch.poses().set(input.poses.values);
    for (const name of ARRAYS) {
      const values = input[name];
      if (values !== null) batch[name]().set(values);
    }
  }

  // The body that stands for an articulation of the recording here: itself, or a level of it.
  #bodyOf(index: number): Body {
    const known = this.#bodies.get(index);
    if (known !== undefined) return known;
    const articulation = this.recording.articulations[index]!;
    const body = inWords(`articulation ${index} ${articulation.name}`, () => {
      if (articulation.level !== null) return this.#recordedLevel(index);
      const full = this.#fullOf(index);
      if (this.levelLeaves !== null && articulation.skin) {
        this.#note(index, 'has a skin, which has no levels, and stays as it is');
        return full;
      }
      return this.levelLeaves === null ? full : this.#levelOf(index, full, this.levelLeaves);
    });
    this.#bodies.set(index, body);
    return body;
  }

  #fullOf(index: number): Body {
    let body = this.#full.get(index);
    if (body === undefined) {
      body = this.#world.addArticulation(descOf(this.recording.articulations[index]!));
      this.#full.set(index, body);
    }
    return body;
  }

  #recordedLevel(index: number): Body {
    const articulation = this.recording.articulations[index]!, level = articulation.level!;
    const of = this.#fullOf(level.of);
    if (level.kind === 'nodes') this.#hasShapes = false;
    if (this.levelLeaves !== null) this.#note(index, 'was recorded as a level of detail, and stays as it is');
    return this.#world.addLod(lodDescOf(articulation, of));
  }

  #levelOf(index: number, of: Body, maxLeaves: number): Body {
    if (of.leafCount <= maxLeaves) {
      this.#note(index, `has ${of.leafCount} leaves, and stays as it is`);
      return of;
    }
    const restPoses = posesForReach(this.recording, index);
    if (restPoses !== null) {
      try {
        const level = this.#world.addLod({of, kind: 'reach', maxLeaves, restPoses});
        this.#note(index, 'has boxes that hold whatever its links can reach, by the joints of some frames: where ' +
                          'links are farther apart, hits may be lost');
        return level;
      } catch (error) {
        if (!(error instanceof CabError)) throw error;
        this.#note(index, `can have no boxes that are fixed to links: ${error.message}`);
      }
    }
    this.#hasShapes = false;
    this.#note(index, 'has nodes of its hierarchy, made from all leaves in each frame');
    return this.#world.addLod({of, kind: 'nodes', maxLeaves});
  }

  #note(index: number, words: string): void {
    const {name} = this.recording.articulations[index]!;
    this.notes.push(`Articulation ${index}${name === '' ? '' : ` (${name})`} ${words}.`);
  }
}

/** Whether the engine refused what it was given. Any other error is a fault of this page. */
export const isRefusal = (error: unknown): boolean =>
    error instanceof CabError || (error instanceof Error && error.cause instanceof CabError);

// An error of the engine, with what it is about.
function inWords<T>(what: string, call: () => T): T {
  try {
    return call();
  } catch (error) {
    if (error instanceof CabError) throw new Error(`${what.trim()}: ${error.message}`, {cause: error});
    throw error;
  }
}
