// What one batch is drawn as: pieces, each with a geometry and a place on a link. Pieces with the same geometry become
// instances of one draw call.
import type * as THREE from 'three';
import type {Articulation, Batch, Box, Leaf, Part, StaticBody} from '../recording/types.js';
import {boxCorner, type Fineness, hull, unitBall, unitCapsule, unitCylinder, unitQuad} from './geometries.js';
import type {Look} from './instances.js';
import {ROWS, writeRotation} from './transforms.js';

export interface Piece {
  link: number;
  /** From the geometry to the link: 12 floats. */
  local: Float32Array;
}

export interface PieceGroup {
  geometry: THREE.BufferGeometry;
  look: Look;
  /** Half the extents of the geometry about its origin. */
  half: readonly [number, number, number];
  /** Whether it is a plane without end, which is not part of what the camera looks at. */
  endless: boolean;
  pieces: Piece[];
}

/** A leaf, or a static body, as far as drawing goes. */
interface Drawn {
  link: number;
  box: Box;
  parts: readonly Part[];
}

// 12 floats that take a box from -1 to 1 to `box`.
function boxRows(box: Box): Float32Array {
  const rows = new Float32Array(ROWS);
  for (let row = 0; row < 3; ++row) {
    for (let k = 0; k < 3; ++k) rows[row * 4 + k] = box.axis[k * 3 + row]! * box.half[k]!;
    rows[row * 4 + 3] = box.center[row]!;
  }
  return rows;
}

function partRows(part: Part, scale: readonly [number, number, number]): Float32Array {
  const rows = new Float32Array(ROWS);
  writeRotation(part.rotation, 0, 1, rows, 0);
  for (let row = 0; row < 3; ++row) {
    for (let k = 0; k < 3; ++k) rows[row * 4 + k]! *= scale[k]!;
    rows[row * 4 + 3] = part.position[row]!;
  }
  return rows;
}

class Collector {
  readonly #groups = new Map<string, PieceGroup>();
  readonly #fineness: Fineness;

  constructor(fineness: Fineness) {
    this.#fineness = fineness;
  }

  get groups(): PieceGroup[] {
    return [...this.#groups.values()];
  }

  add(drawn: Drawn): void {
    if (drawn.parts.length === 0) {
      this.#put('box', boxCorner, [1, 1, 1], {link: drawn.link, local: boxRows(drawn.box)});
      return;
    }
    for (const part of drawn.parts) this.#addPart(drawn, part);
  }

  #addPart({link, box}: Drawn, part: Part): void {
    const [x = 1, y = 1, z = 1] = part.size;
    const put = (key: string, make: () => THREE.BufferGeometry, half: readonly [number, number, number],
                 scale: readonly [number, number, number]): void =>
      this.#put(key, make, half, {link, local: partRows(part, scale)});
    switch (part.kind) {
      case 'box':
        return put('box', boxCorner, [1, 1, 1], [x, y, z]);
      case 'ellipsoid':
        return put('ball', () => unitBall(this.#fineness), [1, 1, 1], [x, y, z]);
      case 'sphere':
        return put('ball', () => unitBall(this.#fineness), [1, 1, 1], [x, x, x]);
      case 'cylinder':
        return put('cylinder', () => unitCylinder(this.#fineness), [1, 1, 1], [x, x, y]);
      case 'capsule': {
        const length = y / x;
        return put(`capsule ${length.toPrecision(6)}`, () => unitCapsule(length, this.#fineness), [1, 1, 1 + length],
                   [x, x, x]);
      }
      case 'half_space': {
        const size = 2 * Math.hypot(...box.half);
        return put('half space', unitQuad, [1, 1, 0], [size, size, 1]);
      }
      case 'convex_hull':
        return put(`hull ${part.vertices.join(' ')}`, () => hull(part.vertices), extentsOf(part.vertices), [1, 1, 1]);
    }
  }

  #put(key: string, make: () => THREE.BufferGeometry, half: readonly [number, number, number], piece: Piece): void {
    const known = this.#groups.get(key);
    if (known) {
      known.pieces.push(piece);
    } else {
      const geometry = make();
      const look = key === 'box' ? 'box' : geometry.hasAttribute('normal') ? 'round' : 'flat';
      this.#groups.set(key, {geometry, look, half, endless: key === 'half space', pieces: [piece]});
    }
  }
}

function extentsOf(vertices: Float32Array): [number, number, number] {
  const half: [number, number, number] = [0, 0, 0];
  vertices.forEach((value, i) => {
    const k = i % 3;
    half[k] = Math.max(half[k]!, Math.abs(value));
  });
  return half;
}

// The leaves that are drawn as pieces. A level of nodes has none of its own, so it is drawn as what it is a level of.
function leavesOf(articulations: readonly Articulation[], index: number): readonly Leaf[] {
  const articulation = articulations[index];
  if (!articulation) return [];
  const {level} = articulation;
  if (!level) return articulation.leaves.filter(({triangles}) => triangles.length === 0);
  if (level.kind === 'reach' && level.leaves.length > 0) {
    return articulation.leaves;
  }
  return articulations[level.of]?.leaves ?? [];
}

/** How many links poses of a batch have. */
export function linkCountOf(articulations: readonly Articulation[], batch: Batch): number {
  const articulation = articulations[batch.articulation];
  if (!articulation) return 0;
  const base = articulation.level ? articulations[articulation.level.of] : articulation;
  return base?.linkParents.length ?? 0;
}

export function characterPieces(articulations: readonly Articulation[], batch: Batch,
                                fineness: Fineness): PieceGroup[] {
  const collector = new Collector(fineness);
  for (const leaf of leavesOf(articulations, batch.articulation)) collector.add(leaf);
  return collector.groups;
}

/** Static bodies are drawn as the links of one character. */
export function staticPieces(bodies: readonly StaticBody[]): PieceGroup[] {
  const collector = new Collector(bodies.length > 200 ? 'coarse' : 'fine');
  bodies.forEach(({box, parts}, link) => collector.add({link, box, parts}));
  return collector.groups;
}
