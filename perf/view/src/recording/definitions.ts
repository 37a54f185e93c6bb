// What frames refer to: the header of a recording, articulations and batches.
import type {
  Articulation as ArticulationTable, Batch as BatchTable, Header as HeaderTable, Leaf as LeafTable,
  Level as LevelTable, LevelLeaf as LevelLeafTable, Part as PartTable, Skin as SkinTable,
  StaticBodies as StaticBodiesTable, StaticBody as StaticBodyTable,
} from 'recording-format';
import type {Payload} from './payload.js';
import {readPoses} from './poses.js';
import type {
  Articulation, Batch, Box, Header, Leaf, Level, LevelLeaf, Part, Poses, ShapeKind, Skin, StaticBodies, StaticBody,
} from './types.js';

// The limits of the engine.
const MOST_LINKS = 1024;
const MOST_LEAVES = 1024;
const MOST_INSTANCES = 1 << 24;
const MOST_BATCHES = 4096;

const SHAPE_KINDS: readonly ShapeKind[] =
    ['box', 'ellipsoid', 'capsule', 'convex_hull', 'sphere', 'cylinder', 'half_space'];
const LEVEL_KINDS: readonly Level['kind'][] = ['reach', 'nodes'];

export interface Definitions {
  header: Header;
  articulations: Articulation[];
  batches: Batch[];
}

/** What a chunk defines, behind what is defined already. The first chunk has the header. */
export function readDefinitions(payload: Payload, before: Definitions | null): Definitions {
  const {root} = payload;
  const headerTable = root.header();
  if (before === null && headerTable === null) payload.fail('it has no header, and the first chunk needs one');
  const header = before === null ? readHeader(payload, headerTable!) : before.header;
  const articulations = [...before?.articulations ?? []];
  payload.list('articulation', root.articulationsLength(), (i) => root.articulations(i), (table) => {
    const what = `articulation ${articulations.length}`;
    articulations.push(readArticulation(payload, what, table, articulations, header.poseStep));
  });
  const batches = [...before?.batches ?? []];
  payload.list('batch', root.batchesLength(), (i) => root.batches(i), (table) => {
    batches.push(readBatch(payload, `batch ${batches.length}`, table, articulations));
  });
  return {header, articulations, batches};
}

function readHeader(payload: Payload, table: HeaderTable): Header {
  const finite = (what: string, number: number): number => {
    payload.check(Number.isFinite(number) && number >= 0, () => `the header's ${what} is ${number}`);
    return number;
  };
  const up = table.up();
  payload.check(up === 0 || (up >= 0x78 && up <= 0x7a), () => `the header's up is ${up}, and neither x, y nor z`);
  return {
    library: payload.text('library', table.library()),
    title: payload.text('title', table.title()),
    secondsPerFrame: finite('seconds per frame', table.secondsPerFrame()),
    metresPerUnit: finite('metres per unit', table.metresPerUnit()),
    up: up === 0 ? '' : String.fromCharCode(up) as 'x' | 'y' | 'z',
    isa: payload.text('isa', table.isa()),
    threads: table.threads(),
    poseStep: finite('step of poses', table.poseStep()),
    notes: payload.texts('note', table.notesLength(), (i) => table.notes(i)),
  };
}

function boxOf(numbers: Float32Array): Box {
  return {center: numbers.subarray(0, 3), axis: numbers.subarray(3, 12), half: numbers.subarray(12, 15)};
}

function readPart(payload: Payload, what: string, table: PartTable): Part {
  const place = payload.exactly(`${what}: its place`, 10, () => table.placeArray());
  const vertices = payload.numbers(`${what}: its vertices`, () => table.verticesArray()) ?? new Float32Array(0);
  payload.check(vertices.length % 3 === 0, () => `${what}: ${vertices.length} numbers are no vertices`);
  return {
    kind: payload.oneOf(`${what}: its kind`, SHAPE_KINDS, table.kind()),
    position: place.subarray(0, 3),
    rotation: place.subarray(3, 7),
    size: place.subarray(7, 10),
    vertices,
  };
}

function readParts(payload: Payload, what: string, table: LeafTable | StaticBodyTable): Part[] {
  return payload.list(`${what}: part`, table.partsLength(), (i) => table.parts(i),
                      (part, where) => readPart(payload, where, part));
}

function linkOf(payload: Payload, what: string, link: number, linkCount: number): number {
  payload.check(link < linkCount, () => `${what}: link ${link} is named, of ${linkCount}`);
  return link;
}

const POINT: Box = boxOf(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]));

function readLeaf(payload: Payload, what: string, table: LeafTable, linkCount: number, skin: Skin | null): Leaf {
  const triangles = payload.numbers(`${what}: its triangles`, () => table.trianglesArray()) ?? new Uint32Array(0);
  checkTriangles(payload, what, triangles, (skin?.vertices.length ?? 0) / 3);
  return {
    link: linkOf(payload, what, table.link(), linkCount),
    box: triangles.length > 0 ? POINT : boxOf(payload.exactly(`${what}: its box`, 15, () => table.boxArray())),
    parts: readParts(payload, what, table),
    triangles,
  };
}

function checkTriangles(payload: Payload, what: string, triangles: Uint32Array, vertexCount: number): void {
  payload.check(triangles.length % 3 === 0, () => `${what}: ${triangles.length} numbers are no triangles`);
  for (const vertex of triangles) {
    payload.check(vertex < vertexCount, () => `${what}: a triangle names vertex ${vertex}, of ${vertexCount}`);
  }
}

function readSkin(payload: Payload, what: string, table: SkinTable, linkCount: number): Skin {
  const vertices = payload.numbers(`${what}: its vertices`, () => table.verticesArray()) ?? new Float32Array(0);
  payload.check(vertices.length % 3 === 0, () => `${what}: ${vertices.length} numbers are no vertices`);
  const influenceCount = table.influenceCount(), influences = vertices.length / 3 * influenceCount;
  const influenceLinks = payload.numbers(`${what}: its links`, () => table.influenceLinksArray()) ?? new Uint32Array(0);
  const influenceWeights =
      payload.numbers(`${what}: its weights`, () => table.influenceWeightsArray()) ?? new Float32Array(0);
  payload.check(influenceLinks.length === influences && influenceWeights.length === influences,
                () => `${what}: ${influenceLinks.length} links and ${influenceWeights.length} weights, and ` +
                      `${influences} are needed`);
  for (const [i, link] of influenceLinks.entries()) {
    if (influenceWeights[i] !== 0) linkOf(payload, what, link, linkCount);
  }
  const inverseBind = payload.numbers(`${what}: its matrices`, () => table.inverseBindArray());
  payload.check(inverseBind === null || inverseBind.length === 16 * linkCount,
                () => `${what}: ${inverseBind?.length} numbers are not the matrices of ${linkCount} links`);
  return {vertices, influenceCount, influenceLinks, influenceWeights, inverseBind};
}

const namesOfLinks = (names: string[], count: number): string[] =>
    names.length > 0 ? names : Array.from({length: count}, (_, link) => `link ${link}`);

function readArticulation(payload: Payload, what: string, table: ArticulationTable,
                          before: readonly Articulation[], poseStep: number): Articulation {
  const levelTable = table.level();
  const name = payload.text(`${what}: its name`, table.name());
  const linkNames = payload.texts(`${what}: name of link`, table.linkNamesLength(), (i) => table.linkNames(i));
  const checkNames = (linkCount: number): void =>
      payload.check(linkNames.length === 0 || linkNames.length === linkCount,
                    () => `${what}: ${linkNames.length} names of ${linkCount} links`);
  if (levelTable !== null) {
    const of = before[levelTable.of()];
    if (of === undefined || of.level !== null) payload.fail(`${what} is a level of ${levelTable.of()}, which is none`);
    checkNames(of.linkParents.length);
    const level = readLevel(payload, what, levelTable, of.linkParents.length, poseStep);
    // Links, joints and what is ignored are those of the articulation that it is a level of.
    return {
      ...of,
      name,
      linkNames: linkNames.length > 0 ? linkNames : of.linkNames,
      leaves: level.leaves.map(({link, box}) => ({link, box, parts: [], triangles: new Uint32Array(0)})),
      restPose: null,
      level,
      skin: null,
    };
  }
  const linkParents = readParents(payload, what, table);
  const linkCount = linkParents.length;
  checkNames(linkCount);
  const joints = payload.numbers(`${what}: its joints`, () => table.linkJointsArray());
  payload.check(joints === null || joints.length === 3 * linkCount,
                () => `${what}: ${joints?.length} numbers are not the joints of ${linkCount} links`);
  const skinTable = table.skin();
  const skin = skinTable && readSkin(payload, `${what}: its skin`, skinTable, linkCount);
  const leaves = payload.list(`${what}: leaf`, table.leavesLength(), (i) => table.leaves(i),
                              (leaf, where) => readLeaf(payload, where, leaf, linkCount, skin));
  payload.check(leaves.length >= 1 && leaves.length <= MOST_LEAVES,
                () => `${what}: ${leaves.length} leaves, and 1 to ${MOST_LEAVES} may be`);
  const ignoredPairs = payload.numbers(`${what}: its ignored pairs`, () => table.ignoredPairsArray()) ??
      new Uint16Array(0);
  payload.check(ignoredPairs.length % 2 === 0, () => `${what}: ${ignoredPairs.length} numbers are no pairs of links`);
  for (const link of ignoredPairs) linkOf(payload, `${what}: its ignored pairs`, link, linkCount);
  const rest = table.restPose();
  return {
    name,
    linkNames: namesOfLinks(linkNames, linkCount),
    linkParents,
    linkJoints: joints ?? new Float32Array(3 * linkCount),
    leaves,
    ignoredPairs,
    ignoredHops: table.ignoredHops(),
    restPose: rest && readPoses(payload, `${what}: its rest pose`, rest, poseStep,
                                {least: linkCount, most: linkCount, links: linkCount}),
    level: null,
    skin,
  };
}

function readParents(payload: Payload, what: string, table: ArticulationTable): Int16Array {
  const parents = payload.numbers(`${what}: its links`, () => table.linkParentsArray()) ?? new Int16Array(0);
  payload.check(parents.length >= 1 && parents.length <= MOST_LINKS,
                () => `${what}: ${parents.length} links, and 1 to ${MOST_LINKS} may be`);
  parents.forEach((parent, link) => {
    payload.check(parent >= -1 && parent < link, () => `${what}: link ${link} has the parent ${parent}`);
  });
  return parents;
}

function readLevelLeaf(payload: Payload, what: string, table: LevelLeafTable, linkCount: number): LevelLeaf {
  const links = payload.numbers(`${what}: its links`, () => table.linksArray()) ?? new Uint32Array(0);
  for (const link of links) linkOf(payload, what, link, linkCount);
  return {
    link: linkOf(payload, what, table.link(), linkCount),
    box: boxOf(payload.exactly(`${what}: its box`, 15, () => table.boxArray())),
    links: [...links],
  };
}

function readLevel(payload: Payload, what: string, table: LevelTable, linkCount: number, poseStep: number): Level {
  const restPosesTable = table.restPoses(), restPoseCount = table.restPoseCount();
  const count = restPoseCount * linkCount;
  const restPoses: Poses | null = restPosesTable &&
      readPoses(payload, `${what}: its rest poses`, restPosesTable, poseStep,
                {least: count, most: count, links: linkCount});
  return {
    of: table.of(),
    kind: payload.oneOf(`${what}: its kind`, LEVEL_KINDS, table.kind()),
    maxLeaves: table.maxLeaves(),
    leaves: payload.list(`${what}: leaf`, table.leavesLength(), (i) => table.leaves(i),
                         (leaf, where) => readLevelLeaf(payload, where, leaf, linkCount)),
    restPoses,
    restPoseCount,
    jointPlay: table.jointPlay(),
  };
}

function readBatch(payload: Payload, what: string, table: BatchTable, articulations: readonly Articulation[]): Batch {
  const instanceCount = table.instanceCount(), slot = table.slot();
  payload.check(instanceCount >= 1 && instanceCount <= MOST_INSTANCES,
                () => `${what}: ${instanceCount} instances, and 1 to ${MOST_INSTANCES} may be`);
  payload.check(slot < MOST_BATCHES, () => `${what} has the slot ${slot}, of ${MOST_BATCHES}`);
  const instanceNames =
      payload.texts(`${what}: name of instance`, table.instanceNamesLength(), (i) => table.instanceNames(i));
  payload.check(instanceNames.length === 0 || instanceNames.length === instanceCount,
                () => `${what}: ${instanceNames.length} names of ${instanceCount} instances`);
  const staticTable = table.staticBodies(), articulation = table.articulation();
  const staticBodies = staticTable && readStaticBodies(payload, what, staticTable);
  if (staticBodies === null) {
    payload.check(articulation < articulations.length,
                  () => `${what} is of articulation ${articulation}, of ${articulations.length}`);
  } else {
    const bodies = staticBodies.bodies.length + staticBodies.triangles.length / 3;
    payload.check(bodies === instanceCount, () => `${what}: ${instanceCount} instances of ${bodies} static bodies`);
  }
  return {
    slot,
    articulation: staticBodies === null ? articulation : -1,
    instanceCount,
    name: payload.text(`${what}: its name`, table.name()),
    instanceNames,
    staticBodies,
  };
}

function readStaticBody(payload: Payload, what: string, table: StaticBodyTable): StaticBody {
  return {
    origin: payload.exactly(`${what}: its place`, 3, () => table.placeArray()),
    rotation: payload.exactly(`${what}: its rotation`, 4, () => table.rotationArray()),
    box: boxOf(payload.exactly(`${what}: its box`, 15, () => table.boxArray())),
    parts: readParts(payload, what, table),
  };
}

function readStaticBodies(payload: Payload, what: string, table: StaticBodiesTable): StaticBodies {
  const bodies = payload.list(`${what}: body`, table.bodiesLength(), (i) => table.bodies(i),
                              (body, where) => readStaticBody(payload, where, body));
  const vertices = payload.numbers(`${what}: its vertices`, () => table.verticesArray()) ?? new Float32Array(0);
  const triangles = payload.numbers(`${what}: its triangles`, () => table.trianglesArray()) ?? new Uint32Array(0);
  payload.check(vertices.length % 3 === 0, () => `${what}: ${vertices.length} numbers are no vertices`);
  checkTriangles(payload, what, triangles, vertices.length / 3);
  const origin = payload.numbers(`${what}: its origin`, () => table.originArray()) ?? new Float64Array(3);
  payload.check(origin.length === 3, () => `${what}: ${origin.length} numbers are no origin`);
  return {bodies, vertices, triangles, origin};
}
