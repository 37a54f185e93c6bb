// What is asked about hits and boxes: which began and ended, how deep links touch, and lines to draw.
import assert from 'node:assert/strict';
import test from 'node:test';
import {bone, cab, chain, Numbers} from './package.mjs';

const module = await cab.load();
const TOUCHING = 1, FREE = 3;

// Balls of radius 1 in a row along x.
function balls(...places) {
  const world = module.createWorld();
  const ball = world.addArticulation({
    linkParents: [-1], leaves: [{link: 0, box: {half: [1, 1, 1]}, parts: [{kind: 'sphere', size: [1, 0, 0]}]}],
  });
  const batch = world.addBatch(ball, places.length);
  place(batch, ...places);
  return {world, ball, batch};
}

function place(batch, ...places) {
  places.forEach((x, i) => batch.origins().set([x, 0, 0], 3 * i));
}

const numbersOf = ({instanceA, linkA, instanceB, linkB}) => [instanceA, linkA, instanceB, linkB];

test('hits that are new began, those that are gone ended, and the others did neither', () => {
  const {world, batch} = balls(0, TOUCHING, 10, 10 + TOUCHING, 20, 20 + FREE);
  const job = {rules: [{a: batch}]};
  const before = world.runFrame(job).words().slice();
  assert.deepEqual(world.diffHits(before, before), {began: [], ended: []});
  place(batch, 0, TOUCHING, 10, 10 + FREE, 20, 20 + TOUCHING);
  const now = world.runFrame(job);
  for (const current of [now, now.words(), now.words().slice(), now.toArray()]) {
    const {began, ended} = world.diffHits(before, current);
    assert.deepEqual(began.map(numbersOf), [[4, 0, 5, 0]]);
    assert.deepEqual(ended.map(numbersOf), [[2, 0, 3, 0]]);
    assert.deepEqual([began[0].batchA, began[0].batchB], [batch, batch]);
  }
  const [first, second] = now.toArray();
  assert.deepEqual(world.diffHits([], now).began.map(numbersOf), [[0, 0, 1, 0], [4, 0, 5, 0]]);
  assert.deepEqual(world.diffHits(now, []).ended.length, 2);
  assert.throws(() => world.diffHits([], [second, first]), {status: 'unsorted_hits'});
  assert.throws(() => world.diffHits(before.slice(1), now), /previous has 11 words, and not 6 per hit/);
  assert.throws(() => world.diffHits(before, 7), /current is no list of hits/);
  world.runFrame(job);
  assert.throws(() => world.diffHits(before, now), /toArray\(\) keeps/);
  const last = world.runFrame(job).words().slice();
  world.remove(batch);
  assert.deepEqual(world.diffHits(last, []).ended.map(({batchA}) => batchA), [null, null]);
  world.destroy();
});

test('hits that were kept name their own batches, though others have taken their slots', () => {
  const {world, ball, batch} = balls(0);
  const job = (other) => ({rules: [{a: batch, b: other}], policies: {exact: 'convex'}});
  const named = (changes) => changes.map(({batchA, batchB, instanceB}) => [batchA, batchB, instanceB]);
  const goblins = world.addBatch(ball, 2);
  const old = world.runFrame(job(goblins));
  assert.equal(old.length, 2);
  const live = old.words(), part = live.subarray(0, 6).slice();
  const copy = Uint32Array.from(live), kept = [live.slice(), live.slice().slice(), old.toArray()];
  world.remove(goblins);
  // Until another batch takes its slot, a slot means the batch that had it.
  assert.deepEqual(named(world.diffHits(copy, []).ended), [[batch, null, 0], [batch, null, 1]]);
  const dragon = world.addBatch(ball, 1);
  assert.equal(dragon.slot, goblins.slot);
  const removed = /pairs names a batch that has been removed/, unknown = /names slot 2, which several batches have had/;
  for (const pairs of kept) {
    assert.throws(() => world.computeContacts(pairs), removed);
    assert.throws(() => world.findTouchingTriangles(pairs), removed);
    assert.throws(() => world.boxLines(dragon, {hits: pairs}), /hits names a batch that has been removed/);
  }
  for (const pairs of [copy, live]) assert.throws(() => world.computeContacts(pairs), unknown);

  const now = world.runFrame(job(dragon)), words = now.words().slice();
  assert.equal(now.length, 1);
  for (const before of kept) {
    for (const current of [now, words, now.toArray()]) {
      const {began, ended} = world.diffHits(before, current);
      assert.deepEqual(named(began), [[batch, dragon, 0]]);
      assert.deepEqual(named(ended), [[batch, null, 0], [batch, null, 1]]);
    }
  }
  assert.deepEqual(named(world.diffHits(part, now).ended), [[batch, null, 0]]);
  assert.deepEqual(world.diffHits(words, now), {began: [], ended: []});
  assert.equal(world.computeContacts(words).length, 1);
  for (const pairs of [[copy, now], [now, copy], [live, now], [live.slice(0, 6), now]]) {
    assert.throws(() => world.diffHits(...pairs), unknown);
  }
  assert.throws(() => world.diffHits([...kept[2].slice(0, 1), ...now.toArray()], []), /previous has hits of two times/);

  world.remove(dragon);
  assert.deepEqual(named(world.diffHits(kept[0], words).began), [[batch, null, 0]]);
  const other = balls(0, TOUCHING);
  assert.throws(() => other.world.diffHits(words, []), /previous is of another world/);
  other.world.destroy();
  world.destroy();
});

test('leaves of hits that are objects are those of what began and ended', () => {
  const world = module.createWorld();
  const batch = world.addBatch(world.addArticulation({linkParents: [-1], leaves: [0, 1].map((at) => ({
    link: 0, box: {center: [4 * at, 0, 0], half: [1, 1, 1]},
  }))}), 2);
  batch.origins()[3] = 5;
  const hits = world.runFrame({rules: [{a: batch}]}), [{leafA, leafB}] = hits;
  assert.deepEqual([leafA, leafB], [1, 0]);
  for (const list of [hits, hits.toArray()]) {
    for (const [change] of [world.diffHits([], list).began, world.diffHits(list, []).ended]) {
      assert.deepEqual([change.leafA, change.leafB], [1, 0]);
    }
  }
  world.destroy();
});

test('contacts of named links say how deep they are or how far apart', () => {
  const {world, ball, batch} = balls(0, TOUCHING, 10);
  const other = world.addBatch(ball, 1);
  place(other, 13);
  const pair = (instanceA, batchB, instanceB) => ({batchA: batch, instanceA, linkA: 0, batchB, instanceB, linkB: 0});
  const contacts = world.computeContacts([pair(0, batch, 1), pair(0, batch, 2), pair(2, other, 0)]);
  assert.deepEqual(contacts.map(({depth}) => depth), [1, -8, -1]);
  assert.deepEqual(contacts[2].normal, [1, 0, 0]);
  assert.deepEqual([contacts[2].pointA, contacts[2].pointB], [[1, 0, 0], [2, 0, 0]]);
  const hits = world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true});
  assert.deepEqual(world.computeContacts(hits), hits.toArray().map(({contact}) => contact));
  assert.deepEqual(world.computeContacts([]), []);
  assert.throws(() => world.computeContacts([pair(0, batch, 3)]), {status: 'bad_pairs'});
  assert.throws(() => world.computeContacts([{...pair(0, batch, 1), batchB: ball}]), /batchB of pairs is not what add/);
  const {instanceB, ...half} = pair(0, batch, 2);
  assert.equal(instanceB, 2);
  const mistyped = /a pair of pairs takes no 'instance_b'/;
  for (const given of [{...half, instance_b: 2}, {...pair(0, batch, 2), instance_b: 2}]) {
    assert.throws(() => world.computeContacts([given]), {name: 'TypeError', message: mistyped});
    assert.throws(() => world.findTouchingMoments({last: [batch.moment()], pairs: [given], resolution: 1}), mistyped);
  }
  assert.throws(() => world.computeContacts([half]), {name: 'TypeError', message: /Hit needs 'instanceB'/});
  const {leafB, ...unlike} = contacts[0];
  assert.equal(leafB, 0);
  assert.throws(() => world.boxLines(batch, {hits, contacts: [unlike]}), /Contact needs 'leafB'/);
  const words = hits.words().slice();
  world.remove(batch);
  assert.throws(() => world.computeContacts([pair(0, batch, 1)]), /pairs names a batch that has been removed/);
  assert.throws(() => world.computeContacts(words), /pairs names a batch that has been removed/);
  world.destroy();
});

test('contacts with static bodies and with bodies of another world', () => {
  const {world, batch} = balls(0);
  const wall = world.addStaticBatch({bodies: [{origin: [3, 0, 0], box: {half: [1, 9, 9]}}]});
  const pair = {batchA: batch, instanceA: 0, linkA: 0, batchB: wall, instanceB: 0, linkB: 0};
  assert.deepEqual(world.computeContacts([pair]).map(({depth}) => depth), [-1]);
  const others = balls(0, TOUCHING);
  assert.throws(() => others.world.computeContacts([pair]), /batchA of pairs is of another world/);
  const hits = others.world.runFrame({rules: [{a: others.batch}]});
  assert.equal(hits.length, 1);
  assert.throws(() => world.computeContacts(hits), /pairs is of another world/);
  others.world.destroy();
  world.destroy();
});

test('explainJob names what is wrong with a job, and what may not be meant', () => {
  const {world, batch} = balls(0, TOUCHING);
  const job = {rules: [{a: batch}]};
  assert.equal(world.explainJob(job), 'nothing is wrong');
  assert.match(world.explainJob({...job, margin: -1}), /^margin.*-1/);
  assert.equal(world.explainJob({rules: []}).split('\n')[0], 'inputs is empty: no batch takes part');
  assert.match(world.explainJob({...job, contacts: true}), /contacts/);
  batch.poses()[0] = NaN;
  assert.match(world.explainJob(job), /1 of 2 instances are masked, the first is 0: number 0 .* nan/);
  assert.throws(() => world.explainJob({...job, margins: 1}), /takes no 'margins'/);
  assert.equal(world.runFrame(job).length, 0);
  world.destroy();
});

test('lines of boxes are their edges, and those of hits are marked', () => {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(2));
  const batch = world.addBatch(arm, 3);
  for (const instance of [0, 1, 2]) batch.poses().set([0, 0, 0, 1, 1, 0, 0], 14 * instance + 7);
  batch.origins().set([0, 0, 0, 1.5, 0, 0.125, 50, 0, 0]);
  const hits = world.runFrame({rules: [{a: batch}]});
  const lines = world.boxLines(batch, {hits, origin: [1, 0, 0]});
  assert.equal(lines.count, 3 * 2 * 12);
  const hit = new Set();
  for (const one of hits) hit.add(`${one.instanceA} ${one.linkA}`).add(`${one.instanceB} ${one.linkB}`);
  assert.ok(hit.size > 0 && hit.size < 6);
  for (let i = 0; i < lines.count; ++i) {
    assert.equal(lines.isHit[i], Number(hit.has(`${lines.instances[i]} ${lines.links[i]}`)));
    const ends = [lines.positions.subarray(6 * i, 6 * i + 3), lines.positions.subarray(6 * i + 3, 6 * i + 6)];
    const lengths = [0, 1, 2].map((c) => Math.abs(ends[1][c] - ends[0][c])).filter((length) => length > 1e-3);
    assert.equal(lengths.length, 1);
    for (const end of ends) {
      const center = batch.origins()[3 * lines.instances[i]] + lines.links[i] + bone.center[0] - 1;
      assert.ok(Math.abs(Math.abs(end[0] - center) - bone.half[0]) < 1e-4, `${end[0]} ${center}`);
    }
  }
  assert.equal(world.boxLines(batch).isHit.includes(1), false);
  const roots = world.boxLines(batch, {level: 0, policies: 'tight'});
  assert.equal(roots.count, 3 * 12);
  assert.ok(roots.links.every((link) => link === 0xffff));
  batch.instances = [1];
  assert.equal(world.boxLines(batch).count, 2 * 12);
  batch.instances = [];
  assert.equal(world.boxLines(batch).count, 0);
  assert.throws(() => world.boxLines(batch, {colour: 1}), /boxLines takes no 'colour'/);
  assert.throws(() => world.boxLines(batch, {origin: [NaN, 0, 0]}), {status: 'bad_origins'});
  world.destroy();
});

test('lines of shapes are on their surface, and those of contacts join their points', () => {
  const {world, batch} = balls(0, TOUCHING);
  const hits = world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true});
  const contacts = hits.toArray().map(({contact}) => contact);
  const lines = world.boxLines(batch, {shapes: true, hits, contacts});
  const CIRCLE = 16;
  assert.equal(lines.count, 2 * 3 * CIRCLE + 1);
  for (let i = 0; i < lines.count - 1; ++i) {
    for (const end of [6 * i, 6 * i + 3]) {
      const [x, y, z] = lines.positions.subarray(end, end + 3);
      assert.ok(Math.abs(Math.hypot(x - lines.instances[i] * TOUCHING, y, z) - 1) < 1e-5);
    }
  }
  assert.deepEqual([...lines.positions.subarray(-6)], [...contacts[0].pointA, ...contacts[0].pointB]);
  assert.throws(() => world.boxLines(batch, {contacts}), {status: 'bad_pairs'});
  world.destroy();
});

test('neighbours in the world are neighbours in the spatial order', () => {
  const numbers = new Numbers(5);
  const places = Array.from({length: 64}, () => 1000 * numbers.next());
  const {world, batch} = balls(...places);
  assert.deepEqual([...world.spatialOrder(batch)], places.map((_, i) => i));
  world.runFrame({rules: [{a: batch}]});
  const order = [...world.spatialOrder(batch)];
  assert.deepEqual([...order].sort((a, b) => a - b), places.map((_, i) => i));
  const length = (list) => list.reduce((sum, i, k) => sum + (k ? Math.abs(places[i] - places[list[k - 1]]) : 0), 0);
  assert.ok(length(order) < length(places.map((_, i) => i)) / 5);
  assert.throws(() => world.spatialOrder(batch.articulation), /the batch is not what addBatch returns/);
  world.destroy();
});
