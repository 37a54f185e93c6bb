// What batches, instances and links are called.
import type {Articulation, Recording} from '../recording/types.js';
import type {Hit} from '../scene/hits.js';

export class Names {
  readonly #recording: Recording;
  readonly #batches: readonly string[];

  constructor(recording: Recording) {
    this.#recording = recording;
    const plain = recording.batches.map(({name, staticBodies}, i) =>
      name || this.#articulation(i)?.name || (staticBodies ? 'static bodies' : `batch ${i}`));
    const counts = new Map<string, number>();
    for (const name of plain) counts.set(name, (counts.get(name) ?? 0) + 1);
    this.#batches = plain.map((name, i) => counts.get(name) === 1 ? name : `${name} (batch ${i})`);
  }

  /** Batches that are called the same have their numbers too. */
  batch(index: number): string {
    return this.#batches[index] ?? `batch ${index}`;
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
