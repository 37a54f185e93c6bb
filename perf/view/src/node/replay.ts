// Runs all frames of a recording again, by the engine in WebAssembly, and compares them bit by bit:
//
//   node replay.mjs FILE.cab [--isa scalar|wasm128] [--package DIR]
//
// DIR is the folder of the engine's package. Exits with 1 if a frame differs or cannot be compared, or if the recording
// is not whole.
import {readFile} from 'node:fs/promises';
import {basename, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {createEngine} from '../engine/engine.js';
import {Fnv1a} from '../engine/fnv1a.js';
import type {EngineInPage, RunResult} from '../engine/types.js';
import {RecordingError} from '../recording/error.js';
import {readRecording} from '../recording/reader.js';
import {type Frame, type Recording, WORDS_PER_CONTACT, WORDS_PER_HIT} from '../recording/types.js';
import {firstDifference} from '../ui/dial_state.js';

const MODULES: Record<string, string> = {scalar: 'cab_scalar.wasm', wasm128: 'cab_simd.wasm'};

class UsageError extends Error {}

interface Options {
  file: string;
  isa: 'scalar' | 'wasm128';
  package: string;
}

function readOptions(): Options {
  const {values, positionals} = parseArgs({
    allowPositionals: true,
    options: {
      isa: {type: 'string', default: 'wasm128'},
      package: {type: 'string', default: fileURLToPath(new URL('../engine_package', import.meta.url))},
    },
  });
  const [file, ...more] = positionals, {isa} = values;
  if (file === undefined || more.length > 0) throw new UsageError('usage: replay.mjs FILE.cab [--isa scalar|wasm128]');
  if (isa !== 'scalar' && isa !== 'wasm128') throw new UsageError(`--isa is ${isa}, and neither scalar nor wasm128`);
  return {file, isa, package: values.package};
}

const inHex = (hash: bigint): string => hash.toString(16).padStart(16, '0');

/** The hash of a recording: of the eight bytes of each frame's hash, the lowest first. */
class TotalHash {
  #hash = new Fnv1a();
  #bytes = new DataView(new ArrayBuffer(8));

  add(hash: bigint): void {
    this.#bytes.setBigUint64(0, hash, true);
    this.#hash.add(new Uint8Array(this.#bytes.buffer));
  }

  toString(): string { return inHex(this.#hash.hash); }
}

const hitInWords = (hits: Uint32Array, at: number): string => {
  const [slotA, instanceA, slotB, instanceB, links, leaves] = hits.subarray(at, at + WORDS_PER_HIT);
  const side = (slot = 0, instance = 0, link = 0, leaf = 0): string =>
      `batch slot ${slot} instance ${instance} link ${link} leaf ${leaf}`;
  return `${side(slotA, instanceA, links! & 0xffff, leaves! & 0xffff)} with ` +
      `${side(slotB, instanceB, links! >>> 16, leaves! >>> 16)}`;
};

// The first hit that differs, or whose contact does.
function describeDifference(frame: Frame, result: RunResult): string {
  const at = firstDifference(frame.hits, result.hits);
  if (at >= 0) {
    const side = (hits: Uint32Array): string =>
        at * WORDS_PER_HIT < hits.length ? hitInWords(hits, at * WORDS_PER_HIT) : 'none';
    return `hit ${at} was ${side(frame.hits)}, and is ${side(result.hits)}`;
  }
  const recorded = wordsOf(frame.contacts), own = wordsOf(result.contacts);
  const contact = firstDifference(recorded, own, WORDS_PER_CONTACT);
  if (contact < 0) return 'the recorded hash is not that of the recorded hits';
  const floats = (list: Float32Array | null): string =>
      list === null ? 'none' :
                      list.subarray(contact * WORDS_PER_CONTACT, (contact + 1) * WORDS_PER_CONTACT - 1).join(' ');
  return `the contact of hit ${contact}, ${hitInWords(frame.hits, contact * WORDS_PER_HIT)}, was ` +
      `${floats(frame.contacts)}, and is ${floats(result.contacts)}`;
}

const wordsOf = (floats: Float32Array | null): Uint32Array =>
    floats === null ? new Uint32Array(0) : new Uint32Array(floats.buffer, floats.byteOffset, floats.length);

interface Tally {
  frames: number;
  hits: number;
  total: TotalHash;
  differ: number;
  lost: number;
  notCompared: number;
}

function replay(recording: Recording, engine: EngineInPage): Tally {
  const tally: Tally = {frames: 0, hits: 0, total: new TotalHash(), differ: 0, lost: 0, notCompared: 0};
  for (let index = 0; index < recording.frameCount; ++index) {
    let frame: Frame;
    try {
      frame = recording.frame(index);
    } catch (error) {
      if (!(error instanceof RecordingError)) throw error;
      if (tally.lost++ === 0) console.error(error.message);
      continue;
    }
    const result = engine.run(frame, {});
    ++tally.frames;
    tally.hits += result.hits.length / WORDS_PER_HIT;
    tally.total.add(result.hash);
    if (result.notes.length > 0) {
      if (tally.notCompared++ === 0) console.error(`frame ${index} is not compared: ${result.notes.join(' ')}`);
    } else if (result.hash !== frame.hash && tally.differ++ === 0) {
      console.error(`frame ${index} differs: its hash was ${inHex(frame.hash)}, and is ${inHex(result.hash)}: ` +
                    describeDifference(frame, result));
    }
  }
  return tally;
}

async function main(): Promise<number> {
  const options = readOptions();
  const recording = readRecording(await readFile(options.file), basename(options.file));
  for (const problem of recording.problems) console.error(problem);
  const module = await WebAssembly.compile(await readFile(join(options.package, MODULES[options.isa]!)));
  const engine = await createEngine(recording, {module, isa: options.isa});
  const {frames, hits, total, differ, lost, notCompared} = replay(recording, engine);
  console.log(`${frames} frames, ${hits} hits, hash ${total}, by ${engine.isa} of cab ${engine.version}`);
  engine.destroy();
  if (differ > 0) console.error(`${differ} of ${frames} frames differ`);
  if (lost > 0) console.error(`${lost} frames are lost`);
  if (notCompared > 0) console.error(`${notCompared} frames are not compared`);
  return differ > 0 || notCompared > 0 || recording.problems.length > 0 || lost > 0 ? 1 : 0;
}

try {
  process.exitCode = await main();
} catch (error) {
  // A fault of this program shows where it is.
  const isTold = error instanceof RecordingError || error instanceof UsageError;
  console.error(isTold || !(error instanceof Error) ? String((error as Error).message ?? error) : error.stack);
  process.exitCode = 1;
}
