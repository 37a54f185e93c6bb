// The payload of a chunk, and checked access to what its FlatBuffer says. A FlatBuffer may say anything: tables may lie
// over each other, and many may share one list, so each list is paid for from a budget that a sound payload never
// exceeds.
import {ByteBuffer} from 'flatbuffers';
import {decompress} from 'fzstd';
import {Chunk as ChunkTable} from 'recording-format';
import type {Chunk} from './chunks.js';
import {RecordingError} from './error.js';

const IDENTIFIER = 'CABR';
const PREFIX_BYTES = 4;
/** Prefix, offset of the root, identifier. */
const LEAST_BYTES = 12;
/** Times the bytes of the payload: strings and lists may be shared by a few owners. */
const BUDGET_PER_BYTE = 8;
const LEAST_BUDGET = 1 << 16;

export class Payload {
  readonly root: ChunkTable;
  readonly bytes: number;
  #left: number;

  constructor(readonly file: string, readonly chunk: Chunk) {
    const bytes = this.#decode();
    this.bytes = bytes.length;
    this.#left = this.#budget();
    const buffer = new ByteBuffer(bytes);
    const isPrefixed = bytes.length >= LEAST_BYTES && buffer.readUint32(0) === bytes.length - PREFIX_BYTES;
    if (!isPrefixed || String.fromCharCode(...bytes.subarray(8, 12)) !== IDENTIFIER) {
      this.fail('its payload is no FlatBuffer of a recording');
    }
    this.root = ChunkTable.getSizePrefixedRootAsChunk(buffer);
  }

  fail(reason: string): never { throw new RecordingError(this.file, this.chunk.number, this.chunk.byte, reason); }

  check(holds: boolean, reason: () => string): void {
    if (!holds) this.fail(reason());
  }

  #budget(): number { return BUDGET_PER_BYTE * this.bytes + LEAST_BUDGET; }

  /** Begins another reading, which may take as much again. */
  renewBudget(): void { this.#left = this.#budget(); }

  #pay(count: number, what: string): void {
    this.#left -= count;
    if (this.#left < 0) this.fail(`${what}: lists hold more than the payload has room for`);
  }

  /** A list of numbers, as a view of the payload; null if it is absent or empty. */
  numbers<T extends {length: number}>(what: string, read: () => T | null): T | null {
    let list: T | null;
    try {
      list = read();
    } catch (error) {
      if (error instanceof RangeError) this.fail(`${what}: the list does not lie within the payload`);
      throw error;
    }
    if (list === null || list.length === 0) return null;
    this.#pay(list.length, what);
    return list;
  }

  /** So many numbers, no less and no more. */
  exactly<T extends {length: number}>(what: string, count: number, read: () => T | null): T {
    const list = this.numbers(what, read);
    if (list?.length !== count) this.fail(`${what}: ${list?.length ?? 0} numbers, and ${count} are needed`);
    return list;
  }

  /** A list of tables or structs, each made by `make`. */
  list<T, U>(what: string, length: number, read: (index: number) => T | null,
             make: (entry: T, what: string) => U): U[] {
    if (length < 0 || length > this.bytes / 4) this.fail(`${what}: ${length} entries do not lie within the payload`);
    this.#pay(length, what);
    const list: U[] = [];
    for (let index = 0; index < length; ++index) {
      const entry = read(index);
      if (entry === null) this.fail(`${what} ${index} is missing`);
      list.push(make(entry, `${what} ${index}`));
    }
    return list;
  }

  text(what: string, value: string | null): string {
    this.#pay(value?.length ?? 0, what);
    return value ?? '';
  }

  texts(what: string, length: number, read: (index: number) => string | null): string[] {
    return this.list(what, length, read, (text) => this.text(what, text));
  }

  /** The member of an enumeration, by its number. */
  oneOf<T>(what: string, values: readonly T[], number: number): T {
    const value = values[number];
    if (value === undefined) this.fail(`${what} is ${number}, which is not known`);
    return value;
  }

  // At the beginning of a buffer, so that numbers are aligned.
  #decode(): Uint8Array {
    const {codec, stored, bytes} = this.chunk;
    if (codec === 'stored') return stored.slice();
    let decoded: Uint8Array;
    try {
      decoded = decompress(stored, new Uint8Array(bytes));
    } catch (error) {
      this.fail(`its payload of ${bytes} bytes is not decompressed: ${error instanceof Error ? error.message : error}`);
    }
    if (decoded.length !== bytes) this.fail(`its payload has ${decoded.length} bytes when decompressed, not ${bytes}`);
    return decoded;
  }
}
