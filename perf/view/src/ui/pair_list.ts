// The list of pairs of links that touch, each with its own timeline.
import {contactOfPair, type PairHistory} from './contact_index.js';
import {el, prepareCanvas, setText} from './dom.js';
import {count, depthText, plural} from './format.js';
import type {Names} from './names.js';
import {drawIntervals} from './timeline.js';

const MOST_ROWS = 200;

export interface PairListOptions {
  names: Names;
  frameCount: number;
  metresPerUnit: number;
  /** Whether frames are states, without times. */
  areStates: () => boolean;
  onPick: (pair: PairHistory, frame: number) => void;
  /** Saves all of them. */
  onMarkers: () => void;
}

interface Row {
  pair: PairHistory;
  element: HTMLElement;
  canvas: HTMLCanvasElement;
}

export class PairList {
  readonly element: HTMLElement;
  readonly #options: PairListOptions;
  readonly #filter: HTMLInputElement;
  readonly #sort: HTMLSelectElement;
  readonly #summary = el('p', {class: 'quiet', 'aria-live': 'polite'});
  readonly #list = el('ul', {class: 'pairs'});
  readonly #texts = new Map<PairHistory, string>();
  #pairs: PairHistory[] = [];
  #rows: Row[] = [];
  #selected: PairHistory | null = null;

  constructor(options: PairListOptions) {
    this.#options = options;
    this.#filter = el('input', {
      type: 'search', placeholder: 'Filter by name', 'aria-label': 'Filter pairs by name', input: () => this.#show(),
    });
    this.#sort = el('select', {'aria-label': 'Sort pairs', change: () => this.#show()},
      el('option', {value: 'deepest'}, 'deepest first'), el('option', {value: 'longest'}, 'longest first'),
      el('option', {value: 'earliest'}, 'earliest first'));
    this.element = el('section', {class: 'pair-list', 'aria-label': 'Pairs of links that touch'},
      el('div', {class: 'filter'}, this.#filter, this.#sort),
      el('div', {class: 'filter'}, this.#summary, el('button', {
        type: 'button', title: 'Save when and where all pairs touch as a CSV file', click: options.onMarkers,
      }, 'Markers')), this.#list);
    new ResizeObserver(() => this.drawTimelines()).observe(this.#list);
  }

  setPairs(pairs: readonly PairHistory[]): void {
    this.#pairs = [...pairs];
    const hasDepths = pairs.some(({worstDepth}) => worstDepth !== null);
    this.#sort.querySelector('option')!.disabled = !hasDepths;
    if (!hasDepths && this.#sort.value === 'deepest') this.#sort.value = 'longest';
    this.#show();
  }

  select(pair: PairHistory | null): void {
    this.#selected = pair;
    for (const row of this.#rows) row.element.classList.toggle('selected', row.pair === pair);
  }

  #textOf(pair: PairHistory): string {
    const known = this.#texts.get(pair);
    if (known !== undefined) return known;
    const text = this.#options.names.pair(pair.batchA, pair.hit, pair.batchB);
    this.#texts.set(pair, text);
    return text;
  }

  #show(): void {
    const words = this.#filter.value.toLowerCase().split(/\s+/).filter((word) => word !== '');
    const found = this.#pairs.filter((pair) => {
      const text = this.#textOf(pair).toLowerCase();
      return words.every((word) => text.includes(word));
    });
    const order = this.#sort.value;
    found.sort((a, b) => order === 'earliest' ? a.intervals[0]! - b.intervals[0]! :
      order === 'longest' ? b.frames - a.frames : (b.worstDepth ?? -Infinity) - (a.worstDepth ?? -Infinity));
    const rest = found.length - MOST_ROWS;
    setText(this.#summary, this.#pairs.length === 0 ? 'No links touch in this recording.' :
      `${plural(found.length, 'pair')} of ${count(this.#pairs.length)}` +
      (rest > 0 ? `; the first ${MOST_ROWS} are shown, filter for others` : ''));
    this.#rows = found.slice(0, MOST_ROWS).map((pair) => this.#row(pair));
    this.#list.replaceChildren(...this.#rows.map(({element}) => element));
    this.drawTimelines();
  }

  #row(pair: PairHistory): Row {
    const {frameCount, metresPerUnit, areStates, onPick} = this.#options;
    const canvas = el('canvas', {
      class: 'pair-timeline', 'aria-hidden': 'true',
      click: (event) => {
        event.stopPropagation();
        const {left, width} = canvas.getBoundingClientRect();
        const frame = Math.floor(((event as MouseEvent).clientX - left) / width * frameCount);
        onPick(pair, nearestContact(pair, frame));
      },
    });
    const depth = pair.worstDepth === null ? '' : `, ${depthText(pair.worstDepth, metresPerUnit)}`;
    const button = el('button', {
      type: 'button', title: 'Go to the deepest contact of this pair, or to its next one',
      click: () => onPick(pair, pair !== this.#selected ? pair.worstFrame : nextContact(pair, pair.worstFrame)),
    }, el('span', {class: 'pair-name'}, this.#textOf(pair)),
       el('span', {class: 'quiet'}, plural(pair.frames, areStates() ? 'state' : 'frame') +
         ` (${share(pair.frames, frameCount)})${depth}`));
    const element = el('li', {class: pair === this.#selected ? 'selected' : ''}, button, canvas);
    return {pair, element, canvas};
  }

  drawTimelines(): void {
    for (const {canvas, pair} of this.#rows) {
      const prepared = prepareCanvas(canvas);
      if (!prepared) continue;
      drawIntervals(prepared.context, pair, this.#options.frameCount, prepared.width, 1, prepared.height - 2);
    }
  }
}

const share = (frames: number, of: number): string => {
  const percent = 100 * frames / of;
  return `${percent < 1 ? percent.toFixed(1) : percent.toFixed(0)} %`;
};

const nextContact = (pair: PairHistory, frame: number): number => {
  const next = contactOfPair(pair, frame, true);
  return next >= 0 ? next : pair.intervals[0]!;
};

/** The frame of a pair's contacts that is nearest to one that was clicked. */
function nearestContact({intervals}: PairHistory, frame: number): number {
  let best = intervals[0]!;
  for (let i = 0; i < intervals.length; i += 2) {
    const inside = Math.min(Math.max(frame, intervals[i]!), intervals[i + 1]!);
    if (Math.abs(inside - frame) < Math.abs(best - frame)) best = inside;
  }
  return best;
}
