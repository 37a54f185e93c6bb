// Finds the chunks of a file by their headers, and says what is cut off or damaged (docs/recording.md has the bytes).
import {crc32} from './crc32.js';
import {RecordingError} from './error.js';

export const FILE_HEADER_BYTES = 16;
export const CHUNK_HEADER_BYTES = 48;
const MAGIC = 'CABREC\r\n';
const VERSION = 1;
const CHUNK_MAGIC = 0x4b4e4843;  // CHNK
/** What a FlatBuffer can have, and what may be decompressed. */
const MOST_BYTES = {stored: 0x7fffffff, zstd: 1 << 28};
const CODECS = ['stored', 'zstd'] as const;
/** An offset, a table and its vtable. */
const LEAST_BYTES_PER_FRAME = 12;
/** Three days at 60 frames a second. Lists by frame stay within the memory of a page. */
const MOST_FRAMES = 1 << 24;

export type Codec = typeof CODECS[number];

export interface Chunk {
  /** Counted from 0 in the file, damaged ones included. */
  number: number;
  /** Where its header begins. */
  byte: number;
  codec: Codec;
  hasDefinitions: boolean;
  /** The payload as it is in the file. */
  stored: Uint8Array;
  /** Bytes of the payload when decoded. */
  bytes: number;
  firstFrame: number;
  frameCount: number;
}

/** Frames that no chunk has, and why. */
export interface LostFrames {
  first: number;
  last: number;
  error: RecordingError;
}

/** What a file has. The frames are those up to the last whole chunk that has any. */
export interface Scan {
  chunks: Chunk[];
  lost: LostFrames[];
  problems: string[];
  /** The first chunk whose definitions are lost, or may be: what later definitions are counted from is unknown then. */
  definitionsLost: RecordingError | null;
  frameCount: number;
}

interface ChunkHeader {
  codec: number;
  hasDefinitions: boolean;
  /** It marks the end of a recording of `firstFrame` frames, and has no payload. */
  isEnd: boolean;
  stored: number;
  bytes: number;
  firstFrame: number;
  frameCount: number;
  crc: number;
}

export const framesInWords = (first: number, last: number): string =>
    first === last ? `frame ${first}` : `frames ${first} to ${last}`;

export function scanChunks(file: Uint8Array, name: string): Scan {
  checkFileHeader(file, name);
  return new Scanner(file, name).scan();
}

function checkFileHeader(file: Uint8Array, name: string): void {
  const fail = (reason: string): never => {
    throw new RecordingError(name, null, 0, reason);
  };
  if (file.length === 0) fail('the file is empty');
  const magic = String.fromCharCode(...file.subarray(0, MAGIC.length));
  if (!MAGIC.startsWith(magic)) fail('this is no recording of cab: it does not begin with CABREC');
  if (file.length < FILE_HEADER_BYTES) fail(`the file ends after ${file.length} bytes, within its header`);
  const version = new DataView(file.buffer, file.byteOffset).getUint32(8, true);
  if (version !== VERSION) fail(`the recording has version ${version} of the format, and ${VERSION} is known`);
}

class Scanner {
  #view: DataView;
  #at = FILE_HEADER_BYTES;
  #number = 0;
  #nextFrame = 0;
  // What hides how many frames there were since #nextFrame: those up to the next chunk with frames are lost by it.
  #fault: RecordingError | null = null;
  #hasEnd = false;
  #scan: Scan = {chunks: [], lost: [], problems: [], definitionsLost: null, frameCount: 0};

  constructor(readonly file: Uint8Array, readonly name: string) {
    this.#view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  }

  scan(): Scan {
    while (this.#at < this.file.length) {
      const left = this.file.length - this.#at;
      if (left < CHUNK_HEADER_BYTES) {
        this.#cutOff(`is cut off: it has ${left} of the ${CHUNK_HEADER_BYTES} bytes of its header`, null);
        return this.#scan;
      }
      const header = this.#headerAt(this.#at);
      if (header === null) {
        if (!this.#skipToNextHeader()) return this.#scan;
        continue;
      }
      if (header.stored > left - CHUNK_HEADER_BYTES) {
        const has = left - CHUNK_HEADER_BYTES;
        this.#cutOff(`is cut off: it has ${has} of the ${header.stored} bytes of its payload`, header);
        return this.#scan;
      }
      this.#hasEnd = header.isEnd;
      this.#take(header);
      this.#at += CHUNK_HEADER_BYTES + 8 * Math.ceil(header.stored / 8);
      ++this.#number;
    }
    if (!this.#hasEnd) {
      this.#scan.problems.push('The recording is not closed: its recorder ended before its end, or still writes. ' +
                               `Frames from ${this.#nextFrame} on may be missing.`);
    }
    return this.#scan;
  }

  // The header at a byte, or null if there is none, or a damaged one.
  #headerAt(byte: number): ChunkHeader | null {
    const u32 = (offset: number): number => this.#view.getUint32(byte + offset, true);
    if (u32(0) !== CHUNK_MAGIC || crc32(this.file.subarray(byte, byte + 44)) !== u32(44)) return null;
    const header = {
      codec: this.#view.getUint16(byte + 4, true),
      hasDefinitions: (u32(4) >>> 16 & 1) !== 0,
      isEnd: (u32(4) >>> 16 & 2) !== 0,
      stored: Number(this.#view.getBigUint64(byte + 8, true)),
      bytes: Number(this.#view.getBigUint64(byte + 16, true)),
      firstFrame: u32(24),
      frameCount: u32(28),
      crc: u32(32),
    };
    const {isEnd, codec, hasDefinitions, stored, bytes, frameCount} = header;
    return isEnd && (codec !== 0 || hasDefinitions || stored + bytes + frameCount > 0) ? null : header;
  }

  #errorOf(reason: string): RecordingError {
    return new RecordingError(this.name, this.#number, this.#at, reason);
  }

  #problem(text: string): void { this.#scan.problems.push(`Chunk ${this.#number} at byte ${this.#at} ${text}`); }

  #cutOff(reason: string, header: ChunkHeader | null): void {
    this.#loseDefinitions(header, this.#errorOf(reason));
    this.#problem(`${reason}. ${this.#framesLostBy(header)}`);
  }

  #framesLostBy(header: ChunkHeader | null): string {
    if (header === null) return `Frames from ${this.#nextFrame} on are lost.`;
    const {firstFrame, frameCount} = header;
    if (frameCount === 0) return 'It has no frames. All that follows it is lost.';
    return `Its ${framesInWords(firstFrame, firstFrame + frameCount - 1)} and all that follows are lost.`;
  }

  #skipToNextHeader(): boolean {
    const reason = 'is damaged: its header is';
    this.#damaged(reason, null);
    let next = this.#at + 8;
    while (next + CHUNK_HEADER_BYTES <= this.file.length && this.#headerAt(next) === null) next += 8;
    const found = next + CHUNK_HEADER_BYTES <= this.file.length;
    this.#problem(found ? `${reason}. The next chunk that can be read begins at byte ${next}.` :
                          `${reason}, and no chunk follows. Frames from ${this.#nextFrame} on are lost.`);
    this.#at = next;
    ++this.#number;
    return found;
  }

  #damaged(reason: string, header: ChunkHeader | null): void {
    const error = this.#errorOf(reason);
    this.#fault ??= error;
    this.#loseDefinitions(header, error);
  }

  #loseDefinitions(header: ChunkHeader | null, error: RecordingError): void {
    if (header === null || header.hasDefinitions) this.#scan.definitionsLost ??= error;
  }

  #take(header: ChunkHeader): void {
    const begin = this.#at + CHUNK_HEADER_BYTES;
    const stored = this.file.subarray(begin, begin + header.stored);
    const misnumbered = this.#faultOfFrames(header);
    if (misnumbered !== null) {
      this.#damaged(misnumbered, header);
      this.#problem(`${misnumbered}. It is left out.`);
      return;
    }
    if (header.frameCount > 0 || header.isEnd) this.#loseFramesBefore(header.firstFrame);
    if (header.isEnd) {
      this.#scan.frameCount = this.#nextFrame = header.firstFrame;
      this.#fault = null;
      return;
    }
    const fault = faultOfPayload(header, stored);
    if (fault === null) {
      this.#add(header, stored);
    } else {
      this.#leaveOut(header, fault);
    }
    if (header.frameCount > 0) {
      this.#nextFrame = header.firstFrame + header.frameCount;
      this.#fault = null;
    }
  }

  #add(header: ChunkHeader, stored: Uint8Array): void {
    const {hasDefinitions, bytes, firstFrame, frameCount} = header;
    const codec = CODECS[header.codec]!;
    this.#scan.chunks.push(
        {number: this.#number, byte: this.#at, codec, hasDefinitions, stored, bytes, firstFrame, frameCount});
    if (frameCount > 0) this.#scan.frameCount = firstFrame + frameCount;
  }

  #leaveOut(header: ChunkHeader, fault: string): void {
    const error = this.#errorOf(fault);
    this.#loseDefinitions(header, error);
    const definitions = header.hasDefinitions ? ' Its definitions are lost.' : '';
    if (header.frameCount === 0) {
      this.#problem(`${fault}.${definitions}`);
      return;
    }
    const first = header.firstFrame, last = first + header.frameCount - 1;
    this.#scan.lost.push({first, last, error});
    this.#problem(`${fault}. Its ${framesInWords(first, last)} ${first === last ? 'is' : 'are'} lost.${definitions}`);
  }

  // The frames before `next` that no chunk has.
  #loseFramesBefore(next: number): void {
    if (this.#fault === null || next === this.#nextFrame) return;
    const first = this.#nextFrame, last = next - 1;
    this.#scan.lost.push({first, last, error: this.#fault});
    this.#scan.problems.push(`By the damage from byte ${this.#fault.byte} on, ${framesInWords(first, last)} ` +
                             `${first === last ? 'is' : 'are'} lost.`);
  }

  #faultOfFrames({firstFrame, frameCount, bytes, isEnd}: ChunkHeader): string | null {
    if (frameCount === 0 && !isEnd) return null;
    if (frameCount > bytes / LEAST_BYTES_PER_FRAME) return `has ${frameCount} frames in ${bytes} bytes`;
    if (firstFrame + frameCount > MOST_FRAMES) return `has frames from ${firstFrame} on, and ${MOST_FRAMES} may be`;
    if (firstFrame < this.#nextFrame || (firstFrame > this.#nextFrame && this.#fault === null)) {
      if (isEnd) return `ends the recording after ${firstFrame} frames, where frame ${this.#nextFrame} is next`;
      return `has frames from ${firstFrame} on, where frame ${this.#nextFrame} is next`;
    }
    return null;
  }
}

function faultOfPayload({codec, stored: storedBytes, bytes, crc}: ChunkHeader, stored: Uint8Array): string | null {
  if (crc32(stored) !== crc) return 'is damaged: the checksum of its payload is another';
  const name = CODECS[codec];
  if (name === undefined) return `has the codec ${codec}, and 0 and 1 are known`;
  if (bytes > MOST_BYTES[name]) return `has a payload of ${bytes} bytes, and ${MOST_BYTES[name]} may be`;
  if (name === 'stored' && bytes !== storedBytes) {
    return `is stored in ${storedBytes} bytes, and its payload has ${bytes}`;
  }
  return null;
}
