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

/** The options that are on or off. */
export type Switch = 'leafBoxes' | 'contacts' | 'falsePositives' | 'follow';

export interface ViewActions {
  onChange: (change: Partial<ViewOptions>) => void;
  onFit: () => void;
  onPicture: () => void;
  /** Begins or ends a film. Null: the browser cannot. */
  onFilm: (() => void) | null;
}

/** What the picture has. */
export interface Drawn extends ViewOptions {
  selectedPair: boolean;
  masked: boolean;
  /** Whether triangles of skins are marked, and not links. */
  triangles: boolean;
}

type Entry = 'hit' | 'triangles' | 'selectedPair' | 'falsePositives' | 'masked' | 'contacts' | 'leafBoxes' | 'level';

const MOST_LEVELS = 64;

export class ViewPanel {
  readonly controls: HTMLElement;
  readonly legend: HTMLElement;
  readonly #switches: Record<Switch, HTMLInputElement>;
  readonly #level: HTMLSelectElement;
  readonly #entries: Record<Entry, HTMLElement>;
  readonly #film = el('button', {type: 'button'});
  readonly #note = el('p', {class: 'scene-note', 'aria-live': 'polite'});

  constructor({onChange, onFit, onPicture, onFilm}: ViewActions) {
    const box = (name: Switch): HTMLInputElement => {
      const input = el('input', {type: 'checkbox', change: () => onChange({[name]: input.checked})});
      return input;
    };
    this.#switches = {
      leafBoxes: box('leafBoxes'), contacts: box('contacts'), falsePositives: box('falsePositives'),
      follow: box('follow'),
    };
    this.#level = el('select', {change: () => onChange({level: Number(this.#level.value)})});
    this.setDepth(0);
    const check = (input: HTMLInputElement, words: string, title: string): HTMLElement =>
      el('label', {class: 'check', title}, input, words);
    this.controls = el('div', {class: 'view-controls', role: 'group', 'aria-label': 'What is drawn'},
      check(this.#switches.leafBoxes, 'Leaf boxes', 'Boxes of the leaves (b)'),
      el('label', {title: 'Boxes of one level of the tree (0 to 9)'}, 'Inner boxes ', this.#level),
      check(this.#switches.contacts, 'Contacts', 'Points and normals of contacts (c)'),
      check(this.#switches.falsePositives, 'False positives',
            'Links whose boxes overlap and whose shapes are apart (p)'),
      check(this.#switches.follow, 'Follow', 'The camera goes along with the selected character (f)'),
      el('button', {
        type: 'button', title: 'Fit the camera to what is selected, or to everything (z)', click: onFit,
      }, 'Fit'),
      el('button', {type: 'button', title: 'Save what is shown as a PNG file', click: onPicture}, 'Picture'),
      this.#film);
    if (onFilm) this.#film.addEventListener('click', onFilm);
    else this.#film.hidden = true;
    this.setFilming(false);
    this.#entries = {
      hit: entry('hit', 'red: links in a hit'),
      triangles: entry('hit', 'red: triangles that touch'),
      selectedPair: entry('hit', 'red: where the selected pair touches; the larger link, and all else, is seen ' +
        'through'),
      falsePositives: entry('false-positive', 'pink, striped: false positive, boxes overlap and shapes are apart'),
      masked: entry('masked', 'grey, crossed, in a cube: masked, since its pose is no pose'),
      contacts: entry('contact', 'white arrow: contact normal, from a to b'),
      leafBoxes: entry('leaf-box', 'light blue lines: leaf boxes'),
      level: entry('inner-box', 'violet lines: inner boxes'),
    };
    this.legend = el('div', {class: 'legend', role: 'group', 'aria-label': 'Legend'},
      el('ul', {}, ...Object.values(this.#entries)), this.#note);
  }

  setFilming(filming: boolean): void {
    setText(this.#film, filming ? 'End film' : 'Film');
    this.#film.title = filming ? 'End the film and save it' : 'Play, and save what is shown as a WebM file';
    this.#film.setAttribute('aria-pressed', String(filming));
  }

  /** Only what is drawn is explained. */
  showLegend({selectedPair, falsePositives, masked, contacts, leafBoxes, level, triangles}: Drawn): void {
    const drawn = {
      hit: !triangles && !selectedPair, triangles: triangles && !selectedPair, selectedPair, falsePositives, masked,
      contacts, leafBoxes, level: level > 0,
    };
    for (const name of Object.keys(drawn) as (keyof typeof drawn)[]) this.#entries[name].hidden = !drawn[name];
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

  show(options: ViewOptions): void {
    for (const name of Object.keys(this.#switches) as Switch[]) this.#switches[name].checked = options[name];
    this.#level.value = String(options.level);
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
  'false-positive': css(COLORS.falsePositive),
  masked: css(COLORS.masked),
  contact: css(COLORS.contact),
  'leaf-box': css(COLORS.leafBox),
  'inner-box': css(COLORS.innerBox),
};

function entry(kind: string, words: string): HTMLElement {
  const swatch = el('span', {class: `swatch ${kind}`});
  swatch.style.setProperty('--color', SWATCHES[kind] ?? null);
  return el('li', {}, swatch, words);
}
