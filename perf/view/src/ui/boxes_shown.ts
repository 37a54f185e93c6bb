// Which boxes of hierarchies are drawn: those of the wanted nodes, of all characters if they are few, else of the
// selected one and those near it.
import type {Dial, EngineInPage} from '../engine/types.js';
import type {Frame, Recording} from '../recording/types.js';
import {type Hierarchy, hierarchyOf} from '../scene/hierarchy.js';
import type {BoxSet, Selection, Stage} from '../scene/stage.js';
import {boxesOfBodies} from '../scene/static_boxes.js';
import {count} from './format.js';
import type {Names} from './names.js';
import type {ViewOptions} from './view_panel.js';

const FEW = 64;
const NEAR_SIZES = 2;

export interface BoxesShown {
  sets: BoxSet[];
  /** Which characters have no boxes, in words; empty: all have. */
  note: string;
}

export class BoxChooser {
  readonly #recording: Recording;
  readonly #engine: EngineInPage;
  readonly #names: Names;
  readonly #hierarchies = new Map<string, Hierarchy>();
  readonly #static = new Map<number, Float32Array>();

  constructor(recording: Recording, engine: EngineInPage, names: Names) {
    this.#recording = recording;
    this.#engine = engine;
    this.#names = names;
  }

  /** The deepest level of all hierarchies of a frame. */
  depth(frame: Frame, dial: Dial): number {
    let depth = 0;
    for (const {batch} of frame.inputs) {
      if (!this.#isStatic(batch)) depth = Math.max(depth, this.#hierarchy(batch, dial).depth);
    }
    return depth;
  }

  choose(frame: Frame, dial: Dial, {leafBoxes, level}: ViewOptions, selection: Selection, stage: Stage): BoxesShown {
    const sets: BoxSet[] = [];
    const notes: string[] = [];
    if (!leafBoxes && level === 0) return {sets, note: ''};
    for (const input of frame.inputs) {
      const {batch} = input;
      if (this.#isStatic(batch)) {
        if (leafBoxes) sets.push(this.#staticBoxes(batch, stage));
        continue;
      }
      const {leafCount, levels} = this.#hierarchy(batch, dial);
      const nodes = [...levels.keys()].filter((node) =>
        node < leafCount ? leafBoxes || levels[node] === level : levels[node] === level);
      const {instances, note} = this.#instances(batch, selection, stage);
      if (note !== '') notes.push(note);
      if (instances.length === 0) continue;
      const {values, nodeCount} = this.#engine.boxes(frame, batch, dial);
      sets.push({batch, values, nodeCount, leafCount, instances, nodes});
    }
    return {sets, note: notes.join(' ')};
  }

  #isStatic(batch: number): boolean {
    return (this.#recording.batches[batch]?.articulation ?? -1) < 0;
  }

  // Static bodies have one box each, and triangles none.
  #staticBoxes(batch: number, stage: Stage): BoxSet {
    const bodies = this.#recording.batches[batch]?.staticBodies?.bodies ?? [];
    const values = this.#static.get(batch) ?? boxesOfBodies(bodies);
    this.#static.set(batch, values);
    const instances = stage.presentInstances(batch).filter((i) => i < bodies.length);
    return {batch, values, nodeCount: 1, leafCount: 1, instances, nodes: [0]};
  }

  #hierarchy(batch: number, dial: Dial): Hierarchy {
    const key = `${batch} ${dial.levelLeaves ?? 0}`;
    const known = this.#hierarchies.get(key);
    if (known) return known;
    const merges = this.#engine.merges(batch, dial);
    // A hierarchy of n leaves has n - 1 merges.
    const made = hierarchyOf(merges, merges.length + 1);
    this.#hierarchies.set(key, made);
    return made;
  }

  #instances(batch: number, {instance, pair}: Selection, stage: Stage): {instances: number[]; note: string} {
    const present = stage.presentInstances(batch);
    if (present.length <= FEW) return {instances: present, note: ''};
    const focus = instance ?? (pair ? {batch: stage.batchOfSlot(pair.slotA) ?? -1, instance: pair.instanceA} : null);
    if (!focus) {
      return {instances: [], note: `Boxes of ${this.#names.batch(batch)}: select a character to see those near it.`};
    }
    const middle = stage.middleOf(focus.batch, focus.instance);
    const instances = middle ? stage.near(batch, middle, NEAR_SIZES * stage.characterSize) : [];
    return {
      instances,
      note: `Boxes of ${count(instances.length)} of ${count(present.length)} characters, near ` +
          `${this.#names.instance(focus.batch, focus.instance)}.`,
    };
  }
}
