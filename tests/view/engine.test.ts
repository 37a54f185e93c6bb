// Frames that the page's engine runs again: hits that are worked out here, the same bits by every instruction set, and
// what a dial changes.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {load} from 'cab-collision';
import type {Isa} from 'cab-collision';
import {createEngine} from '../../perf/view/src/engine/engine.js';
import {Fnv1a, hashOfHits} from '../../perf/view/src/engine/fnv1a.js';
import {isRefusal} from '../../perf/view/src/engine/recorded_world.js';
import type {EngineInPage} from '../../perf/view/src/engine/types.js';
import {readRecording} from '../../perf/view/src/recording/reader.js';
import type {Articulation, Batch, Input, Recording, Settings} from '../../perf/view/src/recording/types.js';
import {fixture} from './fixture.js';
import {
  ARM, armPoses, boxOf, CLOTH, CLOTHS, CRATE, CRATES, DEFINITIONS, HEADER, inputOf, NO_STATS, NONE, Numbers, POLICIES,
  posesOf, SETTINGS,
} from './scene.js';
import type {Contents, WrittenFrame} from './write_recording.js';
import {chunkOfContents, fileOf} from './write_recording.js';

const MODULES_AT = new URL('../engine_package/', import.meta.url);

const MODULES = {
  wasm128: new WebAssembly.Module(readFileSync(new URL('cab_simd.wasm', MODULES_AT))),
  scalar: new WebAssembly.Module(readFileSync(new URL('cab_scalar.wasm', MODULES_AT))),
};

/** The ways to run: both modules, and both instruction sets of the one with SIMD. */
const WAYS: readonly {module: WebAssembly.Module; isa: Isa}[] = [
  {module: MODULES.wasm128, isa: 'wasm128'}, {module: MODULES.wasm128, isa: 'scalar'},
  {module: MODULES.scalar, isa: 'scalar'},
];

const engineOf = (recording: Recording): Promise<EngineInPage> => createEngine(recording, WAYS[0]!);

const frameOf = (index: number, settings: Settings, inputs: Input[]): WrittenFrame =>
    ({index, time: index, settings, inputs, hits: new Uint32Array(0), contacts: null, hash: 0n, stats: NO_STATS});

const recordingOf = (contents: Contents, ...more: Contents[]): Recording =>
    readRecording(fileOf([contents, ...more].map((chunk) => chunkOfContents(chunk))), 'scene.cab');

// Two crates, half a length apart along x, whose tetrahedra are apart though their boxes overlap.
const CRATE_PAIR = inputOf(1, {
  poses: posesOf([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]), origins: new Float64Array([0, 0, 0, 0.25, 0.75, 0.25]),
});

const crates = (settings: Partial<Settings>, inputs: Input[] = [CRATE_PAIR]): Recording => recordingOf({
  ...DEFINITIONS,
  frames: [frameOf(0, {...SETTINGS, rules: [{a: 1, b: 1, pairing: 'between'}], ...settings}, inputs)],
});

const exactly = (policies: Partial<typeof POLICIES>): typeof POLICIES => ({...POLICIES, ...policies});

// Many arms of many links, one standing over each field of a square, and crates among them.
const LINKS = 12;
const CHAIN: Articulation = {
  ...ARM,
  name: 'chain',
  linkNames: [],
  linkParents: Int16Array.from({length: LINKS}, (_, link) => link - 1),
  linkJoints: new Float32Array(3 * LINKS),
  leaves: Array.from({length: LINKS},
                     (_, link) => ({link, box: boxOf([0.25, 0, 0], [0.25, 0.125, 0.125]), parts: [], triangles: NONE})),
  ignoredPairs: new Uint16Array(0),
  restPose: null,
};
const CHAINS: Batch =
    {slot: 5, articulation: 0, instanceCount: 36, name: 'chains', instanceNames: [], staticBodies: null};

function chainPoses(numbers: Numbers): Float32Array {
  const values = new Float32Array(7 * LINKS * CHAINS.instanceCount);
  for (let instance = 0; instance < CHAINS.instanceCount; ++instance) {
    let angle = 0, x = 0, y = 0;
    for (let link = 0; link < LINKS; ++link) {
      angle += numbers.next() / 2;
      values.set([0, 0, Math.sin(angle), Math.cos(angle), x, y, 0], 7 * (LINKS * instance + link));
      x += 0.5 * Math.cos(2 * angle);
      y += 0.5 * Math.sin(2 * angle);
    }
  }
  return values;
}

function crowd(policies: Partial<typeof POLICIES> = {}): Recording {
  const numbers = new Numbers(3);
  const settings: Settings = {
    ...SETTINGS, policies: exactly(policies),
    rules: [{a: 0, b: 0, pairing: 'between'}, {a: 0, b: 1, pairing: 'between'}, {a: 0, b: 0, pairing: 'within'}],
    contacts: policies.exact === 'convex',
  };
  const frames = [0, 1, 2].map((index) => frameOf(index, settings, [
    inputOf(0, {
      poses: posesOf(chainPoses(numbers)),
      origins: Float64Array.from({length: 3 * CHAINS.instanceCount},
                                 (_, i) => [1.5 * (i / 3 % 6), 1.5 * Math.floor(i / 18), 0][i % 3]!),
    }),
    inputOf(1, {
      poses: posesOf([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]), origins: new Float64Array([2, 2, 0, 4, 4, 0]),
    }),
  ]));
  return recordingOf({
    header: HEADER, articulations: [CHAIN, CRATE], batches: [CHAINS, {...CRATES, slot: 4000}], frames,
  });
}

// Pairs of instances in hits.
const instancesOf = (hits: Uint32Array): Set<string> => {
  const pairs = new Set<string>();
  for (let at = 0; at < hits.length; at += 6) pairs.add(hits.subarray(at, at + 4).join(' '));
  return pairs;
};

// The words of the two sides of a hit's links.
const linkPairsOf = (hits: Uint32Array): Set<string> => {
  const pairs = new Set<string>();
  for (let at = 0; at < hits.length; at += 6) pairs.add(hits.subarray(at, at + 5).join(' '));
  return pairs;
};

test('FNV-1a is that of its authors, in any pieces', () => {
  const hashOf = (...texts: string[]): string => {
    const hash = new Fnv1a();
    for (const text of texts) hash.add(new TextEncoder().encode(text));
    return hash.hash.toString(16);
  };
  assert.equal(hashOf(), 'cbf29ce484222325');
  assert.equal(hashOf('a'), 'af63dc4c8601ec8c');
  assert.equal(hashOf('foobar'), '85944171f73967e8');
  assert.equal(hashOf('foo', '', 'bar'), '85944171f73967e8');
  const bytes = new Uint8Array(1000);
  const numbers = new Numbers(8);
  let expected = 0xcbf29ce484222325n;
  for (let i = 0; i < bytes.length; ++i) {
    bytes[i] = numbers.below(256);
    expected = BigInt.asUintN(64, (expected ^ BigInt(bytes[i]!)) * 0x100000001b3n);
  }
  const hash = new Fnv1a();
  hash.add(bytes);
  assert.equal(hash.hash, expected);
});

test('links that touch are hits with the slots of the recording, by every instruction set', async () => {
  const rules: Settings['rules'] = [{a: 0, b: 0, pairing: 'between'}, {a: 0, b: 2, pairing: 'between'}];
  const settings = {...SETTINGS, rules};
  const arms = inputOf(0, {
    // The first arm is bent upwards, the others are straight; the third is far away.
    poses: posesOf([0, 0, 0, 1, 0, 0, 0, 0, 0, 0.7071068, 0.7071068, 1, 0, 0,
                    0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]),
    origins: new Float64Array([0, -3, 0, 0.6, -2.5, 0, -90, -3, 0]),
  });
  const recording = recordingOf({...DEFINITIONS, frames: [frameOf(0, settings, [arms, inputOf(2)])]});
  for (const way of WAYS) {
    const engine = await createEngine(recording, way);
    assert.equal(engine.isa, way.isa);
    const {hits, contacts, hash, notes} = engine.run(recording.frame(0), {});
    assert.deepEqual([...hits], [3, 0, 3, 1, 1, 1]);
    assert.equal(contacts, null);
    assert.equal(hash, hashOfHits(new Uint32Array([3, 0, 3, 1, 1, 1]), null));
    assert.deepEqual(notes, []);
    const onFloor = {...recording.frame(0), inputs: [{...arms, origins: new Float64Array(9).fill(-0.5)}, inputOf(2)]};
    const {hits: below} = engine.run(onFloor, {});
    assert.ok(instancesOf(below).has('2 0 3 0'), 'the floor has the lower slot');
    engine.destroy();
  }
});

test('a recording of another machine has the same bits here', async () => {
  // Written by `cab record` with AVX-512.
  const recording = readRecording(fixture('avx512.cab'), 'avx512.cab');
  assert.equal(recording.header.isa, 'avx512');
  assert.deepEqual(recording.problems, []);
  // How many boxes an engine tests is its own choice, and no part of the answer; all instruction sets make the same.
  const boxTests: number[][] = [];
  for (const way of WAYS) {
    const engine = await createEngine(recording, way);
    let hits = 0;
    boxTests.push([]);
    for (let index = 0; index < recording.frameCount; ++index) {
      const frame = recording.frame(index), result = engine.run(frame, {});
      hits += result.hits.length / 6;
      assert.equal(result.hash, frame.hash, `frame ${index}`);
      assert.deepEqual(result.hits, frame.hits);
      assert.deepEqual(result.contacts, frame.contacts);
      assert.ok(result.contacts !== null || result.hits.length === 0);
      assert.deepEqual(result.notes, []);
      const {leafPairs, exactTests, falsePositives} = frame.stats;
      assert.deepEqual([result.leafPairs, result.exactTests, result.falsePositives],
                       [leafPairs, exactTests, falsePositives]);
      boxTests.at(-1)!.push(result.boxTests);
    }
    assert.ok(hits > 100, `${hits}`);
    engine.destroy();
  }
  for (const counts of boxTests) assert.deepEqual(counts, boxTests[0]);
});

test('all that an input may have is given to the engine', async () => {
  const recording = recordingOf({
    ...DEFINITIONS,
    frames: [frameOf(0, SETTINGS, [
      inputOf(0, {poses: posesOf(armPoses(3, new Numbers(1)))}), CRATE_PAIR, inputOf(2),
    ])],
  });
  const engine = await engineOf(recording);
  const count = (more: Partial<Input>, settings: Partial<Settings> = {}): number => {
    const frame = recording.frame(0);
    const rules: Settings['rules'] = [{a: 1, b: 1, pairing: 'between'}];
    return engine.run({...frame, settings: {...frame.settings, rules, ...settings},
                       inputs: [{...CRATE_PAIR, ...more}]}, {}).hits.length / 6;
  };
  const far = {origins: new Float64Array([0, 0, 0, 3, 0, 0])};
  assert.equal(count({}), 1);
  assert.equal(count({layers: new Uint32Array([1, 2]), layerMasks: new Uint32Array([1, 2])}), 0);
  assert.equal(count({count: 1}), 0);
  assert.equal(count({count: 0}), 0);
  assert.equal(count({instances: new Uint32Array([1])}), 0);
  assert.equal(count(far), 0);
  assert.equal(count({...far, scales: new Float32Array([1, 5])}), 1);
  assert.equal(count({...far, margins: new Float32Array([2, 0])}), 1);
  assert.equal(count(far, {margin: 2}), 1);
  assert.equal(count({origins: null}), 1);
  const turned = new Float32Array([0, 0, 0, 1, 0, 0, 0.38268343, 0.92387953]);
  const apart = {origins: new Float64Array([0, 0, 0, 1.1, 0, 0])};
  assert.deepEqual([count(apart), count({...apart, orientations: turned})], [0, 1]);
  const rows = posesOf([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 0, 0, 5, 0, 0, 0, 0, 5, 0], 'matrix3x4_rows');
  assert.equal(count({...far, poses: {...rows, hasScale: true}}), 1);
  assert.equal(count({}), 1);
  assert.equal(count({poses: posesOf([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0])}), 0, 'a pose that is none is masked');
  engine.destroy();
});

test('batches that take the place of others are added where a frame needs them', async () => {
  const rules: Settings['rules'] = [{a: 1, b: 1, pairing: 'between'}];
  const later = {...CRATES, instanceCount: 4};
  const four = inputOf(3, {
    poses: posesOf(Array.from({length: 4}, () => [0, 0, 0, 1, 0, 0, 0]).flat()),
    origins: new Float64Array([0, 0, 0, 0.9, 0, 0, 1.8, 0, 0, 2.7, 0, 0]),
  });
  const recording = recordingOf(
      {...DEFINITIONS, frames: [frameOf(0, {...SETTINGS, rules}, [CRATE_PAIR])]},
      {batches: [later], frames: [frameOf(1, {...SETTINGS, rules: [{a: 3, b: 3, pairing: 'between'}]}, [four])]});
  const engine = await engineOf(recording);
  for (const index of [0, 1, 1, 0, 1]) {
    assert.equal(engine.run(recording.frame(index), {}).hits.length / 6, index === 0 ? 1 : 3);
  }
  assert.equal(engine.boxes(recording.frame(1), 3, {}).values.length, 4 * 15);
  engine.destroy();
});

test('the exact test drops what boxes alone report, and falsePositives says what', async () => {
  const recording = crates({policies: exactly({exact: 'convex'}), contacts: true});
  const engine = await engineOf(recording), frame = recording.frame(0);
  const result = engine.run(frame, {});
  assert.equal(result.hits.length, 0);
  assert.deepEqual([result.exactTests, result.falsePositives], [1, 1]);
  assert.deepEqual([...engine.falsePositives(frame, {})], [1, 0, 1, 1, 0, 0]);
  const byBoxes = engine.run(frame, {exact: 'none'});
  assert.equal(byBoxes.hits.length, 6);
  assert.equal(byBoxes.contacts, null);
  assert.deepEqual(byBoxes.notes, ['Without an exact test there are no contacts.']);
  const byMargin = engine.run(frame, {margin: 1});
  assert.equal(byMargin.contacts!.length, 11);
  assert.ok(byMargin.contacts![3]! < 0, 'apart');
  assert.deepEqual([...engine.falsePositives(frame, {margin: 1})], []);
  const none = crates({});
  assert.deepEqual([...engine.falsePositives(none.frame(0), {})], [1, 0, 1, 1, 0, 0]);
  engine.destroy();
});

// The poses of two cloths of two links each, the second cloth 2 farther along z.
const clothPoses = (rotation: number[], y: number, z: number): ReturnType<typeof posesOf> => posesOf(
  [0, 0, 2, 2].flatMap((along) => [...rotation, 0, y, z + along]));

// The second cloth stands on edge across the middle of the first, or far away.
const cloths = (settings: Partial<Settings>, away = 0): Recording => recordingOf({
  header: HEADER, articulations: [CLOTH], batches: [CLOTHS, {...CLOTHS, slot: 2}],
  frames: [frameOf(0, {...SETTINGS, rules: [{a: 0, b: 1, pairing: 'between'}], ...settings}, [
    inputOf(0, {poses: clothPoses([0, 0, 0, 1], 0, away)}),
    inputOf(1, {poses: clothPoses([Math.SQRT1_2, 0, 0, Math.SQRT1_2], 0.5, -0.5)}),
  ])],
});

test('triangles of skins that touch are named by their hits, by every instruction set', async () => {
  for (const way of WAYS) {
    const recording = cloths({policies: exactly({exact: 'surface'})});
    const engine = await createEngine(recording, way);
    const frame = recording.frame(0);
    const {hits} = engine.run(frame, {});
    // Slot 2 stands before slot 7, and is the upright one.
    assert.deepEqual([...hits], [2, 0, 7, 0, 0, 0, 2, 1, 7, 1, 0, 0]);
    const all = [[0, 0], [0, 1], [1, 0], [1, 1]];
    assert.deepEqual([...engine.touchingTriangles(frame, hits)],
                     [0, 1].flatMap((hit) => all.flatMap(([a, b]) => [hit, 0, a!, b!])));
    assert.deepEqual([...engine.touchingTriangles(frame, hits.subarray(6))], all.flatMap(([a, b]) => [0, 0, a!, b!]));
    assert.equal(engine.touchingTriangles(frame, new Uint32Array(0)).length, 0);
    engine.destroy();
  }
});

test('a skin is tested by its triangles, whatever else the dial says, and has no levels', async () => {
  const recording = cloths({policies: exactly({exact: 'none'})}, 0.6);
  const engine = await engineOf(recording), frame = recording.frame(0);
  const boxes = engine.run(frame, {}).hits;
  const asConvex = engine.run(frame, {exact: 'convex'});
  assert.match(asConvex.notes.join(' '), /surface takes the place of convex/);
  assert.deepEqual([...asConvex.hits], [...engine.run(frame, {exact: 'surface'}).hits]);
  assert.equal(engine.falsePositives(frame, {}).length, boxes.length - asConvex.hits.length);
  const level = engine.run(frame, {levelLeaves: 1});
  assert.match(level.notes.join(' '), /cloth\) has a skin, which has no levels/);
  assert.deepEqual([...level.hits], [...boxes]);
  engine.destroy();
});

// A closed skin about the origin, 8 long along each axis. Each of its six sides is a leaf.
const ROOM: Articulation = {
  ...CRATE,
  name: 'room',
  leaves: [1, 2, 4].flatMap((bit) => {
    const [across, up] = [bit === 4 ? 1 : 2 * bit, bit === 1 ? 4 : bit / 2];
    return [[0, up, across], [bit, across, up]].map(([at, a, b]) => ({
      link: 0, box: boxOf([0, 0, 0], [0, 0, 0]), parts: [],
      triangles: new Uint32Array([at!, at! + a!, at! + b!, at! + a!, at! + a! + b!, at! + b!]),
    }));
  }),
  skin: {
    // Bits 1, 2 and 4 of a vertex's number say on which side it is along x, y and z.
    vertices: Float32Array.from({length: 24}, (_, i) => (Math.floor(i / 3) >> i % 3) % 2 === 1 ? 4 : -4),
    influenceCount: 1,
    influenceLinks: new Uint32Array(8),
    influenceWeights: new Float32Array(8).fill(1),
    inverseBind: null,
  },
};

test('what is wholly inside a skin is a hit as it was recorded, and hides no false positive', async () => {
  const batches = [{...CRATES, articulation: 0, instanceCount: 3}, {...CRATES, slot: 7, instanceCount: 1}];
  // A crate in the middle of the room, one through its wall, and one whose box alone reaches the wall, from outside.
  const inputs = [
    inputOf(0, {
      poses: posesOf([0, 1, 2].flatMap(() => [0, 0, 0, 1, 0, 0, 0])),
      origins: new Float64Array([0, 0, 0, 4, 0, 0, 0, 4.25, 0]),
    }),
    inputOf(1, {poses: posesOf([0, 0, 0, 1, 0, 0, 0])}),
  ];
  for (const containment of [true, false]) {
    const settings: Settings = {
      ...SETTINGS, policies: exactly({exact: 'surface'}), containment, rules: [{a: 0, b: 1, pairing: 'between'}],
    };
    const recording =
        recordingOf({header: HEADER, articulations: [CRATE, ROOM], batches, frames: [frameOf(0, settings, inputs)]});
    const engine = await engineOf(recording), frame = recording.frame(0);
    const inside = containment ? ['1 0 7 0'] : [];
    assert.deepEqual(instancesOf(engine.run(frame, {}).hits), new Set([...inside, '1 1 7 0']));
    assert.deepEqual(instancesOf(engine.run(frame, {exact: 'none'}).hits), new Set(['1 1 7 0', '1 2 7 0']));
    assert.deepEqual(instancesOf(engine.falsePositives(frame, {})), new Set(['1 2 7 0']));
    engine.destroy();
  }
});

test('distances and a least depth are run as they were recorded', async () => {
  const recording =
      crates({policies: exactly({exact: 'convex'}), contacts: true, report: 'distances', margin: 2, minDepth: 0});
  const engine = await engineOf(recording);
  const distances = engine.run(recording.frame(0), {});
  assert.deepEqual([distances.hits.length, distances.contacts!.length], [6, 11]);
  assert.deepEqual(engine.run(recording.frame(0), {exact: 'none'}).notes,
                   ['Without an exact test there are no distances: all links within the margin are reported.']);
  const inside = inputOf(1, {...CRATE_PAIR, origins: new Float64Array([0, 0, 0, 0.25, 0, 0])});
  const deep = crates({policies: exactly({exact: 'convex'}), minDepth: 0.001}, [inside]);
  assert.equal(engine.run(deep.frame(0), {}).hits.length, 6);
  const deeper = crates({policies: exactly({exact: 'convex'}), minDepth: 1}, [inside]);
  assert.equal(engine.run(deeper.frame(0), {}).hits.length, 0);
  assert.equal(engine.run(deeper.frame(0), {exact: 'none'}).hits.length, 6);
  engine.destroy();
});

test('what was recorded with FCL is run with convex, and the result says so', async () => {
  const recording = crates({policies: exactly({exact: 'fcl'})});
  const engine = await engineOf(recording);
  const {hits, notes} = engine.run(recording.frame(0), {});
  assert.equal(hits.length, 0);
  assert.match(notes.join(), /fcl is not in this page: convex takes its place/);
  engine.destroy();
});

test('every policy gives the same link pairs by boxes, and the same bits by every instruction set', async () => {
  const recording = crowd();
  const dials = [
    {}, {refit: 'best3'}, {refit: 'covariance', strategy: 'tree'}, {strategy: 'rows'}, {strategy: 'brute'},
    {extents: 'leaves', strategy: 'tree'}, {strategy: 'links', margin: 0},
  ];
  const hashes: bigint[][] = [];
  for (const way of WAYS) {
    const engine = await createEngine(recording, way);
    hashes.push(dials.map((dial) => {
      const frame = recording.frame(1);
      const {hits, hash} = engine.run(frame, dial);
      assert.ok(hits.length > 600, `${hits.length}`);
      assert.deepEqual(linkPairsOf(hits), linkPairsOf(engine.run(frame, {}).hits));
      return hash;
    }));
    const faces = engine.run(recording.frame(1), {sat: 'faces_6', margin: 0.125});
    assert.ok(faces.hits.length > engine.run(recording.frame(1), {sat: 'faces_6'}).hits.length);
    engine.destroy();
  }
  assert.deepEqual(hashes[1], hashes[0]);
  assert.deepEqual(hashes[2], hashes[0]);
});

test('a level of detail reports every two instances that touch, with an exact test and without', async () => {
  for (const exact of ['none', 'convex']) {
    const recording = crowd({exact});
    const engine = await engineOf(recording);
    for (let index = 0; index < recording.frameCount; ++index) {
      const frame = recording.frame(index);
      const full = engine.run(frame, {}), coarse = engine.run(frame, {levelLeaves: 3});
      const pairs = instancesOf(coarse.hits);
      for (const pair of instancesOf(full.hits)) {
        const [slotA, instanceA, slotB, instanceB] = pair.split(' ');
        // Links that one leaf stands for are not reported against each other.
        if (slotA !== slotB || instanceA !== instanceB) assert.ok(pairs.has(pair), pair);
      }
      assert.match(coarse.notes.join('\n'),
                   /Articulation 0 \(chain\) has boxes that hold whatever its links can reach/);
      assert.match(coarse.notes.join('\n'), /Articulation 1 \(crate\) has 1 leaves, and stays as it is/);
      assert.deepEqual(full.notes, []);
      assert.equal(engine.run(frame, {}).hash, full.hash);
    }
    const boxes = engine.boxes(recording.frame(0), 0, {levelLeaves: 3});
    assert.deepEqual([boxes.leafCount, boxes.nodeCount], [3, 5]);
    assert.equal(engine.merges(0, {levelLeaves: 3}).length, 2);
    assert.equal(engine.merges(0, {levelLeaves: 5}).length, 4);
    engine.destroy();
  }
});

test('a level of nodes takes the place of one that cannot be, without an exact test', async () => {
  // Two trees need two boxes at least.
  const trees = {...CHAIN, linkParents: Int16Array.from({length: LINKS}, (_, link) => link === 6 ? -1 : link - 1)};
  const recording = recordingOf({
    header: HEADER, articulations: [trees, CRATE], batches: [CHAINS, {...CRATES, slot: 4000}],
    frames: [crowd({exact: 'convex'}).frame(0)],
  });
  const engine = await engineOf(recording);
  const {hits, contacts, notes} = engine.run(recording.frame(0), {levelLeaves: 1});
  assert.ok(hits.length > 0);
  assert.equal(contacts, null);
  assert.match(notes.join('\n'), /can have no boxes that are fixed to links: max_leaves/);
  assert.match(notes.join('\n'), /has nodes of its hierarchy/);
  assert.match(notes.join('\n'), /A level of nodes has no shapes, so there is no exact test/);
  assert.equal(engine.falsePositives(recording.frame(0), {levelLeaves: 1}).length, 0);
  engine.destroy();
});

test('recorded levels of detail are added to the world', async () => {
  const level = (kind: 'reach' | 'nodes'): Articulation => ({
    ...CHAIN, name: kind, leaves: [], level: {
      of: 0, kind, maxLeaves: 2, leaves: [],
      restPoses: kind === 'nodes' ? null : posesOf(chainPoses(new Numbers(1)).subarray(0, 7 * LINKS)),
      restPoseCount: kind === 'nodes' ? 0 : 1, jointPlay: 0.01,
    },
  });
  const recording = recordingOf({
    header: HEADER,
    articulations: [CHAIN, level('reach'), level('nodes')],
    batches: [{...CHAINS, articulation: 1}, {...CHAINS, slot: 6, articulation: 2}],
    frames: [frameOf(0, {...SETTINGS, rules: [{a: 0, b: 1, pairing: 'between'}]},
                     [0, 1].map((batch) => inputOf(batch, {poses: posesOf(chainPoses(new Numbers(1)))})))],
  });
  const engine = await engineOf(recording), frame = recording.frame(0);
  const {hits, notes} = engine.run(frame, {});
  assert.ok(instancesOf(hits).size > 36);
  assert.deepEqual(notes, []);
  assert.deepEqual([0, 1].map((batch) => engine.boxes(frame, batch, {}).leafCount), [2, 2]);
  assert.match(engine.run(frame, {levelLeaves: 1}).notes.join('\n'), /was recorded as a level of detail/);
  engine.destroy();
});

test('boxes and merges are those of the hierarchy', async () => {
  const recording = crowd();
  const engine = await engineOf(recording);
  const {nodeCount, leafCount, values} = engine.boxes(recording.frame(0), 0, {});
  assert.deepEqual([nodeCount, leafCount, values.length],
                   [2 * LINKS - 1, LINKS, 15 * (2 * LINKS - 1) * CHAINS.instanceCount]);
  const steps = engine.merges(0, {});
  assert.equal(steps.length, LINKS - 1);
  assert.deepEqual(new Set(steps.flatMap(({left, right}) => [left, right])).size, 2 * LINKS - 2);
  const level = recordingOf({...DEFINITIONS, frames: [frameOf(0, {...SETTINGS, rules: []}, [inputOf(2)])]});
  const floor = await engineOf(level);
  assert.equal(floor.boxes(level.frame(0), 2, {}).nodeCount, 0);
  assert.deepEqual(floor.merges(2, {}), []);
  floor.destroy();
  engine.destroy();
});

test('what the engine refuses is an error that names what it is about, and the next frame runs', async () => {
  const crooked = {...CRATE, leaves: [{...CRATE.leaves[0]!, box: boxOf([0, 0, 0], [1, -1, 1])}]};
  const recording = recordingOf({
    ...DEFINITIONS, articulations: [ARM, crooked],
    frames: [frameOf(0, {...SETTINGS, rules: []}, [CRATE_PAIR]), frameOf(1, {...SETTINGS, rules: []}, [inputOf(2)])],
  });
  const engine = await engineOf(recording);
  for (let i = 0; i < 2; ++i) {
    assert.throws(() => engine.run(recording.frame(0), {}), /articulation 1 crate: box of a leaf .* \(element 0\)/);
    assert.equal(engine.run(recording.frame(1), {}).hits.length, 0);
  }
  assert.throws(() => engine.run(recording.frame(1), {refit: 'guess'}), /Policies.refit is 'guess'/);
  assert.throws(() => engine.run(recording.frame(1), {margin: -1}), /margin/);
  // Nothing is shown then. An error of the page itself must not look like that.
  for (const refused of [() => engine.touchingTriangles(recording.frame(0), NONE),
                         () => engine.run(recording.frame(1), {margin: -1})]) {
    assert.throws(refused, isRefusal);
  }
  assert.equal(isRefusal(new TypeError('of the page')), false);
  engine.destroy();
});

test('the version is that of the module', async () => {
  const engine = await engineOf(crowd());
  assert.equal(engine.version, (await load({module: MODULES.wasm128})).version);
  engine.destroy();
});
