// The frames of one chunk, decoded one by one when they are asked for.
import type {
  Frame as FrameTable, Input as InputTable, Poses as PosesTable, Rule as RuleStruct, Settings as SettingsTable,
} from 'recording-format';
import type {Definitions} from './definitions.js';
import type {Payload} from './payload.js';
import {readPoses} from './poses.js';
import {
  type Batch, type Frame, type Input, type Poses, type Rule, type Settings, type Stats, WORDS_PER_CONTACT,
  WORDS_PER_HIT,
} from './types.js';

const PAIRINGS: readonly Rule['pairing'][] = ['between', 'within'];
const REPORTS: readonly (Settings['report'] | undefined)[] = ['hits', undefined, 'distances'];
const ALL_INSTANCES = 0xffffffff;

type List = {length: number; subarray(begin: number, end: number): List};

// The tables that an input is made of: those of an earlier frame where nothing changed.
interface Source {
  own: InputTable;
  fields: InputTable;
  /** Where they are those of the frame before: its table. */
  poses: PosesTable | null;
}

interface Entry {
  table: FrameTable;
  sources: Map<number, Source>;
}

export class FramesOfChunk {
  #entries: Entry[] = [];
  // By where their tables are in the payload: frames share them.
  #settings = new Map<number, Settings>();
  // By batch: the last ones that were read.
  #poses = new Map<number, {at: number; least: number; poses: Poses}>();

  constructor(readonly payload: Payload, readonly definitions: Definitions) {
    const {root, chunk} = payload;
    const count = root.framesLength();
    payload.check(count === chunk.frameCount, () => `its header says ${chunk.frameCount} frames, and it has ${count}`);
    const defines = root.header() !== null || root.articulationsLength() > 0 || root.batchesLength() > 0;
    payload.check(!defines || chunk.hasDefinitions, () => 'it has definitions, and its header says that it has none');
    const before = new Map<number, Source>();
    payload.list('frame', count, (i) => root.frames(i), (table, what) => {
      const sources = this.#sourcesOf(table, `${what} of the chunk`, before);
      for (const [batch, source] of sources) before.set(batch, source);
      this.#entries.push({table, sources});
    });
  }

  frame(index: number): Frame {
    const {payload} = this, what = `frame ${index}`;
    payload.renewBudget();
    const {table, sources} = this.#entries[index - payload.chunk.firstFrame]!;
    const inputs = [...sources.values()].map((source) => this.#input(source, what));
    const settings = this.#settingsOf(table, what, sources);
    const bySlot = this.#batchesBySlot(inputs, what);
    const hits = this.#hits(table, what, bySlot);
    return {
      index,
      time: table.time(),
      settings,
      inputs,
      hits,
      contacts: this.#contacts(table, what, hits.length / WORDS_PER_HIT),
      hash: table.hash(),
      stats: this.#stats(table, what),
    };
  }

  #sourcesOf(table: FrameTable, what: string, before: Map<number, Source>): Map<number, Source> {
    const {payload} = this;
    const sources = new Map<number, Source>();
    payload.list(`${what}: input`, table.inputsLength(), (i) => table.inputs(i), (own, where) => {
      const batch = own.batch(), earlier = before.get(batch);
      if (sources.has(batch)) payload.fail(`${where} is of batch ${batch}, which has an input already`);
      if (own.sameAsBefore() && earlier === undefined) {
        payload.fail(`${where} is that of an earlier frame of this chunk, and there is none`);
      }
      const fields = own.sameAsBefore() ? earlier!.fields : own;
      sources.set(batch, {own, fields, poses: fields.poses() ?? earlier?.poses ?? null});
    });
    return sources;
  }

  #batchOf(index: number, what: string): Batch {
    const batch = this.definitions.batches[index];
    if (batch === undefined) {
      this.payload.fail(`${what} has batch ${index}, and ${this.definitions.batches.length} are defined`);
    }
    return batch;
  }

  #input({own, fields, poses}: Source, of: string): Input {
    const {payload} = this, index = own.batch(), what = `${of}: input of batch ${index}`;
    const batch = this.#batchOf(index, of), {instanceCount} = batch;
    const count = fields.count() === ALL_INSTANCES ? instanceCount : fields.count();
    payload.check(count <= instanceCount, () => `${what}: the count is ${count}, of ${instanceCount} instances`);
    const instances = payload.numbers(`${what}: its instances`, () => fields.instancesArray());
    instances?.forEach((instance, i) => {
      const isInOrder = i === 0 || instance > instances[i - 1]!;
      payload.check(isInOrder && instance < count, () => `${what}: instance ${instance} of ${count} is not in order`);
    });
    const least = instances === null ? count : instances[instances.length - 1]! + 1;
    const perInstance = <T extends List>(name: string, size: number, read: () => T | null): T | null => {
      const list = payload.numbers(`${what}: its ${name}`, read);
      const entries = (list?.length ?? 0) / size;
      payload.check(list === null || (Number.isInteger(entries) && entries >= least && entries <= instanceCount),
                    () => `${what}: its ${name} are ${list?.length} numbers, for ${least} instances`);
      return list;
    };
    const masked = payload.numbers(`${what}: its masked instances`, () => own.maskedArray()) ?? new Uint32Array(0);
    for (const instance of masked) {
      payload.check(instance < instanceCount, () => `${what}: instance ${instance} is masked, of ${instanceCount}`);
    }
    return {
      batch: index,
      poses: batch.staticBodies === null ? this.#posesOf(index, batch, poses, what, least) : null,
      origins: perInstance('origins', 3, () => fields.originsArray()),
      orientations: perInstance('orientations', 4, () => fields.orientationsArray()),
      scales: perInstance('scales', 1, () => fields.scalesArray()),
      layers: perInstance('layers', 1, () => fields.layersArray()),
      layerMasks: perInstance('layer masks', 1, () => fields.layerMasksArray()),
      margins: perInstance('margins', 1, () => fields.marginsArray()),
      count,
      instances,
      masked,
    };
  }

  #posesOf(index: number, batch: Batch, table: PosesTable | null, what: string, least: number): Poses {
    const {payload, definitions} = this;
    if (table === null) return payload.fail(`${what} has no poses, and no frame before it in this chunk has any`);
    const kept = this.#poses.get(index);
    const links = definitions.articulations[batch.articulation]!.linkParents.length;
    if (kept?.at === table.bb_pos && kept.least >= least) return kept.poses;
    const poses = readPoses(payload, `${what}: its poses`, table, definitions.header.poseStep,
                            {least: least * links, most: batch.instanceCount * links, links});
    this.#poses.set(index, {at: table.bb_pos, least, poses});
    return poses;
  }

  #settingsOf(frame: FrameTable, what: string, sources: ReadonlyMap<number, unknown>): Settings {
    const {payload} = this;
    const table = frame.settings();
    if (table === null) return payload.fail(`${what} has no settings`);
    let settings = this.#settings.get(table.bb_pos);
    if (settings === undefined) {
      settings = this.#readSettings(table, what);
      this.#settings.set(table.bb_pos, settings);
    }
    for (const {a, b} of settings.rules) {
      for (const batch of [a, b]) {
        payload.check(sources.has(batch), () => `${what}: a rule names batch ${batch}, which has no input`);
      }
    }
    return settings;
  }

  #readSettings(table: SettingsTable, what: string): Settings {
    const {payload} = this;
    const policies: Record<string, string> = {};
    payload.list(`${what}: policy`, table.policiesLength(), (i) => table.policies(i), (policy, where) => {
      policies[payload.text(where, policy.field())] = payload.text(where, policy.value());
    });
    const length = (name: string, value: number): number => {
      payload.check(Number.isFinite(value) && value >= 0, () => `${what}: its ${name} is ${value}`);
      return value;
    };
    return {
      policies,
      margin: length('margin', table.margin()),
      minDepth: length('least depth', table.minDepth()),
      report: payload.oneOf(`${what}: its report`, REPORTS, table.report())!,
      containment: !table.withoutContainment(),
      contacts: table.contacts(),
      rules: payload.list(`${what}: rule`, table.rulesLength(), (i) => table.rules(i), (rule, where) => ({
                            a: rule.a(),
                            b: rule.b(),
                            pairing: this.#pairingOf(rule, where),
                          })),
    };
  }

  #pairingOf(rule: RuleStruct, what: string): Rule['pairing'] {
    return this.payload.oneOf(`${what}: its pairing`, PAIRINGS, rule.pairing());
  }

  #batchesBySlot(inputs: readonly Input[], what: string): Map<number, Batch> {
    const bySlot = new Map<number, Batch>();
    for (const {batch: index} of inputs) {
      const batch = this.#batchOf(index, what);
      if (bySlot.has(batch.slot)) this.payload.fail(`${what} has two batches of slot ${batch.slot}`);
      bySlot.set(batch.slot, batch);
    }
    return bySlot;
  }

  #hits(table: FrameTable, what: string, bySlot: ReadonlyMap<number, Batch>): Uint32Array {
    const {payload} = this;
    const hits = payload.numbers(`${what}: its hits`, () => table.hitsArray()) ?? new Uint32Array(0);
    payload.check(hits.length % WORDS_PER_HIT === 0, () => `${what}: ${hits.length} words are no hits`);
    for (let at = 0; at < hits.length; at += WORDS_PER_HIT) {
      const links = hits[at + 4]!, leaves = hits[at + 5]!;
      this.#checkSide(what, at, bySlot, hits[at]!, hits[at + 1]!, links & 0xffff, leaves & 0xffff);
      this.#checkSide(what, at, bySlot, hits[at + 2]!, hits[at + 3]!, links >>> 16, leaves >>> 16);
    }
    return hits;
  }

  #checkSide(what: string, at: number, bySlot: ReadonlyMap<number, Batch>, slot: number, instance: number, link: number,
             leaf: number): void {
    const {payload} = this, batch = bySlot.get(slot);
    const fail = (why: string): never => payload.fail(`${what}: hit ${at / WORDS_PER_HIT} names ${why}`);
    if (batch === undefined) return fail(`slot ${slot}, and no input has it`);
    if (instance >= batch.instanceCount) fail(`instance ${instance}, of ${batch.instanceCount}`);
    const body = this.definitions.articulations[batch.articulation];
    const links = body?.linkParents.length ?? 1;
    if (link >= links) fail(`link ${link}, of ${links}`);
    // How many leaves a level has is the engine's to say.
    if (body?.level) return;
    const leaves = body?.leaves.length ?? 1;
    if (leaf >= leaves) fail(`leaf ${leaf}, of ${leaves}`);
  }

  #contacts(table: FrameTable, what: string, hitCount: number): Float32Array | null {
    const {payload} = this;
    const words = payload.numbers(`${what}: its contacts`, () => table.contactsArray());
    if (words === null) return null;
    payload.check(words.length === WORDS_PER_CONTACT * hitCount,
                  () => `${what}: ${words.length} words are not the contacts of ${hitCount} hits`);
    return new Float32Array(words.buffer, words.byteOffset, words.length);
  }

  #stats(frame: FrameTable, what: string): Stats {
    const stats = frame.stats();
    if (stats === null) this.payload.fail(`${what} has no statistics`);
    return {
      candidates: Number(stats.candidates()),
      boxTests: Number(stats.boxTests()),
      leafPairs: Number(stats.leafPairs()),
      exactTests: Number(stats.exactTests()),
      falsePositives: Number(stats.falsePositives()),
      instancesMasked: Number(stats.instancesMasked()),
      secondsTotal: stats.secondsTotal(),
    };
  }
}
