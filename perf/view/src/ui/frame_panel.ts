// The numbers of the shown frame, as they were recorded.
import type {Frame} from '../recording/types.js';
import {hitCount} from '../scene/hits.js';
import {el, setText} from './dom.js';
import {count, hash, seconds} from './format.js';

const ROWS = {
  frame: 'Frame',
  time: 'Time',
  hits: 'Hits',
  boxTests: 'Box tests',
  leafPairs: 'Leaf pairs',
  exactTests: 'Exact tests',
  falsePositives: 'False positives',
  masked: 'Masked',
} as const;

type Row = keyof typeof ROWS;

const MEANINGS: Record<Row, string> = {
  frame: 'Number of the frame, from 0',
  time: 'Seconds since the recording began',
  hits: 'Pairs of links that touch',
  boxTests: 'Overlap tests of two boxes, inner ones and leaves',
  leafPairs: 'Leaf pairs whose boxes overlap: #coll in the paper',
  exactTests: 'Leaf pairs that went to the exact test',
  falsePositives: 'Exact tests that found the leaves apart: #false in the paper',
  masked: 'Instances that took no part, since their poses are no poses',
};

export class FramePanel {
  readonly element: HTMLElement;
  readonly #values = new Map<Row, HTMLElement>();
  readonly #hash = el('code');

  constructor() {
    const list = el('dl', {class: 'numbers'});
    for (const row of Object.keys(ROWS) as Row[]) {
      const value = el('dd', {}, '\u2013');
      this.#values.set(row, value);
      list.append(el('div', {title: MEANINGS[row]}, el('dt', {}, ROWS[row]), value));
    }
    list.append(el('div', {class: 'wide', title: 'FNV-1a, 64 bits, of the bytes of hits, then of contacts'},
                   el('dt', {}, 'Hash of hits'), el('dd', {}, this.#hash)));
    this.element = el('section', {class: 'frame-panel', 'aria-label': 'This frame, as recorded'}, list);
  }

  show(frame: Frame, time: number): void {
    const {stats} = frame;
    const texts: Record<Row, string> = {
      frame: count(frame.index),
      time: seconds(time),
      hits: count(hitCount(frame.hits)),
      boxTests: count(stats.boxTests),
      leafPairs: count(stats.leafPairs),
      exactTests: count(stats.exactTests),
      falsePositives: count(stats.falsePositives),
      masked: count(stats.instancesMasked),
    };
    for (const [row, element] of this.#values) setText(element, texts[row]);
    this.#values.get('masked')!.classList.toggle('warning', stats.instancesMasked > 0);
    setText(this.#hash, hash(frame.hash));
  }
}
