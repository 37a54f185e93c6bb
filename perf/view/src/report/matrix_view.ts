// Shows the matrix of links of two characters as a heat map, whose numbers stand below it in words.
import {el, setText} from '../ui/dom.js';
import {characterPairs, type CharacterPair, heat, hottest, makeMatrix, type Measure} from './matrix_data.js';
import {pairSentence, severityText, shareText} from './texts.js';
import type {Report, ReportPair} from './types.js';

const MOST_LINKS = 80;
const MOST_CHARACTER_PAIRS = 500;

export class MatrixView {
  readonly element: HTMLElement;
  readonly #report: Report;
  readonly #names: readonly string[];
  readonly #onOpen: (pair: ReportPair) => void;
  readonly #which = el('select', {'aria-label': 'Characters', change: () => this.#show()});
  readonly #measure = el('select', {'aria-label': 'Colour by', change: () => this.#show()},
    el('option', {value: 'share'}, 'share of frames'), el('option', {value: 'worst'}, 'worst contact'));
  readonly #scale = el('span', {class: 'report-scale', role: 'img'});
  readonly #grid = el('div', {class: 'report-scroll'});
  readonly #note = el('p', {class: 'quiet'});
  readonly #words = el('p', {class: 'quiet', 'aria-live': 'polite'});
  #found: CharacterPair[] = [];

  constructor(report: Report, names: readonly string[], onOpen: (pair: ReportPair) => void) {
    this.#report = report;
    this.#names = names;
    this.#onOpen = onOpen;
    this.element = el('div', {class: 'report-matrix'},
      el('div', {class: 'report-filters'}, el('label', {}, 'Characters ', this.#which),
        el('label', {}, 'Colour by ', this.#measure), this.#scale),
      this.#words, this.#grid, this.#note);
  }

  setPairs(pairs: readonly ReportPair[]): void {
    const before = this.#which.selectedOptions[0]?.text;
    this.#found = characterPairs(pairs);
    const options = this.#found.slice(0, MOST_CHARACTER_PAIRS).map(({file, a, b}, index) => {
      const where = this.#report.files.length > 1 ? `${this.#names[file] ?? ''}: ` : '';
      const text = `${where}${a} \u2013 ${b}`;
      return el('option', {value: index, selected: text === before}, text);
    });
    this.#which.replaceChildren(...options);
    this.#show();
  }

  #show(): void {
    const chosen = this.#found[Number(this.#which.value)];
    setText(this.#words, chosen ? 'Point at a cell, or walk with the arrow keys, to read its numbers.' :
      'No pair of links passes the filters.');
    const rest = this.#found.length - MOST_CHARACTER_PAIRS;
    const notes: string[] = [];
    if (rest > 0) notes.push(`The list has the worst ${MOST_CHARACTER_PAIRS} pairs of characters; filter for others.`);
    if (!chosen) {
      this.#showScale('');
      this.#grid.replaceChildren();
      setText(this.#note, '');
      return;
    }
    const matrix = makeMatrix(chosen, MOST_LINKS);
    if (matrix.leftOut > 0) notes.push(`${matrix.leftOut} links that touch the least are left out.`);
    const measure = this.#measure.value as Measure;
    const hottestPair = hottest(chosen.pairs, measure);
    if (!hottestPair) notes.unshift('No depth is known; record it with contacts.');
    this.#showScale(!hottestPair ? '' : measure === 'share' ? `${shareText(hottestPair.share)} of the frames` :
      severityText(hottestPair, this.#report.files[hottestPair.file]));
    setText(this.#note, notes.join(' '));
    const {columns, rows, cells} = matrix;
    const header = el('tr', {}, el('td'), ...columns.map((name) => el('th', {scope: 'col'}, el('span', {}, name))));
    const body = rows.map((name, row) => el('tr', {}, el('th', {scope: 'row'}, name),
      ...columns.map((_, column) => this.#cell(cells[row * columns.length + column] ?? null, measure, hottestPair))));
    const table = el('table', {'aria-label': `Links of ${chosen.a} and ${chosen.b} that touch`},
      el('thead', {}, header), el('tbody', {}, ...body));
    table.addEventListener('keydown', (event) => walk(event));
    table.style.setProperty('--columns', String(columns.length));
    this.#grid.replaceChildren(table);
    table.querySelector('button')?.setAttribute('tabindex', '0');
  }

  // What the colours mean, from none to the most of all cells; empty: they mean nothing.
  #showScale(most: string): void {
    this.#scale.hidden = most === '';
    this.#scale.setAttribute('aria-label', `The warmest colour is ${most}, the coolest none.`);
    this.#scale.replaceChildren('none', el('i'), most);
  }

  #cell(pair: ReportPair | null, measure: Measure, hottestPair: ReportPair | undefined): HTMLTableCellElement {
    if (!pair) return el('td');
    const sentence = pairSentence(pair, this.#report.files[pair.file]);
    const warmth = heat(pair, measure, hottestPair);
    const tell = (): void => setText(this.#words, sentence);
    const button = el('button', {
      type: 'button', tabindex: -1, title: sentence, 'aria-label': sentence,
      class: warmth === null ? 'unknown' : '', focus: tell, pointerenter: tell, click: () => this.#onOpen(pair),
    });
    if (warmth !== null) button.style.setProperty('--heat', warmth.toFixed(3));
    return el('td', {}, button);
  }
}

// Moves the focus to the next cell with a contact in the direction of an arrow key. Tab reaches one cell alone.
function walk(event: KeyboardEvent): void {
  const steps: Record<string, readonly [row: number, column: number]> = {
    ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowDown: [1, 0], ArrowUp: [-1, 0],
  };
  const step = steps[event.key];
  const from = (event.target as Element).closest('td');
  const row = from?.parentElement as HTMLTableRowElement | null | undefined;
  const body = row?.parentElement as HTMLTableSectionElement | null | undefined;
  if (!step || !from || !row || !body) return;
  event.preventDefault();
  event.stopPropagation();
  let at = row.sectionRowIndex + step[0];
  let column = from.cellIndex + step[1];
  for (; body.rows[at]?.cells[column]; at += step[0], column += step[1]) {
    const to = body.rows[at]?.cells[column]?.querySelector('button');
    if (!to) continue;
    from.querySelector('button')?.setAttribute('tabindex', '-1');
    to.setAttribute('tabindex', '0');
    to.focus();
    return;
  }
}
