// The camera: it orbits about a point, fits what it is shown, and goes along with what moves.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import type {Bounds} from './bounds.js';
import type {Axis} from './up_axis.js';

const FIELD_OF_VIEW = 40;
/** The cosine of the least angle to a contact's normal from which one looks at it. */
const MOST_ALONG = 0.7;
/** How much of the picture's height is around the ball that the camera flies to. */
const FLIGHT_ROOM = 1.5;
const UPS: readonly (readonly [number, number, number])[] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
// From the middle of a scene to where it is first seen from: from the front, the side and above.
function firstDirection(up: Axis): THREE.Vector3 {
  const direction = new THREE.Vector3().setComponent(up, 0.45);
  direction.setComponent(up === 0 ? 1 : 0, 0.6);
  direction.setComponent(up === 2 ? 1 : 2, up === 2 ? -0.9 : 0.9);
  return direction.normalize();
}

/** How long the camera flies. */
const FLIGHT_MS = 450;

interface Flight {
  began: number;
  from: {target: THREE.Vector3; position: THREE.Vector3};
  to: {target: THREE.Vector3; position: THREE.Vector3};
}

export class Viewpoint {
  readonly camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1000);
  readonly #controls: OrbitControls;
  #up: Axis;
  readonly #onChange: () => void;
  #flight: Flight | null = null;

  constructor(surface: HTMLElement, up: Axis, onChange: () => void) {
    this.#up = up;
    this.#onChange = onChange;
    this.camera.up.set(...UPS[up]!);
    this.#controls = new OrbitControls(this.camera, surface);
    this.#controls.addEventListener('change', onChange);
    this.#controls.addEventListener('start', () => (this.#flight = null));
    this.#controls.zoomToCursor = true;
  }

  get target(): THREE.Vector3 {
    return this.#controls.target;
  }

  /** From the target to the camera, of length 1. */
  get direction(): THREE.Vector3 {
    return this.camera.position.clone().sub(this.target).normalize();
  }

  resize(width: number, height: number): void {
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
  }

  /**
   * Flies to where a ball is seen as large as it can be: from where the camera is, but not along `normal`, along which
   * one does not see how deep a contact is. A viewer who wants less motion is there at once.
   */
  flyTo(center: THREE.Vector3, radius: number, normal: THREE.Vector3 | null): void {
    const direction = this.direction;
    const along = normal ? direction.dot(normal) : 0;
    if (normal && Math.abs(along) > MOST_ALONG) {
      direction.addScaledVector(normal, -along);
      if (direction.lengthSq() < 1e-4) direction.copy(firstDirection(this.#up)).addScaledVector(normal, -0.5 * along);
      direction.normalize();
    }
    const tangent = Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) * Math.min(this.camera.aspect, 1);
    const position = center.clone().addScaledVector(direction, FLIGHT_ROOM * radius / tangent);
    this.#flight = {
      began: performance.now(),
      from: {target: this.target.clone(), position: this.camera.position.clone()},
      to: {target: center.clone(), position},
    };
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) this.#flight.began -= FLIGHT_MS;
    this.#onChange();
  }

  /** Moves on in a flight. Returns whether it goes on. */
  advance(now: number): boolean {
    if (!this.#flight) return false;
    const {began, from, to} = this.#flight;
    const share = Math.min(Math.max((now - began) / FLIGHT_MS, 0), 1);
    const eased = share * share * (3 - 2 * share);
    this.target.lerpVectors(from.target, to.target, eased);
    this.camera.position.lerpVectors(from.position, to.position, eased);
    if (share === 1) this.#flight = null;
    this.#controls.update();
    this.#onChange();
    return share < 1;
  }

  /** Looks at all of the bounds, from the first direction or from where the camera is. */
  fit(bounds: Bounds, keepDirection: boolean): void {
    if (bounds.empty) return;
    this.#flight = null;
    const direction = keepDirection ? this.direction : firstDirection(this.#up);
    this.target.set(...bounds.center());
    const distance = this.#fittingDistance(bounds, direction);
    this.camera.position.copy(this.target).addScaledVector(direction, distance);
    this.#controls.update();
  }

  /** Before a picture is drawn: what is near is not cut off, and the scene is drawn to its end. */
  setRange(scene: Bounds): void {
    const {camera, target} = this;
    const distance = camera.position.distanceTo(target);
    const middle = new THREE.Vector3(...scene.center());
    camera.far = camera.position.distanceTo(middle) + 8 * scene.radius + distance;
    camera.near = Math.max(0.02 * distance, 1e-6 * camera.far);
    camera.updateProjectionMatrix();
  }

  // How far from the target all corners of the bounds are in view.
  #fittingDistance(bounds: Bounds, direction: THREE.Vector3): number {
    const right = this.camera.up.clone().cross(direction).normalize();
    const up = direction.clone().cross(right);
    const tangent = Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) * 0.92;
    let distance = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const p = new THREE.Vector3(
          (corner & 1 ? bounds.high : bounds.low)[0], (corner & 2 ? bounds.high : bounds.low)[1],
          (corner & 4 ? bounds.high : bounds.low)[2]).sub(this.target);
      const across = Math.max(Math.abs(p.dot(right)) / Math.min(this.camera.aspect, 4), Math.abs(p.dot(up)));
      distance = Math.max(distance, p.dot(direction) + across / tangent);
    }
    return distance;
  }

  /** Goes along with what moved by so much. */
  shift(by: THREE.Vector3): void {
    this.#flight = null;
    this.target.add(by);
    this.camera.position.add(by);
    this.#controls.update();
  }

  dispose(): void {
    this.#controls.dispose();
  }
}
