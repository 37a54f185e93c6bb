// Writes recordings for tests, from the bytes and the schema that docs/recording.md describes: nothing of it is cab's
// own writer or reader.
import {crc32} from 'node:zlib';
import {Builder} from 'flatbuffers';
import * as format from 'recording-format';
import type {
  Articulation, Batch, Box, Frame, Header, Input, Level, Part, Poses, Settings, Skin, StaticBodies, Stats,
} from '../../perf/view/src/recording/types.js';

const SHAPES: readonly Part['kind'][] =
    ['box', 'ellipsoid', 'capsule', 'convex_hull', 'sphere', 'cylinder', 'half_space'];
const FORMATS: readonly Poses['format'][] = ['quaternion_translation', 'matrix3x4_rows', 'matrix4x4_columns'];

/** An input as it is written: what is left out is that of the frame before. */
export interface WrittenInput extends Input {
  sameAsBefore?: boolean;
  posesAsBefore?: boolean;
}

export interface WrittenFrame extends Omit<Frame, 'inputs'> {
  inputs: WrittenInput[];
}

export interface Contents {
  header?: Header;
  articulations?: readonly Articulation[];
  batches?: readonly Batch[];
  frames?: readonly WrittenFrame[];
  /** Above 0: poses are rounded. */
  poseStep?: number;
}

type Offsets = number[];

const boxNumbers = ({center, axis, half}: Box): number[] => [...center, ...axis, ...half];

class PayloadWriter {
  readonly builder = new Builder(1024);
  #settings = new Map<Settings, number>();

  constructor(readonly poseStep: number) {}

  #texts(texts: readonly string[], make: (offsets: Offsets) => number): number {
    return make(texts.map((text) => this.builder.createString(text)));
  }

  header(header: Header): number {
    const {builder} = this;
    const notes = this.#texts(header.notes, (offsets) => format.Header.createNotesVector(builder, offsets));
    const [library, title, isa] = [header.library, header.title, header.isa].map((text) => builder.createString(text));
    return format.Header.createHeader(builder, library!, title!, header.secondsPerFrame, header.metresPerUnit,
                                      header.up === '' ? 0 : header.up.charCodeAt(0), isa!, header.threads,
                                      header.poseStep, notes);
  }

  poses(poses: Poses, mayRound: boolean): number {
    const {builder, poseStep} = this;
    const isRounded = mayRound && poseStep > 0;
    const list = isRounded ? format.Poses.createRoundedVector(builder, rounded(poses.values, poseStep)) :
                             format.Poses.createValuesVector(builder, poses.values);
    return format.Poses.createPoses(builder, FORMATS.indexOf(poses.format), poses.hasScale, isRounded ? 0 : list,
                                    isRounded ? list : 0);
  }

  #parts(parts: readonly Part[]): Offsets {
    const {builder} = this;
    return parts.map(({kind, position, rotation, size, vertices}) => {
      const place = format.Part.createPlaceVector(builder, [...position, ...rotation, ...size]);
      return format.Part.createPart(builder, SHAPES.indexOf(kind), place,
                                    format.Part.createVerticesVector(builder, vertices));
    });
  }

  #level(level: Level): number {
    const {builder} = this;
    const leaves = format.Level.createLeavesVector(builder, level.leaves.map(({link, box, links}) => {
      const boxAt = format.LevelLeaf.createBoxVector(builder, boxNumbers(box));
      return format.LevelLeaf.createLevelLeaf(builder, link, boxAt,
                                              format.LevelLeaf.createLinksVector(builder, links));
    }));
    const rest = level.restPoses === null ? 0 : this.poses(level.restPoses, false);
    format.Level.startLevel(builder);
    format.Level.addOf(builder, level.of);
    format.Level.addKind(builder, level.kind === 'reach' ? 0 : 1);
    format.Level.addMaxLeaves(builder, level.maxLeaves);
    format.Level.addLeaves(builder, leaves);
    if (rest !== 0) format.Level.addRestPoses(builder, rest);
    format.Level.addRestPoseCount(builder, level.restPoseCount);
    format.Level.addJointPlay(builder, level.jointPlay);
    return format.Level.endLevel(builder);
  }

  #skin({vertices, influenceCount, influenceLinks, influenceWeights, inverseBind}: Skin): number {
    const {builder} = this;
    const lists = [
      format.Skin.createVerticesVector(builder, vertices),
      format.Skin.createInfluenceLinksVector(builder, influenceLinks),
      format.Skin.createInfluenceWeightsVector(builder, influenceWeights),
      inverseBind === null ? 0 : format.Skin.createInverseBindVector(builder, inverseBind),
    ] as const;
    return format.Skin.createSkin(builder, lists[0], influenceCount, lists[1], lists[2], lists[3]);
  }

  articulation(articulation: Articulation): number {
    const {builder} = this, {level, restPose} = articulation;
    const name = builder.createString(articulation.name);
    const names = this.#texts(articulation.linkNames,
                              (offsets) => format.Articulation.createLinkNamesVector(builder, offsets));
    const levelAt = level === null ? 0 : this.#level(level);
    const own = level === null;
    const parents = own ? format.Articulation.createLinkParentsVector(builder, articulation.linkParents) : 0;
    const joints = own ? format.Articulation.createLinkJointsVector(builder, articulation.linkJoints) : 0;
    const leaves = own ? format.Articulation.createLeavesVector(builder, articulation.leaves.map((leaf) => {
      const parts = format.Leaf.createPartsVector(builder, this.#parts(leaf.parts));
      const isRigid = leaf.triangles.length === 0;
      const box = isRigid ? format.Leaf.createBoxVector(builder, boxNumbers(leaf.box)) : 0;
      const triangles = isRigid ? 0 : format.Leaf.createTrianglesVector(builder, leaf.triangles);
      return format.Leaf.createLeaf(builder, leaf.link, box, parts, triangles);
    })) : 0;
    const skin = articulation.skin === null ? 0 : this.#skin(articulation.skin);
    const ignored = own ? format.Articulation.createIgnoredPairsVector(builder, articulation.ignoredPairs) : 0;
    const rest = restPose === null ? 0 : this.poses(restPose, false);
    format.Articulation.startArticulation(builder);
    format.Articulation.addName(builder, name);
    format.Articulation.addLinkNames(builder, names);
    if (own) {
      format.Articulation.addLinkParents(builder, parents);
      format.Articulation.addLinkJoints(builder, joints);
      format.Articulation.addLeaves(builder, leaves);
      format.Articulation.addIgnoredPairs(builder, ignored);
      format.Articulation.addIgnoredHops(builder, articulation.ignoredHops);
    }
    if (rest !== 0) format.Articulation.addRestPose(builder, rest);
    if (skin !== 0) format.Articulation.addSkin(builder, skin);
    if (levelAt !== 0) format.Articulation.addLevel(builder, levelAt);
    return format.Articulation.endArticulation(builder);
  }

  #staticBodies({bodies, vertices, triangles, origin}: StaticBodies): number {
    const {builder} = this;
    const list = format.StaticBodies.createBodiesVector(builder, bodies.map((body) => {
      const parts = format.StaticBody.createPartsVector(builder, this.#parts(body.parts));
      const box = format.StaticBody.createBoxVector(builder, boxNumbers(body.box));
      const rotation = format.StaticBody.createRotationVector(builder, body.rotation);
      return format.StaticBody.createStaticBody(builder, format.StaticBody.createPlaceVector(builder, body.origin),
                                                rotation, box, parts);
    }));
    const vertexList = format.StaticBodies.createVerticesVector(builder, vertices);
    const triangleList = format.StaticBodies.createTrianglesVector(builder, triangles);
    return format.StaticBodies.createStaticBodies(builder, list, vertexList, triangleList,
                                                  format.StaticBodies.createOriginVector(builder, origin));
  }

  batch(batch: Batch): number {
    const {builder} = this;
    const bodies = batch.staticBodies === null ? 0 : this.#staticBodies(batch.staticBodies);
    const name = builder.createString(batch.name);
    const names =
        this.#texts(batch.instanceNames, (offsets) => format.Batch.createInstanceNamesVector(builder, offsets));
    format.Batch.startBatch(builder);
    format.Batch.addSlot(builder, batch.slot);
    format.Batch.addArticulation(builder, Math.max(batch.articulation, 0));
    format.Batch.addInstanceCount(builder, batch.instanceCount);
    format.Batch.addName(builder, name);
    format.Batch.addInstanceNames(builder, names);
    if (bodies !== 0) format.Batch.addStaticBodies(builder, bodies);
    return format.Batch.endBatch(builder);
  }

  #input(input: WrittenInput): number {
    const {builder} = this, {Input: table} = format;
    const masked = input.masked.length > 0 ? table.createMaskedVector(builder, input.masked) : 0;
    const lists: [(at: Builder, list: number) => void, number][] = [];
    const add = <T>(value: T | null, create: (at: Builder, value: T) => number,
                    put: (at: Builder, list: number) => void): void => {
      if (value !== null) lists.push([put, create(builder, value)]);
    };
    if (!input.sameAsBefore) {
      if (!input.posesAsBefore) add(input.poses, (_, poses) => this.poses(poses, true), table.addPoses);
      add(input.origins, (at, list) => table.createOriginsVector(at, list), table.addOrigins);
      add(input.orientations, (at, list) => table.createOrientationsVector(at, list), table.addOrientations);
      add(input.scales, (at, list) => table.createScalesVector(at, list), table.addScales);
      add(input.layers, (at, list) => table.createLayersVector(at, list), table.addLayers);
      add(input.layerMasks, (at, list) => table.createLayerMasksVector(at, list), table.addLayerMasks);
      add(input.margins, (at, list) => table.createMarginsVector(at, list), table.addMargins);
      add(input.instances, (at, list) => table.createInstancesVector(at, list), table.addInstances);
    }
    table.startInput(builder);
    table.addBatch(builder, input.batch);
    if (masked !== 0) table.addMasked(builder, masked);
    for (const [put, list] of lists) put(builder, list);
    if (input.sameAsBefore) table.addSameAsBefore(builder, true);
    else table.addCount(builder, input.count);
    return table.endInput(builder);
  }

  #settingsOf(settings: Settings): number {
    const {builder} = this;
    const known = this.#settings.get(settings);
    if (known !== undefined) return known;
    const policies = format.Settings.createPoliciesVector(builder, Object.entries(settings.policies).map(
        ([field, value]) => {
          const name = builder.createString(field);
          return format.PolicyChoice.createPolicyChoice(builder, name, builder.createString(value));
        }));
    format.Settings.startRulesVector(builder, settings.rules.length);
    for (const {a, b, pairing} of [...settings.rules].reverse()) {
      format.Rule.createRule(builder, a, b, pairing === 'between' ? 0 : 1);
    }
    const made = format.Settings.createSettings(builder, policies, settings.margin, settings.minDepth,
                                                settings.report === 'hits' ? 0 : 2, settings.contacts,
                                                builder.endVector(), !settings.containment);
    this.#settings.set(settings, made);
    return made;
  }

  #stats(stats: Stats): number {
    const counts = [stats.candidates, stats.boxTests, stats.leafPairs, stats.exactTests, stats.falsePositives,
                    stats.instancesMasked].map((count) => BigInt(count));
    return format.Stats.createStats(this.builder, counts[0]!, counts[1]!, counts[2]!, counts[3]!, counts[4]!,
                                    counts[5]!, stats.secondsTotal);
  }

  frame(frame: WrittenFrame): number {
    const {builder} = this;
    const settings = this.#settingsOf(frame.settings);
    const inputs = format.Frame.createInputsVector(builder, frame.inputs.map((input) => this.#input(input)));
    const hits = format.Frame.createHitsVector(builder, frame.hits);
    const contacts = frame.contacts === null ? 0 :
        format.Frame.createContactsVector(builder, new Uint32Array(frame.contacts.slice().buffer));
    format.Frame.startFrame(builder);
    format.Frame.addTime(builder, frame.time);
    format.Frame.addSettings(builder, settings);
    format.Frame.addInputs(builder, inputs);
    format.Frame.addHits(builder, hits);
    if (contacts !== 0) format.Frame.addContacts(builder, contacts);
    format.Frame.addHash(builder, frame.hash);
    format.Frame.addStats(builder, this.#stats(frame.stats));
    return format.Frame.endFrame(builder);
  }
}

const rounded = (values: Float32Array, step: number): Int16Array =>
    Int16Array.from(values, (value, i) => Math.round(i % 7 < 4 ? value * 32767 : value / step));

export function payloadOf({header, articulations = [], batches = [], frames = [], poseStep = 0}: Contents): Uint8Array {
  const writer = new PayloadWriter(poseStep), {builder} = writer;
  const headerAt = header === undefined ? 0 : writer.header(header);
  const articulationsAt =
      format.Chunk.createArticulationsVector(builder, articulations.map((one) => writer.articulation(one)));
  const batchesAt = format.Chunk.createBatchesVector(builder, batches.map((one) => writer.batch(one)));
  const framesAt = format.Chunk.createFramesVector(builder, frames.map((one) => writer.frame(one)));
  format.Chunk.startChunk(builder);
  if (headerAt !== 0) format.Chunk.addHeader(builder, headerAt);
  format.Chunk.addArticulations(builder, articulationsAt);
  format.Chunk.addBatches(builder, batchesAt);
  format.Chunk.addFrames(builder, framesAt);
  builder.finishSizePrefixed(format.Chunk.endChunk(builder), 'CABR');
  return builder.asUint8Array().slice();
}

export interface ChunkFields {
  codec: number;
  flags: number;
  bytes: number;
  firstFrame: number;
  frameCount: number;
}

/** A header of a chunk, the payload and zeros. */
export function chunkOf(stored: Uint8Array, {codec, flags, bytes, firstFrame, frameCount}: ChunkFields): Uint8Array {
  const chunk = new Uint8Array(48 + 8 * Math.ceil(stored.length / 8));
  const view = new DataView(chunk.buffer);
  chunk.set(new TextEncoder().encode('CHNK'));
  view.setUint16(4, codec, true);
  view.setUint16(6, flags, true);
  view.setBigUint64(8, BigInt(stored.length), true);
  view.setBigUint64(16, BigInt(bytes), true);
  view.setUint32(24, firstFrame, true);
  view.setUint32(28, frameCount, true);
  view.setUint32(32, crc32(stored), true);
  view.setUint32(44, crc32(chunk.subarray(0, 44)), true);
  chunk.set(stored, 48);
  return chunk;
}

/** A chunk of what a payload has, stored unless `compress` makes zstd of it. */
export function chunkOfContents(contents: Contents, compress?: (payload: Uint8Array) => Uint8Array): Uint8Array {
  const payload = payloadOf(contents);
  const {header, articulations = [], batches = [], frames = []} = contents;
  return chunkOf(compress?.(payload) ?? payload, {
    codec: compress ? 1 : 0,
    flags: header !== undefined || articulations.length > 0 || batches.length > 0 ? 1 : 0,
    bytes: payload.length,
    firstFrame: frames[0]?.index ?? 0,
    frameCount: frames.length,
  });
}

/** The mark of the end. */
export const endOf = (frameCount: number): Uint8Array =>
    chunkOf(new Uint8Array(0), {codec: 0, flags: 2, bytes: 0, firstFrame: frameCount, frameCount: 0});

/** A file of chunks that ends after them, without the mark of its end. */
export function openFileOf(chunks: readonly Uint8Array[], version = 1): Uint8Array {
  const begin = new Uint8Array(16);
  begin.set(new TextEncoder().encode('CABREC\r\n'));
  new DataView(begin.buffer).setUint32(8, version, true);
  const file = new Uint8Array(chunks.reduce((sum, chunk) => sum + chunk.length, 16));
  let at = 0;
  for (const part of [begin, ...chunks]) {
    file.set(part, at);
    at += part.length;
  }
  return file;
}

/** A file of chunks, closed. */
export function fileOf(chunks: readonly Uint8Array[], version = 1): Uint8Array {
  const framesUntil = chunks.map((chunk) => {
    const view = new DataView(chunk.buffer, chunk.byteOffset);
    return view.getUint32(24, true) + view.getUint32(28, true);
  });
  return openFileOf([...chunks, endOf(Math.max(0, ...framesUntil))], version);
}
