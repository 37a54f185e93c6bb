// Where links are drawn: a point p of a link stands at origin + orientation * (scale * (pose * p)), relative to the
// scene's centre.
import assert from 'node:assert/strict';
import test from 'node:test';
import * as THREE from 'three';
import type {EngineInPage} from '../../perf/view/src/engine/types.js';
import type {Frame, Input, Poses, Recording} from '../../perf/view/src/recording/types.js';
import {DrawnBatch} from '../../perf/view/src/scene/drawn_batch.js';
import {hull} from '../../perf/view/src/scene/geometries.js';
import {SkinShape} from '../../perf/view/src/scene/skin_shape.js';
import {Stage} from '../../perf/view/src/scene/stage.js';
import {boxesOfBodies} from '../../perf/view/src/scene/static_boxes.js';
import {isDrawable, multiply, placeLinks, ROWS} from '../../perf/view/src/scene/transforms.js';
import {BoxChooser} from '../../perf/view/src/ui/boxes_shown.js';
import {Names} from '../../perf/view/src/ui/names.js';
import {ARM, ARMS, boxOf, CLOTH, FLOOR, frameOf, HEADER, inputOf, Numbers, posesOf} from './scene.js';

const HALF = Math.SQRT1_2;
// A quarter turn about z, then by 1, 2, 3.
const TURNED = [0, 0, HALF, HALF, 1, 2, 3];
const TURNED_ROWS = [0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3];
// The rows of a pose differ from exact ones by the rounding of float.
const ROUNDING = 1e-6;

function near(seen: ArrayLike<number>, wanted: ArrayLike<number>): void {
  assert.equal(seen.length, wanted.length);
  for (let i = 0; i < wanted.length; ++i) {
    assert(Math.abs(seen[i]! - wanted[i]!) <= ROUNDING * Math.max(1, Math.abs(wanted[i]!)), `${[...Array.from(seen)]}`);
  }
}

interface Placed {
  rows: Float32Array;
  present: Uint8Array;
}

function place(input: Input, links: number, instances: number, center = [0, 0, 0]): Placed {
  // What stood there before must not be seen.
  const rows = new Float32Array(links * instances * ROWS).fill(7);
  const present = new Uint8Array(instances).fill(1);
  placeLinks(input, links, Float64Array.from(center), rows, present);
  return {rows, present};
}

test('the three formats of poses say the same', () => {
  const columns = [0, 1, 0, 9, -1, 0, 0, 9, 0, 0, 1, 9, 1, 2, 3, 9];
  const formats: readonly Poses[] = [
    posesOf(TURNED), posesOf(TURNED.map((value, i) => i < 4 ? 2 * value : value)),
    posesOf(TURNED_ROWS, 'matrix3x4_rows'), posesOf(columns, 'matrix4x4_columns'),
  ];
  for (const poses of formats) near(place(inputOf(0, {poses}), 1, 1).rows, TURNED_ROWS);
});

test('an instance is scaled, then turned, then moved', () => {
  const input = inputOf(0, {
    poses: posesOf(TURNED), origins: new Float64Array([10, 20, 30]), orientations: new Float32Array([0, 0, 1, 0]),
    scales: new Float32Array([2]),
  });
  // Half a turn about z takes x y to -x -y.
  near(place(input, 1, 1).rows, [0, 2, 0, 8, -2, 0, 0, 16, 0, 0, 2, 36]);
});

test('far from the origin of the world nothing is lost beside the centre', () => {
  const far = 2 ** 40;
  const input = inputOf(0, {poses: posesOf([0, 0, 0, 1, 0, 0, 0]), origins: new Float64Array([far + 0.125, -far, 1])});
  const {rows} = place(input, 1, 1, [far, -far, 0]);
  assert.deepEqual([rows[3], rows[7], rows[11]], [0.125, 0, 1]);
});

test('who takes no part has no size', () => {
  const poses = posesOf([...TURNED, ...TURNED, ...TURNED, ...TURNED]);
  const listed = place(inputOf(0, {poses, instances: new Uint32Array([1, 3]), count: 3}), 1, 4);
  assert.deepEqual([...listed.present], [0, 1, 0, 0]);
  near(listed.rows.subarray(ROWS, 2 * ROWS), TURNED_ROWS);
  near(listed.rows.subarray(2 * ROWS), new Float32Array(2 * ROWS));
  assert.deepEqual([...place(inputOf(0, {poses, count: 2}), 1, 4).present], [1, 1, 0, 0]);
  assert.deepEqual([...place(inputOf(0), 1, 2).present], [0, 0]);
  assert.deepEqual([...place(inputOf(0, {poses: posesOf(TURNED)}), 1, 3).present], [1, 0, 0], 'poses that are missing');
});

test('a batch takes room for the instances of frames, and not for those that it claims', () => {
  const recording: Recording = {
    header: HEADER, articulations: [ARM], batches: [{...ARMS, instanceCount: 2 ** 20}], frameCount: 0, problems: [],
    frame: () => frameOf(0),
  };
  const drawn = new DrawnBatch(recording, 0, new Float64Array(3), 'fine', false);
  const poses = posesOf(Array.from({length: 12}, () => TURNED).flat());
  const placed = (more: Partial<Input>): number[] => {
    drawn.place(inputOf(0, {poses, ...more}), new Float64Array(3), new THREE.Vector3());
    drawn.markLink(drawn.present.lastIndexOf(1), 1, 2);
    assert(drawn.linkRows.length <= 12 * drawn.linkCount * ROWS);
    return [...drawn.present.keys()].filter((i) => drawn.present[i] === 1);
  };
  assert.deepEqual(placed({count: 1}), [0]);
  near(drawn.linkRows, [...TURNED_ROWS, ...TURNED_ROWS]);
  assert.deepEqual(placed({count: 6, instances: new Uint32Array([1, 5])}), [1, 5]);
  near(drawn.linkRows.subarray(10 * ROWS, 12 * ROWS), [...TURNED_ROWS, ...TURNED_ROWS]);
  assert.deepEqual([...drawn.marks.links.keys()].filter((i) => drawn.marks.links[i] !== 0), [11]);
  assert.deepEqual(placed({count: 2}), [0, 1]);
  drawn.dispose();
});

test('static bodies and triangles that take no part are not there', () => {
  const crateAt = (x: number) => ({
    origin: new Float64Array([x, 0, 0]), rotation: new Float32Array([0, 0, 0, 1]), parts: [],
    box: boxOf([0, 0, 0], [0.5, 0.5, 0.5]),
  });
  const staticBodies = {...FLOOR.staticBodies!, bodies: [crateAt(-4), crateAt(4)], origin: new Float64Array([8, 0, 0])};
  const frameWith = (more: Partial<Input>): Frame => ({...frameOf(0), inputs: [inputOf(0, more)]});
  const recording: Recording = {
    header: HEADER, articulations: [], batches: [{...FLOOR, instanceCount: 4, staticBodies}], frameCount: 1,
    problems: [], frame: () => frameWith({}),
  };
  const stage = new Stage(recording, [recording.frame(0)], false), selection = {instance: null, pair: null};
  // Boxes of characters alone come from the engine.
  const boxes = new BoxChooser(recording, {} as EngineInPage, new Names(recording));
  const view = {leafBoxes: true, level: 0, contacts: false, falsePositives: false, follow: false};
  const shown = (more: Partial<Input>) => {
    const frame = frameWith(more);
    stage.show({
      frame, hits: frame.hits, contacts: null, falsePositives: null, triangles: null, selection,
      eye: new THREE.Vector3(),
    });
    const {low, high} = stage.bounds();
    const picked = [-4, 4].map((x) => {
      return stage.pick(new THREE.Ray(new THREE.Vector3(x, 0, 5), new THREE.Vector3(0, 0, -1)))?.instance;
    });
    return {
      x: [low[0], high[0]], picked, middles: [0, 1].map((i) => stage.middleOf(0, i)?.x),
      boxes: boxes.choose(frame, {}, view, selection, stage).sets[0]!.instances,
    };
  };
  assert.deepEqual(shown({}), {x: [-4.5, 9], picked: [0, 1], middles: [-4, 4], boxes: [0, 1]});
  assert.deepEqual(shown({count: 1}), {x: [-4.5, -3.5], picked: [0, undefined], middles: [-4, undefined], boxes: [0]});
  assert.deepEqual(shown({instances: new Uint32Array([1])}),
                   {x: [3.5, 4.5], picked: [undefined, 1], middles: [undefined, 4], boxes: [1]});
  assert.deepEqual(shown({instances: new Uint32Array([1, 3])}),
                   {x: [3.5, 9], picked: [undefined, 1], middles: [undefined, 4], boxes: [1]});
  stage.dispose();
});

test('poses that are no numbers are not drawn', () => {
  const {rows} = place(inputOf(0, {poses: posesOf([...TURNED, 0, 0, 0, 0, 1, 2, 3, NaN, 0, 0, 1, 0, 0, 0])}), 3, 1);
  assert.deepEqual([0, 1, 2].map((link) => isDrawable(rows, link * ROWS)), [true, false, false]);
});

test('a product of transforms takes a point through both', () => {
  const out = new Float32Array(ROWS);
  const rows = Float32Array.from(TURNED_ROWS);
  multiply(rows, 0, rows, 0, out, 0);
  near(out, [-1, 0, 0, -1, 0, -1, 0, 3, 0, 0, 1, 6]);
});

test('boxes of static bodies turn with them, and are relative to their origins', () => {
  const body = {
    origin: new Float64Array([100, 200, 300]), rotation: Float32Array.from(TURNED.slice(0, 4)),
    box: boxOf([1, 2, 3], [4, 5, 6]), parts: [],
  };
  near(boxesOfBodies([body]), [-2, 1, 3, 0, 1, 0, -1, 0, 0, 0, 0, 1, 4, 5, 6]);
});

test('hulls of points in a plane and on a line, however many, are as large as the points reach', () => {
  const sizeOf = (points: readonly number[]): number[] => {
    const geometry = hull(Float32Array.from(points));
    geometry.computeBoundingBox();
    return geometry.boundingBox!.getSize(new THREE.Vector3()).toArray();
  };
  assert.deepEqual(sizeOf([0, 0, 0, 1, 0, 0, 0.25, 0, 0, 1, 2, 0, 0, 2, 0]), [1, 2, 0]);
  assert.deepEqual(sizeOf([0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 4]), [1, 2, 4]);
  assert.deepEqual(sizeOf(Array.from({length: 90000}, (_, i) => i % 3 === 0 ? i / 3 : 0)), [29999, 0, 0]);
});

test('vertices of a skin are at the weighted mean of where its links take them', () => {
  assert.equal(SkinShape.of(ARM), null);
  assert.equal(SkinShape.of(undefined), null);
  const numbers = new Numbers(9);
  const values = (count: number): Float32Array => Float32Array.from({length: count}, () => numbers.next());
  const bind = values(32), weights = values(8).map((weight) => Math.abs(weight));
  weights[3] = 0;
  const shape = SkinShape.of({...CLOTH, skin: {...CLOTH.skin!, influenceWeights: weights, inverseBind: bind}})!;
  assert.equal(shape.triangleCount, 2);
  assert.deepEqual([...shape.links], [0, 0]);
  const rows = values(4 * ROWS), positions = new Float32Array(12), normals = new Float32Array(12);
  shape.place(rows, 2 * ROWS, positions, normals);
  const {vertices, influenceLinks} = CLOTH.skin!;
  for (let v = 0; v < 4; ++v) {
    const wanted = [0, 0, 0], turned = [0, 0, 0];
    const sum = weights[2 * v]! + weights[2 * v + 1]!;
    for (const i of [2 * v, 2 * v + 1]) {
      const m = 16 * influenceLinks[i]!, r = (2 + influenceLinks[i]!) * ROWS;
      // The normal of the cloth is along z, and as long as the areas of a vertex's triangles are.
      const apply = (p: readonly number[], w: number): number[] => {
        const at = [0, 1, 2].map((c) => bind[m + c]! * p[0]! + bind[m + 4 + c]! * p[1]! + bind[m + 8 + c]! * p[2]! +
          w * bind[m + 12 + c]!);
        return [0, 4, 8].map((c) => rows[r + c]! * at[0]! + rows[r + c + 1]! * at[1]! + rows[r + c + 2]! * at[2]! +
          w * rows[r + c + 3]!);
      };
      apply([...vertices.subarray(3 * v, 3 * v + 3)], 1).forEach((x, k) => (wanted[k]! += weights[i]! / sum * x));
      apply([0, 0, v === 0 || v === 3 ? 1 : 2], 0).forEach((x, k) => (turned[k]! += weights[i]! / sum * x));
    }
    near(positions.subarray(3 * v, 3 * v + 3), wanted);
    near(normals.subarray(3 * v, 3 * v + 3), turned);
  }
});
