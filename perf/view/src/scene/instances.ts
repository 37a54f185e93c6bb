// Many copies of one geometry in one draw call. Each copy has a transform of 12 floats, and a paint: red, green, blue
// and a pattern.
//
// Copies lie in a texture, and each instance of the draw call is a chunk of copies. One instance per copy would be the
// plain way, but drawing in software takes as long for an instance of a box as for a hundred triangles.
import * as THREE from 'three';
import {ROWS} from './transforms.js';

/** Floats of one copy: its rows, then its paint. */
export const COPY = 16;

/**
 * What a copy is filled with. Patterns tell apart what colours alone do not tell everyone. `glass` and `ghost` are seen
 * through: the pair that one looks at, and everything else.
 */
export const PATTERN = {plain: 0, crosses: 1, stripes: 2, glass: 3, ghost: 4} as const;

/**
 * `flat` is lit by faces, `round` by normals, `over` as round, over all else, and as large on the screen wherever it
 * is; `wire` is lines. `box` takes boxCorner(), which it turns to the camera, and is lit by faces.
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

// A length of 1 is as long as a thousandth of the picture's height, at the place of the copy.
const OVER_VERTEX = `${PLACE}
  uniform vec3 light;
  out vec4 tint;
  void main() {
    bool isCopy = readCopy();
    vec3 n = normalize(placed(vec4(normal, 0.0)));
    tint = vec4(paint.rgb * (0.66 + 0.34 * dot(n, light)), paint.a);
    vec3 place = vec3(rowX.w, rowY.w, rowZ.w);
    float depth = -(viewMatrix * vec4(place, 1.0)).z;
    float size = 0.002 * depth / projectionMatrix[1][1];
    vec4 p = vec4(place + size * placed(vec4(position, 0.0)), 1.0);
    gl_Position = isCopy ? projectionMatrix * (viewMatrix * p) : vec4(0.0);
  }
`;

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

// Samples of a pixel are left out where something is seen through, or whole pixels where a pixel has one sample. So
// what is behind is seen in whatever order it is drawn.
const patterned = (qualifier: '' | 'flat'): string => `
  ${qualifier} in vec4 tint;
  uniform bool sampled;
  out vec4 color;
  vec4 patterned(vec3 rgb) {
    if (tint.a < 0.5) return vec4(rgb, 1.0);
    vec2 p = gl_FragCoord.xy;
    if (tint.a > 2.5) {
      bool isGhost = tint.a > 3.5;
      if (sampled) return vec4(rgb, isGhost ? 0.26 : 0.51);
      bvec2 isOdd = greaterThan(mod(floor(p), 2.0), vec2(0.5));
      if (isGhost ? isOdd.x || isOdd.y : isOdd.x != isOdd.y) discard;
      return vec4(rgb, 1.0);
    }
    bool falling = mod(p.x + p.y, 8.0) < 2.5;
    bool rising = tint.a < 1.5 && mod(p.x - p.y, 8.0) < 2.5;
    return vec4(falling || rising ? rgb * 0.45 : rgb, 1.0);
  }
`;

/** Of shaders whose vertices have a tint: a colour and a pattern. */
export const PATTERNED = patterned('');

const PLAIN = 'void main() { color = patterned(tint.rgb); }';
const ROUND_FRAGMENT = PATTERNED + PLAIN;
const BOX_FRAGMENT = patterned('flat') + PLAIN;

// The normal of a face is that of the plane through neighbouring pixels.
const FLAT_FRAGMENT = `${PATTERNED}
  in vec3 seen;
  uniform vec3 lightSeen;
  void main() {
    vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
    color = patterned(tint.rgb * (0.66 + 0.34 * dot(n, lightSeen)));
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
  over: [OVER_VERTEX, ROUND_FRAGMENT],
  wire: [WIRE_VERTEX, WIRE_FRAGMENT],
};

/** Where the light comes from: in the world, and as the camera sees it. All lit materials share it. */
export const light = {world: new THREE.Vector3(0, 1, 0), seen: new THREE.Vector3(0, 1, 0)};

/** Whether a pixel has several samples. All materials that are seen through share it, and are made once it is known. */
export const sampled = {value: true};

// Alpha chooses samples, and leaves that of the picture as it is.
const BY_SAMPLES = {
  alphaToCoverage: true,
  blending: THREE.CustomBlending,
  blendSrc: THREE.OneFactor,
  blendDst: THREE.ZeroFactor,
  blendSrcAlpha: THREE.ZeroFactor,
  blendDstAlpha: THREE.OneFactor,
} as const;

/** What materials need whose patterns are seen through. Blending takes time, which crowds have not. */
export const seenThrough = (): THREE.ShaderMaterialParameters => sampled.value ? BY_SAMPLES : {};

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
        lightSeen: {value: light.seen}, sampled,
      },
      ...seenThrough(),
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
