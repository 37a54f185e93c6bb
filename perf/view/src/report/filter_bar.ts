// The filters of a report: names, file, depth and duration.
import {el} from '../ui/dom.js';
import {hasStatesAlone} from './events.js';
import {type Filter, hasMetres, NO_FILTER} from './filter.js';
import type {Report} from './types.js';

const MILLIMETRES_PER_METRE = 1000;

export class FilterBar {
  readonly element: HTMLElement;
  readonly #text: HTMLInputElement;
  readonly #file: HTMLSelectElement;
  readonly #depth: HTMLInputElement;
  readonly #frames: HTMLInputElement;
  readonly #perUnit: number;

  /** `onChange` is called when what the filter says has changed. */
  constructor(report: Report, names: readonly string[], onChange: () => void) {
    this.#perUnit = hasMetres(report) ? MILLIMETRES_PER_METRE : 1;
    const hasDepths = report.intervals.some(({worst_depth: depth}) => depth !== null);
    this.#text = el('input', {type: 'search', placeholder: 'words of names', input: onChange});
    this.#file = el('select', {change: onChange}, el('option', {value: ''}, 'all files'),
      ...names.map((name, index) => el('option', {value: index}, name)));
    this.#depth = el('input', {
      type: 'number', min: 0, step: 'any', placeholder: hasDepths ? 'any' : 'none', disabled: !hasDepths,
      input: onChange,
    });
    this.#frames = el('input', {type: 'number', min: 1, step: 1, placeholder: '1', input: onChange});
    this.element = el('form', {class: 'report-filters', role: 'search', 'aria-label': 'Filters of the report',
                               submit: (event) => event.preventDefault(),
                               reset: () => { setTimeout(onChange); }},
      el('label', {}, 'Character, link or file ', this.#text),
      ...(names.length > 1 ? [el('label', {}, 'File ', this.#file)] : []),
      el('label', {}, 'At least ', this.#depth, hasMetres(report) ? ' mm deep' : ' units deep'),
      // States are not long.
      ...(hasStatesAlone(report) ? [] : [el('label', {}, 'At least ', this.#frames, ' frames long')]),
      el('button', {type: 'reset'}, 'Clear filters'));
  }

  get filter(): Filter {
    const depth = this.#depth.valueAsNumber;
    const frames = this.#frames.valueAsNumber;
    return {
      text: this.#text.value,
      file: this.#file.value === '' ? NO_FILTER.file : Number(this.#file.value),
      minDepth: Number.isFinite(depth) ? depth / this.#perUnit : NO_FILTER.minDepth,
      minFrames: Number.isFinite(frames) ? frames : NO_FILTER.minFrames,
    };
  }
}
