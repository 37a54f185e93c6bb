// Messages above the scene: what is wrong with a recording, and what went wrong in the page.
import {el} from './dom.js';

export class Messages {
  readonly element = el('div', {class: 'messages', role: 'alert'});
  readonly #texts: string[] = [];

  get texts(): readonly string[] {
    return this.#texts;
  }

  /** Each text is shown once. */
  add(text: string, kind: 'problem' | 'error'): void {
    if (this.#texts.includes(text)) return;
    this.#texts.push(text);
    const line = el('p', {class: kind}, el('strong', {}, kind === 'problem' ? 'Problem: ' : 'Error: '), text,
      el('button', {type: 'button', 'aria-label': 'Close this message', click: () => line.remove()}, '\u00d7'));
    this.element.append(line);
  }

  clear(): void {
    this.#texts.length = 0;
    this.element.replaceChildren();
  }
}
