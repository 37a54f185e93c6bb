// What touches in the shown frame, for people: which pair, how deep, how long.
import {el, setText} from './dom.js';
import {count, depthText, length, plural, seconds} from './format.js';

/** A pair of links in a frame. */
export interface ShownPair {
  /** Both links, in words. */
  name: string;
  /** Whether one has chosen it. Else it is the worst one of the frame. */
  isSelected: boolean;
  /** Whether it touches in this frame. */
  touches: boolean;
  /** In this frame; below 0 they are apart. Null: it is not known. */
  depth: number | null;
  /** How many pairs of triangles of skins touch. Null: it is not known. */
  triangles: number | null;
  /** First and last frame of the time in which it touches, and the frames of all its times. Null: not all are read. */
  interval: {first: number; last: number} | null;
  frames: number | null;
  /** Its deepest contact. Null: none is known. */
  worst: {frame: number; depth: number} | null;
}

export interface ContactPanelOptions {
  metresPerUnit: number;
  /** When a frame is. Null: frames are states, and have no times. */
  timeOf: (frame: number) => number | null;
}

export class ContactPanel {
  readonly element: HTMLElement;
  readonly #options: ContactPanelOptions;
  readonly #kind = el('p', {class: 'quiet'});
  readonly #name = el('p', {class: 'contact-name'});
  readonly #depth = el('p', {class: 'contact-depth'});
  readonly #duration = el('p', {});
  readonly #worst = el('p', {});
  readonly #others = el('p', {class: 'quiet'});

  constructor(options: ContactPanelOptions) {
    this.#options = options;
    this.element = el('section', {class: 'contact-panel', 'aria-label': 'What touches in this frame'},
      this.#kind, this.#name, this.#depth, this.#duration, this.#worst, this.#others);
  }

  /** `others`: how many more pairs touch in the frame; with a margin, how many more are within it. */
  show(frame: number, pair: ShownPair | null, others: number, hasMargin: boolean): void {
    const touch = (isOne: boolean): string =>
      hasMargin ? `${isOne ? 'is' : 'are'} within the margin` : isOne ? 'touches' : 'touch';
    setText(this.#kind, !pair ? this.#at(frame) : `${pair.isSelected ? 'Selected' : 'Worst'}, ${this.#at(frame)}`);
    setText(this.#name, pair ? pair.name : 'Nothing touches');
    setText(this.#depth, pair ? this.#depthOf(pair, touch(true)) : '');
    setText(this.#duration, pair ? this.#durationOf(pair, touch(true)) : '');
    setText(this.#worst, pair ? this.#worstOf(pair, frame) : '');
    setText(this.#others, others === 0 ? '' : `${plural(others, 'more pair')} ${touch(others === 1)}`);
    this.#depth.classList.toggle('apart', pair !== null && (!pair.touches || (pair.depth ?? 0) < 0));
    for (const line of this.element.children) (line as HTMLElement).hidden = line.textContent === '';
  }

  #at(frame: number): string {
    const time = this.#options.timeOf(frame);
    return time === null ? `state ${count(frame)}` : `${seconds(time)}, frame ${count(frame)}`;
  }

  #depthOf({touches, depth, triangles}: ShownPair, touch: string): string {
    if (!touches) return 'apart here';
    if (depth !== null) return depthText(depth, this.#options.metresPerUnit);
    return triangles === null || triangles === 0 ? touch : `${plural(triangles, 'pair')} of triangles`;
  }

  #durationOf({interval, frames}: ShownPair, touch: string): string {
    const {timeOf} = this.#options;
    if (timeOf(0) === null) return frames === null ? '' : `in ${plural(frames, 'state')}`;
    if (!interval) return frames === null ? '' : `${touch} in ${plural(frames, 'frame')}`;
    const [from, to] = [timeOf(interval.first) ?? 0, timeOf(interval.last) ?? 0];
    const lasts = plural(interval.last - interval.first + 1, 'frame');
    return interval.first === interval.last ? `for one frame` :
      `for ${seconds(to - from)}, ${lasts}: ${seconds(from)} to ${seconds(to)}`;
  }

  #worstOf({worst}: ShownPair, frame: number): string {
    if (!worst || worst.depth < 0) return '';
    const depth = length(worst.depth, this.#options.metresPerUnit);
    return worst.frame === frame ? 'its deepest contact' : `deepest ${depth}, at ${this.#at(worst.frame)}`;
  }
}
