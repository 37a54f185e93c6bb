// The memory of the module: it grows under views, fails with a status, and is given back.
import assert from 'node:assert/strict';
import test from 'node:test';
import {cab, chain} from './package.mjs';

test('views from before the memory grew are empty, and new ones show what was written', async () => {
  const module = await cab.load();
  const world = module.createWorld();
  const arm = world.addArticulation(chain(4));
  const batch = world.addBatch(arm, 2);
  const before = batch.poses(), bytes = module.memory.buffer.byteLength;
  batch.origins()[3] = 0.5;
  const first = world.runFrame({rules: [{a: batch}]}).toArray();
  assert.ok(first.length > 0);
  const large = world.addBatch(arm, 200000);
  assert.ok(module.memory.buffer.byteLength > bytes);
  assert.equal(before.length, 0);
  assert.equal(batch.poses().length, 2 * 4 * 7);
  assert.equal(batch.origins()[3], 0.5);
  const origins = large.origins();
  for (let i = 0; i < large.size; ++i) origins[3 * i] = 10 * i + 100;
  const second = world.runFrame({rules: [{a: batch}]});
  assert.deepEqual(second.toArray(), first);
  world.destroy();
});

// A world whose views are checked, of three links one on the other.
async function checkedWorld() {
  const module = await cab.load({checkViews: true});
  const world = module.createWorld();
  return {module, world, batch: world.addBatch(world.addArticulation(chain(1)), 3)};
}

test('a view that is checked is what a typed array is, until it ends', async () => {
  const {world, batch} = await checkedWorld();
  const identity = [0, 0, 0, 1, 0, 0, 0];
  const poses = batch.poses(), plain = Float32Array.from([...identity, ...identity, ...identity]);
  assert.ok(poses instanceof Float32Array);
  assert.equal(poses.constructor, Float32Array);
  assert.deepEqual([poses.length, poses.byteLength, 20 in poses, 21 in poses], [21, 84, true, false]);
  assert.deepEqual(Object.keys(poses), Object.keys(plain));
  assert.deepEqual([...poses], [...plain]);
  assert.deepEqual(new Float32Array(poses), plain);
  const copy = poses.slice(), other = new Float32Array(21);
  other.set(poses);
  assert.deepEqual([copy, other], [plain, plain]);
  poses[4] = 0.25;
  poses.set([0.5, 0.75], 5);
  const second = poses.subarray(7, 14);
  assert.equal(second.fill(2), second);
  assert.deepEqual([...batch.poses()].slice(4, 8), [0.25, 0.5, 0.75, 2]);
  assert.deepEqual([poses.findLastIndex((value) => value === 2), poses.indexOf(2)], [13, 7]);
  batch.poses().set(plain);
  const {length} = world.runFrame({rules: [{a: batch}]});
  assert.equal(length, 3);
  assert.throws(() => second[0], /get poses\(\) again/);  // a part ends with the whole
  assert.deepEqual(copy, plain);
});

test('a view that is checked throws after each call in which the memory may grow', async () => {
  const {module, world, batch} = await checkedWorld();
  const bytes = module.memory.buffer.byteLength, rules = [{a: batch}];
  const calls = [() => world.runFrame({rules}), () => world.runQueries({queries: []}), () => world.computeBoxes(batch),
                 () => world.addArticulation(chain(1)), () => world.explainJob({rules}), () => world.memory(),
                 () => batch.origins(), () => module.createWorld().destroy()];
  for (const call of calls) {
    const poses = batch.poses();
    assert.equal(poses.length, 21);
    call();
    const uses = [() => poses[0], () => { poses[0] = 1; }, () => poses.length, () => poses.set([1]), () => [...poses],
                  () => 0 in poses, () => Object.keys(poses), () => Object.getOwnPropertyDescriptor(poses, 0),
                  () => Object.defineProperty(poses, 0, {value: 1})];
    for (const use of uses) {
      assert.throws(use, {name: 'Error', message: /^cab: a call has been made .* get poses\(\) again$/}, `${call}`);
    }
  }
  assert.equal(module.memory.buffer.byteLength, bytes);  // it did not grow
  batch.origins();
  const poses = batch.poses(), set = poses.set;
  batch.origins();  // is there by now
  assert.equal(poses[3], 1);
  world.memory();
  assert.throws(() => set([1]), /get poses\(\) again/);  // a method that was taken out before
  assert.throws(() => { batch.instances = poses; world.runFrame({rules}); }, /get poses\(\) again/);
});

test('a view that is checked throws once its batch is removed, and hits once they are replaced', async () => {
  const {world, batch} = await checkedWorld();
  const job = {rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true};
  const hits = world.runFrame(job), words = hits.words(), contacts = hits.contactWords();
  assert.equal(words.length, 3 * hits.wordsPerHit);
  assert.equal(contacts.length, 3 * hits.wordsPerContact);
  assert.equal(world.diffHits(words, hits.words().slice()).began.length, 0);
  assert.throws(() => words[0], /get words\(\) again/);
  assert.throws(() => contacts[0], /get contactWords\(\) again/);
  const kept = hits.words();
  world.runFrame(job);
  assert.throws(() => kept[0], /these hits have been replaced/);
  const poses = batch.poses(), margins = batch.margins();
  world.remove(batch);
  assert.throws(() => poses[0], {name: 'TypeError', message: /the batch has been removed/});
  assert.throws(() => { margins[0] = 1; }, {name: 'TypeError', message: /the batch has been removed/});
});

test('memory that grows while a call is prepared loses no array of the call', async () => {
  // The hits and the lists of a first frame are taken after its arrays are named.
  for (const size of [3000, 30000, 120000]) {
    const module = await cab.load();
    const world = module.createWorld();
    const batch = world.addBatch(world.addArticulation(chain(1)), size);
    const origins = batch.origins();
    for (let i = 0; i < size; ++i) origins[3 * i] = 10 * Math.floor(i / 2);
    batch.instances = Uint32Array.from({length: size}, (_, i) => i);
    const hits = world.runFrame({rules: [{a: batch}]});
    assert.equal(hits.length, size / 2);
    assert.equal(hits.instanceB(size / 2 - 1), size - 1);
    world.destroy();
  }
});

// Takes the memory that there is, so that any call which needs more than 64 kB makes it grow.
function fillMemory({memory, exports}) {
  const {byteLength} = memory.buffer;
  let at;
  do at = exports.malloc(1 << 16);
  while (memory.buffer.byteLength === byteLength);
  exports.malloc(memory.buffer.byteLength - at - (1 << 17));
}

test('views of the memory that are deep inside an argument are read before the call lets it grow', async () => {
  const COUNT = 5000, cube = {half: [1, 1, 1]};
  for (const checkViews of [false, true]) {
    const module = await cab.load({checkViews});
    const world = module.createWorld();
    const batch = world.addBatch(world.addArticulation({linkParents: [-1], leaves: [{link: 0, box: cube}]}), COUNT);
    batch.origins().set(Float64Array.from({length: 3 * COUNT}, (_, i) => i % 3 ? 0 : 10 * (i / 3)));
    const place = (i) => batch.origins().subarray(3 * i, 3 * i + 3);
    const each = (make) => Array.from({length: COUNT}, (_, i) => make(place(i)));
    const grown = (call) => {
      fillMemory(module);
      const {byteLength} = module.memory.buffer, found = call();
      assert.ok(module.memory.buffer.byteLength > byteLength, `${call}`);
      return found;
    };
    const point = (position) => ({kind: 'point', length: 1, position});
    assert.ok(grown(() => world.runQueries({queries: each(point)})).found.every((one) => one === 1));
    const level = grown(() => world.addStaticBatch({bodies: each((origin) => ({origin, box: cube}))}));
    const hits = world.runFrame({rules: [{a: batch, b: level}], policies: {exact: 'convex'}, contacts: true});
    assert.equal(hits.length, COUNT);
    const lines = grown(() => {
      const contacts = hits.toArray().map(({contact}, i) => ({...contact, pointA: place(i).subarray()}));
      return world.boxLines(batch, {hits: hits.words(), contacts, origin: place(0)});
    });
    assert.equal(lines.count, 12 * COUNT + COUNT);
    const vertices = [0, 0, 0, 1, 0, 0, 0, 1, 0];
    batch.layers().set([0, 1, 2]);
    assert.equal(grown(() => world.addStaticBatch({
      vertices, triangles: batch.layers().subarray(0, 3), bodies: each((origin) => ({origin, box: cube})),
    })).size, COUNT + 1);
    world.destroy();
  }
});

test('a failing allocation is an error, and the world goes on', async () => {
  const module = await cab.load();
  const world = module.createWorld();
  const arm = world.addArticulation(chain(2));
  const batch = world.addBatch(arm, 2);
  batch.origins()[3] = 0.5;
  const {length} = world.runFrame({rules: [{a: batch}]});
  const {total} = world.memory();
  for (const size of [1 << 24, (1 << 24) - 1]) {
    assert.throws(() => world.addBatch(arm, size), {name: 'CabError', status: 'out_of_memory'});
  }
  assert.throws(() => world.reserve({queries: 0xffffffff}), {status: 'out_of_memory'});
  assert.throws(() => world.reserve({characters: 0x7fffffff}), {status: 'out_of_memory'});
  assert.equal(world.memory().total, total);
  assert.equal(world.runFrame({rules: [{a: batch}]}).length, length);
  world.destroy();
});

test('poses that find no memory take their batch with them', async () => {
  const module = await cab.load();
  const world = module.createWorld();
  const arm = world.addArticulation(chain(1024, {leaves: chain(1).leaves}));
  // 2136 MB of poses, of the 2147 MB of which the engine has some 50 already.
  assert.throws(() => world.addBatch(arm, 74500), {status: 'out_of_memory'});
  const batch = world.addBatch(arm, 2);
  assert.equal(batch.slot, 1);
  assert.ok(world.runFrame({rules: [{a: batch}]}).length > 0);
  world.destroy();
});

test('worlds that come and go, with batches, frames and queries, do not make the memory grow', async () => {
  const module = await cab.load();
  const live = () => {
    const world = module.createWorld();
    const batch = world.addBatch(world.addArticulation(chain(8)), 16);
    batch.inContact();
    assert.ok(world.runFrame({rules: [{a: batch}]}).length > 1000);
    batch.count = 2;
    assert.ok(world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true}).length > 10);
    world.runQueries({queries: [{kind: 'sphere', position: [0, 0, 0], radius: 9, want: 'all'}]});
    world.addStaticBatch({vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0], triangles: [0, 1, 2]}).inContact();
    world.remove(world.addBatch(batch.articulation, 50));
    assert.throws(() => world.addBatch(batch.articulation, 0));
    world.destroy();
  };
  for (let i = 0; i < 3; ++i) live();
  const bytes = module.memory.buffer.byteLength;
  for (let i = 0; i < 60; ++i) live();
  assert.equal(module.memory.buffer.byteLength, bytes);
});

test('memory that a call borrowed is given back after it', async () => {
  const module = await cab.load();
  const world = module.createWorld();
  const linkParents = new Int32Array(15e6);
  const refused = () => assert.throws(() => world.addArticulation({...chain(1), linkParents}),
                                      {status: 'too_many_links'});
  refused();
  refused();  // beside what is kept from the first
  const bytes = module.memory.buffer.byteLength;
  for (let i = 0; i < 3; ++i) refused();
  // Room where the 60 MB of the call were.
  module.exports.free(module.exports.malloc(50e6));
  assert.equal(module.memory.buffer.byteLength, bytes);
  world.destroy();
});
