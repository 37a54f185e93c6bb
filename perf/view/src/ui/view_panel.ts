// What is drawn beside the shapes, and the legend, which says in words what colours stand for.
import {COLORS} from '../scene/colors.js';
import {el, setText} from './dom.js';

export interface ViewOptions {
  leafBoxes: boolean;
  /** 0: no inner boxes. 1: the root. */
  level: number;
  contacts: boolean;
  falsePositives: boolean;
  follow: boolean;
}

export const MOST_LEVELS = 64;

export class ViewPanel {
  readonly controls: HTMLElement;
  readonly legend: HTMLElement;
  readonly #boxes: Record<'leafBoxes' | 'contacts' | 'falsePositives' | 'follow', HTMLInputElement>;
  readonly #level: HTMLSelectElement;
  readonly #note = el('p', {class: 'scene-note', 'aria-live': 'polite'});

  constructor(onChange: (change: Partial<ViewOptions>) => void, onFit: () => void) {
    const box = (name: 'leafBoxes' | 'contacts' | 'falsePositives' | 'follow'): HTMLInputElement => {
      const input = el('input', {type: 'checkbox', change: () => onChange({[name]: input.checked})});
      return input;
    };
    this.#boxes = {
      leafBoxes: box('leafBoxes'), contacts: box('contacts'), falsePositives: box('falsePositives'),
      follow: box('follow'),
    };
    this.#level = el('select', {change: () => onChange({level: Number(this.#level.value)})});
    this.setDepth(0);
    const check = (input: HTMLInputElement, words: string, title: string): HTMLElement =>
      el('label', {class: 'check', title}, input, words);
    this.controls = el('div', {class: 'view-controls', role: 'group', 'aria-label': 'What is drawn'},
      check(this.#boxes.leafBoxes, 'Leaf boxes', 'Boxes of the leaves (b)'),
      el('label', {title: 'Boxes of one level of the tree (0 to 9)'}, 'Inner boxes ', this.#level),
      check(this.#boxes.contacts, 'Contacts', 'Points and normals of contacts (c)'),
      check(this.#boxes.falsePositives, 'False positives', 'Links whose boxes overlap and whose shapes are apart (p)'),
      check(this.#boxes.follow, 'Follow', 'The camera goes along with the selected character (f)'),
      el('button', {type: 'button', title: 'See everything (Z)', click: onFit}, 'Fit'));
    this.legend = el('div', {class: 'legend', 'aria-label': 'Legend'},
      el('ul', {},
        entry('hit', 'red: links in a hit'),
        entry('selected', 'red, striped: the selected pair'),
        entry('amber', 'amber, striped: false positive, boxes overlap and shapes are apart'),
        entry('masked', 'grey, crossed: masked, its pose is no pose'),
        entry('contact', 'white arrow: contact normal, from a to b'),
        entry('leaf-box', 'light blue lines: leaf boxes'),
        entry('inner-box', 'violet lines: inner boxes')),
      this.#note);
  }

  /** The deepest level that there is to choose. */
  setDepth(depth: number): void {
    const chosen = this.#level.value;
    const levels = Math.min(depth, MOST_LEVELS);
    if (this.#level.options.length === levels + 1) return;
    this.#level.replaceChildren(el('option', {value: 0}, 'none'), ...Array.from({length: levels}, (_, i) =>
      el('option', {value: i + 1}, i === 0 ? 'level 1, root' : `level ${i + 1}`)));
    this.#level.value = Number(chosen) <= levels ? chosen || '0' : '0';
  }

  show({leafBoxes, level, contacts, falsePositives, follow}: ViewOptions): void {
    Object.assign(this.#boxes.leafBoxes, {checked: leafBoxes});
    Object.assign(this.#boxes.contacts, {checked: contacts});
    Object.assign(this.#boxes.falsePositives, {checked: falsePositives});
    Object.assign(this.#boxes.follow, {checked: follow});
    this.#level.value = String(level);
  }

  /** What is left out of the picture, or which hits it shows. */
  setNote(words: string): void {
    setText(this.#note, words);
    this.#note.hidden = words === '';
  }
}

const css = (rgb: number): string => `#${rgb.toString(16).padStart(6, '0')}`;

const SWATCHES: Record<string, string> = {
  hit: css(COLORS.hit),
  selected: css(COLORS.hit),
  amber: css(COLORS.falsePositive),
  masked: css(COLORS.masked),
  contact: css(COLORS.contact),
  'leaf-box': css(COLORS.leafBox),
  'inner-box': css(COLORS.innerBox),
};

function entry(kind: string, words: string): HTMLElement {
  return el('li', {}, el('span', {class: `swatch ${kind}`, style: `--color: ${SWATCHES[kind]}`}), words);
}
