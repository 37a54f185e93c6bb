// What the page works out from a recording: which frame is due, which pairs touch when, which boxes a level has, which
// axis points up, and what two hashes say.
import assert from 'node:assert/strict';
import test from 'node:test';
import type {Frame, Recording} from '../../perf/view/src/recording/types.js';
import {Bounds} from '../../perf/view/src/scene/bounds.js';
import {hierarchyOf} from '../../perf/view/src/scene/hierarchy.js';
import {CHARACTERS, COLORS} from '../../perf/view/src/scene/colors.js';
import {placeBoxes} from '../../perf/view/src/scene/label_places.js';
import {upAxis} from '../../perf/view/src/scene/up_axis.js';
import {ContactIndex, contactOfPair, intervalAt} from '../../perf/view/src/ui/contact_index.js';
import {changed, firstDifference, hasMargin, isAsRecorded, verdictOf} from '../../perf/view/src/ui/dial_state.js';
import {depthText} from '../../perf/view/src/ui/format.js';
import {markersOf} from '../../perf/view/src/ui/markers.js';
import {Names} from '../../perf/view/src/ui/names.js';
import {Player} from '../../perf/view/src/ui/player.js';
import {ARM, ARMS, CRATE, CRATES, HEADER, inputOf, NO_STATS, Numbers, SETTINGS} from './scene.js';

// Words of the hits of two pairs of links.
const CRATE_ARM = [1, 0, 3, 1, 0x10000, 0];
const ARM_ARM = [3, 0, 3, 2, 0x10001, 0];
const contactOf = (depth: number): number[] => [0, 0, 1, depth, 0, 0, 0, 0, 0, 0, 0];

const ORIGINS = new Float64Array([1, -2, 4, 0, 0, 0]);

/** Frames of these hits, with depths if there are any. Null: a frame that cannot be read. */
function recordingOf(hits: readonly (readonly (readonly number[])[] | null)[],
                     depths: readonly (readonly number[])[] = []): Recording {
  return {
    header: HEADER, articulations: [ARM, CRATE], batches: [ARMS, CRATES], frameCount: hits.length, problems: [],
    frame(index: number): Frame {
      const words = hits[index];
      if (!words) throw new Error('damaged');
      return {
        index, time: index / 32, settings: SETTINGS, inputs: [inputOf(0), inputOf(1, {origins: ORIGINS})], hash: 1n,
        stats: NO_STATS,
        hits: Uint32Array.from(words.flat()),
        contacts: depths[index] ? Float32Array.from(depths[index].flatMap(contactOf)) : null,
      };
    },
  };
}

async function indexOf(recording: Recording): Promise<ContactIndex> {
  const index = new ContactIndex(recording);
  await index.scan(() => undefined, new AbortController().signal);
  return index;
}

test('pairs have intervals, and their deepest frame', async () => {
  const index = await indexOf(recordingOf([[], [CRATE_ARM], [CRATE_ARM, ARM_ARM], [], [CRATE_ARM], null, [CRATE_ARM]],
                                          [[], [0.1], [0.3, 0.2], [], [0.25], [], [0.1]]));
  assert.deepEqual([...index.hitsPerFrame], [0, 1, 2, 0, 1, 0, 1]);
  assert.deepEqual([...index.damaged], [0, 0, 0, 0, 0, 1, 0]);
  const [first, second] = index.pairs;
  assert(first && second);
  assert.deepEqual([first.batchA, first.batchB], [1, 0], 'slots are named by their batches');
  assert.deepEqual(first.intervals, [1, 2, 4, 4, 6, 6]);
  assert.deepEqual(first.worst.map(({frame}) => frame), [2, 4, 6]);
  assert.deepEqual([0, 1, 3, 6].map((frame) => intervalAt(first, frame)),
                   [null, {first: 1, last: 2}, null, {first: 6, last: 6}]);
  assert.equal(index.pairOf(first.batchA, first.hit, first.batchB), first);
  assert.equal(index.pairOf(0, first.hit, first.batchB), undefined);
  assert.equal(first.frames, 4);
  assert.equal(first.worstFrame, 2);
  assert(Math.abs(first.worstDepth! - 0.3) < 1e-6);
  assert.deepEqual(second.intervals, [2, 2]);
  assert.deepEqual([0, 1, 2, 6].map((frame) => index.contactFrom(frame, true)), [1, 2, 4, -1]);
  assert.deepEqual([0, 2, 6].map((frame) => index.contactFrom(frame, false)), [-1, 1, 4]);
  assert.deepEqual([1, 5, 6].map((frame) => contactOfPair(first, frame, true)), [4, 6, -1]);
  assert.deepEqual([1, 5].map((frame) => contactOfPair(first, frame, false)), [-1, 4]);
});

test('without contacts no depth is known', async () => {
  const [pair] = (await indexOf(recordingOf([[ARM_ARM]]))).pairs;
  assert.equal(pair?.worstDepth, null);
});

test('reading all frames can be stopped', async () => {
  const stop = new AbortController();
  stop.abort();
  const index = new ContactIndex(recordingOf([[ARM_ARM]]));
  await index.scan(() => undefined, stop.signal);
  assert.deepEqual(index.pairs, []);
});

test('frames are played at the speed of the recording', () => {
  let shown = 0;
  const player = new Player(100, 1, () => ++shown);
  player.play();
  player.tick(performance.now() + 10500);
  assert.equal(player.frame, 10, 'frames between are dropped');
  player.setSpeed(4);
  player.tick(performance.now() + 10125);
  assert.equal(player.frame, 50);
  player.tick(performance.now() + 600125);
  assert.equal(player.frame, 10, 'it begins again, as often as it is due');
  player.goTo(1000);
  assert.equal(player.frame, 99);
  player.goTo(Number.NaN);
  assert.equal(player.frame, 0);
  player.step(-1);
  assert.equal(player.playing, false);
  assert.equal(player.frame, 0);
  assert(shown > 4);
});

test('a recording that is shorter than a picture takes moves', () => {
  const player = new Player(8, 1 / 64, () => undefined);
  player.setTimes(Float64Array.from({length: 8}, (_, i) => 5 + i / 64));
  player.play();
  const began = performance.now(), shown = new Set<number>();
  for (let picture = 1; picture <= 8; ++picture) {
    player.tick(began + 7.8125 + 1015.625 * picture);  // half a frame, and then by 65 frames
    shown.add(player.frame);
  }
  assert.equal(shown.size, 8);
});

test('frames are played by their times, if these rise', () => {
  const player = new Player(4, 0.1, () => undefined);
  player.setTimes(Float64Array.from([0, 1, 1, 2]));
  assert.equal(player.timeOf(3), 3 * 0.1, 'equal times are not used');
  player.setTimes(Float64Array.from([0, 10, 30, 70]));
  assert.equal(player.timeOf(2), 30);
  player.play();
  const began = performance.now();
  player.tick(began + 29000);
  assert.equal(player.frame, 1);
  player.tick(began + 31000);
  assert.equal(player.frame, 2);
});

test('levels of a tree count from its root', () => {
  const {levels, depth} = hierarchyOf([{left: 0, right: 1}, {left: 3, right: 2}], 3);
  assert.deepEqual([...levels], [3, 3, 2, 2, 1]);
  assert.equal(depth, 3);
  assert.deepEqual([...hierarchyOf([], 1).levels], [1]);
});

test('up is what the recording says, or where characters are tall', () => {
  const boundsOf = (x: number, y: number, z: number): Bounds => {
    const bounds = new Bounds();
    bounds.addPoint(0, 0, 0);
    bounds.addPoint(x, y, z);
    return bounds;
  };
  const unknown = {...HEADER, up: ''} as const;
  const wide = boundsOf(30, 2, 30);
  assert.equal(upAxis(HEADER, [], wide), 2);
  assert.equal(upAxis({...HEADER, up: 'x'}, [], wide), 0);
  assert.equal(upAxis(unknown, [boundsOf(1, 2, 0.5)], boundsOf(30, 30, 2)), 1);
  assert.equal(upAxis(unknown, [boundsOf(1, 0.5, 2)], wide), 2);
  assert.equal(upAxis(unknown, [wide, wide, wide, wide], wide), 1);
});

test('a dial with nothing set is as recorded', () => {
  const dial = changed({refit: 'cab'}, {margin: 1});
  assert.deepEqual(dial, {refit: 'cab', margin: 1});
  assert.equal(isAsRecorded(changed(dial, {refit: undefined, margin: undefined})), true);
  assert.equal(isAsRecorded(dial), false);
});

test('links that are apart may be hits with a margin: of the frame, of an instance or of the dial', () => {
  const frame = recordingOf([[]]).frame(0);
  const near = {...frame, settings: {...SETTINGS, margin: 0.5}};
  const ofInstance = (margin: number): Frame =>
    ({...frame, inputs: [inputOf(0, {margins: new Float32Array([0, margin])}), inputOf(1)]});
  assert.deepEqual([frame, near, ofInstance(0), ofInstance(0.5)].map((one) => hasMargin(one, {})),
                   [false, true, false, true]);
  assert.deepEqual([hasMargin(frame, {margin: 0.5}), hasMargin(near, {margin: 0})], [true, false]);
  assert.deepEqual([0.25, 0, -0.25].map((depth) => depthText(depth, 0.5)),
                   ['125 mm deep', '0.00 mm deep', '125 mm apart']);
});

test('hashes are put into words', () => {
  const frame = recordingOf([[CRATE_ARM]]).frame(0);
  const resultOf = (hits: readonly (readonly number[])[], hash: bigint): Parameters<typeof verdictOf>[1] => ({
    hits: Uint32Array.from(hits.flat()), contacts: null, hash, milliseconds: 1, boxTests: 0, leafPairs: 0,
    exactTests: 0, falsePositives: 0, notes: [],
  });
  assert.equal(verdictOf(frame, resultOf([CRATE_ARM], 1n), {}).kind, 'same');
  assert.match(verdictOf(frame, resultOf([ARM_ARM], 2n), {}).text, /1 recorded hits? .*not found here, 1 .*here alone/);
  assert.match(verdictOf(frame, resultOf([CRATE_ARM, ARM_ARM], 2n), {refit: 'cab'}).text, /1 more, 0 fewer/);
  assert.match(verdictOf(frame, resultOf([CRATE_ARM], 2n), {refit: 'cab'}).text, /the same pairs of links/);
  const [a, b] = [Uint32Array.from(CRATE_ARM), Uint32Array.from([...CRATE_ARM, ...ARM_ARM])];
  assert.equal(firstDifference(a, b), 1);
  assert.equal(firstDifference(a, a), -1);
});

test('markers have the columns of the report, one row per interval, in metres and in order', async () => {
  const hits = [[], [CRATE_ARM], [CRATE_ARM, ARM_ARM], [], [CRATE_ARM]];
  const recording = recordingOf(hits, [[], [0.25], [0.5, 0.125], [], [0.25]]);
  const index = await indexOf(recording);
  const [header, ...rows] = markersOf(recording, 'a,"b"', new Names(recording), index.pairs, index.times)
      .trimEnd().split('\n');
  assert.equal(header, 'file,character_a,link_a,character_b,link_b,first_frame,last_frame,frames,first_seconds,' +
      'last_seconds,worst_depth,worst_triangles,worst_frame,worst_seconds,worst_x,worst_y,worst_z,problem');
  assert.equal(rows.length, 3);
  const file = '"a,""b"""';
  assert(rows.every((row) => row.startsWith(`${file},`)));
  // Half a metre per unit; the first crate stands at its origin.
  const fields = rows.map((row) => row.slice(file.length + 1).split(','));
  assert.deepEqual(fields.map((row) => row.slice(4, 7)), [['1', '2', '2'], ['2', '2', '1'], ['4', '4', '1']]);
  assert.deepEqual(fields[0]!.slice(7, 13), ['0.03125', '0.0625', '0.25', '', '2', '0.0625']);
  assert.deepEqual(fields[0]!.slice(13, 16), ['0.5', '-1', '2']);
  const plain = recordingOf(hits);
  const without = markersOf(plain, 'a', new Names(plain), (await indexOf(plain)).pairs, index.times);
  assert.match(without.split('\n')[1]!, /,0\.03125,0\.0625,,,1,0\.03125,,,,$/);
});

test('no text of the markers is a formula, and numbers stay numbers', async () => {
  const recording = recordingOf([[ARM_ARM]]), {pairs, times} = await indexOf(recording);
  const written = (file: string): string =>
    markersOf(recording, file, new Names(recording), pairs, times).split('problem\n')[1]!.split(',ann,lower,')[0]!;
  for (const text of ['=1+2', '+x', '-x', '@x', '\tx', "'=x", '-2+3', '-.5', '+-1', '-1e', '-inf', '+', '-1 ']) {
    assert.equal(written(text), `'${text}`);
  }
  assert.equal(written('\nx'), '"\'\nx"');
  for (const text of ['-1', '+3', '-1.5e-3', '-1.', '+2E+9', '-1e999', 'a-b', 'left=right']) {
    assert.equal(written(text), text);
  }
  assert.equal(written('=A1,"x"'), '"\'=A1,""x"""');
});

test('frames without a length are states, unless their times rise', () => {
  const player = new Player(3, 0, () => undefined);
  assert.equal(player.hasTimes, false);
  player.setTimes(new Float64Array([0, 0, 0]));
  assert.equal(player.hasTimes, false);
  player.setTimes(new Float64Array([0, 1, 2]));
  assert.equal(player.hasTimes, true);
  assert.equal(new Player(3, 0.5, () => undefined).hasTimes, true);
});

test('no label is over another one or beyond the picture, and one without room is left out', () => {
  const numbers = new Numbers(21);
  let placed = 0, left = 0;
  for (let round = 0; round < 300; ++round) {
    const boxes = Array.from({length: 1 + numbers.below(12)}, () => ({
      x: numbers.below(400), y: numbers.below(300), width: 20 + numbers.below(160), height: 18,
    }));
    const places = placeBoxes(boxes, 400, 300);
    const all = places.flatMap((place, i) => place ? [{...boxes[i]!, ...place}] : []);
    placed += all.length;
    left += boxes.length - all.length;
    all.forEach((one, i) => {
      assert(one.x >= 0 && one.y >= 0 && one.x + one.width <= 400 && one.y + one.height <= 300);
      for (const other of all.slice(0, i)) {
        assert(one.x >= other.x + other.width || other.x >= one.x + one.width || one.y >= other.y + other.height ||
               other.y >= one.y + one.height, `${JSON.stringify(one)} is over ${JSON.stringify(other)}`);
      }
    });
  }
  assert(placed > 10 * left, `${placed} placed, ${left} left out`);
  assert.deepEqual(placeBoxes([{x: 100, y: 100, width: 50, height: 20}], 400, 300), [{x: 108, y: 72}]);
  assert.deepEqual(placeBoxes([{x: 5, y: 5, width: 500, height: 20}], 400, 300), [null]);
});

// What somebody sees who lacks one kind of cones, of linear red, green and blue (Viénot, Brettel and Mollon 1999).
const SEEN: Record<string, readonly (readonly number[])[]> = {
  normal: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  protanopia: [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]],
  deuteranopia: [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]],
};

// Lightness and two differences of colours (CIE L*a*b*).
function labOf(rgb: number, seen: readonly (readonly number[])[]): number[] {
  const linear = [16, 8, 0].map((shift) => {
    const part = ((rgb >> shift) & 255) / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
  const [r, g, b] = seen.map((row) => Math.max(0, row.reduce((sum, share, k) => sum + share * linear[k]!, 0)));
  const xyz = [(0.4124 * r! + 0.3576 * g! + 0.1805 * b!) / 0.9505, 0.2126 * r! + 0.7152 * g! + 0.0722 * b!,
               (0.0193 * r! + 0.1192 * g! + 0.9505 * b!) / 1.089];
  const [x, y, z] = xyz.map((t) => t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);
  return [116 * y! - 16, 500 * (x! - y!), 200 * (y! - z!)];
}

test('the first two characters and what touches differ for whoever sees no difference of red and green', () => {
  // A difference of 10 is seen at a glance. Worst measured: 35.5, hits and the second character in deuteranopia.
  const LEAST = 25;
  const colors = [CHARACTERS[0], CHARACTERS[1], COLORS.hit, COLORS.background];
  for (const [name, seen] of Object.entries(SEEN)) {
    colors.forEach((one, i) => {
      for (const other of colors.slice(0, i)) {
        const [a, b] = [labOf(one, seen), labOf(other, seen)];
        const difference = Math.hypot(...a.map((value, k) => value - b[k]!));
        assert(difference > LEAST, `${one.toString(16)} and ${other.toString(16)} differ by ${difference}, ${name}`);
      }
    });
  }
});
