// What batches, instances and links are called.
import type {Articulation, Recording} from '../recording/types.js';
import type {Hit} from '../scene/hits.js';

export class Names {
  readonly #recording: Recording;

  constructor(recording: Recording) {
    this.#recording = recording;
  }

  /** Batches that are called the same have their numbers too. */
  batch(index: number): string {
    const name = this.#nameOf(index);
    const isShared = this.#recording.batches.some((_, other) => other !== index && this.#nameOf(other) === name);
    return isShared ? `${name} (batch ${index})` : name;
  }

  #nameOf(index: number): string {
    const batch = this.#recording.batches[index];
    return batch?.name || this.#articulation(index)?.name || (batch?.staticBodies ? 'static bodies' : `batch ${index}`);
  }

  instance(batch: number, instance: number): string {
    const known = this.#recording.batches[batch];
    const own = known?.instanceNames[instance];
    if (own) return own;
    const name = this.batch(batch);
    const bodies = known?.staticBodies;
    if (bodies) {
      const first = bodies.bodies.length;
      return instance < first ? `${name}, body ${instance}` : `${name}, triangle ${instance - first}`;
    }
    return known?.instanceCount === 1 ? name : `${name} ${instance}`;
  }

  link(batch: number, link: number): string {
    return this.#articulation(batch)?.linkNames[link] || `link ${link}`;
  }

  /** An instance and its link. */
  place(batch: number, instance: number, link: number): string {
    const name = this.instance(batch, instance);
    return this.#recording.batches[batch]?.staticBodies ? name : `${name}: ${this.link(batch, link)}`;
  }

  /** Two links. Of one instance, its name is there once. */
  pair(batchA: number, {instanceA, linkA, instanceB, linkB}: Hit, batchB: number): string {
    const a = this.place(batchA, instanceA, linkA);
    const isWithin = batchA === batchB && instanceA === instanceB;
    return `${a} \u2013 ${isWithin ? this.link(batchB, linkB) : this.place(batchB, instanceB, linkB)}`;
  }

  // A level of detail may have no names of links, and then has those of what it is a level of.
  #articulation(batch: number): Articulation | undefined {
    const {articulations, batches} = this.#recording;
    const own = articulations[batches[batch]?.articulation ?? -1];
    return own?.level && own.linkNames.length === 0 ? articulations[own.level.of] : own;
  }
}
