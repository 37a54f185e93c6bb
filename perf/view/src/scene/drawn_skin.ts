// The skins of a batch: one mesh per instance, which bends with its links, and over them the triangles that are marked.
import * as THREE from 'three';
import type {Bounds} from './bounds.js';
import {COLORS} from './colors.js';
import {light, PATTERN, PATTERNED, sampled, seenThrough} from './instances.js';
import {MARK} from './marks.js';
import type {SkinShape} from './skin_shape.js';
import {isDrawable, ROWS} from './transforms.js';

/** The most instances that are drawn. */
const MOST = 64;

const VERTEX = `
  #ifdef MARKED
  in vec4 paint;
  #else
  uniform vec4 paint;
  #endif
  out vec4 tint;
  uniform vec3 light;
  void main() {
    tint = vec4(paint.rgb * (0.66 + 0.34 * dot(normalize(normal), light)), paint.a);
    gl_Position = projectionMatrix * (viewMatrix * vec4(position, 1.0));
  }
`;

const FRAGMENT = `${PATTERNED} void main() { color = patterned(tint.rgb); }`;

function makeMaterial(marked: boolean): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    defines: marked ? {MARKED: ''} : {},
    uniforms: {light: {value: light.world}, paint: {value: new THREE.Vector4()}, sampled},
    ...seenThrough(),
    side: THREE.DoubleSide,
    polygonOffset: true,
    // Marked triangles are in front of what they mark.
    polygonOffsetFactor: marked ? 0 : 1,
    polygonOffsetUnits: marked ? 0 : 1,
  });
}

class PosedSkin {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  /** One MARK per triangle. */
  readonly marks: Uint8Array;
  instance = -1;

  constructor(shape: SkinShape, index: THREE.BufferAttribute) {
    this.positions = new Float32Array(3 * shape.vertexCount);
    this.normals = new Float32Array(3 * shape.vertexCount);
    this.marks = new Uint8Array(shape.triangleCount);
    const geometry = new THREE.BufferGeometry()
        .setAttribute('position', new THREE.BufferAttribute(this.positions, 3))
        .setAttribute('normal', new THREE.BufferAttribute(this.normals, 3))
        .setIndex(index);
    this.mesh = new THREE.Mesh(geometry, makeMaterial(false));
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
  }

  set paint([rgb, pattern]: readonly [number, number]) {
    const {value} = this.mesh.material.uniforms['paint'] as {value: THREE.Vector4};
    value.set((rgb >> 16) / 255, ((rgb >> 8) & 255) / 255, (rgb & 255) / 255, pattern);
  }
}

export class DrawnSkin {
  readonly object = new THREE.Group();
  readonly #shape: SkinShape;
  readonly #index: THREE.BufferAttribute;
  readonly #posed: PosedSkin[] = [];
  /** By instance: those that are drawn in this frame. */
  readonly #drawn = new Map<number, PosedSkin>();
  readonly #marked: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #room = 0;

  constructor(shape: SkinShape) {
    this.#shape = shape;
    this.#index = new THREE.BufferAttribute(shape.corners, 1);
    this.#marked = new THREE.Mesh(new THREE.BufferGeometry(), makeMaterial(true));
    this.#marked.frustumCulled = false;
    this.#marked.matrixAutoUpdate = false;
    this.object.add(this.#marked);
  }

  /** Bends the skins of the first instances of `order`, and takes all marks away. Returns how many are left out. */
  place(order: readonly number[], linkRows: Float32Array, linkCount: number): number {
    this.#drawn.clear();
    for (const instance of order) {
      if (this.#drawn.size === MOST) break;
      const first = instance * linkCount * ROWS;
      if (!isDrawableAt(linkRows, first, linkCount)) continue;
      const posed = this.#posed[this.#drawn.size] ??= this.#add();
      posed.instance = instance;
      posed.marks.fill(MARK.none);
      this.#shape.place(linkRows, first, posed.positions, posed.normals);
      for (const name of ['position', 'normal']) posed.mesh.geometry.getAttribute(name).needsUpdate = true;
      this.#drawn.set(instance, posed);
    }
    this.#posed.forEach(({mesh}, i) => (mesh.visible = i < this.#drawn.size));
    return Math.max(0, order.length - MOST);
  }

  #add(): PosedSkin {
    const posed = new PosedSkin(this.#shape, this.#index);
    this.object.add(posed.mesh);
    return posed;
  }

  /** The higher mark wins. `leaf` and `triangle` are as in TouchingTriangles. */
  markTriangle(instance: number, leaf: number, triangle: number, value: number): void {
    const marks = this.#drawn.get(instance)?.marks;
    const at = (this.#shape.firstOfLeaf[leaf] ?? Infinity) + triangle;
    if (marks && at < (this.#shape.firstOfLeaf[leaf + 1] ?? 0) && marks[at]! < value) marks[at] = value;
  }

  /** All triangles of a link's leaves. */
  markLink(instance: number, link: number, value: number): void {
    const marks = this.#drawn.get(instance)?.marks, {links} = this.#shape;
    if (!marks) return;
    for (let at = 0; at < links.length; ++at) {
      if (links[at] === link && marks[at]! < value) marks[at] = value;
    }
  }

  /** Colours each skin by `paintOf`, and what is marked. */
  paint(paintOf: (instance: number) => readonly [rgb: number, pattern: number]): void {
    let count = 0;
    for (const [instance, posed] of this.#drawn) {
      posed.paint = paintOf(instance);
      for (const value of posed.marks) if (value !== MARK.none) ++count;
    }
    this.#reserve(count);
    const {geometry} = this.#marked;
    geometry.setDrawRange(0, 3 * count);
    this.#marked.visible = count > 0;
    if (count === 0) return;
    const [positions, normals, paints] = ['position', 'normal', 'paint'].map((name) =>
      geometry.getAttribute(name).array as Float32Array) as [Float32Array, Float32Array, Float32Array];
    const {corners} = this.#shape;
    let corner = 0;
    for (const posed of this.#drawn.values()) {
      for (let triangle = 0; triangle < posed.marks.length; ++triangle) {
        const value = posed.marks[triangle]!;
        if (value === MARK.none) continue;
        const rgb = value === MARK.falsePositive ? COLORS.falsePositive : COLORS.hit;
        const pattern = value === MARK.falsePositive ? PATTERN.stripes : PATTERN.plain;
        for (let k = 0; k < 3; ++k, ++corner) {
          const from = 3 * corners[3 * triangle + k]!;
          for (let c = 0; c < 3; ++c) {
            positions[3 * corner + c] = posed.positions[from + c]!;
            normals[3 * corner + c] = posed.normals[from + c]!;
          }
          paints[4 * corner] = (rgb >> 16) / 255;
          paints[4 * corner + 1] = ((rgb >> 8) & 255) / 255;
          paints[4 * corner + 2] = (rgb & 255) / 255;
          paints[4 * corner + 3] = pattern;
        }
      }
    }
    for (const name of ['position', 'normal', 'paint']) geometry.getAttribute(name).needsUpdate = true;
  }

  // Room for so many marked triangles.
  #reserve(count: number): void {
    if (count <= this.#room) return;
    this.#room = Math.max(64, 2 * count);
    const {geometry} = this.#marked;
    geometry.dispose();
    for (const [name, size] of [['position', 3], ['normal', 3], ['paint', 4]] as const) {
      geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(3 * size * this.#room), size));
    }
  }

  /** Adds the triangles of an instance, or of one of its links. -1: of all. */
  addBounds(bounds: Bounds, onlyInstance = -1, onlyLink = -1): void {
    const {corners, links} = this.#shape;
    for (const {instance, positions} of this.#drawn.values()) {
      if (onlyInstance >= 0 && onlyInstance !== instance) continue;
      for (let c = 0; c < corners.length; ++c) {
        if (onlyLink >= 0 && links[Math.floor(c / 3)] !== onlyLink) continue;
        const at = 3 * corners[c]!;
        bounds.addPoint(positions[at]!, positions[at + 1]!, positions[at + 2]!);
      }
    }
  }

  addTriangle(bounds: Bounds, instance: number, leaf: number, triangle: number): void {
    const {corners, firstOfLeaf} = this.#shape, positions = this.#drawn.get(instance)?.positions;
    const first = 3 * ((firstOfLeaf[leaf] ?? Infinity) + triangle);
    for (let c = first; positions && c < first + 3 && c < corners.length; ++c) {
      const at = 3 * corners[c]!;
      bounds.addPoint(positions[at]!, positions[at + 1]!, positions[at + 2]!);
    }
  }

  /** The nearest triangle that a ray meets. */
  pick(ray: THREE.Ray): {instance: number; link: number; distance: number} | null {
    const {corners, links} = this.#shape;
    const [a, b, c, met] = [0, 0, 0, 0].map(() => new THREE.Vector3()) as
        [THREE.Vector3, THREE.Vector3, THREE.Vector3, THREE.Vector3];
    let best: {instance: number; link: number; distance: number} | null = null;
    for (const {instance, positions} of this.#drawn.values()) {
      for (let t = 0; t < links.length; ++t) {
        a.fromArray(positions, 3 * corners[3 * t]!);
        b.fromArray(positions, 3 * corners[3 * t + 1]!);
        c.fromArray(positions, 3 * corners[3 * t + 2]!);
        if (!ray.intersectTriangle(a, b, c, false, met)) continue;
        const distance = met.distanceTo(ray.origin);
        if (distance < (best?.distance ?? Infinity)) best = {instance, link: links[t]!, distance};
      }
    }
    return best;
  }

  dispose(): void {
    for (const {mesh} of [...this.#posed, {mesh: this.#marked}]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.object.removeFromParent();
  }
}

function isDrawableAt(rows: Float32Array, first: number, linkCount: number): boolean {
  for (let at = first; at < first + linkCount * ROWS; at += ROWS) {
    if (!isDrawable(rows, at)) return false;
  }
  return true;
}
