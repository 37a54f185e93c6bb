// Runs frames of a recording again, as they were recorded or as a dial says.
import {load} from 'cab-collision';
import type {Cab, Isa} from 'cab-collision';
import {WORDS_PER_HIT} from '../recording/types.js';
import type {Frame, Recording} from '../recording/types.js';
import {choose, chooseForFalsePositives} from './choice.js';
import type {Choice} from './choice.js';
import {hashOfHits} from './fnv1a.js';
import {RecordedWorld} from './recorded_world.js';
import type {Boxes, Dial, EngineInPage, MergeStep, RunResult} from './types.js';

export interface EngineOptions {
  /** A compiled cab_simd.wasm or cab_scalar.wasm. */
  module: WebAssembly.Module;
  /** Default: the best that the module has. */
  isa?: Isa;
}

/** The recorded level of detail, and that of the dial. */
const KEPT_WORLDS = 2;

export async function createEngine(recording: Recording, {module, isa = 'auto'}: EngineOptions): Promise<EngineInPage> {
  return new Engine(await load({module}), isa, recording);
}

class Engine implements EngineInPage {
  readonly isa: string;
  readonly version: string;
  // By leaves of a level; null: as recorded. The one that was used last is the last.
  #worlds = new Map<number | null, RecordedWorld>();

  constructor(readonly cab: Cab, readonly wanted: Isa, readonly recording: Recording) {
    this.version = cab.version;
    this.isa = this.#worldOf({}).isaInUse;
  }

  run(frame: Frame, dial: Dial): RunResult {
    const world = this.#given(frame, dial);
    const choice = choose(frame.settings, dial, world);
    const {stats, ...result} = this.#run(world, frame, choice);
    return {
      ...result,
      hash: hashOfHits(result.hits, result.contacts),
      milliseconds: 1000 * stats.secondsTotal,
      boxTests: stats.boxTests,
      leafPairs: stats.leafPairs,
      exactTests: stats.exactTests,
      falsePositives: stats.falsePositives,
      notes: [...choice.notes, ...world.notes],
    };
  }

  falsePositives(frame: Frame, dial: Dial): Uint32Array {
    const world = this.#given(frame, dial);
    if (!world.hasShapes) return new Uint32Array(0);
    const {byBoxes, byShapes} = chooseForFalsePositives(frame.settings, dial, world.hasSkins);
    return without(this.#run(world, frame, byBoxes).hits, this.#run(world, frame, byShapes).hits);
  }

  boxes(frame: Frame, batch: number, dial: Dial): Boxes {
    if (this.recording.batches[batch]!.staticBodies !== null) {
      return {nodeCount: 0, leafCount: 0, values: new Float32Array(0)};
    }
    const world = this.#given(frame, dial);
    return world.boxes(batch, choose(frame.settings, dial, world));
  }

  touchingTriangles(frame: Frame, hits: Uint32Array): Uint32Array {
    return this.#given(frame, {}).touchingTriangles(frame, hits);
  }

  merges(batch: number, dial: Dial): MergeStep[] {
    if (this.recording.batches[batch]!.staticBodies !== null) return [];
    return this.#worldOf(dial).merges(batch).map(({left, right}) => ({left, right}));
  }

  destroy(): void {
    for (const world of this.#worlds.values()) world.destroy();
    this.#worlds.clear();
  }

  #worldOf({levelLeaves = null}: {levelLeaves?: number | null}): RecordedWorld {
    let world = this.#worlds.get(levelLeaves);
    if (world === undefined) {
      if (this.#worlds.size === KEPT_WORLDS) this.#drop([...this.#worlds.keys()].find((key) => key !== null) ?? null);
      world = new RecordedWorld(this.cab, this.wanted, this.recording, levelLeaves);
      this.#worlds.set(levelLeaves, world);
    }
    return world;
  }

  #drop(levelLeaves: number | null): void {
    this.#worlds.get(levelLeaves)?.destroy();
    this.#worlds.delete(levelLeaves);
  }

  // The world, with what the frame has. One that the engine refused to fill is made anew.
  #given(frame: Frame, dial: Dial): RecordedWorld {
    const world = this.#worldOf(dial);
    try {
      world.give(frame);
    } catch (error) {
      this.#drop(dial.levelLeaves ?? null);
      throw error;
    }
    return world;
  }

  #run(world: RecordedWorld, frame: Frame, choice: Choice): Pick<RunResult, 'hits' | 'contacts'> & {stats: Stats} {
    const found = world.run(frame, choice);
    const hits = world.wordsOf(found);
    const hasContacts = choice.job.contacts === true || choice.job.report === 'distances';
    const contacts = hasContacts ? new Float32Array(found.contactWords().slice().buffer) : null;
    return {hits, contacts, stats: found.stats};
  }
}

type Stats = ReturnType<RecordedWorld['run']>['stats'];

// The hits of `all` whose links are not in `some`. Both are sorted. `some` may have others: what is wholly inside a
// skin is a hit of leaves whose boxes are apart.
function without(all: Uint32Array, some: Uint32Array): Uint32Array {
  const left: number[] = [];
  let next = 0;
  for (let at = 0; at < all.length; at += WORDS_PER_HIT) {
    while (next < some.length && compareLinks(some, next, all, at) < 0) next += WORDS_PER_HIT;
    if (next < some.length && compareLinks(some, next, all, at) === 0) continue;
    left.push(...all.subarray(at, at + WORDS_PER_HIT));
  }
  return Uint32Array.from(left);
}

// Below 0: hit a is sorted before hit b. 0: both are of the same two links.
function compareLinks(a: Uint32Array, atA: number, b: Uint32Array, atB: number): number {
  for (let word = 0; word < 4; ++word) {
    if (a[atA + word] !== b[atB + word]) return a[atA + word]! - b[atB + word]!;
  }
  const linksA = a[atA + 4]!, linksB = b[atB + 4]!;
  return (linksA & 0xffff) - (linksB & 0xffff) || (linksA >>> 16) - (linksB >>> 16);
}
