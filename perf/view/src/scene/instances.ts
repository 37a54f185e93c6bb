// Many copies of one geometry in one draw call. Each copy has a transform of 12 floats and a paint of four bytes: red,
// green, blue and a pattern.
import * as THREE from 'three';
import {ROWS} from './transforms.js';

/** What a copy is filled with. Patterns tell apart what colours alone do not tell everyone. */
export const PATTERN = {plain: 0, crosses: 1, stripes: 2} as const;

/** `solid` is lit, `wire` are lines, and `over` is lit and drawn over all else. */
export type Look = 'solid' | 'solid_both_sides' | 'wire' | 'over';

const TRANSFORM = `
  in vec4 rowX;
  in vec4 rowY;
  in vec4 rowZ;
  in vec4 paint;
  out vec3 tint;
  vec3 placed(vec4 p) { return vec3(dot(rowX, p), dot(rowY, p), dot(rowZ, p)); }
`;

// The columns of a transform are orthogonal, so its inverse transpose is itself with columns divided by their squares.
const SOLID_VERTEX = `${TRANSFORM}
  uniform vec3 light;
  flat out int pattern;
  void main() {
    vec3 squares = rowX.xyz * rowX.xyz + rowY.xyz * rowY.xyz + rowZ.xyz * rowZ.xyz;
    vec3 n = normalize(placed(vec4(normal / max(squares, vec3(1e-30)), 0.0)));
    float facing = dot(n, light);
    tint = paint.rgb * (0.66 + 0.34 * facing);
    pattern = int(paint.a * 255.0 + 0.5);
    gl_Position = projectionMatrix * viewMatrix * vec4(placed(vec4(position, 1.0)), 1.0);
  }
`;

const SOLID_FRAGMENT = `
  in vec3 tint;
  flat in int pattern;
  out vec4 color;
  void main() {
    float shade = 1.0;
    if (pattern != 0) {
      vec2 p = gl_FragCoord.xy;
      bool falling = mod(p.x + p.y, 8.0) < 2.5;
      bool rising = pattern == 1 && mod(p.x - p.y, 8.0) < 2.5;
      if (falling || rising) shade = 0.45;
    }
    color = vec4(tint * shade, 1.0);
  }
`;

const WIRE_VERTEX = `${TRANSFORM}
  void main() {
    tint = paint.rgb;
    gl_Position = projectionMatrix * viewMatrix * vec4(placed(vec4(position, 1.0)), 1.0);
  }
`;

const WIRE_FRAGMENT = `
  in vec3 tint;
  out vec4 color;
  void main() { color = vec4(tint, 1.0); }
`;

/** Where the light comes from, in the world. All lit materials share it. */
export const light = new THREE.Vector3(0.3, 0.8, 0.5).normalize();

function makeMaterial(look: Look): THREE.Material {
  if (look === 'wire') {
    return new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: WIRE_VERTEX, fragmentShader: WIRE_FRAGMENT,
    });
  }
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: SOLID_VERTEX,
    fragmentShader: SOLID_FRAGMENT,
    uniforms: {light: {value: light}},
    side: look === 'solid_both_sides' ? THREE.DoubleSide : THREE.FrontSide,
    depthTest: look !== 'over',
    depthWrite: look !== 'over',
  });
}

const materials = new Map<Look, THREE.Material>();

function materialOf(look: Look): THREE.Material {
  const known = materials.get(look);
  if (known) return known;
  const made = makeMaterial(look);
  materials.set(look, made);
  return made;
}

export class Instances {
  readonly object: THREE.Mesh | THREE.LineSegments;
  /** 12 floats per copy. Call changed() after writing. */
  rows = new Float32Array(0);
  /** Four bytes per copy. Call changed() after writing. */
  paint = new Uint8Array(0);
  readonly #geometry: THREE.InstancedBufferGeometry;
  #rowBuffer: THREE.InstancedInterleavedBuffer | null = null;
  #paintAttribute: THREE.InstancedBufferAttribute | null = null;

  constructor(shape: THREE.BufferGeometry, look: Look, capacity = 16) {
    this.#geometry = Instances.#copyOf(shape);
    const material = materialOf(look);
    this.object = look === 'wire' ? new THREE.LineSegments(this.#geometry, material) :
                                    new THREE.Mesh(this.#geometry, material);
    this.object.frustumCulled = false;
    this.object.matrixAutoUpdate = false;
    if (look === 'over') this.object.renderOrder = 1;
    this.reserve(capacity);
    this.count = 0;
  }

  static #copyOf(shape: THREE.BufferGeometry): THREE.InstancedBufferGeometry {
    const geometry = new THREE.InstancedBufferGeometry();
    geometry.index = shape.index;
    for (const name of ['position', 'normal']) {
      if (shape.hasAttribute(name)) geometry.setAttribute(name, shape.getAttribute(name));
    }
    return geometry;
  }

  get count(): number {
    return this.#geometry.instanceCount;
  }

  set count(count: number) {
    this.#geometry.instanceCount = count;
    this.object.visible = count > 0;
  }

  /** Makes room for so many copies. What was written is lost if there was less room. */
  reserve(capacity: number): void {
    if (capacity * ROWS <= this.rows.length) return;
    // The renderer frees the buffers of a geometry that is disposed of, and makes new ones when it draws it again.
    this.#geometry.dispose();
    this.rows = new Float32Array(capacity * ROWS);
    this.paint = new Uint8Array(capacity * 4);
    const rows = new THREE.InstancedInterleavedBuffer(this.rows, ROWS);
    rows.setUsage(THREE.DynamicDrawUsage);
    this.#rowBuffer = rows;
    ['rowX', 'rowY', 'rowZ'].forEach((name, i) => {
      this.#geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(rows, 4, 4 * i));
    });
    this.#paintAttribute = new THREE.InstancedBufferAttribute(this.paint, 4, true);
    this.#paintAttribute.setUsage(THREE.DynamicDrawUsage);
    this.#geometry.setAttribute('paint', this.#paintAttribute);
  }

  /** Writes the paint of copy i. */
  setPaint(i: number, rgb: number, pattern: number): void {
    const at = i * 4;
    this.paint[at] = rgb >> 16;
    this.paint[at + 1] = rgb >> 8;
    this.paint[at + 2] = rgb;
    this.paint[at + 3] = pattern;
  }

  changed(): void {
    this.#upload(this.#rowBuffer, this.count * ROWS);
    this.#upload(this.#paintAttribute, this.count * 4);
  }

  #upload(buffer: THREE.InstancedInterleavedBuffer | THREE.InstancedBufferAttribute | null, numbers: number): void {
    if (!buffer) return;
    buffer.clearUpdateRanges();
    buffer.addUpdateRange(0, numbers);
    buffer.needsUpdate = true;
  }

  dispose(): void {
    this.object.removeFromParent();
    this.#geometry.dispose();
  }
}
