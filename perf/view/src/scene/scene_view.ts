// The canvas: draws the stage when something has changed, and no more often than the browser shows pictures.
import * as THREE from 'three';
import {COLORS} from './colors.js';
import {light} from './instances.js';
import {type Box, placeBoxes} from './label_places.js';
import type {Picked} from './drawn_batch.js';
import type {Stage} from './stage.js';
import {Viewpoint} from './viewpoint.js';

/** A text that stands at a place of the scene. */
export interface Label {
  text: string;
  position: THREE.Vector3;
  kind: 'masked' | 'selected';
}

export class SceneView {
  readonly viewpoint: Viewpoint;
  readonly canvas: HTMLCanvasElement;
  readonly #surface: HTMLElement;
  readonly #labelLayer: HTMLElement;
  readonly #renderer: THREE.WebGLRenderer;
  readonly #stage: Stage;
  readonly #resizing: ResizeObserver;
  #labels: Label[] = [];
  #labelElements: HTMLElement[] = [];
  #stale = true;
  #fitted = false;

  /** Throws if the browser has no WebGL 2. */
  constructor(surface: HTMLElement, stage: Stage) {
    this.#surface = surface;
    this.#stage = stage;
    this.#renderer = makeRenderer(!stage.isCrowd);
    this.#renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.#renderer.setPixelRatio(stage.isCrowd ? 1 : Math.min(window.devicePixelRatio, 2));
    this.#renderer.setClearColor(COLORS.background);
    this.canvas = this.#renderer.domElement;
    this.canvas.setAttribute('role', 'img');
    this.#labelLayer = document.createElement('div');
    this.#labelLayer.className = 'scene-labels';
    surface.append(this.canvas, this.#labelLayer);
    this.viewpoint = new Viewpoint(this.canvas, stage.up, () => this.invalidate());
    this.#resizing = new ResizeObserver(() => this.resize());
    this.#resizing.observe(surface);
  }

  /** Takes the size of the surface. */
  resize(): void {
    const {clientWidth: width, clientHeight: height} = this.#surface;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height, false);
    this.viewpoint.resize(width, height);
    this.#stale = true;
    if (this.#fitted) return;
    this.#fitted = true;
    this.viewpoint.fit(this.#stage.sampled, false);
  }

  /** What the scene is called by those who do not see it. */
  describe(words: string): void {
    this.canvas.setAttribute('aria-label', words);
  }

  /** The scene has changed. */
  invalidate(): void {
    this.#stale = true;
  }

  /** Draws if something has changed. Returns whether it did. */
  render(now: number): boolean {
    this.viewpoint.advance(now);
    if (!this.#stale) return false;
    this.#stale = false;
    this.viewpoint.setRange(this.#stage.sampled);
    this.#placeLight();
    this.#renderer.render(this.#stage.scene, this.viewpoint.camera);
    this.#placeLabels();
    return true;
  }

  // The light is behind the camera, and above.
  #placeLight(): void {
    const {camera, direction} = this.viewpoint;
    light.world.copy(direction).addScaledVector(camera.up, 0.8).normalize();
    camera.updateMatrixWorld();
    light.seen.copy(light.world).transformDirection(camera.matrixWorldInverse);
  }

  /** Draw calls and triangles of the last picture. */
  get drawn(): {calls: number; triangles: number} {
    const {calls, triangles} = this.#renderer.info.render;
    return {calls, triangles};
  }

  setLabels(labels: readonly Label[]): void {
    this.#labels = [...labels];
    this.#stale = true;
    while (this.#labelElements.length > labels.length) this.#labelElements.pop()!.remove();
    while (this.#labelElements.length < labels.length) {
      const element = document.createElement('span');
      this.#labelLayer.append(element);
      this.#labelElements.push(element);
    }
    labels.forEach(({text, kind}, i) => {
      const element = this.#labelElements[i]!;
      if (element.textContent !== text) element.textContent = text;
      element.className = `scene-label ${kind}`;
    });
  }

  // Labels that have no room are left out.
  #placeLabels(): void {
    const {clientWidth: width, clientHeight: height} = this.#surface;
    const shown: {element: HTMLElement; box: Box}[] = [];
    this.#labels.forEach(({position}, i) => {
      const p = position.clone().project(this.viewpoint.camera);
      const isInView = Math.abs(p.x) < 1 && Math.abs(p.y) < 1 && p.z < 1;
      const element = this.#labelElements[i]!;
      element.style.display = isInView ? '' : 'none';
      if (!isInView) return;
      const [x, y] = [(p.x + 1) / 2 * width, (1 - p.y) / 2 * height];
      shown.push({element, box: {x, y, width: element.offsetWidth, height: element.offsetHeight}});
    });
    placeBoxes(shown.map(({box}) => box), width, height).forEach((place, i) => {
      const {style} = shown[i]!.element;
      if (place) style.transform = `translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
      else style.display = 'none';
    });
  }

  /** The picture that is shown, with its labels, as a PNG. */
  async picture(): Promise<Blob> {
    this.#stale = true;
    this.render(performance.now());
    const {width, height} = this.canvas;
    const scale = width / this.#surface.clientWidth;
    const drawn = document.createElement('canvas');
    drawn.width = width;
    drawn.height = height;
    const context = drawn.getContext('2d')!;
    context.drawImage(this.canvas, 0, 0);
    const {left, top} = this.#surface.getBoundingClientRect();
    context.textBaseline = 'middle';
    for (const element of this.#labelElements) {
      if (element.style.display === 'none') continue;
      const box = element.getBoundingClientRect(), style = getComputedStyle(element);
      context.setTransform(scale, 0, 0, scale, scale * (box.left - left), scale * (box.top - top));
      context.fillStyle = style.backgroundColor;
      context.fillRect(0, 0, box.width, box.height);
      context.strokeStyle = style.borderTopColor;
      context.strokeRect(0.5, 0.5, box.width - 1, box.height - 1);
      context.font = `${style.fontSize} ${style.fontFamily}`;
      context.fillStyle = style.color;
      context.fillText(element.textContent ?? '', parseFloat(style.paddingLeft) + 1, box.height / 2);
    }
    return new Promise((done, fail) => {
      drawn.toBlob((blob) => blob ? done(blob) : fail(new Error('no picture')), 'image/png');
    });
  }

  /** What is drawn under a pointer, given in pixels of the window. */
  pick(clientX: number, clientY: number): Picked | null {
    const {left, top, width, height} = this.canvas.getBoundingClientRect();
    const caster = new THREE.Raycaster();
    const at = new THREE.Vector2((clientX - left) / width * 2 - 1, 1 - (clientY - top) / height * 2);
    caster.setFromCamera(at, this.viewpoint.camera);
    return this.#stage.pick(caster.ray);
  }

  dispose(): void {
    this.#resizing.disconnect();
    this.viewpoint.dispose();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
    this.canvas.remove();
    this.#labelLayer.remove();
  }
}

function makeRenderer(antialias: boolean): THREE.WebGLRenderer {
  try {
    return new THREE.WebGLRenderer({antialias, powerPreference: 'high-performance'});
  } catch (error) {
    throw new Error('The scene cannot be drawn, since this browser has no WebGL 2 or has turned it off. Another ' +
                    'browser, or another graphics driver, may have it.', {cause: error});
  }
}
