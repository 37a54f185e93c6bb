// The dial: settings of the engine in the page, and what a frame costs and finds as recorded and with them.
import type {Dial, RunResult} from '../engine/types.js';
import type {Frame} from '../recording/types.js';
import {hitCount} from '../scene/hits.js';
import {changed, isAsRecorded, verdictOf} from './dial_state.js';
import {el, setText} from './dom.js';
import {count, hash, milliseconds, timeLeft} from './format.js';
import {POLICY_TABLE} from './policy_table.js';
import type {Progress} from './slices.js';

export interface DialActions {
  onDial: (dial: Dial) => void;
  onRunWhilePlaying: (on: boolean) => void;
  onRerunAll: () => void;
  onStop: () => void;
}

/** Each with its meaning. */
const RESULTS = {
  milliseconds: ['Time', 'Of the frame, in the engine'],
  boxTests: ['Box tests', 'Overlap tests of two boxes, inner ones and leaves'],
  leafPairs: ['Leaf pairs', 'Leaf pairs whose boxes overlap: #coll in the paper'],
  exactTests: ['Exact tests', 'Leaf pairs that went to the exact test'],
  falsePositives: ['False positives', 'Exact tests that found the leaves apart: #false in the paper'],
  hits: ['Hits', 'Pairs of links that touch'],
  masked: ['Masked', 'Instances that took no part, since their poses are no poses'],
  hash: ['Hash', 'FNV-1a, 64 bits, of the bytes of hits, then of contacts'],
} as const;

type ResultRow = keyof typeof RESULTS;

export class DialPanel {
  readonly element: HTMLElement;
  #dial: Dial = {};
  readonly #actions: DialActions;
  readonly #selects = new Map<string, HTMLSelectElement>();
  readonly #margin: HTMLInputElement;
  readonly #levelLeaves: HTMLInputElement;
  readonly #cells = new Map<ResultRow, {recorded: HTMLElement; here: HTMLElement}>();
  readonly #engine = el('p', {class: 'quiet'}, 'The engine is starting.');
  readonly #notes = el('p', {class: 'quiet'});
  readonly #verdict = el('p', {class: 'verdict', role: 'status'}, '');
  readonly #reset: HTMLButtonElement;
  readonly #rerun: HTMLButtonElement;
  readonly #stop: HTMLButtonElement;
  readonly #progress = el('progress', {max: 1, value: 0, 'aria-label': 'Frames that were run again'});
  readonly #rerunText = el('p', {class: 'verdict', role: 'status'}, '');

  constructor(actions: DialActions) {
    this.#actions = actions;
    const fields = el('div', {class: 'dial-fields'});
    for (const {name, label, meaning, values, firstForComparison} of POLICY_TABLE) {
      const options = Object.entries(values).map(([value, words]) => el('option', {value, title: words}, value));
      const used = firstForComparison ? Object.keys(values).indexOf(firstForComparison) : options.length;
      const select = el('select', {
        title: meaning, change: () => this.#change({[name]: select.value === '' ? undefined : select.value}),
      }, el('option', {value: ''}, 'as recorded'), ...options.slice(0, used));
      if (used < options.length)
        select.append(el('optgroup', {label: 'the paper\u2019s, for comparison'}, ...options.slice(used)));
      this.#selects.set(name, select);
      fields.append(el('label', {title: meaning}, el('span', {}, label), select));
    }
    this.#margin = numberInput('as recorded', 0, 'any', (margin) => this.#change({margin}));
    this.#levelLeaves = numberInput('as recorded', 1, '1', (levelLeaves) => this.#change({levelLeaves}));
    fields.append(
      el('label', {title: 'Links at most this far apart are reported too'}, el('span', {}, 'Margin'), this.#margin),
      el('label', {title: 'Articulations are replaced by a level of detail of at most so many leaves'},
         el('span', {}, 'Level, leaves'), this.#levelLeaves));
    this.#reset = button('Reset', () => actions.onDial({}));
    this.#rerun = button('Rerun all frames', actions.onRerunAll);
    this.#stop = button('Stop', actions.onStop);
    const playing = el('input', {type: 'checkbox', change: () => actions.onRunWhilePlaying(playing.checked)});
    this.element = el('section', {class: 'dial-panel', 'aria-label': 'The dial'}, fields,
      el('div', {class: 'row'}, this.#reset, el('label', {class: 'check'}, playing, 'run each frame while playing')),
      this.#verdict, this.#notes, this.#resultTable(),
      el('div', {class: 'row'}, this.#rerun, this.#stop, this.#progress), this.#rerunText, this.#engine);
    this.#progress.hidden = true;
    this.#stop.hidden = true;
    this.setEngine(null);
  }

  #resultTable(): HTMLElement {
    const body = el('tbody');
    for (const [row, [label, title]] of Object.entries(RESULTS) as [ResultRow, readonly [string, string]][]) {
      const cells = {recorded: el('td'), here: el('td')};
      this.#cells.set(row, cells);
      body.append(el('tr', {title}, el('th', {scope: 'row'}, label), cells.recorded, cells.here));
    }
    return el('table', {class: 'results'}, el('thead', {}, el('tr', {}, el('td'),
      el('th', {scope: 'col'}, 'as recorded'), el('th', {scope: 'col'}, 'in your browser'))), body);
  }

  #change(change: {[K in keyof Dial]?: Dial[K] | undefined}): void {
    this.#actions.onDial(changed(this.#dial, change));
  }

  setEngine(words: string | null): void {
    setText(this.#engine, words ?? 'The engine is starting.');
    this.#rerun.disabled = words === null;
  }

  /** Why there is no engine, or why it refused something. */
  setProblem(words: string): void {
    setText(this.#verdict, words);
    this.#verdict.className = 'verdict different';
    for (const {here} of this.#cells.values()) setText(here, '\u2013');
  }

  setDial(dial: Dial): void {
    this.#dial = dial;
    for (const {name} of POLICY_TABLE) {
      const select = this.#selects.get(name)!;
      select.value = dial[name] ?? '';
      select.classList.toggle('set', dial[name] !== undefined);
    }
    if (document.activeElement !== this.#margin) this.#margin.value = dial.margin?.toString() ?? '';
    if (document.activeElement !== this.#levelLeaves) this.#levelLeaves.value = dial.levelLeaves?.toString() ?? '';
    this.#margin.classList.toggle('set', dial.margin !== undefined);
    this.#levelLeaves.classList.toggle('set', dial.levelLeaves !== undefined);
    this.#reset.disabled = isAsRecorded(dial);
  }

  /** What the frame was recorded with, as the words of "as recorded". */
  showRecorded(frame: Frame): void {
    const {policies, margin} = frame.settings;
    for (const [name, select] of this.#selects) setText(select.options[0]!, `${policies[name] ?? 'unknown'}, recorded`);
    this.#margin.placeholder = `${Number(margin.toPrecision(6))}, recorded`;
    const {stats} = frame;
    this.#write('recorded', {
      milliseconds: stats.secondsTotal * 1000, boxTests: stats.boxTests, leafPairs: stats.leafPairs,
      exactTests: stats.exactTests, falsePositives: stats.falsePositives, hits: hitCount(frame.hits),
      masked: stats.instancesMasked,
    }, frame.hash);
  }

  #write(column: 'recorded' | 'here', numbers: Partial<Record<Exclude<ResultRow, 'hash'>, number>>,
    bits: bigint): void {
    for (const [row, cells] of this.#cells) {
      const number = row === 'hash' ? undefined : numbers[row];
      setText(cells[column], row === 'hash' ? hash(bits) : number === undefined ? '\u2013' :
        row === 'milliseconds' ? milliseconds(number) : count(number));
    }
  }

  showResult(frame: Frame, result: RunResult): void {
    this.#write('here', {...result, hits: hitCount(result.hits)}, result.hash);
    const {kind, text} = verdictOf(frame, result, this.#dial);
    setText(this.#verdict, text);
    this.#verdict.className = `verdict ${kind}`;
    setText(this.#notes, result.notes.join(' '));
    this.element.classList.remove('stale');
  }

  /** The numbers in the right column are of another frame. */
  showStale(): void {
    this.element.classList.add('stale');
  }

  showRerun(progress: Progress | null, text: string, isSame: boolean): void {
    const running = progress !== null;
    this.#progress.hidden = !running;
    this.#stop.hidden = !running;
    this.#rerun.disabled = running;
    if (progress) this.#progress.value = progress.done / Math.max(progress.of, 1);
    setText(this.#rerunText,
            progress ? `${count(progress.done)} of ${count(progress.of)}, ${timeLeft(progress.secondsLeft)}` : text);
    this.#rerunText.className = `verdict ${running || text === '' ? '' : isSame ? 'same' : 'different'}`;
  }
}

function button(words: string, click: () => void): HTMLButtonElement {
  return el('button', {type: 'button', click}, words);
}

function numberInput(placeholder: string, min: number, step: string,
                     onValue: (value: number | undefined) => void): HTMLInputElement {
  const input = el('input', {
    type: 'number', min, step, placeholder,
    change: () => {
      const value = input.value === '' ? undefined : Number(input.value);
      const valid = value === undefined || (Number.isFinite(value) && value >= min);
      input.setAttribute('aria-invalid', String(!valid));
      if (valid) onValue(value);
    },
  });
  return input;
}
