// The strip of all frames: how many hits each has, where the selected pair touches, and which frame is shown. Clicking
// and dragging go to a frame.
import type {ContactIndex, PairHistory} from './contact_index.js';
import {el, prepareCanvas} from './dom.js';
import {count, plural, seconds} from './format.js';
import type {Player} from './player.js';

// By the names of the page's colours.
type Color = 'shade' | 'bar' | 'pair' | 'damaged' | 'quiet' | 'line';

const colorOf = (name: Color): string => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);
const WORDS_HEIGHT = 14;
const PAIR_HEIGHT = 7;
const AXIS_HEIGHT = 15;

export class Timeline {
  readonly element: HTMLElement;
  readonly #canvas = el('canvas', {'aria-hidden': 'true'});
  readonly #head = el('div', {class: 'timeline-head'});
  readonly #player: Player;
  readonly #index: ContactIndex;
  #pair: PairHistory | null = null;

  constructor(player: Player, index: ContactIndex) {
    this.#player = player;
    this.#index = index;
    this.element = el('div', {
      class: 'timeline', tabindex: 0, role: 'slider', 'aria-label': 'Frame', 'aria-valuemin': 0,
      'aria-valuemax': Math.max(0, player.frameCount - 1),
      title: 'Links that touch, per frame. Click or drag to go to a frame.',
      pointerdown: (event) => this.#drag(event as PointerEvent, true),
      pointermove: (event) => this.#drag(event as PointerEvent, false),
    }, this.#canvas, this.#head);
    new ResizeObserver(() => {
      this.draw();
      this.update();
    }).observe(this.element);
  }

  setPair(pair: PairHistory | null): void {
    this.#pair = pair;
    this.draw();
  }

  #drag(event: PointerEvent, begins: boolean): void {
    if (begins) this.element.setPointerCapture(event.pointerId);
    if (!this.element.hasPointerCapture(event.pointerId)) return;
    const {left, width} = this.element.getBoundingClientRect();
    this.#player.pause();
    this.#player.goTo(Math.floor((event.clientX - left) / width * this.#player.frameCount));
  }

  /** Another frame is shown. Only the head moves: drawing the strip anew takes longer than drawing the scene. */
  update(): void {
    const {frame, frameCount} = this.#player;
    this.element.setAttribute('aria-valuenow', String(frame));
    this.element.setAttribute('aria-valuetext',
                              `frame ${frame}, ${plural(this.#index.hitsPerFrame[frame] ?? 0, 'hit')}`);
    const x = (frame + 0.5) / Math.max(frameCount, 1) * this.element.clientWidth;
    this.#head.style.transform = `translateX(${x.toFixed(1)}px)`;
  }

  /** What it shows of all frames has changed. */
  draw(): void {
    const prepared = prepareCanvas(this.#canvas);
    if (!prepared) return;
    const {context, width, height} = prepared;
    const bottom = height - AXIS_HEIGHT - PAIR_HEIGHT - 2;
    context.fillStyle = colorOf('shade');
    context.fillRect(0, 0, width, height - AXIS_HEIGHT);
    this.#drawBars(context, width, bottom);
    if (this.#pair) drawIntervals(context, this.#pair, this.#player.frameCount, width, bottom + 2, PAIR_HEIGHT);
    this.#drawWords(context);
    this.#drawAxis(context, width, height);
  }

  // Each column of pixels has the largest count of its frames.
  #drawBars(context: CanvasRenderingContext2D, width: number, bottom: number): void {
    const {hitsPerFrame, damaged} = this.#index;
    const frames = this.#player.frameCount;
    const scale = hitsPerFrame.reduce((a, b) => Math.max(a, b), 1);
    const most = bottom - WORDS_HEIGHT;
    const columns = Math.min(Math.ceil(width), frames);
    const edge = (column: number): number => Math.round(column / columns * width);
    const barColor = colorOf('bar'), damagedColor = colorOf('damaged');
    for (let column = 0; column < columns; ++column) {
      const first = Math.floor(column * frames / columns);
      const behind = Math.max(first + 1, Math.floor((column + 1) * frames / columns));
      let hits = 0;
      let bad = false;
      for (let i = first; i < behind; ++i) {
        hits = Math.max(hits, hitsPerFrame[i]!);
        bad ||= damaged[i] === 1;
      }
      if (bad) {
        context.fillStyle = damagedColor;
        context.fillRect(edge(column), WORDS_HEIGHT, edge(column + 1) - edge(column), most);
      }
      if (hits === 0) continue;
      const tall = Math.max(3, hits / scale * most);
      context.fillStyle = barColor;
      const wide = edge(column + 1) - edge(column);
      context.fillRect(edge(column), bottom - tall, wide > 4 ? wide - 1 : wide, tall);
    }
  }

  // What the colours stand for.
  #drawWords(context: CanvasRenderingContext2D): void {
    const {hitsPerFrame, damaged} = this.#index;
    const most = hitsPerFrame.reduce((a, b) => Math.max(a, b), 0);
    const words = `red: hits, at most ${count(most)} per frame` +
        (this.#pair ? '; blue: the selected pair touches' : '') + (damaged.includes(1) ? '; grey: damaged' : '');
    context.font = '10px system-ui, sans-serif';
    context.fillStyle = colorOf('quiet');
    context.fillText(words, 5, 11);
  }

  #drawAxis(context: CanvasRenderingContext2D, width: number, height: number): void {
    const frames = this.#player.frameCount;
    const marks = Math.max(2, Math.floor(width / 120));
    const rough = frames / marks;
    const power = 10 ** Math.floor(Math.log10(Math.max(rough, 1)));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((value) => value >= rough) ?? power * 10;
    context.strokeStyle = colorOf('line');
    context.fillStyle = colorOf('quiet');
    context.font = '10px system-ui, sans-serif';
    for (let frame = 0; frame < frames; frame += step) {
      const x = Math.round(frame / frames * width) + 0.5;
      context.beginPath();
      context.moveTo(x, height - AXIS_HEIGHT);
      context.lineTo(x, height - AXIS_HEIGHT + 4);
      context.stroke();
      const words = count(frame) + (this.#player.hasTimes ? ` \u00b7 ${seconds(this.#player.timeOf(frame))}` : '');
      if (x + 3 + context.measureText(words).width < width) context.fillText(words, x + 3, height - 3);
    }
  }
}

/** Draws when a pair of links touches, as bars of at least a pixel. */
export function drawIntervals(context: CanvasRenderingContext2D, {intervals}: PairHistory, frames: number,
                              width: number, top: number, height: number): void {
  context.fillStyle = colorOf('pair');
  for (let i = 0; i < intervals.length; i += 2) {
    const from = intervals[i]! / frames * width;
    const to = (intervals[i + 1]! + 1) / frames * width;
    context.fillRect(from, top, Math.max(to - from, 1.5), height);
  }
}
