// What the page carries: recordings, a report, and both modules of the engine.
import {pairText, readPair} from './report/pair_text.js';
import type {PairRef, Report} from './report/types.js';

export interface EmbeddedRecording {
  name: string;
  /** Decodes it, which takes a while for a large one. */
  bytes: () => Promise<Uint8Array>;
}

/** Base64 to bytes. */
async function decode(text: string): Promise<Uint8Array> {
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

export function embeddedRecordings(): EmbeddedRecording[] {
  return [...document.querySelectorAll<HTMLScriptElement>('script.cab-recording')].map((script, i) => ({
    name: script.dataset['name'] || `recording ${i + 1}`,
    bytes: () => decode(script.textContent ?? ''),
  }));
}

/** What `cab report` has found. Null: the page has no report. */
export function embeddedReport(): Report | null {
  const script = document.getElementById('cab-report');
  return script ? JSON.parse(script.textContent ?? '') as Report : null;
}

/** One of the two WebAssembly modules of the engine: base64 of its deflated bytes. */
export async function engineModule(simd: boolean): Promise<WebAssembly.Module> {
  const script = document.getElementById(simd ? 'cab-wasm-simd' : 'cab-wasm-scalar');
  const deflated = new Blob([await decode(script?.textContent ?? '') as BlobPart]);
  const stream = deflated.stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

/** What the page shows: a frame of a recording, and a pair of links that is selected there. */
export interface Place {
  recording: number;
  frame: number;
  pair: PairRef | null;
}

/** `#recording=1&frame=20&pair=1.0.4-2.0.7` */
export const fragmentOf = ({recording, frame, pair}: Place): string =>
  `#recording=${recording}&frame=${frame}${pair ? `&pair=${pairText(pair)}` : ''}`;

/** Null: the fragment names no recording. */
export function placeInFragment(): Place | null {
  const fields = new URLSearchParams(location.hash.slice(1));
  const recording = fields.get('recording');
  if (recording === null) return null;
  const frame = Number(fields.get('frame')) || 0;
  return {recording: Number(recording) || 0, frame, pair: readPair(fields.get('pair') ?? '')};
}
