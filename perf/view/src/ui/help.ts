// The help: keys, and what the mouse does.
import {el} from './dom.js';
import {KEYS} from './keyboard.js';

export function makeHelp(): HTMLDialogElement {
  return el('dialog', {class: 'help', 'aria-label': 'Help'},
    el('h2', {}, 'Keys and mouse'),
    el('table', {}, ...KEYS.map(([keys, meaning]) => el('tr', {}, el('th', {scope: 'row'}, keys),
                                                        el('td', {}, meaning)))),
    el('p', {}, 'Drag to orbit, right button or Shift to move, wheel to zoom. Click a character to select it. Click ' +
       'a pair to go to its deepest contact, and its timeline to go to that frame.'),
    el('form', {method: 'dialog'}, el('button', {autofocus: true}, 'Close')));
}
