// The 300 frames of tests/embed/golden, through the ES module: their hits have the same hash in every language and by
// every instruction set, with SIMD in the module and without.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {cab, chain, Hash, Numbers} from './package.mjs';

const expected = readFileSync(new URL('../../../embed/golden/expected.txt', import.meta.url), 'utf8').trim();
const REFITS = ['cab', 'best3', 'cab_sum', 'covariance', 'aabb_hull', 'aabb_vertices'];
const STRATEGIES = ['tree', 'rows', 'links', 'brute'];
const LINKS = 8, INSTANCES = 64, FRAMES = 300;

function golden(module, isa) {
  const world = module.createWorld({isa});
  const batch = world.addBatch(world.addArticulation(chain(LINKS)), INSTANCES);
  const origins = batch.origins();
  for (let i = 0; i < INSTANCES; ++i) origins.set([1.5 * (i % 8), 1.5 * Math.floor(i / 8), 0], 3 * i);

  const numbers = new Numbers(1);
  const hash = new Hash();
  let most = 0;
  for (let frame = 0; frame < FRAMES; ++frame) {
    const poses = batch.poses();
    for (let i = 0; i < poses.length; ++i) poses[i] = i % 7 < 4 ? numbers.next() : 2 * numbers.next();
    const contacts = frame % 3 === 2;
    const hits = world.runFrame({
      rules: [{a: batch}, {a: batch, pairing: 'within'}],
      policies: {
        refit: REFITS[frame % REFITS.length],
        strategy: STRATEGIES[frame % 4],
        extents: frame % 2 ? 'leaves' : 'children',
        exact: contacts ? 'convex' : 'none',
      },
      contacts,
    });
    hash.add(hits.length);
    for (let i = 0; i < hits.length; ++i) {
      for (const word of [hits.batchA(i).slot, hits.instanceA(i), hits.batchB(i).slot, hits.instanceB(i), hits.linkA(i),
                          hits.linkB(i)]) {
        hash.add(word);
      }
      if (contacts) hash.addFloats(hits.depth(i));
    }
    most = Math.max(most, hits.length);
  }
  assert.equal(world.isa, isa);
  assert.ok(most > 100, `only ${most} hits in a frame`);
  world.destroy();
  return hash.toString();
}

for (const [simd, isas] of [[true, ['scalar', 'wasm128']], [false, ['scalar']]]) {
  const module = await cab.load({simd});
  test(`the module ${simd ? 'with' : 'without'} SIMD has the instruction sets ${isas.join(' and ')}`, () => {
    assert.deepEqual(module.instructionSets, isas);
    const world = module.createWorld();
    assert.equal(world.isa, isas.at(-1));
    world.destroy();
  });
  for (const isa of isas) {
    test(`the golden frames have their hash by ${isa}, in the module ${simd ? 'with' : 'without'} SIMD`, () => {
      assert.equal(golden(module, isa), expected);
    });
  }
}
