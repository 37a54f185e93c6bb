// The page around the viewer: which recording is open, files that are dropped on it, and the object for tests.
import {type EmbeddedRecording, fragmentOf, placeInFragment} from '../embedded.js';
import type {EngineInPage} from '../engine/types.js';
import type {Recording} from '../recording/types.js';
import type {LinkRef, OpenRecording, PairRef, PictureOfRecording} from '../report/types.js';
import type {Hit} from '../scene/hits.js';
import {el, setText} from './dom.js';
import {plural, wordsOf} from './format.js';
import {makeHelp} from './help.js';
import {Messages} from './messages.js';
import type {CabPage} from './page_api.js';
import {snapshot} from './snapshot.js';
import {Viewer} from './viewer.js';

export interface PageOptions {
  embedded: readonly EmbeddedRecording[];
  read: (bytes: Uint8Array, name: string) => Recording;
  startEngine: (recording: Recording) => Promise<EngineInPage>;
  /** Fills an element with the report that the page carries; null: it carries none. */
  showReport: ((element: HTMLElement, open: OpenRecording, picture: PictureOfRecording) => void) | null;
}

/** Of a report's worst contact, in pixels. */
const PICTURE = {width: 640, height: 360};

/** Something that can be opened. */
interface Source {
  name: string;
  bytes: () => Promise<Uint8Array>;
}

export class Page implements CabPage {
  readonly element: HTMLElement;
  readonly #options: PageOptions;
  readonly #messages = new Messages();
  readonly #help = makeHelp();
  readonly #title = el('h1', {}, 'cab');
  readonly #chooser: HTMLSelectElement;
  readonly #file: HTMLInputElement;
  readonly #place = el('div', {class: 'place'});
  readonly #report = el('div', {class: 'report-place', hidden: true});
  readonly #toReport: HTMLButtonElement;
  readonly #sources: Source[];
  readonly #pageErrors: string[] = [];
  #viewer: Viewer | null = null;
  #shown = -1;
  #opening: Promise<void> = Promise.resolve();
  /** How many recordings were asked for. What was asked for before the last one is given up. */
  #asked = 0;

  constructor(options: PageOptions) {
    this.#options = options;
    this.#sources = [...options.embedded];
    this.#chooser = el('select', {
      'aria-label': 'Recording', change: () => void this.open(Number(this.#chooser.value)),
    });
    this.#file = el('input', {
      type: 'file', accept: '.cab', hidden: true, 'aria-label': 'Open a recording',
      change: () => this.#openFile(this.#file.files?.[0]),
    });
    this.#toReport = el('button', {type: 'button', hidden: true, click: () => this.#backToReport()}, 'Report');
    this.element = el('div', {class: 'page'},
      el('header', {class: 'top'}, el('span', {class: 'brand'}, 'cab'), this.#title, this.#chooser,
        el('span', {class: 'spring'}), this.#toReport,
        el('button', {type: 'button', click: () => this.#file.click()}, 'Open\u2026'), this.#file,
        el('button', {type: 'button', title: 'Keys and mouse (?)', click: () => this.#showHelp()}, 'Help')),
      this.#messages.element, this.#report, this.#place, this.#help);
    this.#listen();
    this.#showStart();
    options.showReport?.(this.#report, (recording, frame, pair) => {
      const fragment = fragmentOf({recording, frame, pair});
      if (location.hash === fragment) this.#follow();
      else location.hash = fragment;
    }, (recording, frame, pair) => this.#pictureOf(recording, frame, pair));
    window.addEventListener('hashchange', () => this.#follow());
    this.#follow();
  }

  async #pictureOf(index: number, frame: number, pair: PairRef): Promise<string> {
    const source = this.#sources[index];
    if (!source) throw new Error(`there is no recording ${index}`);
    const recording = this.#options.read(await source.bytes(), source.name);
    const hasSkins = recording.articulations.some(({skin}) => skin !== null);
    const engine = hasSkins ? await this.#options.startEngine(recording) : null;
    try {
      return await snapshot(recording, engine, frame, hitOf(pair), PICTURE.width, PICTURE.height);
    } finally {
      engine?.destroy();
    }
  }

  // The fragment says what is shown: a recording at a frame, else the report, else the first recording.
  #follow(): void {
    const place = placeInFragment();
    if (!place && this.#options.showReport) {
      this.#turnToReport(true);
      this.#viewer?.player.pause();
      setText(this.#title, 'Report');
    } else if (place || this.#sources.length > 0) {
      const {recording, frame, pair} = place ?? {recording: 0, frame: 0, pair: null};
      const opened = this.open(recording, frame);
      if (pair) void opened.then(() => this.#shown === recording && this.#viewer?.selectPair(hitOf(pair)));
    }
  }

  // The address names what is shown, so that a copy of it opens there. It makes no entries in the browser's history.
  #setAddress(frame: number, hit: Hit | null): void {
    if (this.#place.hidden || !this.#viewer) return;
    const pair: PairRef | null = hit && {
      a: [hit.slotA, hit.instanceA, hit.linkA], b: [hit.slotB, hit.instanceB, hit.linkB],
    };
    const fragment = fragmentOf({recording: this.#shown, frame, pair});
    if (location.hash !== fragment) history.replaceState(history.state, '', fragment);
  }

  #backToReport(): void {
    location.hash = '';
    this.#follow();
  }

  // Shows the report in the place of the viewer, or the other way round.
  #turnToReport(isReport: boolean): void {
    this.#report.hidden = !isReport;
    this.#place.hidden = isReport;
    this.#chooser.hidden = isReport || this.#sources.length < 2;
    this.#toReport.hidden = isReport || this.#options.showReport === null;
  }

  #listen(): void {
    window.addEventListener('error', ({message}) => this.#fail(message));
    window.addEventListener('unhandledrejection', ({reason}) => this.#fail(wordsOf(reason)));
    document.addEventListener('dragover', (event) => event.preventDefault());
    document.addEventListener('drop', (event) => {
      event.preventDefault();
      this.#openFile(event.dataTransfer?.files[0]);
    });
  }

  #fail(words: string): void {
    this.#pageErrors.push(words);
    this.#messages.add(words, 'error');
  }

  #showHelp(): void {
    if (!this.#help.open) this.#help.showModal();
  }

  #showStart(): void {
    setText(this.#title, 'Recordings');
    this.#chooser.hidden = this.#sources.length < 2;
    this.#place.replaceChildren(el('div', {class: 'start'},
      el('h2', {}, 'Open a recording'),
      el('p', {}, 'Drop a file here that ', el('code', {}, 'cab run \u2026 --record FILE.cab'),
         ' wrote, or choose one. Nothing leaves this computer.'),
      el('button', {type: 'button', class: 'primary', click: () => this.#file.click()}, 'Choose a file')));
  }

  #openFile(file: File | undefined): void {
    if (!file) return;
    this.#sources.push({name: file.name, bytes: async () => new Uint8Array(await file.arrayBuffer())});
    void this.open(this.#sources.length - 1);
  }

  /** Opens one of the recordings that the page holds or was given. */
  open(recording: number, frame = 0): Promise<void> {
    this.#turnToReport(false);
    this.#opening = this.#open(recording, frame);
    return this.#opening;
  }

  async #open(index: number, frame: number): Promise<void> {
    if (index === this.#shown && this.#viewer) {
      setText(this.#title, this.#viewer.title);
      this.#viewer.player.pause();
      this.#viewer.player.goTo(frame);
      return;
    }
    const asked = ++this.#asked;
    this.#viewer?.dispose();
    this.#viewer = null;
    this.#shown = index;
    this.#messages.clear();
    this.#showSources();
    const source = this.#sources[index];
    if (!source) {
      if (this.#sources.length > 0) await this.#open(0, 0);
      else this.#showStart();
      const held = plural(this.#sources.length, 'recording');
      this.#messages.add(`There is no recording ${index}: the page holds ${held}, counted from 0.`, 'error');
      return;
    }
    this.#place.replaceChildren(el('p', {class: 'start', role: 'status'}, `Opening ${source.name}\u2026`));
    // The browser shows the words before the page is busy.
    await new Promise((resolve) => setTimeout(resolve));
    try {
      const bytes = await source.bytes();
      if (asked === this.#asked) await this.#show(bytes, source.name, frame);
    } catch (error) {
      if (asked !== this.#asked) return;
      this.#showStart();
      this.#messages.add(wordsOf(error), 'error');
    }
  }

  async #show(bytes: Uint8Array, name: string, frame: number): Promise<void> {
    const recording = this.#options.read(bytes, name);
    for (const problem of recording.problems) this.#messages.add(problem, 'problem');
    const title = recording.header.title || name;
    setText(this.#title, title);
    document.title = `${title} \u2013 cab`;
    const viewer = new Viewer({
      recording,
      title,
      engine: this.#options.startEngine(recording),
      messages: this.#messages,
      firstFrame: frame,
      onHelp: () => this.#showHelp(),
      onPlace: (shown, pair) => this.#setAddress(shown, pair),
    });
    this.#viewer = viewer;
    this.#place.replaceChildren(viewer.element);
    await viewer.indexed;
  }

  #showSources(): void {
    this.#chooser.replaceChildren(...this.#sources.map(({name}, value) => el('option', {value}, name)));
    this.#chooser.value = String(this.#shown);
    this.#chooser.hidden = this.#sources.length < 2;
  }

  get ready(): Promise<void> {
    return this.#opening;
  }

  get engineReady(): Promise<void> {
    return this.#opening.then(() => this.#viewer?.live.ready);
  }

  get title(): string {
    return this.#title.textContent ?? '';
  }

  get recordings(): readonly string[] {
    return this.#sources.map(({name}) => name);
  }

  get recording(): number {
    return this.#shown;
  }

  get frame(): number {
    return this.#viewer?.player.frame ?? 0;
  }

  get frameCount(): number {
    return this.#viewer?.player.frameCount ?? 0;
  }

  get playing(): boolean {
    return this.#viewer?.player.playing ?? false;
  }

  get stats(): CabPage['stats'] {
    return this.#viewer?.stats ?? null;
  }

  get hits(): number {
    return this.#viewer?.hits ?? 0;
  }

  get hash(): string {
    return this.#viewer?.hash ?? '';
  }

  get dial(): CabPage['dial'] {
    return this.#viewer?.live.dial ?? {};
  }

  get run(): CabPage['run'] {
    return this.#viewer?.live.state ?? null;
  }

  get rerun(): CabPage['rerun'] {
    return this.#viewer?.live.rerun ?? null;
  }

  get framesPerSecond(): number {
    return this.#viewer?.framesPerSecond ?? 0;
  }

  get drawn(): CabPage['drawn'] {
    return this.#viewer?.drawn ?? {calls: 0, triangles: 0};
  }

  get camera(): CabPage['camera'] {
    return this.#viewer?.camera ?? {target: [0, 0, 0], distance: 0};
  }

  get errors(): readonly string[] {
    return [...new Set([...this.#messages.texts, ...this.#pageErrors])];
  }

  goTo(frame: number): void {
    this.#viewer?.player.pause();
    this.#viewer?.player.goTo(frame);
  }

  play(speed?: number): void {
    if (speed !== undefined) this.#viewer?.setSpeed(speed);
    this.#viewer?.player.play();
  }

  pause(): void {
    this.#viewer?.player.pause();
  }

  jump(forward: boolean): number {
    return this.#viewer?.jump(forward) ?? -1;
  }

  setDial(dial: CabPage['dial']): void {
    this.#viewer?.live.setDial(dial);
  }

  async rerunAll(): ReturnType<CabPage['rerunAll']> {
    if (!this.#viewer) throw new Error('no recording is open');
    return this.#viewer.live.rerunAll();
  }

  select(batch: number, instance: number): void {
    this.#viewer?.select(batch, instance);
  }
}

function hitOf({a, b}: PairRef): Hit {
  const [[slotA, instanceA, linkA], [slotB, instanceB, linkB]]: [LinkRef, LinkRef] = [a, b];
  return {slotA, instanceA, linkA, slotB, instanceB, linkB};
}
