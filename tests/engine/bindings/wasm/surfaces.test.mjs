// Skins in the ES module: bodies of triangles, which of them touch, and where rays meet them.
import assert from 'node:assert/strict';
import test from 'node:test';
import {bone, cab} from './package.mjs';

const module = await cab.load();
const IDENTITY = [0, 0, 0, 1, 0, 0, 0];

// A strip along x of `cells` squares, each of two triangles, 1 wide along y. Two links move it: the second one the
// more, the farther along.
function strip(cells) {
  const vertices = [], influenceLinks = [], influenceWeights = [], triangles = [];
  for (let i = 0; i <= cells; ++i) {
    const along = i / cells;
    for (const y of [0, 1]) {
      vertices.push(along, y, 0);
      influenceLinks.push(0, 1);
      influenceWeights.push(1 - along, along);
    }
    if (i < cells) triangles.push(2 * i, 2 * i + 2, 2 * i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3);
  }
  return {
    linkParents: [-1, 0],
    leaves: [{link: 0, triangles: new Uint32Array(triangles)}],
    skin: {vertices: new Float32Array(vertices), influenceCount: 2, influenceLinks, influenceWeights},
  };
}

// A world of two strips, the second of which is turned about x by a quarter, and passes through the first at y = 0.5.
function crossed(cells) {
  const world = module.createWorld();
  const body = world.addArticulation(strip(cells));
  const batch = world.addBatch(body, 2);
  const half = Math.SQRT1_2;
  batch.poses().set([...IDENTITY, ...IDENTITY, half, 0, 0, half, 0, 0.5, -0.5, half, 0, 0, half, 0, 0.5, -0.5]);
  return {world, batch, job: {rules: [{a: batch}], policies: {exact: 'surface'}}};
}

test('two skins touch by their triangles, which are named', () => {
  const {world, batch, job} = crossed(1);
  const hits = world.runFrame(job);
  assert.equal(hits.length, 1);
  const found = world.findTouchingTriangles(hits);
  // Both triangles of a square reach y = 0.5, where the other square passes through.
  assert.deepEqual(found.toArray(), [
    {pair: 0, leafA: 0, leafB: 0, triangleA: 0, triangleB: 0},
    {pair: 0, leafA: 0, leafB: 0, triangleA: 0, triangleB: 1},
    {pair: 0, leafA: 0, leafB: 0, triangleA: 1, triangleB: 0},
    {pair: 0, leafA: 0, leafB: 0, triangleA: 1, triangleB: 1},
  ]);
  assert.equal(found.wordsPerHit, 4);
  assert.deepEqual([...found.words().subarray(8, 12)], [0, 0, 1, 0]);
  const words = hits.words().slice();
  const named = [{batchA: batch, instanceA: 0, linkA: 0, batchB: batch, instanceB: 1, linkB: 0}];
  for (const pairs of [words, named]) assert.equal(world.findTouchingTriangles(pairs).length, 4);
  assert.throws(() => found.at(0), /have been replaced/);
  batch.origins()[3] = 5;
  assert.equal(world.runFrame(job).length, 0);
  assert.equal(world.findTouchingTriangles(world.runFrame(job)).length, 0);
  assert.equal(world.findTouchingTriangles(words).length, 0);
  world.destroy();
});

test('a skin bends between its links, and so do the triangles that touch', () => {
  const {world, batch, job} = crossed(64);
  const found = world.findTouchingTriangles(world.runFrame(job)), all = found.length;
  assert.ok(all > 128, `${all} pairs are more than what there was room for at first`);
  assert.equal(new Set(Array.from(found, ({triangleA, triangleB}) => `${triangleA} ${triangleB}`)).size, all);
  batch.poses()[7 + 6] = 4;  // the second link of the first strip goes up, so the strip's far end leaves the other
  const hits = world.runFrame(job);
  const left = world.findTouchingTriangles(hits);
  assert.ok(left.length > 0 && left.length < all, `${left.length} of ${all}`);
  assert.ok(Math.max(...left.toArray().map(({triangleA}) => triangleA)) < 127);
  world.destroy();
});

test('a ray meets a triangle of a skin, and says where', () => {
  const {world, batch} = crossed(1);
  batch.count = 1;
  const block = world.addBatch(world.addArticulation({linkParents: [-1], leaves: [{link: 0, box: bone}]}), 1);
  block.origins()[0] = 10;
  const ray = (x, y) => ({position: [x, y, 5], direction: [0, 0, -1], length: 9});
  const job = {queries: [ray(0.25, 0.5), ray(10.5, 0)], exact: 'surface'};
  const hits = world.runQueries({...job, surfacePoints: true});
  assert.equal(hits.length, 2);
  assert.equal(hits.at(0).distance, 5);
  const {triangle, weights} = hits.surfacePoint(0);
  assert.equal(triangle, 0);
  [0.25, 0.25, 0.5].forEach((weight, k) => assert.ok(Math.abs(weights[k] - weight) < 1e-6, `${weights}`));
  assert.deepEqual(hits.at(0).surfacePoint, {triangle, weights});
  assert.equal(hits.at(1).surfacePoint, null);
  const plain = world.runQueries(job);
  assert.equal('surfacePoint' in plain.at(0), false);
  assert.throws(() => plain.surfacePoint(0), /not asked for surfacePoints/);
  world.destroy();
});

test('what is wrong with a skin, or with pairs, is refused in words', () => {
  const {world, job} = crossed(1);
  const refused = (desc, status, element) => {
    assert.throws(() => world.addArticulation({...strip(1), ...desc}),
                  (error) => error instanceof cab.CabError && error.status === status && error.element === element);
  };
  refused({leaves: [{link: 0, box: bone}, {link: 0, triangles: [0, 1, 4]}]}, 'bad_leaf_triangles', 1);
  refused({skin: {...strip(1).skin, influenceLinks: [0, 1, 0, 1, 0, 1, 0, 2]}}, 'bad_skin', 3);
  assert.throws(() => world.runFrame({...job, policies: {exact: 'convex'}}), {status: 'skin_not_taken'});
  assert.throws(() => world.runFrame({...job, contacts: true}), {status: 'skin_not_taken'});
  const hits = world.runFrame(job);
  const other = crossed(1);
  assert.throws(() => other.world.findTouchingTriangles(hits), /pairs is of another world/);
  assert.throws(() => world.findTouchingTriangles(new Uint32Array(5)), /pairs has 5 words, and not 6 per hit/);
  const ofNone = new Uint32Array([9, 0, 9, 1, 0, 0]);
  assert.throws(() => world.findTouchingTriangles(ofNone), /pairs names a batch that this world does not have/);
  assert.throws(() => world.findTouchingTriangles({}), /pairs is no list of hits/);
  const old = hits;
  world.runFrame(job);
  assert.throws(() => world.findTouchingTriangles(old), /have been replaced/);
  other.world.destroy();
  world.destroy();
});
