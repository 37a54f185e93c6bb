// The buttons that move through time.
import {el, setText} from './dom.js';
import {count, seconds} from './format.js';
import {type Icon, icon} from './icons.js';
import type {Player} from './player.js';

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

export interface TransportActions {
  jump: (forward: boolean) => void;
}

export class Transport {
  readonly element: HTMLElement;
  readonly #player: Player;
  readonly #play: HTMLButtonElement;
  readonly #frame: HTMLInputElement;
  readonly #speed: HTMLSelectElement;
  readonly #time = el('span', {class: 'time'});
  #shownPlaying = false;

  constructor(player: Player, {jump}: TransportActions) {
    this.#player = player;
    this.#play = button('play', 'Play (space)', () => player.toggle());
    this.#play.classList.add('primary');
    const last = player.frameCount - 1;
    this.#frame = el('input', {
      type: 'number', min: 0, max: last, value: 0, 'aria-label': 'Frame',
      change: () => player.step(Number(this.#frame.value) - player.frame),
    });
    this.#speed = el('select', {
      'aria-label': 'Speed', change: () => player.setSpeed(Number(this.#speed.value)),
    }, ...SPEEDS.map((value) => el('option', {value, selected: value === 1}, `${value}\u00d7`)));
    this.element = el('div', {class: 'transport', role: 'group', 'aria-label': 'Playback'},
      el('div', {class: 'buttons'},
        button('first', 'First frame (Home)', () => player.step(-player.frame)),
        button('previousContact', 'Previous contact (Shift+Left)', () => jump(false)),
        button('previous', 'One frame back (Left)', () => player.step(-1)),
        this.#play,
        button('next', 'One frame on (Right)', () => player.step(1)),
        button('nextContact', 'Next contact (Shift+Right)', () => jump(true)),
        button('last', 'Last frame (End)', () => player.step(last - player.frame))),
      el('label', {}, 'Frame ', this.#frame), el('span', {class: 'of'}, `of ${count(player.frameCount)}`), this.#time,
      el('label', {}, 'Speed ', this.#speed));
    this.update();
  }

  update(): void {
    const {frame, playing} = this.#player;
    if (document.activeElement !== this.#frame || playing) this.#frame.value = String(frame);
    this.#speed.value = String(this.#player.speed);
    setText(this.#time, this.#player.hasTimes ? seconds(this.#player.timeOf(frame)) : '');
    if (playing === this.#shownPlaying) return;
    this.#shownPlaying = playing;
    const words = playing ? 'Pause (space)' : 'Play (space)';
    this.#play.replaceChildren(icon(playing ? 'pause' : 'play'));
    this.#play.title = words;
    this.#play.setAttribute('aria-label', words);
  }
}

function button(name: Icon, words: string, click: () => void): HTMLButtonElement {
  return el('button', {type: 'button', class: 'icon', title: words, 'aria-label': words, click}, icon(name));
}
