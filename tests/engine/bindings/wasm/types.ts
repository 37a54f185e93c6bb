// A program that tsc checks against the package's types, and node runs. Lines that must not compile say so.
import {
  Articulation, ArticulationDesc, Batch, BatchBoxes, BoxLines, Box, Cab, CabError, Contact, FrameJob, History, Hits,
  hasSimd, load, LodDesc, MergeStep, Moment, Query, QueryHits, SkinDesc, TouchingTriangles, World
} from 'cab-collision';
import * as inline from 'cab-collision/inline';

const box: Box = {
  center: [0.5, 0, 0],
  axis: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  half: new Float32Array([0.5, 0.1, 0.1]),
};

async function main(): Promise<string> {
  const cab: Cab = await load({simd: hasSimd(), checkViews: false});
  const world: World = cab.createWorld({isa: 'auto'});
  const desc: ArticulationDesc = {
    linkParents: [-1, 0],
    linkJoints: new Float32Array(6),
    leaves: [{link: 0, box}, {link: 1, box, parts: [{kind: 'sphere', position: [0.5, 0, 0], size: [0.1, 0, 0]}]}],
    ignoredPairs: [{a: 0, b: 1}],
    ignoredHops: 1,
    restPose: {format: 'quaternion_translation', data: [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 9, 0, 0]},
  };
  const body: Articulation = world.addArticulation(desc);
  const batch: Batch = world.addBatch(body, 3, {kind: 'characters', format: 'quaternion_translation'});
  const poses: Float32Array = batch.poses();
  const origins: Float64Array = batch.origins();
  const flags: Uint8Array = batch.flags();
  origins[3] = 0.25;
  poses[4] = 0.125;
  batch.count = 2;
  batch.instances = [0, 1];

  const job: FrameJob = {
    rules: [{a: batch}, {a: batch, b: batch, pairing: 'within', resting: 'reported'}],
    policies: {refit: 'best3', strategy: 'rows', exact: 'convex', extents: 'leaves', sat: 'all_15'},
    margin: 0.5,
    minDepth: 0,
    report: 'hits',
    contacts: true,
  };
  const hits: Hits = world.runFrame(job);
  let depth = 0;
  for (const hit of hits) depth += hit.contact?.depth ?? NaN;
  const contactWords: Uint32Array = hits.contactWords();
  const boxes: BatchBoxes = world.computeBoxes(batch, {refit: 'cab'});
  const steps: MergeStep[] = world.mergeSteps(body);
  const lod: LodDesc = {of: body, kind: 'nodes', maxLeaves: 1, jointPlay: 0};
  const level: Articulation = world.addLod(lod);
  const same: boolean = hits.toArray().every((hit, i) => hit.linkA === hits.linkA(i) && hit.batchA === batch);

  const ray: Query = {position: [0, 0, 5], direction: [0, 0, -1], length: Infinity, ignoredBatch: batch};
  const region: Query = {kind: 'region', position: [0, 0, 0], planes: [{normal: [1, 0, 0], offset: 9}], want: 'all'};
  const met: QueryHits = world.runQueries({queries: [ray, region], exact: 'convex'});
  const links: number[] = Array.from(met, (hit) => hit.link);

  const skin: SkinDesc = {vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0], influenceCount: 1, influenceLinks: [0, 0, 0],
                          influenceWeights: [1, 1, 1]};
  const cloth = world.addArticulation({linkParents: [-1], leaves: [{link: 0, triangles: [0, 1, 2]}], skin});
  const triangles: TouchingTriangles = world.findTouchingTriangles(world.runFrame(job));
  const touching: number[] = triangles.toArray().map((pair) => pair.triangleA);
  const point = world.runQueries({queries: [region], exact: 'surface', surfacePoints: true}).at(0).surfacePoint;
  void [cloth, touching, point?.weights];

  const last: Moment = batch.moment();
  const history: History = world.addHistory(batch, 4);
  history.record(1);
  history.record(2, last);
  const then: QueryHits = world.runQueries({queries: [{...ray, time: 1.5}], histories: [history]});
  const margins: Float32Array = world.sweepMargins(last);
  const current: Hits = world.runFrame(job);
  const first: Float32Array = world.findTouchingMoments({last: [last], pairs: current, resolution: 0.01});
  const contacts: Contact[] = world.computeContacts(current.toArray());
  const began: number = world.diffHits(new Uint32Array(0), current).began.length;
  const lines: BoxLines = world.boxLines(batch, {hits: current, level: 'leaves', origin: [0, 0, 0]});
  const words: string = world.explainJob(job);
  const order: Uint32Array = world.spatialOrder(batch);
  const told: boolean = began === contacts.length && first.length === began && lines.count > 0 && words.length > 0 &&
      margins.length === 3 && then.found.length === 1 && order.length === 3;
  const packed: Cab = await inline.load({checkViews: true});
  // @ts-expect-error: it has its module
  const noOptions = () => inline.load({simd: false});
  // @ts-expect-error: no such source
  const noSource = () => load({path: '.'});
  // @ts-expect-error: made by Batch.moment
  const noMoment = () => world.sweepMargins(batch);
  // @ts-expect-error: no pair of links
  const noPairs = () => world.computeContacts([{instanceA: 1}]);
  void [packed.version, noOptions, noSource, noMoment, noPairs];

  let status = '';
  try {
    world.runFrame({...job, margin: -1});
  } catch (error) {
    if (error instanceof CabError && error.element === undefined) status = error.status;
  }

  // @ts-expect-error: no such strategy
  const noStrategy: FrameJob = {rules: [], policies: {strategy: 'trees'}};
  // @ts-expect-error: no such preset
  const noPreset: FrameJob = {rules: [], policies: 'fastest'};
  // @ts-expect-error: a rule needs a batch
  const noBatch: FrameJob = {rules: [{a: body}]};
  // @ts-expect-error: a leaf needs a box or triangles
  const noBox: ArticulationDesc = {linkParents: [-1], leaves: [{link: 0}]};
  // @ts-expect-error: a centre is no number
  const noCenter: Box = {...box, center: 1};
  // @ts-expect-error: not to be written
  const noLength = () => { hits.length = 3; };
  // @ts-expect-error: made by addBatch
  const noNew = () => new Batch();
  // @ts-expect-error: a level is of an articulation
  const noLod: LodDesc = {of: batch};
  void [noLod, contactWords, boxes.values, steps, noStrategy, noPreset, noBatch, noBox, noCenter, noLength, noNew,
        flags];

  world.remove(batch);
  world.remove(level);
  world.remove(body);
  world.destroy();
  return `${began > 0} ${depth > -9} ${same} ${links.length} ${status} ${told}`;
}

main().then((line) => console.log(line));
