// Many copies of one geometry in one draw call. Each copy has a transform of 12 floats, and a paint: red, green, blue
// and a pattern.
//
// Copies lie in a texture, and each instance of the draw call is a chunk of copies. One instance per copy would be the
// plain way, but drawing in software takes as long for an instance of a box as for a hundred triangles.
import * as THREE from 'three';
import {ROWS} from './transforms.js';

/** Floats of one copy: its rows, then its paint. */
export const COPY = 16;

/** What a copy is filled with. Patterns tell apart what colours alone do not tell everyone. */
export const PATTERN = {plain: 0, crosses: 1, stripes: 2} as const;

/**
 * `flat` is lit by faces, `round` by normals, `over` as round and over all else; `wire` is lines. `box` takes
 * boxCorner(), which it turns to the camera, and is lit by faces.
 */
export type Look = 'flat' | 'box' | 'round' | 'over' | 'wire';

const VERTICES_OF_CHUNK = 1024;
const COPIES_OF_TEXTURE_ROW = 256;
const TEXELS_OF_COPY = COPY / 4;

const PLACE = `
  uniform highp sampler2D copies;
  uniform int count;
  uniform int chunk;
  in float place;
  vec4 rowX, rowY, rowZ, paint;
  vec3 placed(vec4 p) { return vec3(dot(rowX, p), dot(rowY, p), dot(rowZ, p)); }
  // Copies behind the last one have no size.
  bool readCopy() {
    int copy = gl_InstanceID * chunk + int(place);
    ivec2 at = ivec2(copy % ${COPIES_OF_TEXTURE_ROW} * ${TEXELS_OF_COPY}, copy / ${COPIES_OF_TEXTURE_ROW});
    rowX = texelFetch(copies, at, 0);
    rowY = texelFetch(copies, at + ivec2(1, 0), 0);
    rowZ = texelFetch(copies, at + ivec2(2, 0), 0);
    paint = texelFetch(copies, at + ivec2(3, 0), 0);
    return copy < count;
  }
`;

// The columns of a transform are orthogonal, so its inverse transpose is itself with columns divided by their squares.
const lit = (qualifier: '' | 'flat', turned: string): string => `${PLACE}
  uniform vec3 light;
  ${qualifier} out vec4 tint;
  ${turned}
  void main() {
    bool isCopy = readCopy();
    vec3 squares = rowX.xyz * rowX.xyz + rowY.xyz * rowY.xyz + rowZ.xyz * rowZ.xyz;
    vec3 signs = turned();
    vec3 n = normalize(placed(vec4(signs * normal / max(squares, vec3(1e-30)), 0.0)));
    tint = vec4(paint.rgb * (0.66 + 0.34 * dot(n, light)), paint.a);
    vec4 p = vec4(placed(vec4(signs * position, 1.0)), 1.0);
    gl_Position = isCopy ? projectionMatrix * (viewMatrix * p) : vec4(0.0);
  }
`;

const ROUND_VERTEX = lit('', 'vec3 turned() { return vec3(1.0); }');

// Of a box at most the three faces are seen that meet in the corner which is nearest to the camera along all axes.
const BOX_VERTEX = lit('flat', `
  vec3 turned() {
    vec3 d = cameraPosition - vec3(rowX.w, rowY.w, rowZ.w);
    vec3 along = d.x * rowX.xyz + d.y * rowY.xyz + d.z * rowZ.xyz;
    return vec3(along.x < 0.0 ? -1.0 : 1.0, along.y < 0.0 ? -1.0 : 1.0, along.z < 0.0 ? -1.0 : 1.0);
  }
`);

const FLAT_VERTEX = `${PLACE}
  out vec4 tint;
  out vec3 seen;
  void main() {
    bool isCopy = readCopy();
    vec4 p = viewMatrix * vec4(placed(vec4(position, 1.0)), 1.0);
    seen = p.xyz;
    tint = paint;
    gl_Position = isCopy ? projectionMatrix * p : vec4(0.0);
  }
`;

const WIRE_VERTEX = `${PLACE}
  out vec4 tint;
  void main() {
    bool isCopy = readCopy();
    tint = paint;
    gl_Position = isCopy ? projectionMatrix * (viewMatrix * vec4(placed(vec4(position, 1.0)), 1.0)) : vec4(0.0);
  }
`;

const patterned = (qualifier: '' | 'flat'): string => `
  ${qualifier} in vec4 tint;
  out vec4 color;
  vec3 patterned(vec3 rgb) {
    if (tint.a < 0.5) return rgb;
    vec2 p = gl_FragCoord.xy;
    bool falling = mod(p.x + p.y, 8.0) < 2.5;
    bool rising = tint.a < 1.5 && mod(p.x - p.y, 8.0) < 2.5;
    return falling || rising ? rgb * 0.45 : rgb;
  }
`;

/** Of shaders whose vertices have a tint: a colour and a pattern. */
export const PATTERNED = patterned('');

const PLAIN = 'void main() { color = vec4(patterned(tint.rgb), 1.0); }';
const ROUND_FRAGMENT = PATTERNED + PLAIN;
const BOX_FRAGMENT = patterned('flat') + PLAIN;

// The normal of a face is that of the plane through neighbouring pixels.
const FLAT_FRAGMENT = `${PATTERNED}
  in vec3 seen;
  uniform vec3 lightSeen;
  void main() {
    vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
    color = vec4(patterned(tint.rgb * (0.66 + 0.34 * dot(n, lightSeen))), 1.0);
  }
`;

const WIRE_FRAGMENT = `
  in vec4 tint;
  out vec4 color;
  void main() { color = vec4(tint.rgb, 1.0); }
`;

const SHADERS: Record<Look, readonly [vertex: string, fragment: string]> = {
  flat: [FLAT_VERTEX, FLAT_FRAGMENT],
  box: [BOX_VERTEX, BOX_FRAGMENT],
  round: [ROUND_VERTEX, ROUND_FRAGMENT],
  over: [ROUND_VERTEX, ROUND_FRAGMENT],
  wire: [WIRE_VERTEX, WIRE_FRAGMENT],
};

/** Where the light comes from: in the world, and as the camera sees it. All lit materials share it. */
export const light = {world: new THREE.Vector3(0, 1, 0), seen: new THREE.Vector3(0, 1, 0)};

export class Instances {
  readonly object: THREE.Mesh | THREE.LineSegments;
  /** COPY floats per copy. Call changed() after writing. */
  data = new Float32Array(0);
  readonly #geometry: THREE.InstancedBufferGeometry;
  readonly #material: THREE.ShaderMaterial;
  readonly #chunk: number;
  readonly #pointsOfCopy: number;
  #texture: THREE.DataTexture | null = null;
  #count = 0;

  constructor(shape: THREE.BufferGeometry, look: Look, bothSides = false) {
    const vertices = shape.getAttribute('position').count;
    this.#chunk = Math.max(1, Math.floor(VERTICES_OF_CHUNK / vertices));
    this.#pointsOfCopy = shape.index ? shape.index.count : vertices;
    this.#geometry = makeChunk(shape, this.#chunk);
    const [vertexShader, fragmentShader] = SHADERS[look];
    this.#material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader,
      fragmentShader,
      uniforms: {
        copies: {value: null}, count: {value: 0}, chunk: {value: this.#chunk}, light: {value: light.world},
        lightSeen: {value: light.seen},
      },
      side: bothSides || look === 'box' ? THREE.DoubleSide : THREE.FrontSide,
      // Wires along the edges of solids are in front of them.
      polygonOffset: look !== 'wire',
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
      depthTest: look !== 'over',
      depthWrite: look !== 'over',
    });
    this.object = look === 'wire' ? new THREE.LineSegments(this.#geometry, this.#material) :
                                    new THREE.Mesh(this.#geometry, this.#material);
    this.object.frustumCulled = false;
    this.object.matrixAutoUpdate = false;
    if (look === 'over') this.object.renderOrder = 1;
    this.count = 0;
  }

  get count(): number {
    return this.#count;
  }

  set count(count: number) {
    this.#count = count;
    this.#geometry.instanceCount = Math.ceil(count / this.#chunk);
    this.#geometry.setDrawRange(0, count < this.#chunk ? count * this.#pointsOfCopy : Infinity);
    this.#material.uniforms['count']!.value = count;
    this.object.visible = count > 0;
  }

  /** Makes room for so many copies. What was written is lost if there was less room. */
  reserve(capacity: number): void {
    if (capacity * COPY <= this.data.length) return;
    const rows = Math.ceil(capacity / COPIES_OF_TEXTURE_ROW);
    this.#texture?.dispose();
    this.data = new Float32Array(rows * COPIES_OF_TEXTURE_ROW * COPY);
    this.#texture = new THREE.DataTexture(this.data, COPIES_OF_TEXTURE_ROW * TEXELS_OF_COPY, rows, THREE.RGBAFormat,
                                          THREE.FloatType);
    this.#material.uniforms['copies']!.value = this.#texture;
  }

  /** Writes the paint of a copy, a colour of 24 bits and a PATTERN. */
  setPaint(copy: number, rgb: number, pattern: number): void {
    const at = copy * COPY + ROWS;
    this.data[at] = (rgb >> 16) / 255;
    this.data[at + 1] = ((rgb >> 8) & 255) / 255;
    this.data[at + 2] = (rgb & 255) / 255;
    this.data[at + 3] = pattern;
  }

  /** What was written is drawn from now on. */
  changed(): void {
    if (this.#texture) this.#texture.needsUpdate = true;
  }

  dispose(): void {
    this.object.removeFromParent();
    this.#geometry.dispose();
    this.#material.dispose();
    this.#texture?.dispose();
  }
}

// A geometry that repeats a shape, and numbers the repetitions in `place`.
function makeChunk(shape: THREE.BufferGeometry, chunk: number): THREE.InstancedBufferGeometry {
  const geometry = new THREE.InstancedBufferGeometry();
  const vertices = shape.getAttribute('position').count;
  for (const name of ['position', 'normal']) {
    if (!shape.hasAttribute(name)) continue;
    const one = shape.getAttribute(name).array;
    const all = new Float32Array(one.length * chunk);
    for (let i = 0; i < chunk; ++i) all.set(one, i * one.length);
    geometry.setAttribute(name, new THREE.BufferAttribute(all, 3));
  }
  const places = Float32Array.from({length: vertices * chunk}, (_, i) => Math.floor(i / vertices));
  geometry.setAttribute('place', new THREE.BufferAttribute(places, 1));
  if (shape.index) {
    const one = shape.index.array;
    const all = new Uint32Array(one.length * chunk);
    for (let i = 0; i < all.length; ++i) all[i] = one[i % one.length]! + Math.floor(i / one.length) * vertices;
    geometry.setIndex(new THREE.BufferAttribute(all, 1));
  }
  return geometry;
}
