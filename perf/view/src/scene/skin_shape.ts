// The triangles of a skin, and where they are once the links stand somewhere: a linear blend, as the engine has it.
import type {Articulation, Skin} from '../recording/types.js';
import {multiply, ROWS} from './transforms.js';

export class SkinShape {
  readonly vertexCount: number;
  /** Three vertices per triangle, the leaves one after the other. */
  readonly corners: Uint32Array;
  /** By triangle: the link of its leaf. */
  readonly links: Uint16Array;
  /** By leaf, which of the triangles is its first; then how many there are. */
  readonly firstOfLeaf: Uint32Array;
  readonly #skin: Skin;
  /** Those of a vertex add to 1. */
  readonly #weights: Float32Array;
  /** 12 floats per link; null: all links are bound where they are. */
  readonly #binds: Float32Array | null;
  readonly #normals: Float32Array;
  /** From the skin to the scene, 12 floats per link. */
  readonly #moved: Float32Array;

  /** Null: no leaf has triangles. */
  static of(articulation: Articulation | undefined): SkinShape | null {
    const {skin, leaves} = articulation ?? {skin: null, leaves: []};
    return skin && leaves.some(({triangles}) => triangles.length > 0) ? new SkinShape(articulation!, skin) : null;
  }

  private constructor({leaves, linkParents}: Articulation, skin: Skin) {
    this.#skin = skin;
    this.vertexCount = skin.vertices.length / 3;
    this.firstOfLeaf = new Uint32Array(leaves.length + 1);
    leaves.forEach(({triangles}, leaf) => {
      this.firstOfLeaf[leaf + 1] = this.firstOfLeaf[leaf]! + triangles.length / 3;
    });
    const count = this.firstOfLeaf[leaves.length]!;
    this.corners = new Uint32Array(3 * count);
    this.links = new Uint16Array(count);
    leaves.forEach(({triangles, link}, leaf) => {
      const first = this.firstOfLeaf[leaf]!;
      this.corners.set(triangles, 3 * first);
      this.links.fill(link, first, first + triangles.length / 3);
    });
    this.#weights = shares(skin);
    this.#binds = skin.inverseBind && rowsOf(skin.inverseBind);
    this.#normals = normalsOf(skin.vertices, this.corners);
    this.#moved = new Float32Array(ROWS * linkParents.length);
  }

  get triangleCount(): number {
    return this.links.length;
  }

  /** Writes where vertices are and where their normals point, for links that stand at `rows` from `first` on. */
  place(rows: Float32Array, first: number, positions: Float32Array, normals: Float32Array): void {
    const moved = this.#moved, {vertices, influenceCount, influenceLinks} = this.#skin;
    for (let at = 0; at < moved.length; at += ROWS) {
      if (this.#binds) multiply(rows, first + at, this.#binds, at, moved, at);
      else moved.set(rows.subarray(first + at, first + at + ROWS), at);
    }
    const weights = this.#weights, rest = this.#normals;
    for (let v = 0, i = 0; v < vertices.length; v += 3) {
      const x = vertices[v]!, y = vertices[v + 1]!, z = vertices[v + 2]!;
      const nx = rest[v]!, ny = rest[v + 1]!, nz = rest[v + 2]!;
      let px = 0, py = 0, pz = 0, qx = 0, qy = 0, qz = 0;
      for (const end = i + influenceCount; i < end; ++i) {
        const weight = weights[i]!;
        if (weight === 0) continue;
        const m = ROWS * influenceLinks[i]!;
        const m0 = moved[m]!, m1 = moved[m + 1]!, m2 = moved[m + 2]!, m4 = moved[m + 4]!, m5 = moved[m + 5]!;
        const m6 = moved[m + 6]!, m8 = moved[m + 8]!, m9 = moved[m + 9]!, m10 = moved[m + 10]!;
        px += weight * (m0 * x + m1 * y + m2 * z + moved[m + 3]!);
        py += weight * (m4 * x + m5 * y + m6 * z + moved[m + 7]!);
        pz += weight * (m8 * x + m9 * y + m10 * z + moved[m + 11]!);
        qx += weight * (m0 * nx + m1 * ny + m2 * nz);
        qy += weight * (m4 * nx + m5 * ny + m6 * nz);
        qz += weight * (m8 * nx + m9 * ny + m10 * nz);
      }
      positions[v] = px;
      positions[v + 1] = py;
      positions[v + 2] = pz;
      normals[v] = qx;
      normals[v + 1] = qy;
      normals[v + 2] = qz;
    }
  }
}

// Weights that add to 1 per vertex. A weight that is not above 0 has no effect.
function shares({influenceCount, influenceWeights}: Skin): Float32Array {
  const out = influenceWeights.map((weight) => weight > 0 ? weight : 0);
  for (let at = 0; at < out.length; at += influenceCount) {
    let sum = 0;
    for (let i = at; i < at + influenceCount; ++i) sum += out[i]!;
    for (let i = at; i < at + influenceCount && sum > 0; ++i) out[i]! /= sum;
  }
  return out;
}

// Matrices by columns as rows of four.
function rowsOf(columns: Float32Array): Float32Array {
  const rows = new Float32Array(columns.length / 16 * ROWS);
  for (let i = 0; i < rows.length; ++i) {
    const at = i % ROWS;
    rows[i] = columns[Math.floor(i / ROWS) * 16 + at % 4 * 4 + Math.floor(at / 4)]!;
  }
  return rows;
}

// Of each vertex the sum of the normals of its triangles, by their areas. Lengths do not matter.
function normalsOf(vertices: Float32Array, corners: Uint32Array): Float32Array {
  const out = new Float32Array(vertices.length);
  for (let c = 0; c < corners.length; c += 3) {
    const [a, b, d] = [3 * corners[c]!, 3 * corners[c + 1]!, 3 * corners[c + 2]!];
    const side = (to: number, k: number): number => vertices[to + k]! - vertices[a + k]!;
    for (let k = 0; k < 3; ++k) {
      const l = (k + 1) % 3, m = (k + 2) % 3;
      const normal = side(b, l) * side(d, m) - side(b, m) * side(d, l);
      for (const corner of [a, b, d]) out[corner + k]! += normal;
    }
  }
  return out;
}
