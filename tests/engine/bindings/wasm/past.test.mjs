// The past: what may have touched since a moment, when it first did, and queries at times that a history has.
import assert from 'node:assert/strict';
import test from 'node:test';
import {cab, chain} from './package.mjs';

const module = await cab.load();

// Balls of radius 0.25, and how far off the first touch of two is found.
const RADIUS = 0.25, RESOLUTION = 1e-4;

function balls(count) {
  const world = module.createWorld();
  const ball = world.addArticulation({
    linkParents: [-1],
    leaves: [{link: 0, box: {half: [RADIUS, RADIUS, RADIUS]}, parts: [{kind: 'sphere', size: [RADIUS, 0, 0]}]}],
  });
  return {world, batch: world.addBatch(ball, count)};
}

test('balls that pass each other between two frames are found with margins, and the moment is the first touch', () => {
  const {world, batch} = balls(3);
  batch.origins().set([-2, 0, 0, 0, 0, 0, 0, 9, 0]);
  const last = batch.moment();
  batch.origins().set([2, 0, 0], 0);
  const rules = [{a: batch}];
  assert.equal(world.runFrame({rules}).length, 0);
  const margins = world.sweepMargins(last);
  assert.equal(margins.length, 3);
  assert.ok(margins[0] >= 4 && margins[0] < 4.1, `${margins[0]}`);
  assert.ok(margins[1] < 1e-3 && margins[2] < 1e-3);
  batch.margins().set(margins);
  const hits = world.runFrame({rules});
  assert.deepEqual(hits.toArray().map(({instanceA, instanceB}) => [instanceA, instanceB]), [[0, 1]]);
  const moments = world.findTouchingMoments({last: [last], pairs: hits, resolution: RESOLUTION});
  assert.equal(moments.length, 1);
  assert.ok(Math.abs(moments[0] - (2 - 2 * RADIUS) / 4) < 1e-3, `${moments[0]}`);
  const apart = {batchA: batch, instanceA: 0, linkA: 0, batchB: batch, instanceB: 2, linkB: 0};
  assert.deepEqual([...world.findTouchingMoments({last: [last], pairs: [apart], resolution: RESOLUTION})], [2]);
  const still = {last: [last], pairs: hits, resolution: 0};
  assert.throws(() => world.findTouchingMoments(still), {status: 'bad_resolution'});
  assert.throws(() => world.findTouchingMoments({last: [], pairs: hits, resolution: 1}), {name: 'CabError'});
  assert.throws(() => world.findTouchingMoments({last: [last], pairs: hits}), /needs a resolution/);
  assert.throws(() => world.findTouchingMoments({last: [batch], pairs: hits, resolution: 1}), /not what Batch.moment/);
  assert.throws(() => world.sweepMargins(batch), /not what Batch.moment returns/);
  world.destroy();
});

test('a moment with a static body is found, and a moment is a copy', () => {
  const {world, batch} = balls(1);
  const wall = world.addStaticBatch({bodies: [{box: {half: [0.5, 9, 9]}}]});
  batch.origins().set([-2.5, 0, 0]);
  const last = batch.moment();
  batch.origins().set([1.5, 0, 0]);
  const pair = {batchA: batch, instanceA: 0, linkA: 0, batchB: wall, instanceB: 0, linkB: 0};
  const [moment] = world.findTouchingMoments({last: [last], pairs: [pair], resolution: RESOLUTION});
  assert.ok(Math.abs(moment - (2 - RADIUS) / 4) < 1e-3, `${moment}`);
  world.reserve({batches: 500, characters: 100000});  // memory grows, and the moment stays
  const [again] = world.findTouchingMoments({last: [last], pairs: [pair], resolution: RESOLUTION});
  assert.equal(again, moment);
  world.remove(batch);
  assert.throws(() => world.sweepMargins(last), /removed/);
  assert.throws(() => batch.moment(), /removed/);
  world.destroy();
});

test('a moment keeps which instances there were', () => {
  const {world, batch} = balls(3);
  batch.instances = [0, 2];
  const last = batch.moment();
  batch.instances = null;
  batch.origins().set([5, 0, 0, 5, 0, 0, 5, 0, 0]);
  const margins = world.sweepMargins(last);
  assert.ok(margins[0] > 4.9 && margins[2] > 4.9);
  assert.equal(margins[1], 0);
  world.destroy();
});

test('queries at a time find links where they were then', () => {
  const {world, batch} = balls(2);
  const history = world.addHistory(batch, 3);
  assert.equal(history.batch, batch);
  assert.deepEqual(history.span, {ticks: 0, first: 0, last: 0});
  for (const tick of [0, 1, 2, 3]) {
    batch.origins().set([10 * tick, 0, 0, 0, 100, 0]);
    history.record(tick);
  }
  assert.deepEqual(history.span, {ticks: 3, first: 1, last: 3});
  batch.origins().set([500, 0, 0]);
  const ray = (x, time) => ({position: [x, 0, 5], direction: [0, 0, -1], length: 10, time});
  const queries = [ray(10, 1), ray(20, 2), ray(25, 2.5), ray(10, 2), ray(500, Infinity), ray(500, 3)];
  const hits = world.runQueries({queries, histories: [history], exact: 'convex'});
  assert.deepEqual([...hits.found], [1, 1, 1, 0, 1, 0]);
  assert.deepEqual(hits.toArray().map((hit) => [hit.query, hit.batch, hit.instance]),
                   [0, 1, 2, 4].map((query) => [query, batch, 0]));
  assert.ok(Math.abs(hits.at(0).distance - (5 - RADIUS)) < 1e-3);
  assert.throws(() => world.runQueries({queries, histories: [history, history]}), {status: 'history_given_twice'});
  assert.throws(() => world.runQueries({queries, histories: [batch]}), /a history is not what addHistory returns/);
  history.remove();
  assert.throws(() => history.span, /removed/);
  assert.throws(() => history.record(9), /removed/);
  assert.throws(() => world.runQueries({queries, histories: [history]}), /a history has been removed/);
  world.destroy();
});

test('a moment is recorded later, and times go forward', () => {
  const {world, batch} = balls(1);
  const history = world.addHistory(batch, 8);
  batch.origins().set([7, 0, 0]);
  const then = batch.moment();
  batch.origins().set([0, 0, 0]);
  history.record(1, then);
  const found = world.runQueries({queries: [{kind: 'point', position: [7, 0, 0], length: 1, time: 1}],
                                  histories: [history]});
  assert.equal(found.found[0], 1);
  assert.throws(() => history.record(1), {status: 'bad_time'});
  assert.throws(() => history.record('now'), /a time is a number/);
  assert.throws(() => history.record(2, batch), /not what Batch.moment returns/);
  const other = world.addBatch(world.addArticulation(chain(2)), 1);
  assert.throws(() => history.record(2, other.moment()), {status: 'unknown_batch'});
  assert.throws(() => world.addHistory(other, 0), {status: 'bad_ticks'});
  assert.throws(() => world.addHistory(other.articulation, 4), {name: 'TypeError'});
  assert.equal(history.span.ticks, 1);
  world.destroy();
  assert.throws(() => history.span, /destroyed/);
});
