// The ES module: what its calls answer, what they refuse in which words, and what its views show.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {runInNewContext} from 'node:vm';
import {abi, bone, cab, chain, folder} from './package.mjs';

const module = await cab.load();

// A world of two arms of two links, of which one link of each touch.
function arms(options = {}) {
  const world = module.createWorld();
  const arm = world.addArticulation(chain(2));
  const batch = world.addBatch(arm, 2, options);
  if (!options.format) {
    const half = Math.fround(0.7071068);
    batch.poses().set([0, 0, 0, 1, 0, 0, 0, 0, 0, half, half, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0]);
    batch.origins().set([0.6, 0.5, 0], 3);
  }
  return {world, arm, batch};
}

// The error that call() throws.
function thrown(call) {
  try {
    call();
  } catch (error) {
    return error;
  }
  return assert.fail('nothing was thrown');
}

test('two links that touch are one hit, as an object and as numbers', () => {
  const {world, batch} = arms();
  const hits = world.runFrame({rules: [{a: batch}]});
  assert.equal(hits.length, 1);
  const expected = {instanceA: 0, linkA: 1, leafA: 1, instanceB: 1, linkB: 0, leafB: 0};
  assert.deepEqual([...hits].map(({batchA, batchB, ...rest}) => rest), [expected]);
  assert.deepEqual([hits.instanceA(0), hits.linkA(0), hits.leafA(0)], [0, 1, 1]);
  assert.deepEqual([hits.instanceB(0), hits.linkB(0), hits.leafB(0)], [1, 0, 0]);
  assert.equal(hits.batchA(0), batch);
  assert.deepEqual([...hits.words()], [batch.slot, 0, batch.slot, 1, 1, 1]);
  assert.equal(hits.wordsPerHit, 6);
  assert.equal(hits.stats.candidates, 1);
  assert.ok(hits.stats.secondsTotal > 0);
  for (const i of [1, -1, 0.5, NaN, undefined, '0']) {
    assert.throws(() => hits.at(i), RangeError);
    assert.throws(() => hits.linkA(i), RangeError);
  }
  assert.throws(() => hits.contact(0), /not asked for contacts/);
  world.destroy();
});

test('hits are sorted by both instances, then by both links', () => {
  const world = module.createWorld(), arm = world.addArticulation(chain(2));
  const first = world.addBatch(arm, 3), second = world.addBatch(arm, 2);
  const hits = world.runFrame({rules: [{a: second, b: first}, {a: first}]}).toArray();
  const keys = hits.map(({batchA, instanceA, linkA, batchB, instanceB, linkB}) =>
      [batchA.slot, instanceA, batchB.slot, instanceB, linkA, linkB]);
  assert.equal(keys.length, 4 * (3 * 2 + 3));
  const compare = (x, y) => x.map((number, i) => number - y[i]).find((difference) => difference !== 0);
  for (let i = 1; i < keys.length; ++i) assert.ok(compare(keys[i - 1], keys[i]) < 0, `${keys[i - 1]}, ${keys[i]}`);
  world.destroy();
});

test('contacts of boxes that overlap by an eighth say so', () => {
  const world = module.createWorld();
  const block = world.addArticulation({linkParents: [-1], leaves: [{
    link: 0,
    box: {half: [1, 1, 1]},  // about the origin, along the axes of the link
    parts: [{kind: 'sphere', size: [1, 0, 0]}],
  }]});
  const batch = world.addBatch(block, 2);
  batch.origins()[3] = 1.875;
  const job = {rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true};
  const [hit] = world.runFrame(job);
  assert.equal(hit.contact.depth, 0.125);
  assert.deepEqual(hit.contact.normal, [1, 0, 0]);
  assert.deepEqual(hit.contact.pointA, [1, 0, 0]);
  assert.equal(world.runFrame({...job, minDepth: 0.25}).length, 0);
  assert.equal(world.runFrame({...job, containment: false}).length, 1);
  batch.origins()[3] = 2.5;
  assert.equal(world.runFrame(job).length, 0);
  const apart = world.runFrame({...job, margin: 1, report: 'distances'});
  assert.equal(apart.depth(0), -0.5);
  world.destroy();
});

test('contacts without an exact test are refused in the first frame, though nothing touches', () => {
  const {world, batch} = arms();
  batch.origins()[3] = 100;
  const error = thrown(() => world.runFrame({rules: [{a: batch}], contacts: true}));
  assert.equal(error.status, 'contacts_need_exact');
  const hits = world.runFrame({rules: [{a: batch}], policies: {exact: 'convex'}, contacts: true});
  assert.equal(hits.length, 0);
  assert.throws(() => hits.contact(0), RangeError);
  world.destroy();
});

test('policies are an object or the name of a preset, and both are checked', () => {
  const {world, batch} = arms();
  const rules = [{a: batch}];
  for (const policies of ['paper', 'tight', {strategy: 'brute', refit: 'best3'}]) {
    assert.equal(world.runFrame({rules, policies}).length, 1);
  }
  assert.throws(() => world.runFrame({rules, policies: 'fastest'}), /no preset 'fastest'$/);
  assert.throws(() => world.runFrame({rules, policies: 'fast'}), /no preset 'fast'$/);
  assert.throws(() => world.runFrame({rules, policies: {strategy: 'trees'}}),
                /Policies.strategy is 'trees', and not one of tree, rows/);
  assert.throws(() => world.runFrame({rules, policies: {speed: 'fast'}}), /no member 'speed'/);
  const error = thrown(() => world.runFrame({rules, policies: {exact: 'fcl'}}));
  assert.equal(error.status, 'exact_not_built');
  world.destroy();
});

test('what the engine refuses is an error with its words, its status and the element at fault', () => {
  const {world, arm, batch} = arms();
  const error = thrown(() => world.addArticulation({...chain(3), linkParents: [-1, 2, 1]}));
  assert.ok(error instanceof cab.CabError && error instanceof Error);
  assert.equal(error.name, 'CabError');
  assert.equal(error.status, 'bad_parent');
  assert.equal(error.element, 1);
  assert.equal(error.code, abi.enums.Status.values.bad_parent);
  assert.match(error.message, /^link_parents must be -1 for the first link.* \(element 1\)$/);

  const cases = [
    ['no_links', () => world.addArticulation({linkParents: [], leaves: []})],
    ['no_leaves', () => world.addArticulation({linkParents: [-1], leaves: []})],
    ['bad_leaf_axes', () => world.addArticulation({linkParents: [-1], leaves: [{link: 0, box: {...bone, axis: [
      [2, 0, 0], [0, 1, 0], [0, 0, 1]]}}]})],
    ['no_instances', () => world.addBatch(arm, 0)],
    ['bad_margin', () => world.runFrame({rules: [{a: batch}], margin: -1})],
    ['contacts_need_exact', () => world.runFrame({rules: [{a: batch}], contacts: true})],
    ['bad_pair_rule', () => world.runFrame({rules: [{a: batch}], batches: []})],
    ['pair_rule_given_twice', () => world.runFrame({rules: [{a: batch}, {a: batch}]})],
    ['articulation_in_use', () => world.remove(arm)],
    ['isa_not_available', () => module.createWorld({isa: 'neon64'})],
    ['bad_instance', () => world.whyMasked(batch, 2)],
    ['bad_vertices', () => module.fitBox([])],
    ['bad_query', () => world.runQueries({queries: [{position: [0, 0, 0], direction: [0, 0, 0], length: 1}]})],
  ];
  for (const [status, call] of cases) assert.equal(thrown(call).status, status);
  batch.origins()[0] = NaN;
  assert.equal(thrown(() => world.runFrame({rules: [{a: batch}]})).status, 'bad_origins');
  batch.origins()[0] = 0;
  assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
  world.destroy();
});

test('what no struct can hold is a TypeError or a RangeError that names the member', () => {
  const {world, batch} = arms();
  const cases = [
    [TypeError, /linkParent'/, () => world.addArticulation({...chain(2), linkParent: [-1, 0]})],
    [TypeError, /Leaf.link is not a number/,
     () => world.addArticulation({...chain(1), leaves: [{link: '0', box: bone}]})],
    [RangeError, /Leaf.link is 0.5, and not a whole number/,
     () => world.addArticulation({...chain(1), leaves: [{link: 0.5, box: bone}]})],
    [RangeError, /linkParents is -2147483649/, () => world.addArticulation({...chain(1), linkParents: [-2147483649]})],
    [TypeError, /Box.half needs 3 numbers, not 2/,
     () => world.addArticulation({...chain(1), leaves: [{link: 0, box: {...bone, half: [1, 1]}}]})],
    [TypeError, /leaves is not an array/, () => world.addArticulation({linkParents: [-1], leaves: 7})],
    [TypeError, /this is not a batch/, () => world.runFrame({rules: [{}]})],
    [TypeError, /runFrame takes no 'margins'/, () => world.runFrame({rules: [{a: batch}], margins: 1})],
    [TypeError, /LinkPair needs 'b'/, () => world.addArticulation({...chain(2), ignoredPairs: [{a: 0}]})],
    [TypeError, /addBatch takes no 'formt'/,
     () => world.addBatch(batch.articulation, 1, {formt: 'matrix4x4_columns', hasscale: true})],
    [TypeError, /format is 'matrix'/, () => world.addBatch(batch.articulation, 1, {format: 'matrix'})],
    [TypeError, /not what addArticulation returns/, () => world.addBatch(7, 1)],
    [TypeError, /neither a batch nor an articulation/, () => world.remove(7)],
    [TypeError, /createWorld takes no 'threads'/, () => module.createWorld({threads: 2})],
  ];
  for (const [type, words, call] of cases) {
    assert.throws(call, (error) => error instanceof type && words.test(error.message) && error.message.length < 200);
  }
  world.destroy();
});

test('a getter of what a call is given cannot make another call, and the world goes on', () => {
  const {world, arm, batch} = arms();
  const expected = [...world.runFrame({rules: [{a: batch}]}).words()];
  const calls = {
    runFrame: () => world.runFrame({rules: [{a: batch}]}),
    runQueries: () => world.runQueries({queries: [{kind: 'point'}]}),
    addBatch: () => world.addBatch(arm, 1),
    remove: () => world.remove(batch),
    reserve: () => world.reserve({batches: 9}),
    computeBoxes: () => world.computeBoxes(batch),
    computeContacts: () => world.computeContacts([]),
    findTouchingTriangles: () => world.findTouchingTriangles([]),
    explainJob: () => world.explainJob({rules: [{a: batch}]}),
    addHistory: () => world.addHistory(batch, 1),
    diffHits: () => world.diffHits([], []),
    sweepMargins: () => world.sweepMargins(batch.moment()),
    boxLines: () => world.boxLines(batch),
    spatialOrder: () => world.spatialOrder(batch),
    mergeSteps: () => world.mergeSteps(arm),
    memory: () => world.memory(),
    destroy: () => world.destroy(),
    fitBox: () => module.fitBox([0, 0, 0, 1, 1, 1]),
    createWorld: () => module.createWorld(),
  };
  for (const [name, call] of Object.entries(calls)) {
    const query = {kind: 'sphere', radius: 1};
    Object.defineProperty(query, 'length', {enumerable: true, get: () => (call(), 1)});
    assert.throws(() => world.runQueries({queries: [query]}), /makes another call/, name);
    const policies = Object.defineProperty({}, 'refit', {enumerable: true, get: () => (call(), 'cab')});
    assert.throws(() => world.runFrame({rules: [{a: batch}], policies}), /makes another call/, name);
    assert.deepEqual([...world.runFrame({rules: [{a: batch}]}).words()], expected, name);
  }
  world.destroy();
});

test('members that are getters of a class, or inherited, count as own ones do, and unknown ones throw', () => {
  const {world, arm, batch} = arms();
  class Ball {
    #place;
    kind = 'sphere';
    constructor(place) { this.#place = place; }
    get position() { return this.#place; }
    get radius() { return 1; }
    get want() { return 'any'; }
    move() { this.#place = [0, 0, 0]; }
  }
  const far = new Ball([1000, 0, 0]), near = new Ball([0, 0, 0]);
  assert.deepEqual([...world.runQueries({queries: [far, near]}).found], [0, 1]);
  class Half extends Ball {
    get planes() { return [{normal: [1, 0, 0], offset: -999}]; }
  }
  const half = Object.assign(new Half([0, 0, 0]), {kind: 'region'});
  assert.deepEqual([...world.runQueries({queries: [half]}).found], [0]);

  const rules = [{a: batch}], base = {margin: 100, rules};
  const all = world.runFrame({...base}).length;
  assert.ok(all > world.runFrame({rules}).length);
  assert.equal(world.runFrame(Object.create(base)).length, all);
  assert.equal(world.runFrame({rules, policies: Object.create({refit: 'best3'})}).length, 1);
  assert.equal(world.runFrame({rules: [Object.create({a: batch, pairing: 'within'})]}).length, 2);
  assert.equal(world.explainJob(Object.create({rules})), 'nothing is wrong');
  assert.equal(world.boxLines(batch, Object.create({level: 0})).count, 2 * 12);
  assert.equal(world.addArticulation(Object.create(chain(3))).linkCount, 3);
  assert.equal(world.addLod(Object.create({of: arm, kind: 'nodes', maxLeaves: 1})).leafCount, 1);
  assert.equal(world.addStaticBatch(Object.create({bodies: [Object.create({box: bone})]})).size, 1);
  assert.equal(module.createWorld(Object.create({isa: 'scalar'})).isa, 'scalar');
  const foreign = runInNewContext('({margin: 100})');
  assert.equal(world.runFrame(Object.assign(foreign, {rules})).length, all);

  class Wrong extends Ball {
    get radios() { return 1; }
  }
  const calls = [
    [/Query has no member 'radios'/, () => world.runQueries({queries: [new Wrong([0, 0, 0])]})],
    [/Policies has no member 'refits'/, () => world.runFrame({rules, policies: Object.create({refits: 'cab'})})],
    [/runFrame takes no 'margins'/, () => world.runFrame(Object.create({margins: 1, rules}))],
    [/runQueries takes no 'query'/, () => world.runQueries(Object.create({query: []}))],
    [/boxLines takes no 'colour'/, () => world.boxLines(batch, Object.create({colour: 1}))],
    [/createWorld takes no 'threads'/, () => module.createWorld(Object.create({threads: 2}))],
    [/the job is not an object/, () => world.runFrame()],
    [/Query is not an object/, () => world.runQueries({queries: [null]})],
  ];
  for (const [message, call] of calls) assert.throws(call, {name: 'TypeError', message});
  world.destroy();
});

test('names that every object has are members of no struct, values of no enumeration and no formats', () => {
  const {world, arm, batch} = arms();
  const rules = [{a: batch}];
  for (const name of ['__proto__', 'constructor', 'toString']) {
    const policies = JSON.parse(`{"${name}": {"x": 1}}`);
    assert.throws(() => world.runFrame({rules, policies}),
                  new RegExp(`TypeError: cab: Policies has no member '${name}'`));
    const query = JSON.parse(`{"kind": "ray", "${name}": 5}`);
    assert.throws(() => world.runQueries({queries: [query]}), new RegExp(`Query has no member '${name}'`));
    assert.throws(() => world.runFrame(JSON.parse(`{"${name}": 1}`)), new RegExp(`runFrame takes no '${name}'`));
    assert.throws(() => world.runFrame({rules, policies: {refit: name}}),
                  new RegExp(`is '${name}', and not one of cab`));
    assert.throws(() => world.addBatch(arm, 1, {format: name}), new RegExp(`format is '${name}', and not one of`));
  }
  assert.equal(world.runFrame({rules}).length, 1);
  world.destroy();
});

test('an instance of a batch that was removed cannot be left out of a query', () => {
  const {world, batch} = arms();
  const query = {kind: 'point', length: 9, ignoredBatch: batch, ignoredInstance: 0};
  assert.equal(world.runQueries({queries: [query]}).found[0], 1);
  world.remove(batch);
  assert.throws(() => world.runQueries({queries: [query]}), /removed/);
  world.destroy();
});

test('a bad pose masks only its own instance, and whyMasked says why', () => {
  const {world, batch} = arms();
  const flags = batch.flags();
  batch.poses()[7 + 4] = Infinity;
  const hits = world.runFrame({rules: [{a: batch}]});
  assert.equal(hits.length, 0);
  assert.equal(hits.stats.instancesMasked, 1);
  assert.deepEqual([...flags], [abi.enums.InstanceFlag.values.instance_not_finite, 0]);
  const reason = world.whyMasked(batch, 0);
  assert.deepEqual([reason.cause, reason.link, reason.index, reason.value], ['pose_number', 1, 4, Infinity]);
  assert.equal(world.whyMasked(batch, 1).cause, 'none');
  for (const instance of [NaN, -1, 1.7, 2 ** 32]) {
    assert.throws(() => world.whyMasked(batch, instance), {name: 'RangeError', message: /instance is .* whole number/});
  }
  for (const instance of [undefined, null, '0', {}]) {
    assert.throws(() => world.whyMasked(batch, instance), {name: 'TypeError', message: /instance is not a number/});
  }
  world.destroy();
});

test('arrays of a batch begin as what changes nothing, and count from then on', () => {
  const {world, batch} = arms();
  const rules = [{a: batch}];
  const begins = [batch.orientations(), batch.scales(), batch.layers(), batch.layerMasks(), batch.margins(),
                  batch.moved(), batch.inContact()].map((array) => [...array]);
  assert.deepEqual(begins, [[0, 0, 0, 1, 0, 0, 0, 1], [1, 1], [0xffffffff, 0xffffffff], [0xffffffff, 0xffffffff],
                            [0, 0], [1, 1], [0, 0]]);
  assert.equal(world.runFrame({rules}).length, 1);
  assert.deepEqual([...batch.inContact()], [1, 1]);
  batch.layers()[0] = 1;
  batch.layerMasks()[1] = 2;
  assert.equal(world.runFrame({rules}).length, 0);
  batch.layerMasks()[1] = 3;
  assert.equal(world.runFrame({rules}).length, 1);
  batch.scales()[1] = 0.001;
  assert.equal(world.runFrame({rules}).length, 0);
  batch.margins()[0] = 1;
  assert.ok(world.runFrame({rules}).length > 0);
  batch.count = 1;
  assert.equal(world.runFrame({rules}).length, 0);
  batch.count = 2;
  batch.instances = [1];
  assert.equal(world.runFrame({rules}).length, 0);
  batch.instances = new Uint32Array([0, 1]);
  assert.ok(world.runFrame({rules}).length > 0);
  world.destroy();
});

test('an empty list of instances is none of them, and null is all', () => {
  const {world, batch} = arms();
  const rules = [{a: batch}];
  const sphere = {kind: 'sphere', position: [0, 0, 0], radius: 9, want: 'all'};
  const inContact = batch.inContact();
  for (const none of [[], new Uint32Array(0)]) {
    batch.instances = null;
    assert.equal(world.runFrame({rules}).length, 1);
    assert.deepEqual([...inContact], [1, 1]);
    assert.equal(world.runQueries({queries: [sphere]}).length, 4);
    batch.instances = none;
    assert.equal(world.runFrame({rules}).length, 0);
    assert.deepEqual([...inContact], [0, 0]);
    assert.equal(world.runQueries({queries: [sphere]}).length, 0);
  }
  const detached = new Uint32Array([0]);
  structuredClone(detached.buffer, {transfer: [detached.buffer]});
  assert.equal(detached.length, 0);
  batch.instances = detached;
  assert.throws(() => world.runFrame({rules}), {name: 'TypeError', message: /Batch.instances is a view of memory/});
  assert.throws(() => world.addArticulation({...chain(1), linkJoints: detached}),
                {name: 'TypeError', message: /linkJoints is a view of memory/});
  batch.instances = 0;
  assert.throws(() => world.runFrame({rules}), {name: 'TypeError', message: /instances is not an array/});
  world.destroy();
});

test('a matrix by columns and one by rows pose as a quaternion does', () => {
  const quarter = {
    matrix4x4_columns: [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1],
    matrix3x4_rows: [0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0],
  };
  for (const [format, bent] of Object.entries(quarter)) {
    const {world, batch} = arms({format});
    const straight = format === 'matrix4x4_columns' ? [[12, 1]] : [[3, 1]];
    const floats = bent.length, poses = batch.poses();
    assert.equal(poses.length, 4 * floats);
    poses.set(bent, floats);
    for (const [at, value] of straight) poses[3 * floats + at] = value;
    batch.origins().set([0.6, 0.5, 0], 3);
    assert.deepEqual(world.runFrame({rules: [{a: batch}]}).toArray().map(({linkA, linkB}) => [linkA, linkB]), [[1, 0]]);
    world.destroy();
  }
});

test('rays, points, spheres, boxes, capsules and regions find the links that they meet', () => {
  const {world, batch} = arms();
  const other = world.addBatch(batch.articulation, 1);
  other.origins().set([100, 0, 0]);
  const up = {position: [0.25, 0, 5], direction: [0, 0, -2], length: 10};
  const hits = world.runQueries({exact: 'convex', queries: [
    up,
    {kind: 'point', position: [0.25, 0, 2], length: Infinity, want: 'closest'},
    {kind: 'sphere', position: [100.5, 0, 0], radius: 0.01, want: 'any'},
    {...up, ignoredBatch: batch, ignoredInstance: 0},
    {kind: 'box', position: [0, 0, 0], half: [10, 10, 10], want: 'all'},
    {kind: 'capsule', position: [0.5, 0, 0.2], radius: 0.1, half: [0, 0, 0.5], want: 'all', withDepth: true},
    {kind: 'region', position: [50, 0, 0], planes: [{normal: [-1, 0, 0], offset: 0}], want: 'all'},
  ]});
  assert.deepEqual([...hits.found], [1, 1, 1, 0, 1, 1, 1]);
  const of = (query) => hits.toArray().filter((hit) => hit.query === query);
  assert.deepEqual([of(0)[0].batch, of(0)[0].link, of(0)[0].distance, of(0)[0].inside], [batch, 0, 4.875, false]);
  assert.deepEqual(of(0)[0].normal, [0, 0, 1]);
  assert.deepEqual(of(1).map(({link, distance}) => [link, distance]), [[0, 1.875]]);
  assert.equal(of(4).length, 4);
  assert.ok(of(5)[0].distance < 0);
  assert.deepEqual(of(6).map((hit) => hit.batch), [other, other]);
  assert.ok(hits.stats.instances > 0);
  const bad = thrown(() => world.runQueries({queries: [up, {...up, length: -1}]}));
  assert.deepEqual([bad.status, bad.element], ['bad_query', 1]);
  world.destroy();
});

test('a region has as many planes as there is memory for', () => {
  const {world} = arms();
  const half = (offset) => ({normal: [1, 0, 0], offset}), region = {kind: 'region', position: [0, 0, 0]};
  const many = Array.from({length: 300000}, () => half(9));
  const planes = [many, [...many, half(-9)], [half(9)], [half(-9)]];
  const queries = planes.map((own) => ({...region, planes: own}));
  assert.deepEqual([...world.runQueries({queries}).found], [1, 0, 1, 0]);
  world.destroy();
});

test('queries ask all batches but sequences, and none of these', () => {
  const {world, arm, batch} = arms();
  const sequence = world.addBatch(arm, 2, {kind: 'sequence'});
  const wall = world.addStaticBatch({bodies: [{origin: [50, 0, 0], box: bone}]});
  const queries = [{kind: 'sphere', position: [0, 0, 0], radius: 100, want: 'all'}];
  assert.deepEqual(new Set(world.runQueries({queries}).toArray().map((hit) => hit.batch)), new Set([batch, wall]));
  assert.equal(thrown(() => world.runQueries({queries, batches: [batch, sequence]})).status, 'bad_batch_kind');
  world.destroy();
});

test('more queries than there was room for, and more hits, are all answered', () => {
  const {world, batch} = arms();
  const queries = Array.from({length: 2000}, () => ({kind: 'sphere', position: [0, 0, 0], radius: 100, want: 'all'}));
  assert.equal(world.runQueries({queries, batches: [batch]}).length, 8000);
  world.destroy();
});

test('static bodies and triangles of a mesh are instances of their batch', () => {
  const {world, batch} = arms();
  const level = world.addStaticBatch({
    bodies: [{origin: [0, 0, -0.5], box: {...bone, center: [0, 0, 0], half: [5, 5, 0.45]}}],
    vertices: new Float32Array([0.2, -1, 0, 0.2, 1, 0, 0.2, 0, 1]), triangles: [0, 1, 2],
  });
  assert.equal(level.size, 2);
  const hits = world.runFrame({rules: [{a: batch, b: level}]}).toArray();
  assert.deepEqual(hits.map((hit) => [hit.instanceA, hit.linkA, hit.instanceB]), [
    [0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0], [1, 1, 0]].sort((a, b) => a[0] - b[0] || a[2] - b[2]));
  assert.throws(() => level.poses(), /no poses/);
  const bad = thrown(() => world.addStaticBatch({vertices: [0, 0, 0, 1, 0, 0, 2, 0, 0], triangles: [0, 1, 2]}));
  assert.deepEqual([bad.status, bad.element], ['bad_shape', 0]);
  world.destroy();
});

test('what is removed takes no part, is refused afterwards, and gives its slot to the next', () => {
  const {world, arm, batch} = arms();
  const second = world.addBatch(arm, 2);
  const {slot} = second;
  assert.ok(world.runFrame({rules: [{a: batch, b: second}]}).length > 0);
  const before = world.memory();
  world.remove(second);
  assert.ok(world.memory().batches < before.batches);
  assert.throws(() => world.runFrame({rules: [{a: batch, b: second}]}), TypeError);
  assert.throws(() => second.poses(), /removed/);
  assert.throws(() => second.origins(), /removed/);
  assert.throws(() => world.remove(second), TypeError);
  assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
  const third = world.addBatch(arm, 2);
  assert.equal(third.slot, slot);
  assert.notEqual(third.id, second.id);
  world.remove(third);
  world.remove(batch);
  world.remove(arm);
  assert.equal(thrown(() => world.remove(arm)).status, 'unknown_articulation');
  assert.equal(thrown(() => world.addBatch(arm, 1)).status, 'unknown_articulation');
  const last = world.addBatch(world.addArticulation(chain(1)), 1);
  world.destroy();
  world.destroy();
  assert.throws(() => last.poses(), /removed/);
  assert.throws(() => world.memory(), /destroyed/);
});

test('a batch or an articulation of another module is refused, though its id is the same', async () => {
  const [first, second] = await Promise.all([cab.load(), cab.load()]);
  const [own, other] = [first, second].map((of) => {
    const world = of.createWorld();
    const arm = world.addArticulation(chain(2));
    return {world, arm, batch: world.addBatch(arm, 2)};
  });
  assert.deepEqual([own.arm.id, own.batch.id], [other.arm.id, other.batch.id]);
  const {world} = own;
  const query = {position: [0, 0, 0], direction: [1, 0, 0], length: 1};
  const calls = [
    () => world.addBatch(other.arm, 1),
    () => world.remove(other.arm),
    () => world.remove(other.batch),
    () => world.runFrame({rules: [{a: other.batch}]}),
    () => world.runFrame({rules: [{a: own.batch, b: other.batch}], batches: [own.batch]}),
    () => world.runQueries({queries: [query], batches: [other.batch]}),
    () => world.runQueries({queries: [{...query, ignoredBatch: other.batch, ignoredInstance: 0}]}),
    () => world.whyMasked(other.batch, 0),
  ];
  for (const call of calls) assert.throws(call, {name: 'TypeError', message: /is of another module$/});
  assert.equal(other.batch.poses().length, 2 * 2 * 7);
  assert.equal(world.runFrame({rules: [{a: own.batch}]}).length, 4);
  world.destroy();
  other.world.destroy();
});

test('a batch is no articulation and an articulation no batch, though both have an id', () => {
  const {world, arm, batch} = arms();
  const like = {id: batch.id};
  const query = {position: [0, 0, 0], direction: [1, 0, 0], length: 1};
  const calls = [
    [/not what addArticulation returns/, () => world.addBatch(batch, 1)],
    [/not what addArticulation returns/, () => world.addBatch({...arm}, 1)],
    [/PairRule.a is not what addBatch returns/, () => world.runFrame({rules: [{a: arm}], batches: [batch]})],
    [/ignoredBatch is not what addBatch returns/, () => world.runQueries({queries: [{...query, ignoredBatch: arm}]})],
    [/this is not a batch/, () => world.runFrame({rules: [{a: batch}], batches: [arm]})],
    [/this is not a batch/, () => world.runQueries({queries: [query], batches: [arm]})],
    [/this is not a batch/, () => world.whyMasked(arm, 0)],
    [/neither a batch nor an articulation/, () => world.remove(like)],
  ];
  for (const [message, call] of calls) assert.throws(call, {name: 'TypeError', message});
  assert.equal(world.runFrame({rules: [{a: batch}]}).length, 1);
  world.destroy();
});

test('hits of an earlier frame are refused, not shown as those of another', () => {
  const {world, batch} = arms();
  const hits = world.runFrame({rules: [{a: batch}]});
  const kept = hits.toArray();
  world.runFrame({rules: [{a: batch}]});
  assert.throws(() => hits.at(0), /toArray\(\) keeps/);
  assert.throws(() => hits.linkA(0), /toArray\(\) keeps/);
  assert.equal(kept.length, 1);
  const asked = world.runQueries({queries: [{kind: 'sphere', position: [0, 0, 0], radius: 9, want: 'all'}]});
  world.runFrame({rules: [{a: batch}]});
  assert.equal(asked.toArray().length, 4);
  world.remove(batch);
  assert.throws(() => asked.at(0), /toArray\(\) keeps/);
  world.destroy();
});

test('fitBox holds the points it is given', () => {
  const {center, axis, half} = module.fitBox([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 1]].flat());
  assert.equal(axis.length, 9);
  for (const point of [[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 1]]) {
    for (let k = 0; k < 3; ++k) {
      const along = [0, 1, 2].reduce((sum, c) => sum + axis[3 * k + c] * (point[c] - center[c]), 0);
      // The axes are orthonormal to rounding.
      assert.ok(Math.abs(along) <= half[k] * (1 + 1e-6));
    }
  }
});

test('the version is that of the package', () => {
  const {version} = JSON.parse(readFileSync(`${folder}/package.json`, 'utf8'));
  assert.equal(module.version, version);
});

test('calls of the C API that the module does not use are exported too', () => {
  for (const name of ['cab_add_lod', 'cab_diff_hits', 'cab_record_tick', 'cab_policy_table', 'malloc']) {
    assert.equal(typeof module.exports[name], 'function', `${name} in ${folder}`);
  }
});
