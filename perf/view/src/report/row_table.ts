// A table of many rows: sorted by its headers, shown a page at a time, and walked through by keyboard.
import {el, setText} from '../ui/dom.js';
import {count} from '../ui/format.js';
import {type Column, sortRows} from './columns.js';

const ROWS_PER_PAGE = 100;

const classOf = <R>({kind, isKey}: Column<R>): string => isKey ? `${kind} key` : kind;

export interface RowTableOptions<R> {
  readonly caption: string;
  readonly columns: readonly Column<R>[];
  /** A picture of the row, in a column of its own. */
  readonly strip?: (row: R) => Element;
  /** What opening a row does, in words for its button; null if it cannot be opened, with the reason. */
  readonly openable: (row: R) => {readonly words: string} | {readonly reason: string};
  readonly onOpen: (row: R) => void;
}

export class RowTable<R> {
  readonly element: HTMLElement;
  readonly #options: RowTableOptions<R>;
  readonly #body = el('tbody');
  readonly #status = el('p', {class: 'quiet', 'aria-live': 'polite'});
  readonly #previous = el('button', {type: 'button', click: () => this.#turn(-1)}, 'Previous rows');
  readonly #next = el('button', {type: 'button', click: () => this.#turn(1)}, 'Next rows');
  readonly #headers: HTMLTableCellElement[];
  #given: readonly R[] = [];
  #sorted: readonly R[] = [];
  #all = 0;
  #page = 0;
  #sort: {column: number; ascends: boolean} | null = null;

  constructor(options: RowTableOptions<R>) {
    this.#options = options;
    this.#headers = options.columns.map((column, index) => this.#header(column, index));
    const unsorted = options.strip ? [el('th', {scope: 'col'}, 'Timeline')] : [];
    const table = el('table', {},
      el('caption', {}, options.caption),
      el('thead', {}, el('tr', {}, el('th', {scope: 'col'}, 'Open'), ...this.#headers, ...unsorted)), this.#body);
    this.element = el('div', {class: 'report-table'},
      el('div', {class: 'report-scroll', tabindex: 0, role: 'region', 'aria-label': options.caption}, table),
      el('div', {class: 'report-pages'}, this.#previous, this.#next, this.#status));
    this.#body.addEventListener('keydown', (event) => this.#onKey(event));
  }

  /** Shows rows, in the order in which they are given until a header is pressed. `all` is how many there are. */
  setRows(rows: readonly R[], all: number): void {
    this.#given = rows;
    this.#all = all;
    this.#order();
  }

  #order(): void {
    const column = this.#sort && this.#options.columns[this.#sort.column];
    this.#sorted = column && this.#sort ? sortRows(this.#given, column, this.#sort.ascends) : this.#given;
    this.#page = 0;
    this.#show();
  }

  #header(column: Column<R>, index: number): HTMLTableCellElement {
    const button = el('button', {type: 'button', title: column.meaning, click: () => this.#sortBy(index)},
      column.title);
    return el('th', {scope: 'col', class: classOf(column), 'aria-sort': 'none'}, button);
  }

  // Numbers begin with the largest and words with the first. A third press brings back the order that was given.
  #sortBy(index: number): void {
    const first = this.#options.columns[index]?.kind !== 'number';
    const now = this.#sort?.column === index ? this.#sort : null;
    this.#sort = now === null ? {column: index, ascends: first} :
      now.ascends === first ? {column: index, ascends: !first} : null;
    this.#headers.forEach((header, at) => {
      const order = this.#sort?.column === at ? (this.#sort.ascends ? 'ascending' : 'descending') : 'none';
      header.setAttribute('aria-sort', order);
    });
    this.#order();
  }

  #turn(by: number): void {
    const pages = Math.max(1, Math.ceil(this.#sorted.length / ROWS_PER_PAGE));
    const page = Math.min(Math.max(this.#page + by, 0), pages - 1);
    if (page === this.#page) return;
    this.#page = page;
    this.#show();
  }

  #show(): void {
    const first = this.#page * ROWS_PER_PAGE;
    const shown = this.#sorted.slice(first, first + ROWS_PER_PAGE);
    this.#body.replaceChildren(...shown.map((row) => this.#row(row)));
    const {length} = this.#sorted;
    const filtered = length < this.#all ? ` (of ${count(this.#all)} without filters)` : '';
    setText(this.#status, length === 0 ? `No rows${filtered}` :
      `Rows ${count(first + 1)} to ${count(first + shown.length)} of ${count(length)}${filtered}`);
    this.#previous.disabled = this.#page === 0;
    this.#next.disabled = first + ROWS_PER_PAGE >= length;
  }

  #row(row: R): HTMLTableRowElement {
    const {columns, strip, openable, onOpen} = this.#options;
    const state = openable(row);
    const [words, sign] = 'words' in state ? [state.words, '\u25b6'] : [state.reason, '\u2013'];
    const button = el('button', {type: 'button', 'aria-label': words, title: words}, sign);
    if ('reason' in state) button.setAttribute('aria-disabled', 'true');
    const element = el('tr', {}, el('td', {}, button),
      ...columns.map((column) => this.#dataCell(column, column.text(row))),
      ...(strip ? [el('td', {class: 'strip'}, strip(row))] : []));
    if ('words' in state) {
      element.classList.add('opens');
      element.addEventListener('click', () => {
        for (const other of this.#body.children) other.classList.toggle('selected', other === element);
        onOpen(row);
      });
    }
    return element;
  }

  // A long name is cut off, and has all of it in its title.
  #dataCell(column: Column<R>, text: string): HTMLTableCellElement {
    const attributes = {class: classOf(column)};
    return column.kind === 'words' ? el('td', {...attributes, title: text}, text) : el('td', attributes, text);
  }

  #onKey(event: KeyboardEvent): void {
    const row = (event.target as Element).closest('tr');
    const focus = (to: Element | null | undefined): void => to?.querySelector('button')?.focus();
    const keys: Record<string, () => void> = {
      ArrowDown: () => focus(row?.nextElementSibling),
      ArrowUp: () => focus(row?.previousElementSibling),
      Home: () => focus(this.#body.firstElementChild),
      End: () => focus(this.#body.lastElementChild),
      PageDown: () => { this.#turn(1); focus(this.#body.firstElementChild); },
      PageUp: () => { this.#turn(-1); focus(this.#body.firstElementChild); },
    };
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  }
}
