// Recordings that are cut off, damaged or made to do harm: a reader gives right frames and says what is lost, and never
// fails in another way.
import assert from 'node:assert/strict';
import test from 'node:test';
import {crc32} from 'node:zlib';
import {Builder} from 'flatbuffers';
import * as format from 'recording-format';
import {RecordingError} from '../../perf/view/src/recording/error.js';
import {readRecording} from '../../perf/view/src/recording/reader.js';
import type {Frame, Level, Recording} from '../../perf/view/src/recording/types.js';
import {ARM, ARMS, CLOTH, CRATE, CRATES, DEFINITIONS, FLOOR, frameOf, HEADER, Numbers, posesOf} from './scene.js';
import type {Contents, WrittenFrame} from './write_recording.js';
import {chunkOf, chunkOfContents, endOf, fileOf, openFileOf, payloadOf} from './write_recording.js';

const NAME = 'arms.cab';
const FLIPS = 4000;

const frames = (first: number, count: number): WrittenFrame[] =>
    Array.from({length: count}, (_, i) => frameOf(first + i));

// Definitions, then three chunks of two or three frames.
const CHUNKS = [
  chunkOfContents(DEFINITIONS), chunkOfContents({frames: frames(0, 2)}), chunkOfContents({frames: frames(2, 3)}),
  chunkOfContents({frames: frames(5, 2)}),
];
const FIRST_FRAMES = [0, 0, 2, 5, 7];
const FRAME_COUNT = 7;
const BEGINS = CHUNKS.reduce((begins, chunk) => [...begins, begins.at(-1)! + chunk.length], [16]);
const WHOLE = fileOf(CHUNKS);
const END = BEGINS.at(-1)!;
const notClosed = (frameCount: number): string =>
    'The recording is not closed: its recorder ended before its end, or still writes. ' +
        `Frames from ${frameCount} on may be missing.`;

const EXPECTED: readonly Frame[] = (() => {
  const recording = readRecording(WHOLE, NAME);
  return Array.from({length: FRAME_COUNT}, (_, index) => recording.frame(index));
})();

// What a call throws, which must be a RecordingError; null if it throws nothing.
function refusal(call: () => unknown): RecordingError | null {
  try {
    call();
  } catch (error) {
    assert.ok(error instanceof RecordingError, error instanceof Error ? error.stack : String(error));
    return error;
  }
  return null;
}

function open(file: Uint8Array): {recording: Recording | null; error: RecordingError | null} {
  let recording: Recording | null = null;
  const error = refusal(() => {
    recording = readRecording(file, NAME);
  });
  return {recording, error};
}

// Checks every frame against what was written, and returns those that are lost.
function lostOf(recording: Recording): number[] {
  const lost: number[] = [];
  for (let index = 0; index < FRAME_COUNT; ++index) {
    if (index >= recording.frameCount || refusal(() => recording.frame(index)) !== null) lost.push(index);
    else assert.deepEqual(recording.frame(index), EXPECTED[index]);
  }
  return lost;
}

const withByte = (file: Uint8Array, at: number, change: (byte: number) => number): Uint8Array => {
  const changed = file.slice();
  changed[at] = change(changed[at]!);
  return changed;
};

test('a file that is cut off anywhere gives the chunks that are whole, and says what is lost', () => {
  for (let length = 0; length < WHOLE.length; ++length) {
    const {recording, error} = open(WHOLE.subarray(0, length));
    const whole = CHUNKS.filter((_, i) => BEGINS[i]! + 48 + payloadBytes(i) <= length).length;
    if (whole === 0) {
      assert.ok(error !== null, `${length}`);
      continue;
    }
    assert.ok(recording !== null);
    assert.equal(recording.frameCount, FIRST_FRAMES[whole]);
    assert.deepEqual(lostOf(recording), EXPECTED.map(({index}) => index).slice(FIRST_FRAMES[whole]));
    const inNext = length - BEGINS[whole]!;
    if (inNext <= 0) {
      assert.deepEqual(recording.problems, [notClosed(FIRST_FRAMES[whole]!)]);
      continue;
    }
    const where = `Chunk ${whole} at byte ${BEGINS[whole]} is cut off: it has `;
    const [first, end] = [FIRST_FRAMES[whole]!, FIRST_FRAMES[whole + 1]!];
    const what = inNext < 48 ? `${inNext} of the 48 bytes of its header. Frames from ${first} on are lost.` :
        `${inNext - 48} of the ${payloadBytes(whole)} bytes of its payload. ` +
            `Its frames ${first} to ${end - 1} and all that follows are lost.`;
    assert.deepEqual(recording.problems, [where + what]);
  }
});

function payloadBytes(chunk: number): number {
  return Number(new DataView(WHOLE.buffer).getBigUint64(BEGINS[chunk]! + 8, true));
}

test('a flipped bit anywhere costs at most what it is in, and is told', () => {
  const numbers = new Numbers(20261125);
  for (let i = 0; i < FLIPS; ++i) {
    const at = numbers.below(WHOLE.length), bit = numbers.below(8);
    const {recording, error} = open(withByte(WHOLE, at, (byte) => byte ^ 1 << bit));
    if (error !== null) {
      // The header of the file, and the definitions, which all frames need.
      assert.ok(at < BEGINS[1]!, `byte ${at}`);
      continue;
    }
    const lost = lostOf(recording!);
    const chunk = BEGINS.filter((begin) => begin <= at).length - 1;
    if (at >= END) {
      assert.deepEqual(lost, []);
      assert.equal(recording!.problems.length, 1);
      continue;
    }
    assert.equal(lost.length > 0, recording!.problems.length > 0, `byte ${at}`);
    const [first, end] = [FIRST_FRAMES[chunk]!, FIRST_FRAMES[chunk + 1]!];
    for (const index of lost) assert.ok(index >= first && index < end, `byte ${at}`);
  }
});

test('several flipped bits never give a wrong frame', () => {
  const numbers = new Numbers(77);
  for (let i = 0; i < FLIPS / 4; ++i) {
    const file = WHOLE.slice();
    for (let flips = 0; flips < 6; ++flips) file[numbers.below(file.length)]! ^= 1 << numbers.below(8);
    const {recording} = open(file);
    if (recording !== null && lostOf(recording).length > 0) assert.ok(recording.problems.length > 0);
  }
});

test('a damaged payload in the middle is skipped, and its frames are named', () => {
  const {recording} = open(withByte(WHOLE, BEGINS[2]! + 100, (byte) => byte ^ 255));
  assert.deepEqual(lostOf(recording!), [2, 3, 4]);
  assert.equal(recording!.frameCount, FRAME_COUNT);
  assert.deepEqual(recording!.problems, [
    `Chunk 2 at byte ${BEGINS[2]} is damaged: the checksum of its payload is another. Its frames 2 to 4 are lost.`,
  ]);
  assert.equal(refusal(() => recording!.frame(3))!.message,
               `${NAME}: chunk 2 at byte ${BEGINS[2]}: it is damaged: the checksum of its payload is another; lost: ` +
                   'frames 2 to 4');
});

test('behind a damaged header the next chunk is found, and the frames between are named', () => {
  const {recording} = open(withByte(WHOLE, BEGINS[2]! + 20, (byte) => byte ^ 255));
  assert.deepEqual(lostOf(recording!), [2, 3, 4]);
  assert.deepEqual(recording!.problems, [
    `Chunk 2 at byte ${BEGINS[2]} is damaged: its header is. The next chunk that can be read begins at byte ` +
        `${BEGINS[3]}.`,
    `By the damage from byte ${BEGINS[2]} on, frames 2 to 4 are lost.`,
  ]);
  const last = open(withByte(WHOLE, BEGINS[3]! + 20, (byte) => byte ^ 255));
  assert.deepEqual(last.recording!.problems, [
    `Chunk 3 at byte ${BEGINS[3]} is damaged: its header is. The next chunk that can be read begins at byte ${END}.`,
    `By the damage from byte ${BEGINS[3]} on, frames 5 to 6 are lost.`,
  ]);
  assert.equal(last.recording!.frameCount, FRAME_COUNT);
  const notEnded = open(withByte(openFileOf(CHUNKS), BEGINS[3]! + 20, (byte) => byte ^ 255));
  assert.deepEqual(notEnded.recording!.problems, [
    `Chunk 3 at byte ${BEGINS[3]} is damaged: its header is, and no chunk follows. Frames from 5 on are lost.`,
  ]);
});

test('a recording without the mark of its end at its end is not closed', () => {
  assert.deepEqual(open(WHOLE).recording!.problems, []);
  assert.deepEqual(open(openFileOf(CHUNKS)).recording!.problems, [notClosed(FRAME_COUNT)]);
  // As an older library appends.
  assert.deepEqual(open(openFileOf([...CHUNKS, endOf(7), chunkOfContents({frames: frames(7, 1)})])).recording!.problems,
                   [notClosed(8)]);
  const other = open(openFileOf([...CHUNKS, endOf(9)]));
  assert.deepEqual(other.recording!.problems, [
    `Chunk 4 at byte ${END} ends the recording after 9 frames, where frame 7 is next. It is left out.`,
  ]);
  assert.equal(other.recording!.frameCount, FRAME_COUNT);
  const payload = chunkOf(new Uint8Array(8), {codec: 0, flags: 2, bytes: 8, firstFrame: 7, frameCount: 0});
  assert.match(open(openFileOf([...CHUNKS, payload])).recording!.problems[0]!, /is damaged: its header is/);
});

test('without the first definitions nothing can be shown, and the error says so', () => {
  for (const at of [20, 100]) {
    const {error} = open(withByte(WHOLE, BEGINS[0]! + at, (byte) => byte ^ 255));
    assert.match(error!.message, /arms.cab: chunk 0 at byte 16: it is damaged: .* all else needs it/);
  }
});

test('frames that need lost definitions are refused, and those that do not are read', () => {
  const later = frameOf(3);
  later.inputs[0]!.batch = 3;
  const chunks = [
    chunkOfContents({...DEFINITIONS, frames: frames(0, 2)}),
    chunkOfContents({articulations: [ARM], batches: [{...ARMS, slot: 9}]}),
    chunkOfContents({frames: frames(2, 1)}),
    chunkOfContents({batches: [{...ARMS, slot: 10}]}),
    chunkOfContents({frames: [later]}),
  ];
  const file = fileOf(chunks), begin = 16 + chunks[0]!.length;
  const {recording} = open(withByte(file, begin + 100, (byte) => byte ^ 255));
  assert.deepEqual(recording!.frame(2), EXPECTED[2]);
  assert.equal(recording!.batches.length, 3);
  assert.match(recording!.problems.join('\n'),
               /Chunk 1 at byte \d+ is damaged: .* Its definitions are lost\.\n.*chunk 3 .* lost too/);
  assert.match(refusal(() => recording!.frame(3))!.message,
               /has batch 3, and 3 are defined; definitions may be lost with chunk 1 at byte/);
});

test('files that are no recordings are refused with a reason', () => {
  const words = (file: Uint8Array): string => open(file).error!.message;
  assert.match(words(new Uint8Array(0)), /arms.cab: at byte 0: the file is empty/);
  assert.match(words(new TextEncoder().encode('HIERARCHY\nROOT Hips')), /no recording of cab/);
  assert.match(words(WHOLE.subarray(0, 12)), /ends after 12 bytes, within its header/);
  assert.match(words(WHOLE.subarray(0, 16)), /no chunk with definitions/);
  assert.match(words(fileOf(CHUNKS, 2)), /version 2 of the format, and 1 is known/);
  assert.match(words(fileOf(CHUNKS.slice(1))), /no chunk with definitions/);
  assert.match(words(fileOf([chunkOfContents({articulations: [ARM]})])), /has no header, and the first chunk needs/);
});

test('headers of chunks that cannot be are told, and their chunks left out', () => {
  const payload = payloadOf({frames: frames(0, 1)});
  const fields = {codec: 0, flags: 0, bytes: payload.length, firstFrame: 0, frameCount: 1};
  const cases: [RegExp, Partial<typeof fields>][] = [
    [/has the codec 7, and 0 and 1 are known\. Its frame 0 is lost/, {codec: 7}],
    [/is stored in \d+ bytes, and its payload has 1000/, {bytes: 1000}],
    [/1099511627776 bytes, and 268435456 may be/, {codec: 1, bytes: 2 ** 40}],
    [/has 4294967295 frames in \d+ bytes/, {frameCount: 0xffffffff}],
    [/has frames from 3 on, where frame 0 is next/, {firstFrame: 3}],
    [/16777216 may be/, {firstFrame: 0xffffffff}],
  ];
  for (const [message, more] of cases) {
    const {recording} = open(openFileOf([CHUNKS[0]!, chunkOf(payload, {...fields, ...more})]));
    assert.match(recording!.problems.join('\n'), message);
    assert.equal(recording!.frameCount, 0);
  }
  const again = open(fileOf([CHUNKS[0]!, CHUNKS[1]!, CHUNKS[1]!, CHUNKS[2]!]));
  assert.match(again.recording!.problems.join('\n'),
               /Chunk 2 .* has frames from 0 on, where frame 2 is next\. It is left out/);
  assert.deepEqual(again.recording!.frame(4), EXPECTED[4]);
});

test('payloads that are no zstd, or no FlatBuffer, are refused', () => {
  const payload = payloadOf({frames: frames(0, 1)});
  const fields = {codec: 1, flags: 0, bytes: payload.length, firstFrame: 0, frameCount: 1};
  const words = (chunk: Uint8Array): string =>
      refusal(() => open(fileOf([CHUNKS[0]!, chunk])).recording!.frame(0))!.message;
  assert.match(words(chunkOf(payload, fields)), /chunk 1 at byte \d+: its payload of \d+ bytes is not decompressed/);
  // A frame of zstd with one block of eight bytes as they are.
  const eight = new Uint8Array([0x28, 0xb5, 0x2f, 0xfd, 0x20, 8, 0x41, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
  assert.match(words(chunkOf(eight, {...fields, bytes: 80})), /no FlatBuffer of a recording/);
  assert.match(words(chunkOf(eight, {...fields, bytes: 12})), /no FlatBuffer of a recording/);
  assert.match(words(chunkOf(new Uint8Array([...eight, ...eight]), {...fields, bytes: 16})), /16/);
  const noise = new Uint8Array(64).fill(7);
  assert.match(words(chunkOf(noise, {...fields, codec: 0, bytes: 64})), /no FlatBuffer of a recording/);
  const shorter = payload.slice();
  shorter[0]! ^= 1;
  assert.match(words(chunkOf(shorter, {...fields, codec: 0})), /no FlatBuffer of a recording/);
});

// A recording of one chunk with one frame, changed.
const wordsOf = (contents: Contents): string => {
  const {recording, error} = open(fileOf([chunkOfContents(contents)]));
  return (error ?? refusal(() => recording!.frame(0)))?.message ?? 'nothing is wrong';
};

test('definitions that cannot be are refused by name', () => {
  const arm = (more: object): Contents => ({...DEFINITIONS, articulations: [{...ARM, ...more}, CRATE]});
  const cloth = (more: object): Contents => ({...DEFINITIONS, articulations: [ARM, {...CLOTH, ...more}]});
  const leaf = CLOTH.leaves[0]!, skin = CLOTH.skin!;
  const batch = (more: object): Contents => ({...DEFINITIONS, batches: [{...ARMS, ...more}, CRATES, FLOOR]});
  const part = ARM.leaves[1]!.parts[0]!, bodies = FLOOR.staticBodies!;
  const level: Level =
      {of: 0, kind: 'nodes', maxLeaves: 1, leaves: [], restPoses: null, restPoseCount: 0, jointPlay: 0};
  const cases: [RegExp, Contents][] = [
    [/articulation 0: 0 links, and 1 to 1024/, arm({linkParents: new Int16Array(0), linkNames: []})],
    [/articulation 0: 1025 links/, arm({linkParents: new Int16Array(1025).fill(-1), linkNames: []})],
    [/articulation 0: link 1 has the parent 1/, arm({linkParents: new Int16Array([-1, 1])})],
    [/articulation 0: 1 names of 2 links/, arm({linkNames: ['one']})],
    [/numbers are not the joints of 2 links/, arm({linkJoints: new Float32Array(5)})],
    [/articulation 0: 0 leaves/, arm({leaves: []})],
    [/leaf 0: link 2 is named, of 2/, arm({leaves: [{...ARM.leaves[0]!, link: 2}]})],
    [/part 0: 4 numbers are no vertices/,
     arm({leaves: [{...ARM.leaves[0]!, parts: [{...part, vertices: new Float32Array(4)}]}]})],
    [/part 0: its place: 9 numbers, and 10 are needed/,
     arm({leaves: [{...ARM.leaves[0]!, parts: [{...part, size: new Float32Array(2)}]}]})],
    [/its box: 14 numbers, and 15 are needed/,
     arm({leaves: [{...ARM.leaves[0]!, box: {...ARM.leaves[0]!.box, half: new Float32Array(2)}}]})],
    [/3 numbers are no pairs of links/, arm({ignoredPairs: new Uint16Array(3)})],
    [/ignored pairs: link 9 is named/, arm({ignoredPairs: new Uint16Array([0, 9])})],
    [/its rest pose: 7 numbers are not the poses/, arm({restPose: posesOf([0, 0, 0, 1, 0, 0, 0])})],
    [/articulation 0 is a level of 0, which is none/, arm({level})],
    [/articulation 1 is a level of 7, which is none/,
     {...DEFINITIONS, articulations: [ARM, {...ARM, level: {...level, of: 7}}]}],
    [/leaf 0: 4 numbers are no triangles/, cloth({leaves: [{...leaf, triangles: new Uint32Array(4)}]})],
    [/leaf 0: a triangle names vertex 4, of 4/, cloth({leaves: [{...leaf, triangles: new Uint32Array([0, 1, 4])}]})],
    [/leaf 0: a triangle names vertex 0, of 0/, cloth({skin: null})],
    [/its skin: 11 numbers are no vertices/, cloth({skin: {...skin, vertices: new Float32Array(11)}})],
    [/its skin: 8 links and 7 weights, and 8 are needed/,
     cloth({skin: {...skin, influenceWeights: new Float32Array(7)}})],
    [/its skin: 8 links and 8 weights, and 17179869180 are needed/,
     cloth({skin: {...skin, influenceCount: 0xffffffff}})],
    [/its skin: link 2 is named, of 2/, cloth({skin: {...skin, influenceLinks: new Uint32Array(8).fill(2)}})],
    [/its skin: 16 numbers are not the matrices of 2 links/,
     cloth({skin: {...skin, inverseBind: new Float32Array(16)}})],
    [/batch 0: 0 instances/, batch({instanceCount: 0, instanceNames: []})],
    [/batch 0 has the slot 4096/, batch({slot: 4096})],
    [/batch 0 is of articulation 5, of 2/, batch({articulation: 5})],
    [/batch 0: 3 names of 4 instances/, batch({instanceCount: 4})],
    [/batch 2: 4 instances of 3 static bodies/,
     {...DEFINITIONS, batches: [ARMS, CRATES, {...FLOOR, instanceCount: 4}]}],
    [/a triangle names vertex 4, of 4/,
     {...DEFINITIONS, batches: [{...FLOOR, staticBodies: {...bodies, triangles: new Uint32Array([0, 1, 4])}}]}],
    [/seconds per frame is NaN/, {...DEFINITIONS, header: {...HEADER, secondsPerFrame: NaN}}],
  ];
  for (const [message, contents] of cases) assert.match(wordsOf({...contents, frames: frames(0, 1)}), message);
});

test('frames that cannot be are refused by name', () => {
  const changed = (change: (frame: WrittenFrame) => void): Contents => {
    const frame = frameOf(0);
    change(frame);
    return {...DEFINITIONS, frames: [frame]};
  };
  const input = (at: number, more: object): Contents => changed(({inputs}) => Object.assign(inputs[at]!, more));
  const hit = (at: number, word: number): Contents => changed((frame) => {
    frame.hits = new Uint32Array([1, 0, 3, 1, 0x10000, 0x10000]);
    frame.hits[at] = word;
    frame.contacts = null;
  });
  const settings = (more: object): Contents => changed((frame) => {
    frame.settings = {...frame.settings, ...more};
  });
  const cases: [RegExp, Contents][] = [
    [/nothing is wrong/, changed(() => undefined)],
    [/nothing is wrong/, hit(0, 1)],
    [/frame 0 has batch 9, and 3 are defined/, input(2, {batch: 9})],
    [/is of batch 1, which has an input already/, input(2, {batch: 1})],
    [/the count is 4, of 3 instances/, input(0, {count: 4})],
    [/instance 0 of 3 is not in order/, input(0, {instances: new Uint32Array([1, 0])})],
    [/instance 3 of 3 is not in order/, input(0, {instances: new Uint32Array([0, 3])})],
    [/its poses: 14 numbers are not the poses that are needed: 6 of 7/,
     input(0, {poses: posesOf(new Float32Array(14))})],
    [/its poses: 43 numbers/, input(0, {poses: posesOf(new Float32Array(43))})],
    [/its origins are 8 numbers, for 3 instances/, input(0, {origins: new Float64Array(8)})],
    [/its scales are 2 numbers, for 3 instances/, input(0, {scales: new Float32Array(2)})],
    [/its margins are 4 numbers, for 3 instances/, input(0, {margins: new Float32Array(4)})],
    [/instance 3 is masked, of 3/, input(0, {masked: new Uint32Array([3])})],
    [/has no poses, and no frame before it/, input(0, {posesAsBefore: true})],
    [/hit 0 names slot 5, and no input has it/, hit(0, 5)],
    [/hit 0 names instance 2, of 2/, hit(1, 2)],
    [/hit 0 names link 1, of 1/, hit(4, 0x10001)],
    [/hit 0 names link 2, of 2/, hit(4, 0x20000)],
    [/hit 0 names leaf 2, of 2/, hit(5, 0x20000)],
    [/5 words are no hits/, changed((frame) => { frame.hits = new Uint32Array(5); })],
    [/11 words are not the contacts of 0 hits/, changed((frame) => { frame.contacts = new Float32Array(11); })],
    [/its margin is -1/, settings({margin: -1})],
    [/its least depth is Infinity/, settings({minDepth: Infinity})],
    [/a rule names batch 7, which has no input/, settings({rules: [{a: 7, b: 0, pairing: 'between'}]})],
    [/frame 0 has two batches of slot 3/, {...changed(({inputs}) => { inputs.push({...inputs[0]!, batch: 3}); }),
                                           batches: [ARMS, CRATES, FLOOR, ARMS]}],
  ];
  for (const [message, contents] of cases) assert.match(wordsOf(contents), message);
  const two = payloadOf({frames: frames(0, 2)});
  const chunk = chunkOf(two, {codec: 0, flags: 0, bytes: two.length, firstFrame: 0, frameCount: 1});
  const {recording} = open(fileOf([CHUNKS[0]!, chunk]));
  assert.match(refusal(() => recording!.frame(0))!.message, /its header says 1 frames, and it has 2/);
  const hidden = payloadOf({batches: [ARMS], frames: frames(0, 1)});
  const unflagged = chunkOf(hidden, {codec: 0, flags: 0, bytes: hidden.length, firstFrame: 0, frameCount: 1});
  assert.match(refusal(() => open(fileOf([CHUNKS[0]!, unflagged])).recording!.frame(0))!.message,
               /has definitions, and its header says that it has none/);
});

test('bytes that are changed under a right checksum give frames or a RecordingError, in no time', () => {
  const numbers = new Numbers(4711);
  const payloads = [payloadOf({...DEFINITIONS, frames: frames(0, 2)}), payloadOf({frames: frames(2, 2)})];
  const extremes = [0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0xfffffff0];
  let refused = 0;
  for (let i = 0; i < FLIPS; ++i) {
    const changed = payloads.map((payload) => payload.slice());
    const views = changed.map((payload) => new DataView(payload.buffer));
    for (let change = 0; change <= i % 3; ++change) {
      const which = numbers.below(2), view = views[which]!;
      const at = 4 * numbers.below(view.byteLength >> 2);
      const kind = numbers.below(3);
      view.setUint32(at, kind === 0 ? extremes[numbers.below(6)]! :
                         kind === 1 ? numbers.below(2 ** 16) : view.getUint32(at, true) + numbers.below(64) - 32, true);
    }
    const file = fileOf(changed.map((payload, which) => chunkOf(
        payload, {codec: 0, flags: 1 - which, bytes: payload.length, firstFrame: 2 * which, frameCount: 2})));
    const {recording} = open(file);
    if (recording === null) {
      ++refused;
      continue;
    }
    for (let index = 0; index < recording.frameCount; ++index) {
      if (refusal(() => recording.frame(index)) !== null) ++refused;
    }
  }
  assert.ok(refused > FLIPS / 10, `${refused}`);
});

test('lists that share what they hold cannot take more time than their bytes are worth', () => {
  const builder = new Builder(1 << 20);
  const long = builder.createString('x'.repeat(100000));
  const notes = format.Header.createNotesVector(builder, new Array<number>(100000).fill(long));
  const name = builder.createString('');
  const header = format.Header.createHeader(builder, name, name, 0, 0, 0, name, 0, 0, notes);
  format.Chunk.startChunk(builder);
  format.Chunk.addHeader(builder, header);
  builder.finishSizePrefixed(format.Chunk.endChunk(builder), 'CABR');
  const payload = builder.asUint8Array().slice();
  const chunk = chunkOf(payload, {codec: 0, flags: 1, bytes: payload.length, firstFrame: 0, frameCount: 0});
  assert.equal(crc32(payload), new DataView(chunk.buffer).getUint32(32, true));
  const begin = performance.now();
  assert.match(open(fileOf([chunk])).error!.message, /lists hold more than the payload has room for/);
  assert.ok(performance.now() - begin < 2000);
});
