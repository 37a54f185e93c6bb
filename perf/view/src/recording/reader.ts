// Reads recordings (docs/recording.md): the whole file by its chunks at first, each frame when it is asked for.
import {framesInWords, scanChunks} from './chunks.js';
import type {Chunk, Scan} from './chunks.js';
import {readDefinitions} from './definitions.js';
import type {Definitions} from './definitions.js';
import {RecordingError} from './error.js';
import {FramesOfChunk} from './frames.js';
import {Payload} from './payload.js';
import type {Articulation, Batch, Frame, Header, Recording} from './types.js';

const KEPT_FRAMES = 8;
const KEPT_CHUNK_BYTES = 1 << 26;
const LEAST_KEPT_CHUNKS = 2;

/** Reads a file whose name is for messages. Throws RecordingError where nothing of it can be shown. */
export function readRecording(bytes: ArrayBuffer | Uint8Array, name: string): Recording {
  const file = bytes instanceof Uint8Array ? bytes : new Uint8Array(bytes);
  return new FileRecording(scanChunks(file, name), name);
}

/** The last few values that were asked for. */
class Kept<T> {
  #values = new Map<number, T>();

  constructor(readonly most: number) {}

  get(key: number, make: () => T): T {
    const value = this.#values.get(key) ?? make();
    this.#values.delete(key);
    this.#values.set(key, value);
    if (this.#values.size > this.most) this.#values.delete(this.#values.keys().next().value!);
    return value;
  }
}

class FileRecording implements Recording {
  readonly frameCount: number;
  readonly problems: readonly string[];
  readonly #definitions: Definitions;
  #definitionsLost: RecordingError | null;
  #problems: string[];
  readonly #chunks: Kept<FramesOfChunk>;
  #frames = new Kept<Frame>(KEPT_FRAMES);
  readonly #withFrames: readonly Chunk[];

  constructor(readonly scan: Scan, readonly name: string) {
    this.#problems = [...scan.problems];
    this.#definitionsLost = scan.definitionsLost;
    this.#definitions = this.#readDefinitions();
    this.#withFrames = scan.chunks.filter(({frameCount}) => frameCount > 0);
    const largest = this.#withFrames.reduce((most, {bytes}) => Math.max(most, bytes), 1);
    this.#chunks = new Kept(Math.max(LEAST_KEPT_CHUNKS, Math.floor(KEPT_CHUNK_BYTES / largest)));
    this.frameCount = scan.frameCount;
    this.problems = this.#problems;
  }

  get header(): Header { return this.#definitions.header; }
  get articulations(): readonly Articulation[] { return this.#definitions.articulations; }
  get batches(): readonly Batch[] { return this.#definitions.batches; }

  frame(index: number): Frame {
    if (!(Number.isInteger(index) && index >= 0 && index < this.frameCount)) {
      throw new RangeError(`${this.name}: there is no frame ${index}, of ${this.frameCount}`);
    }
    return this.#frames.get(index, () => this.#read(index));
  }

  #readDefinitions(): Definitions {
    let definitions: Definitions | null = null;
    for (const chunk of this.scan.chunks) {
      if (!chunk.hasDefinitions) continue;
      if (this.#definitionsLost !== null && this.#definitionsLost.byte < chunk.byte) {
        // Indices count from what is lost.
        this.#problems.push(`The definitions of chunk ${chunk.number} at byte ${chunk.byte} are lost too, since ` +
                            `those of chunk ${this.#definitionsLost.chunk} are, or may be.`);
        continue;
      }
      try {
        definitions = readDefinitions(new Payload(this.name, chunk), definitions);
      } catch (error) {
        if (!(error instanceof RecordingError) || definitions === null) throw error;
        this.#definitionsLost = error;
        this.#problems.push(`Chunk ${chunk.number} at byte ${chunk.byte} has definitions that cannot be read: ` +
                            `${error.reason}.`);
      }
    }
    if (definitions !== null) return definitions;
    const lost = this.#definitionsLost;
    if (lost !== null) {
      throw new RecordingError(this.name, lost.chunk, lost.byte, `it ${lost.reason}; all else needs it`);
    }
    throw new RecordingError(this.name, null, 0, 'the recording has no chunk with definitions');
  }

  #read(index: number): Frame {
    const lost = this.scan.lost.find(({first, last}) => first <= index && index <= last);
    if (lost !== undefined) {
      const {chunk, byte, reason} = lost.error;
      throw new RecordingError(this.name, chunk, byte, `it ${reason}; lost: ${framesInWords(lost.first, lost.last)}`);
    }
    const chunk = this.#chunkOf(index);
    const frames = this.#chunks.get(
        chunk.number, () => new FramesOfChunk(new Payload(this.name, chunk), this.#definitions));
    try {
      return frames.frame(index);
    } catch (error) {
      // What a frame lacks may be what is lost.
      const cause = this.#definitionsLost;
      if (!(error instanceof RecordingError) || cause === null || cause.byte > chunk.byte) throw error;
      throw new RecordingError(error.file, error.chunk, error.byte, `${error.reason}; definitions may be lost with ` +
                               `chunk ${cause.chunk} at byte ${cause.byte}`);
    }
  }

  #chunkOf(index: number): Chunk {
    const chunks = this.#withFrames;
    let low = 0, high = chunks.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >>> 1;
      if (chunks[middle]!.firstFrame <= index) low = middle;
      else high = middle - 1;
    }
    return chunks[low]!;
  }
}
