// Boxes of hierarchies, the merges that make them, coarser levels, and the poses that descriptions have.
import assert from 'node:assert/strict';
import test from 'node:test';
import {bone, cab, chain, Numbers} from './package.mjs';

const module = await cab.load();
const LINKS = 8;
// By how much boxes are larger than what they hold, since they hold its rounding too: at most 1.2e-5 here.
const ROOM = 3e-5;

// Straight poses along x, one link after the other, in either format.
const straight = (links) => Array.from({length: links}, (_, link) => [0, 0, 0, 1, link, 0, 0]).flat();
const straightRows = (links) =>
    Array.from({length: links}, (_, link) => [1, 0, 0, link, 0, 1, 0, 0, 0, 0, 1, 0]).flat();

function bent(batch, seed) {
  const numbers = new Numbers(seed), poses = batch.poses();
  for (let i = 0; i < poses.length; i += 7) {
    const angle = numbers.next();
    poses.set([0, 0, Math.sin(angle), Math.cos(angle), i / 7 % LINKS, numbers.next(), numbers.next()], i);
  }
}

test('every node but the root is a child of one merge, and merges share the joints of a chain', () => {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(LINKS));
  const steps = world.mergeSteps(arm);
  assert.equal(steps.length, LINKS - 1);
  const children = steps.flatMap(({left, right}) => [left, right]).sort((a, b) => a - b);
  assert.deepEqual(children, Array.from({length: 2 * LINKS - 2}, (_, node) => node));
  for (const {jointLink} of steps) assert.ok(jointLink > 0 && jointLink < LINKS);

  const leaves = [0, 1].map(() => ({link: 0, box: bone}));
  const [only] = world.mergeSteps(world.addArticulation({linkParents: [-1], leaves}));
  assert.deepEqual(only, {left: 0, right: 1, jointLink: null});
  assert.deepEqual(world.mergeSteps(world.addArticulation(chain(1))), []);
  assert.throws(() => world.mergeSteps(world.addBatch(arm, 1)), /this is not an articulation/);
  world.remove(world.addBatch(arm, 1));
  world.destroy();
});

test('boxes of leaves are where their poses put them, and inner boxes hold them', () => {
  const world = module.createWorld();
  const batch = world.addBatch(world.addArticulation(chain(LINKS)), 3);
  batch.poses().set(straight(LINKS), 7 * LINKS);
  batch.origins()[3] = 100;
  for (const policies of [undefined, 'paper', {refit: 'best3'}, {refit: 'aabb_hull'}]) {
    const {nodeCount, leafCount, values} = world.computeBoxes(batch, policies);
    assert.deepEqual([nodeCount, leafCount, values.length], [2 * LINKS - 1, LINKS, 15 * 3 * (2 * LINKS - 1)]);
    const box = (node) => values.subarray(15 * (nodeCount + node), 15 * (nodeCount + node + 1));
    for (let leaf = 0; leaf < LINKS; ++leaf) {
      assert.ok(Math.abs(box(leaf)[0] - leaf - 0.5) < ROOM && box(leaf)[1] === 0);
      assert.ok(box(leaf)[12] >= 0.5 && box(leaf)[12] < 0.5 + ROOM, `${box(leaf)[12]}`);
    }
    const root = box(nodeCount - 1);
    assert.ok(Math.abs(root[0] - LINKS / 2) < 1e-4);
    const along = [12, 13, 14].reduce((sum, k) => sum + Math.abs(root[3 * (k - 12) + 3]) * root[k], 0);
    assert.ok(along >= LINKS / 2 && along < 1.1 * LINKS / 2, `${along}`);
  }
  assert.throws(() => world.computeBoxes(batch, 'fastest'), /no preset/);
  world.destroy();
});

test('boxes of masked instances are empty, and those of instances left out are 0', () => {
  const world = module.createWorld();
  const batch = world.addBatch(world.addArticulation(chain(2)), 3);
  batch.poses()[0] = NaN;
  batch.instances = [0, 2];
  const {nodeCount, values} = world.computeBoxes(batch);
  const half = (instance) => [...values.subarray(15 * nodeCount * instance + 12, 15 * nodeCount * instance + 15)];
  assert.deepEqual([0, 1].map(half), [[0, 0, 0], [0, 0, 0]]);
  assert.ok(half(2).every((number, k) => number >= bone.half[k] && number < bone.half[k] + ROOM));
  assert.ok(values.subarray(15 * nodeCount, 30 * nodeCount).every((number) => number === 0));
  const level = world.addStaticBatch({bodies: [{box: bone}]});
  assert.throws(() => world.computeBoxes(level), /static bodies have no hierarchy/);
  world.destroy();
});

test('what touches touches at every level too', () => {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(LINKS));
  const levels = [
    world.addLod({of: arm, maxLeaves: 2, restPoses: {data: straight(LINKS)}, jointPlay: 2}),
    world.addLod({of: arm, maxLeaves: 2, restPoses: {format: 'matrix3x4_rows', data: straightRows(LINKS)},
                  jointPlay: 2}),
    world.addLod({of: arm, kind: 'nodes', maxLeaves: 3}),
  ];
  assert.deepEqual(levels.map((level) => level.leafCount), [2, 2, 3]);
  assert.deepEqual(levels.map((level) => level.linkCount), [LINKS, LINKS, LINKS]);
  const pairs = [arm, ...levels].map((of) => {
    const batch = world.addBatch(of, 16);
    bent(batch, 3);
    for (let i = 0; i < batch.size; ++i) batch.origins().set([3 * (i % 4), 2 * Math.floor(i / 4), 0], 3 * i);
    const hits = world.runFrame({rules: [{a: batch}]}).toArray();
    return new Set(hits.map(({instanceA, instanceB}) => `${instanceA} ${instanceB}`));
  });
  assert.ok(pairs[0].size > 10);
  for (const coarse of pairs.slice(1)) {
    for (const pair of pairs[0]) assert.ok(coarse.has(pair), pair);
  }
  assert.deepEqual(pairs[1], pairs[2]);
  world.destroy();
});

test('leaves of a level that the caller makes are taken, or refused with their index', () => {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(2));
  const restPoses = {data: [...straight(2), ...straight(2)]};
  const large = {center: [0, 0, 0], axis: [1, 0, 0, 0, 1, 0, 0, 0, 1], half: [9, 9, 9]};
  const leaves = [{link: 0, box: large, links: [0]}, {link: 1, box: large, links: new Uint32Array([1])}];
  assert.equal(world.addLod({of: arm, leaves, restPoses}).leafCount, 2);
  assert.throws(() => world.addLod({of: arm, leaves: [leaves[0], {...leaves[1], box: bone}], restPoses}),
                {status: 'lod_leaf_too_small', element: 1});
  assert.throws(() => world.addLod({of: arm, restPoses, maxLeaves: 0}), {status: 'too_few_leaves', element: undefined});
  assert.throws(() => world.addLod({of: arm}), {status: 'bad_rest_pose'});
  const level = world.addLod({of: arm, kind: 'nodes'});
  assert.throws(() => world.addLod({of: level, kind: 'nodes'}), {status: 'bad_lod'});
  assert.throws(() => world.addLod({kind: 'nodes'}), /LodDesc.of is not what addArticulation returns/);
  const batch = world.addBatch(level, 2);
  assert.throws(() => world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}}),
                {status: 'lod_without_shapes'});
  world.destroy();
});

test('poses of a description are as many numbers as its links need', () => {
  const world = module.createWorld();
  // Links that touch at rest are not reported: without a rest pose all neighbours are.
  const within = (more) => {
    const batch = world.addBatch(world.addArticulation(chain(LINKS, more)), 1);
    batch.poses().set(straight(LINKS));
    return world.runFrame({rules: [{a: batch, pairing: 'within'}]}).length;
  };
  assert.equal(within({}), LINKS - 1);
  assert.equal(within({restPose: {data: straight(LINKS)}}), 0);
  assert.equal(within({restPose: {format: 'matrix3x4_rows', data: new Float32Array(straightRows(LINKS))}}), 0);
  assert.throws(() => within({restPose: {data: straight(LINKS - 1)}}), /restPose.data needs 56 numbers, not 49/);
  assert.throws(() => within({restPose: {data: [...straight(LINKS), ...straight(LINKS)]}}), /56 numbers, not 112/);
  assert.throws(() => within({restPose: {data: straight(LINKS), linkStride: 4}}),
                /restPose has no member 'linkStride'/);
  assert.throws(() => within({restPose: {format: 'euler', data: []}}), /format is 'euler', and not one of/);
  assert.throws(() => world.addArticulation({...chain(1), linkParents: [], restPose: {data: []}}),
                {status: 'no_links'});
  const arm = world.addArticulation(chain(LINKS));
  for (const data of [[], straight(LINKS).slice(1)]) {
    assert.throws(() => world.addLod({of: arm, restPoses: {data}}), /restPoses.data needs a multiple of 56 numbers/);
  }
  world.destroy();
});

test('matrices of a batch may hold scales', () => {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(1));
  const batch = world.addBatch(arm, 2, {format: 'matrix3x4_rows', hasScale: true});
  batch.poses().set([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);
  batch.origins()[3] = 1.5;
  assert.equal(batch.hasScale, true);
  assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
  const rigid = world.addBatch(arm, 1, {format: 'matrix3x4_rows'});
  rigid.poses()[0] = 2;
  assert.equal(world.whyMasked(rigid, 0).flag, 'instance_not_rigid');
  world.destroy();
});

test('words of contacts are those of their hits', () => {
  const world = module.createWorld();
  const batch = world.addBatch(world.addArticulation(chain(1)), 3);
  batch.origins().set([0.875, 0, 0, 1.75, 0, 0], 3);
  const hits = world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true});
  const words = hits.contactWords();
  assert.equal(hits.wordsPerContact, 11);
  assert.equal(words.length, 11 * hits.length);
  const floats = new Float32Array(words.slice().buffer);
  for (let i = 0; i < hits.length; ++i) {
    const {normal, depth, pointA, pointB} = hits.contact(i);
    assert.deepEqual([...floats.subarray(11 * i, 11 * i + 10)], [...normal, depth, ...pointA, ...pointB]);
  }
  batch.origins()[3] = 100;
  batch.origins()[6] = 200;
  const none = world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true});
  assert.deepEqual(none.contactWords(), new Uint32Array(0));
  assert.throws(() => world.runFrame({rules: [{a: batch}]}).contactWords(), /not asked for contacts/);
  world.destroy();
});
