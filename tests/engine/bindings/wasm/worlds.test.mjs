// The frames and queries of worlds.cpp through the ES module: answers have the hash of native code, which is over all
// bits of contacts and of the hits of queries.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import test from 'node:test';
import {abi, cab, Hash, Numbers} from './package.mjs';

const expected = readFileSync(new URL('worlds.txt', import.meta.url), 'utf8').trim();
const LINKS = 6, FIGURES = 48, CRATES = 16, FRAMES = 24;
const named = (enumeration) => Object.keys(abi.enums[enumeration].values);
const [REFITS, STRATEGIES, SATS] = ['Refit', 'Strategy', 'Sat'].map(named);
const [KINDS, WANTS] = ['QueryKind', 'QueryWant'].map(named);

const boxOf = (x, y, z, along) => ({center: [along, 0, 0], axis: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], half: [x, y, z]});

function figure() {
  const kinds = ['box', 'sphere', 'capsule', 'convex_hull', 'cylinder', 'ellipsoid'];
  const sizes = [[0.5, 0.25, 0.125], [0.25, 0, 0], [0.125, 0.125, 0], [0, 0, 0], [0.125, 0.25, 0], [0.5, 0.25, 0.125]];
  const hull = [-0.5, 0, -0.25, 0.5, 0.25, 0, 0.5, -0.25, 0, -0.5, 0, 0.25];
  const links = Array.from({length: LINKS}, (_, link) => link);
  return {
    linkParents: links.map((link) => link - 1),
    linkJoints: links.flatMap((link) => [link === 0 ? 0 : 0.0625, 0, 0]),
    leaves: links.map((link) => ({
      link,
      box: boxOf(0.5, 0.25, 0.25, 0.5),
      parts: [{
        kind: kinds[link],
        position: [0.5, 0, 0],
        size: sizes[link],
        vertices: kinds[link] === 'convex_hull' ? hull : [],
      }],
    })),
    ignoredHops: 1,
  };
}

const level = {
  bodies: [{origin: [0, 0, -3.5], box: boxOf(8, 8, 0.5, 0)}],
  vertices: [-4, -4, -2, 4, -4, -2, 4, 4, 1, -4, 4, 1],
  triangles: [0, 1, 2, 0, 2, 3],
  origin: [0.25, 0, 0],
};

function ask(numbers, ignored) {
  const some = (count, by = 1) => Array.from({length: count}, () => by * numbers.next());
  return Array.from({length: 36}, (_, i) => {
    const query = {
      kind: KINDS[i % 6],
      want: WANTS[Math.floor(i / 6) % 3],
      position: some(3, 4),
      direction: some(3),
      orientation: some(4),
      length: 4,
      radius: i % 6 === 0 ? 0.125 : 0.75,
      half: [0.5, 0.5, 0.5],
      withDepth: i % 4 === 1,
      maxHits: 5,
      layerMask: i % 5 ? 0xffffffff : 3,
    };
    query.orientation[3] += 2;
    if (i % 7 === 3) Object.assign(query, {ignoredBatch: ignored, ignoredInstance: i});
    if (query.kind === 'region') query.planes = [0, 1].map(() => ({normal: some(3), offset: 0.25}));
    return query;
  });
}

function answers(module, isa) {
  const world = module.createWorld({isa});
  const ground = world.addStaticBatch(level);
  const figures = world.addBatch(world.addArticulation(figure()), FIGURES);
  const crate = {linkParents: [-1], leaves: [{link: 0, box: boxOf(0.5, 0.375, 0.25, 0)}]};
  const crates = world.addBatch(world.addArticulation(crate), CRATES, {format: 'matrix3x4_rows'});
  for (let i = 0; i < FIGURES; ++i) {
    figures.origins().set([i % 4, Math.floor(i / 4) % 4, Math.floor(i / 16)].map((at) => 1.25 * at - 2), 3 * i);
    figures.scales()[i] = [0.5, 1, 1.25][i % 3];
    figures.margins()[i] = (i % 2) / 64;
    figures.layers()[i] = 1 << i % 3;
    figures.layerMasks()[i] = i % 5 === 0 ? 1 : 7;
  }
  for (let i = 0; i < CRATES; ++i) {
    crates.origins().set([1.5 * (i % 4) - 2, 1.5 * Math.floor(i / 4) - 2, -2.75], 3 * i);
  }
  figures.flags();
  crates.inContact();

  const numbers = new Numbers(7);
  const hash = new Hash();
  let hitCount = 0, queryHitCount = 0;
  for (let frame = 0; frame < FRAMES; ++frame) {
    const poses = figures.poses(), orientations = figures.orientations(), matrices = crates.poses();
    for (let i = 0; i < poses.length; ++i) poses[i] = i % 7 === 3 ? numbers.next() + 1.25 : numbers.next();
    for (let i = 0; i < orientations.length; ++i) orientations[i] = i % 4 === 3 ? numbers.next() + 2 : numbers.next();
    for (let i = 0; i < CRATES; ++i) {
      const matrix = matrices.subarray(12 * i, 12 * i + 12);
      for (let c = 0; c < 12; ++c) matrix[c] = c % 4 === 3 ? numbers.next() : 0;
      for (let row = 0; row < 3; ++row) matrix[4 * row + (i + row) % 3] = frame % 2 ? -1 : 1;
    }
    if (frame === 5) poses[70] = 2e18;

    const exact = frame % 4 !== 3;
    const hits = world.runFrame({
      batches: [ground, figures, crates],
      rules: [{a: figures}, {a: figures, pairing: 'within'}, {a: figures, b: crates}, {a: crates},
              {a: crates, b: ground}, {a: figures, b: ground}],
      policies: {
        refit: REFITS[frame % REFITS.length],
        strategy: frame % 6 < 4 ? STRATEGIES[frame % 6] : 'auto',
        sat: SATS[Math.floor(frame / 2) % 2],
        exact: exact ? 'convex' : 'none',
      },
      margin: (frame % 3) / 64,
      minDepth: frame % 8 === 1 ? 0.0625 : 0,
      report: frame % 8 === 6 ? 'distances' : 'hits',
      contacts: exact,
    });
    hitCount += hits.length;
    for (const word of [hits.length, hits.stats.candidates, hits.stats.boxTests]) hash.add(word);
    for (const hit of hits) {
      for (const word of [hit.batchA.slot, hit.instanceA, hit.batchB.slot, hit.instanceB, hit.linkA, hit.linkB,
                          hit.leafA, hit.leafB]) {
        hash.add(word);
      }
      if (!exact) continue;
      hash.addFloats(...hit.contact.normal, hit.contact.depth, ...hit.contact.pointA, ...hit.contact.pointB);
    }
    for (const flag of figures.flags()) hash.add(flag);
    for (const isIn of crates.inContact()) hash.add(isIn);

    const met = world.runQueries({
      queries: ask(numbers, figures),
      batches: [ground, figures, crates],
      exact: frame % 2 ? 'convex' : 'none',
      reuseBounds: frame % 3 === 1,
    });
    queryHitCount += met.length;
    hash.add(met.length);
    for (const one of met.found) hash.add(one);
    for (const hit of met) {
      for (const word of [hit.query, hit.batch.slot, hit.instance, hit.link, hit.leaf, hit.inside ? 1 : 0]) {
        hash.add(word);
      }
      hash.addFloats(hit.distance, ...hit.point, ...hit.normal);
    }
  }
  world.destroy();
  return `${hash} ${hitCount} ${queryHitCount}`;
}

for (const simd of [true, false]) {
  const module = await cab.load({simd});
  for (const isa of module.instructionSets) {
    test(`frames and queries answer what native code does, by ${isa}, in the module ${simd ? 'with' : 'without'} SIMD`,
         () => assert.equal(answers(module, isa), expected));
  }
}
