// Recordings that are whole: everything that is written is read.
import assert from 'node:assert/strict';
import test from 'node:test';
import {crc32 as crc32OfNode} from 'node:zlib';
import {crc32} from '../../perf/view/src/recording/crc32.js';
import {readRecording} from '../../perf/view/src/recording/reader.js';
import type {Articulation, Frame} from '../../perf/view/src/recording/types.js';
import {
  ARM, ARMS, CLOTH, CRATE, CRATES, DEFINITIONS, FLOOR, frameOf, HEADER, NONE, Numbers, posesOf,
} from './scene.js';
import {fixture} from './fixture.js';
import type {WrittenFrame} from './write_recording.js';
import {chunkOfContents, fileOf} from './write_recording.js';


/** A frame as the reader gives it. */
const read = (frame: WrittenFrame): Frame => ({
  ...frame, inputs: frame.inputs.map(({sameAsBefore: _, posesAsBefore: __, ...input}) => input),
});

const frames = (first: number, count: number): WrittenFrame[] =>
    Array.from({length: count}, (_, i) => frameOf(first + i));

test('the checksum is that of zlib, at every length and alignment', () => {
  const bytes = new Uint8Array(300);
  const numbers = new Numbers(5);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = numbers.below(256);
  assert.equal(crc32(new TextEncoder().encode('123456789')), 0xcbf43926);
  for (let begin = 0; begin < 9; ++begin) {
    for (let end = begin; end < bytes.length; ++end) {
      const part = bytes.subarray(begin, end);
      assert.equal(crc32(part), crc32OfNode(part));
    }
  }
});

test('all that a recording has is read', () => {
  const file = fileOf([chunkOfContents(DEFINITIONS), chunkOfContents({frames: frames(0, 4)}),
                       chunkOfContents({frames: frames(4, 3)})]);
  const recording = readRecording(file, 'arms.cab');
  assert.deepEqual(recording.problems, []);
  assert.deepEqual(recording.header, HEADER);
  assert.deepEqual(recording.articulations, [ARM, CRATE]);
  assert.deepEqual(recording.batches, [ARMS, CRATES, FLOOR]);
  assert.equal(recording.frameCount, 7);
  for (const index of [0, 6, 1, 5, 2, 4, 3, 3, 0]) {
    assert.deepEqual(recording.frame(index), read(frameOf(index)));
  }
  assert.equal(recording.frame(3), recording.frame(3));
  for (const index of [-1, 7, 0.5, NaN]) assert.throws(() => recording.frame(index), RangeError);
});

test('a job without containment is read, beside others of the same chunk', () => {
  const all = frames(0, 3);
  all[1]!.settings = {...all[1]!.settings, containment: false};
  const recording = readRecording(fileOf([chunkOfContents({...DEFINITIONS, frames: all})]), 'arms.cab');
  assert.deepEqual([0, 1, 2].map((index) => recording.frame(index)), all.map(read));
  assert.deepEqual([0, 1, 2].map((index) => recording.frame(index).settings.containment), [true, false, true]);
});

test('a skin is read with the triangles of its leaves, in the place of boxes', () => {
  const skin = CLOTH.skin!;
  const bound: Articulation = {...CLOTH, skin: {...skin, inverseBind: Float32Array.from({length: 32}, (_, i) => i)}};
  const unmoved: Articulation = {...CLOTH, skin: {...skin, influenceLinks: new Uint32Array([0, 9, 0, 1, 0, 9, 0, 1])}};
  for (const cloth of [CLOTH, bound, unmoved]) {
    const contents = {...DEFINITIONS, articulations: [ARM, CRATE, cloth], frames: frames(0, 1)};
    const {articulations, problems} = readRecording(fileOf([chunkOfContents(contents)]), 'cloth.cab');
    assert.deepEqual(problems, []);
    assert.deepEqual(articulations, [ARM, CRATE, cloth]);
  }
});

test('bytes may lie anywhere in a buffer, and are a buffer too', () => {
  const file = fileOf([chunkOfContents({...DEFINITIONS, frames: frames(0, 2)})]);
  for (const offset of [0, 1, 4, 7]) {
    const bytes = new Uint8Array(file.length + offset);
    bytes.set(file, offset);
    assert.deepEqual(readRecording(bytes.subarray(offset), 'arms.cab').frame(1), read(frameOf(1)));
  }
  assert.deepEqual(readRecording(file.buffer as ArrayBuffer, 'arms.cab').frame(1), read(frameOf(1)));
});

test('definitions may come later, and count from those before', () => {
  const later = {...ARMS, slot: 7, articulation: 2, name: 'more arms'};
  const named = {...ARM, name: 'other arm'};
  const moved = frames(2, 1).map((frame) => ({
    ...frame,
    settings: {...frame.settings, rules: []},
    inputs: frame.inputs.map((input, i) => i === 0 ? {...input, batch: 3} : input),
    hits: new Uint32Array([7, 0, 7, 1, 0, 0]),
    contacts: null,
  }));
  const recording = readRecording(fileOf([chunkOfContents({...DEFINITIONS, frames: frames(0, 2)}),
                                          chunkOfContents({articulations: [named], batches: [later], frames: moved})]),
                                  'arms.cab');
  assert.deepEqual(recording.problems, []);
  assert.deepEqual(recording.articulations[2], named);
  assert.deepEqual(recording.batches[3], later);
  assert.equal(recording.frame(2).inputs[0]!.batch, 3);
});

test('what is as in the frame before is that frame\'s, in the same chunk', () => {
  const all = frames(0, 6);
  all.forEach((frame, i) => {
    const [arms, crates] = frame.inputs;
    if (i % 3 === 1) {
      Object.assign(crates!, {sameAsBefore: true});
      Object.assign(arms!, {posesAsBefore: true});
    }
    if (i % 3 === 2) Object.assign(crates!, {sameAsBefore: true, masked: new Uint32Array([1])});
  });
  const recording = readRecording(fileOf([chunkOfContents({...DEFINITIONS, frames: all.slice(0, 3)}),
                                          chunkOfContents({frames: all.slice(3)})]), 'arms.cab');
  assert.deepEqual(recording.problems, []);
  for (const index of [5, 4, 2, 1]) {
    const before = 3 * Math.floor(index / 3);
    const {inputs} = recording.frame(index), [arms, crates] = inputs;
    assert.deepEqual(crates!.poses, all[before]!.inputs[1]!.poses);
    assert.deepEqual(crates!.masked, new Uint32Array(index % 3 === 2 ? [1] : []));
    assert.deepEqual(arms!.poses, all[index % 3 === 1 ? before : index]!.inputs[0]!.poses);
    assert.deepEqual(arms!.origins, all[index]!.inputs[0]!.origins);
  }
});

test('a batch that is absent from frames is as before when it comes back', () => {
  const all = frames(0, 4);
  for (const i of [1, 2]) all[i]!.inputs.splice(1, 1);
  for (const frame of all) {
    Object.assign(frame, {hits: new Uint32Array(0), contacts: null, settings: {...frame.settings, rules: []}});
  }
  Object.assign(all[3]!.inputs[1]!, {sameAsBefore: true});
  const recording = readRecording(fileOf([chunkOfContents({...DEFINITIONS, frames: all})]), 'arms.cab');
  assert.deepEqual(recording.problems, []);
  assert.equal(recording.frame(2).inputs.length, all[3]!.inputs.length - 1);
  assert.deepEqual(recording.frame(3).inputs[1]!.poses, all[0]!.inputs[1]!.poses);
});

test('what is as before in the first frame of a chunk is refused', () => {
  for (const how of [{sameAsBefore: true}, {posesAsBefore: true}]) {
    const [first] = frames(1, 1);
    Object.assign(first!.inputs[0]!, how);
    const recording = readRecording(fileOf([chunkOfContents({...DEFINITIONS, frames: frames(0, 1)}),
                                            chunkOfContents({frames: [first!]})]), 'arms.cab');
    assert.throws(() => recording.frame(1),
                  {name: 'RecordingError', message: /chunk 1 at byte \d+: .*(in|of) this chunk/});
  }
});

test('rounded poses are the floats that C++ makes of them', () => {
  const poseStep = Math.fround(0.001);
  const values = [-32767, 32767, 12345, -1, -32768, 32767, 777];
  const poses = posesOf([...values.slice(0, 4).map((k) => k / 32767), ...values.slice(4).map((k) => k * poseStep)]);
  const frame = {...frameOf(0), settings: {...frameOf(0).settings, rules: []}, inputs: frameOf(0).inputs.slice(1)};
  frame.inputs[0]!.poses = posesOf([...poses.values, ...poses.values]);
  const header = {...HEADER, poseStep};
  const recording =
      readRecording(fileOf([chunkOfContents({...DEFINITIONS, header, frames: [frame], poseStep})]), 'arms.cab');
  const {values: floats} = recording.frame(0).inputs[0]!.poses!;
  const single = (number: number): number => new Float32Array([number])[0]!;
  for (let c = 0; c < 7; ++c) {
    assert.equal(floats[7 + c], c < 4 ? single(values[c]! / 32767) : single(values[c]! * poseStep));
  }
  assert.equal(recording.frame(0).inputs[0]!.poses!.format, 'quaternion_translation');
});

test('a level of detail has the links of what it is a level of', () => {
  const level: Articulation = {
    ...ARM,
    name: 'coarse arm',
    leaves: [],
    restPose: null,
    level: {
      of: 0,
      kind: 'reach',
      maxLeaves: 1,
      leaves: [{link: 0, box: ARM.leaves[0]!.box, links: [0, 1]}],
      restPoses: posesOf([...ARM.restPose!.values, ...ARM.restPose!.values]),
      restPoseCount: 2,
      jointPlay: 0.5,
    },
  };
  const recording = readRecording(
      fileOf([chunkOfContents({...DEFINITIONS, articulations: [ARM, CRATE, level]})]), 'arms.cab');
  const expected = {...level, leaves: [{link: 0, box: ARM.leaves[0]!.box, parts: [], triangles: NONE}]};
  assert.deepEqual(recording.articulations[2], expected);
});

test('links without names are numbered', () => {
  const recording = readRecording(
      fileOf([chunkOfContents({...DEFINITIONS, articulations: [{...ARM, linkNames: []}, CRATE]})]), 'arms.cab');
  assert.deepEqual(recording.articulations[0]!.linkNames, ['link 0', 'link 1']);
});

test('chunks that zstd compressed are read', () => {
  // Eight frames of the scene in two chunks, by zstd -19.
  const recording = readRecording(fixture('arms_zstd.cab'), 'arms_zstd.cab');
  assert.deepEqual(recording.problems, []);
  assert.deepEqual(recording.articulations, [ARM, CRATE]);
  assert.equal(recording.frameCount, 8);
  for (let index = 0; index < 8; ++index) assert.deepEqual(recording.frame(index), read(frameOf(index)));
});
