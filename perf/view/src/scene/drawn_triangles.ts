// The triangles of a batch of static bodies. Each is an instance of the batch, so each may be in a hit.
import * as THREE from 'three';
import type {StaticBodies} from '../recording/types.js';
import type {Bounds} from './bounds.js';
import {COLORS} from './colors.js';
import {light} from './instances.js';
import {MARK} from './marks.js';

const VERTEX = `
  in vec4 paint;
  out vec3 tint;
  uniform vec3 light;
  void main() {
    tint = paint.rgb * (0.66 + 0.34 * abs(dot(normal, light)));
    gl_Position = paint.a * (projectionMatrix * (viewMatrix * vec4(position, 1.0)));
  }
`;

const FRAGMENT = `
  in vec3 tint;
  out vec4 color;
  void main() { color = vec4(tint, 1.0); }
`;

export class DrawnTriangles {
  readonly object: THREE.Mesh;
  readonly #paint: THREE.BufferAttribute;
  readonly #firstInstance: number;
  readonly #present: Uint8Array;
  readonly #marks: Uint8Array;

  /** `present`: 1 per triangle that takes part, in each frame. Others are painted with 0, and have no size. */
  constructor(bodies: StaticBodies, present: Uint8Array, center: Float64Array) {
    const {vertices, triangles, origin} = bodies;
    this.#firstInstance = bodies.bodies.length;
    this.#present = present;
    this.#marks = new Uint8Array(triangles.length / 3);
    const positions = new Float32Array(triangles.length * 3);
    triangles.forEach((vertex, corner) => {
      for (let k = 0; k < 3; ++k) positions[corner * 3 + k] = vertices[vertex * 3 + k]! + (origin[k]! - center[k]!);
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.computeVertexNormals();
    this.#paint = new THREE.BufferAttribute(new Uint8Array(triangles.length * 4), 4, true);
    geometry.setAttribute('paint', this.#paint);
    this.object = new THREE.Mesh(geometry, new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {light: {value: light.world}},
      side: THREE.DoubleSide,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    }));
    this.object.matrixAutoUpdate = false;
  }

  clearMarks(): void {
    this.#marks.fill(MARK.none);
  }

  markInstance(instance: number, value: number): void {
    const triangle = instance - this.#firstInstance;
    if (triangle >= 0 && this.#marks[triangle]! < value) this.#marks[triangle] = value;
  }

  paint(): void {
    const bytes = this.#paint.array;
    this.#marks.forEach((value, triangle) => {
      const special = value === MARK.falsePositive ? COLORS.falsePositive : COLORS.hit;
      const rgb = value === MARK.none ? COLORS.statics : special;
      for (let at = triangle * 12; at < triangle * 12 + 12; at += 4) {
        bytes[at] = rgb >> 16;
        bytes[at + 1] = (rgb >> 8) & 255;
        bytes[at + 2] = rgb & 255;
        bytes[at + 3] = 255 * this.#present[triangle]!;
      }
    });
    this.#paint.needsUpdate = true;
  }

  addBounds(bounds: Bounds): void {
    const positions = this.object.geometry.getAttribute('position');
    for (let i = 0; i < positions.count; ++i) {
      if (this.#present[Math.floor(i / 3)] === 0) continue;
      bounds.addPoint(positions.getX(i), positions.getY(i), positions.getZ(i));
    }
  }

  dispose(): void {
    this.object.removeFromParent();
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
