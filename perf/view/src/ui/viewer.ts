// Plays one recording: joins the scene, the panels, the keyboard and the engine in the page.
import type {Vector3} from 'three';
import {type EngineInPage, WORDS_PER_TRIANGLES} from '../engine/types.js';
import type {Frame, Recording, Stats} from '../recording/types.js';
import {depthAt, type Hit, hitAt, hitCount, isSamePair} from '../scene/hits.js';
import {type Label, SceneView} from '../scene/scene_view.js';
import {countIn, type Selection, Stage} from '../scene/stage.js';
import {aboutOf} from './about.js';
import {BoxChooser} from './boxes_shown.js';
import {ContactIndex, contactOfPair, intervalAt, type PairHistory} from './contact_index.js';
import {ContactPanel} from './contact_panel.js';
import {hasMargin, isAsRecorded} from './dial_state.js';
import {el, setText} from './dom.js';
import {canFilm, Film} from './film.js';
import {count, hash, plural, timeLeft, wordsOf} from './format.js';
import {FrameRate} from './frame_rate.js';
import {listenToKeys} from './keyboard.js';
import {LiveEngine} from './live_engine.js';
import {markersOf} from './markers.js';
import type {Messages} from './messages.js';
import {Names} from './names.js';
import {PairList} from './pair_list.js';
import {Player} from './player.js';
import {fileName, saveFile} from './save.js';
import {makeTabs} from './tabs.js';
import {Timeline} from './timeline.js';
import {Transport} from './transport.js';
import {type Switch, type ViewOptions, ViewPanel} from './view_panel.js';

const CROWD_LEAVES = 4000;
const MOST_LABELS = 40;
const SAMPLES = 5;

export interface ViewerOptions {
  recording: Recording;
  title: string;
  /** Rejects with the reason why there is no engine. */
  engine: Promise<EngineInPage>;
  messages: Messages;
  firstFrame: number;
  onHelp: () => void;
  /** Another frame is shown for a while, or another pair is selected. */
  onPlace: (frame: number, pair: Hit | null) => void;
}

export class Viewer {
  readonly element: HTMLElement;
  readonly title: string;
  readonly player: Player;
  readonly live: LiveEngine;
  /** Settles when all frames are read. */
  readonly indexed: Promise<void>;
  readonly #recording: Recording;
  readonly #names: Names;
  readonly #stage: Stage;
  readonly #view: SceneView;
  readonly #index: ContactIndex;
  readonly #timeline: Timeline;
  readonly #transport: Transport;
  readonly #pairs: PairList;
  readonly #contactPanel: ContactPanel;
  readonly #onPlace: ViewerOptions['onPlace'];
  readonly #messages: Messages;
  readonly #viewPanel: ViewPanel;
  readonly #status = el('p', {class: 'status', role: 'status'});
  readonly #reading = el('p', {class: 'status'});
  readonly #rate = new FrameRate();
  readonly #ended = new AbortController();
  readonly #hasSkins: boolean;
  #boxes: BoxChooser | null = null;
  /** Whether all frames are read. */
  #isRead = false;
  #filming: Film | null = null;
  /** The deepest level of the trees; 0: unknown. */
  #depth = 0;
  #frame: Frame | null = null;
  #options: ViewOptions = {leafBoxes: false, level: 0, contacts: true, falsePositives: false, follow: false};
  #selection: Selection = {instance: null, pair: null};
  #selectedPair: PairHistory | null = null;

  /** Throws if no frame can be read, or if the browser cannot draw. */
  constructor({recording, title, engine, messages, firstFrame, onHelp, onPlace}: ViewerOptions) {
    this.#recording = recording;
    this.title = title;
    this.#onPlace = onPlace;
    this.#messages = messages;
    this.#hasSkins = recording.articulations.some(({skin}) => skin !== null);
    this.#names = new Names(recording);
    const samples = sampleFrames(recording);
    this.#stage = new Stage(recording, samples, leafCount(recording, samples[0]!) > CROWD_LEAVES);
    this.player = new Player(recording.frameCount, recording.header.secondsPerFrame, () => this.#refresh());
    this.#index = new ContactIndex(recording);
    this.#timeline = new Timeline(this.player, this.#index);
    this.#transport = new Transport(this.player, {jump: (forward) => void this.jump(forward)});
    this.#pairs = new PairList({
      names: this.#names,
      frameCount: recording.frameCount,
      metresPerUnit: recording.header.metresPerUnit,
      areStates: () => !this.player.hasTimes,
      onPick: (pair, frame) => this.#pickPair(pair, frame),
      onMarkers: () => this.#saveMarkers(),
    });
    this.#contactPanel = new ContactPanel({
      metresPerUnit: recording.header.metresPerUnit,
      timeOf: (frame) => this.player.hasTimes ? this.player.timeOf(frame) : null,
    });
    this.live = new LiveEngine(recording, this.#names, engine, () => this.#draw(),
                               (words) => messages.add(words, 'error'));
    this.#viewPanel = new ViewPanel({
      onChange: (change) => this.#setOptions(change),
      onFit: () => this.#fit(),
      onPicture: () => void this.#savePicture(),
      onFilm: canFilm() ? () => void this.#film() : null,
    });
    const surface = el('div', {class: 'surface'});
    this.#view = new SceneView(surface, this.#stage);
    this.element = el('div', {class: 'viewer'},
      el('div', {class: 'scene'}, this.#viewPanel.controls, surface, this.#viewPanel.legend),
      el('aside', {class: 'side', 'aria-label': 'Numbers and settings'}, this.#contactPanel.element,
        makeTabs([['Contacts', this.#pairs.element], ['The dial', this.live.panel.element],
                  ['About', aboutOf(recording)]])),
      el('div', {class: 'bottom'}, this.#timeline.element,
        el('div', {class: 'row'}, this.#transport.element, this.#reading, this.#status)));
    this.#listen(surface, onHelp);
    this.#setOptions({});
    this.player.goTo(firstFrame);
    this.#refresh();
    this.indexed = this.#readAll();
    requestAnimationFrame((now) => this.#tick(now));
  }

  get stats(): Stats | null {
    return this.#frame?.stats ?? null;
  }

  get hits(): number {
    return this.#frame ? hitCount(this.#frame.hits) : 0;
  }

  get hash(): string {
    return this.#frame ? hash(this.#frame.hash) : '';
  }

  get framesPerSecond(): number {
    return this.#rate.perSecond(performance.now());
  }

  get camera(): {target: readonly number[]; distance: number} {
    const {camera, target} = this.#view.viewpoint;
    return {target: target.toArray(), distance: camera.position.distanceTo(target)};
  }

  get drawn(): {calls: number; triangles: number} {
    return this.#view.drawn;
  }

  async #readAll(): Promise<void> {
    await this.#index.scan(({done, of, secondsLeft}) => {
      const words = `Reading frames: ${count(done)} of ${count(of)}, ${timeLeft(secondsLeft)}`;
      setText(this.#reading, done < of ? words : '');
      this.#timeline.draw();
    }, this.#ended.signal);
    if (this.#ended.signal.aborted) return;
    this.#isRead = true;
    this.player.setTimes(this.#index.times);
    this.#timeline.draw();
    this.#pairs.setPairs(this.#index.pairs);
    this.#refresh();
  }

  #tick(now: number): void {
    if (this.#ended.signal.aborted) return;
    this.player.tick(now);
    if (this.#view.render(now)) this.#rate.add(performance.now());
    requestAnimationFrame((next) => this.#tick(next));
  }

  // The player shows another frame, or plays or pauses.
  #refresh(): void {
    const {frame, playing} = this.player;
    this.#transport.update();
    this.#timeline.update();
    try {
      this.#frame = this.#recording.frame(frame);
    } catch (error) {
      // The scene stays as it was.
      this.#frame = null;
      this.live.hide();
      this.#setStatus(`Frame ${frame} cannot be read: ${wordsOf(error)}`);
      return;
    }
    this.#setStatus('');
    this.live.show(this.#frame, playing);
    this.#draw();
    if (!playing) this.#onPlace(frame, this.#selection.pair);
    if (this.#filming && !playing) void this.#film();
  }

  // Shows the frame as it was recorded, or what other settings of the dial found.
  #draw(): void {
    const frame = this.#frame;
    if (!frame) return;
    const {dial, engine, result} = this.live;
    const shown = result && !isAsRecorded(dial) ? result : frame;
    const before = this.#focus();
    const falsePositives = this.#options.falsePositives ? this.live.falsePositives(frame) : null;
    const contacts = this.#options.contacts ? shown.contacts : null;
    const exact = dial.exact ?? frame.settings.policies['exact'];
    const triangles = exact !== 'none' && this.#hasSkins ? this.live.touchingTriangles(frame, shown.hits) : null;
    const unshown = this.#stage.show({
      frame, hits: shown.hits, contacts, falsePositives, triangles, selection: this.#selection,
      eye: this.#view.viewpoint.camera.position,
    });
    const after = this.#focus();
    if (this.#options.follow && before && after) this.#view.viewpoint.shift(after.sub(before));
    if (engine) this.#boxes ??= new BoxChooser(this.#recording, engine, this.#names);
    const notes = [shown === frame ? '' : 'Hits are those of the dial, not those recorded.'];
    if (unshown > 0) {
      notes.push(`${count(unshown)} contacts are too many to draw${
        this.#selection.instance ? ' beside those of the character' : ': select a character to see its own'}.`);
    }
    const {skinsLeftOut} = this.#stage;
    if (skinsLeftOut > 0) notes.push(`${count(skinsLeftOut)} skins are too many to draw: the nearest ones are.`);
    notes.push(this.#showBoxes(frame));
    this.#viewPanel.setNote(notes.filter((note) => note !== '').join(' '));
    this.#viewPanel.showLegend({
      ...this.#options, selectedPair: this.#selection.pair !== null, contacts: contacts !== null,
      masked: this.#stage.masked.length > 0, triangles: triangles !== null,
    });
    this.#showLabels();
    this.#showContact(frame, shown, triangles);
    this.#view.describe(`The scene at frame ${frame.index}: ${plural(hitCount(shown.hits), 'hit')}`);
    this.#view.invalidate();
  }

  // The selected pair, else the worst one of the frame: the deepest, or that of most triangles.
  #showContact(frame: Frame, shown: Pick<Frame, 'hits' | 'contacts'>, triangles: Uint32Array | null): void {
    const {hits, contacts} = shown, withMargin = hasMargin(frame, shown === frame ? {} : this.live.dial);
    const total = hitCount(hits), {pair} = this.#selection;
    const counts = triangles && countsOf(triangles, total);
    const badness = (i: number): number => contacts ? depthAt(contacts, i) : counts?.[i] ?? 0;
    let hit = -1;
    for (let i = 0; i < total; ++i) {
      if (pair ? isSamePair(hitAt(hits, i), pair) : hit < 0 || badness(i) > badness(hit)) hit = i;
    }
    const links = pair ?? (hit >= 0 ? hitAt(hits, hit) : null);
    if (!links) {
      this.#contactPanel.show(frame.index, null, 0, withMargin);
      return;
    }
    const batches = [links.slotA, links.slotB].map((slot) => this.#stage.batchOfSlot(slot) ?? -1) as [number, number];
    const history = this.#selectedPair ?? this.#index.pairOf(batches[0], links, batches[1]);
    const isRead = this.#isRead && history !== undefined;
    this.#contactPanel.show(frame.index, {
      name: history ? this.#names.pair(history.batchA, links, history.batchB) :
        this.#names.pair(batches[0], links, batches[1]),
      isSelected: pair !== null,
      touches: hit >= 0,
      depth: hit >= 0 && contacts ? depthAt(contacts, hit) : null,
      triangles: hit >= 0 && counts ? counts[hit]! : null,
      interval: isRead ? intervalAt(history, frame.index) : null,
      frames: isRead ? history.frames : null,
      worst: isRead && history.worstDepth !== null ? {frame: history.worstFrame, depth: history.worstDepth} : null,
    }, total - (hit >= 0 ? 1 : 0), withMargin);
  }

  async #savePicture(): Promise<void> {
    try {
      saveFile(await this.#view.picture(), `${fileName(this.title)}_${this.player.frame}.png`);
    } catch (error) {
      this.#messages.add(`There is no picture: ${wordsOf(error)}`, 'error');
    }
  }

  #saveMarkers(): void {
    const {times} = this.#index;
    const text = markersOf(this.#recording, this.title, this.#names, this.#index.pairs, times);
    saveFile(new Blob([text], {type: 'text/csv'}), `${fileName(this.title)}_contacts.csv`);
  }

  // Begins a film of what is played, or ends it.
  async #film(): Promise<void> {
    const film = this.#filming;
    if (film) {
      this.#filming = null;
      this.#viewPanel.setFilming(false);
      this.player.pause();
      saveFile(await film.stop(), `${fileName(this.title)}.webm`);
      return;
    }
    try {
      this.#filming = new Film(this.#view.canvas);
    } catch (error) {
      this.#messages.add(`There is no film: ${wordsOf(error)}`, 'error');
      return;
    }
    this.#viewPanel.setFilming(true);
    this.player.play();
  }

  // Returns what is left out, in words.
  #showBoxes(frame: Frame): string {
    const {leafBoxes, level} = this.#options;
    if (!this.#boxes) {
      this.#stage.showBoxes([]);
      return leafBoxes || level > 0 ? 'No boxes: they come from the engine in the page, which has not started.' : '';
    }
    try {
      this.#depth = this.#boxes.depth(frame, this.live.dial);
      this.#viewPanel.setDepth(this.#depth);
      const {sets, note} = this.#boxes.choose(frame, this.live.dial, this.#options, this.#selection, this.#stage);
      const left = this.#stage.showBoxes(sets);
      return left > 0 ? `${note} ${count(left)} boxes are too many to draw.` : note;
    } catch (error) {
      this.#stage.showBoxes([]);
      return `No boxes: ${wordsOf(error)}`;
    }
  }

  #setStatus(words: string): void {
    setText(this.#status, words);
  }

  #focus(): ReturnType<Stage['middleOf']> {
    const {instance} = this.#selection;
    return instance && this.#stage.middleOf(instance.batch, instance.instance);
  }

  #showLabels(): void {
    const labels: Label[] = this.#stage.masked.slice(0, MOST_LABELS).map(({batch, instance, position}) =>
      ({text: `masked: ${this.#names.instance(batch, instance)}`, position, kind: 'masked'}));
    const {instance, pair} = this.#selection;
    const position = this.#focus();
    if (instance && position) {
      labels.push({text: this.#names.instance(instance.batch, instance.instance), position, kind: 'selected'});
    }
    const place = this.#stage.pairPlace;
    if (pair && this.#selectedPair && place) {
      const {batchA, batchB} = this.#selectedPair;
      // In the picture, though the middle of a link may be out of it.
      const near = (middle: Vector3): Vector3 =>
        middle.clone().sub(place.center).clampLength(0, place.radius).add(place.center);
      labels.push({text: `a: ${this.#names.place(batchA, pair.instanceA, pair.linkA)}`, position: near(place.a),
                   kind: 'selected'},
                  {text: `b: ${this.#names.place(batchB, pair.instanceB, pair.linkB)}`, position: near(place.b),
                   kind: 'selected'});
    }
    this.#view.setLabels(labels);
  }

  #setOptions(change: Partial<ViewOptions>): void {
    this.#options = {...this.#options, ...change};
    if (change.follow) this.#selection.instance ??= this.#stage.firstCharacter();
    this.#viewPanel.show(this.#options);
    this.#draw();
  }

  // To where the selected pair touches.
  #fly(): void {
    const place = this.#stage.pairPlace;
    if (place) this.#view.viewpoint.flyTo(place.center, place.radius, place.normal);
  }

  #fit(): void {
    if (this.#stage.pairPlace) {
      this.#fly();
      return;
    }
    this.#view.viewpoint.fit(this.#stage.boundsOf(this.#selection), true);
    this.#view.invalidate();
  }

  #pickPair(pair: PairHistory, frame: number): void {
    this.#selectedPair = pair;
    this.#selection = {...this.#selection, pair: pair.hit};
    this.#pairs.select(pair);
    this.#timeline.setPair(pair);
    this.player.pause();
    this.player.goTo(frame);
    this.#draw();
    this.#fly();
    // Where the list is below the scene.
    this.#view.canvas.parentElement?.scrollIntoView({block: 'nearest'});
    this.#onPlace(this.player.frame, pair.hit);
  }

  /** Selects a pair of links once all frames are read, if it touches in any of them. */
  selectPair(hit: Hit): void {
    void this.indexed.then(() => {
      const pair = this.#index.pairs.find((known) => isSamePair(known.hit, hit));
      if (pair) this.#pickPair(pair, this.player.frame);
    });
  }

  select(batch: number, instance: number): void {
    this.#selection = {...this.#selection, instance: {batch, instance}};
    this.#draw();
  }

  #clearSelection(): void {
    this.#selection = {instance: null, pair: null};
    this.#selectedPair = null;
    this.#pairs.select(null);
    this.#timeline.setPair(null);
    this.#draw();
    this.#onPlace(this.player.frame, null);
  }

  /** To the next contact or the one before, of the selected pair if there is one. Returns the frame; -1: none. */
  jump(forward: boolean): number {
    const {frame} = this.player;
    const to = this.#selectedPair ? contactOfPair(this.#selectedPair, frame, forward) :
                                    this.#index.contactFrom(frame, forward);
    this.player.pause();
    if (to >= 0) {
      this.player.goTo(to);
      this.#fly();
    } else {
      this.#setStatus(`There is no ${forward ? 'later' : 'earlier'} contact.`);
    }
    return to;
  }

  #listen(surface: HTMLElement, onHelp: () => void): void {
    const {signal} = this.#ended;
    let pressed: {x: number; y: number} | null = null;
    surface.addEventListener('pointerdown', ({clientX, clientY}) => (pressed = {x: clientX, y: clientY}), {signal});
    surface.addEventListener('pointerup', ({clientX, clientY}) => {
      if (!pressed || Math.hypot(clientX - pressed.x, clientY - pressed.y) > 4) return;
      const picked = this.#view.pick(clientX, clientY);
      if (picked) this.select(picked.batch, picked.instance);
      else this.#clearSelection();
    }, {signal});
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
      this.#timeline.draw();
      this.#pairs.drawTimelines();
    }, {signal});
    const toggle = (name: Switch) => (): void => this.#setOptions({[name]: !this.#options[name]});
    listenToKeys({
      toggle: () => this.player.toggle(),
      step: (by) => this.player.step(by),
      jump: (forward) => void this.jump(forward),
      first: () => this.player.step(-this.player.frame),
      last: () => this.player.step(this.player.frameCount - 1 - this.player.frame),
      level: (level) => this.#setOptions({level: Math.min(level, this.#depth)}),
      boxes: toggle('leafBoxes'),
      contacts: toggle('contacts'),
      falsePositives: toggle('falsePositives'),
      follow: toggle('follow'),
      fit: () => this.#fit(),
      clear: () => this.#clearSelection(),
      help: onHelp,
    }, () => this.element.offsetParent !== null, signal);
  }

  setSpeed(speed: number): void {
    this.player.setSpeed(speed);
    this.#transport.update();
  }

  dispose(): void {
    this.#ended.abort();
    this.live.destroy();
    this.#view.dispose();
    this.#stage.dispose();
    this.element.remove();
  }
}

// A few frames that can be read, spread over the recording, in their order.
function sampleFrames(recording: Recording): Frame[] {
  const wanted = new Set(Array.from({length: SAMPLES}, (_, i) =>
    Math.round(i * (recording.frameCount - 1) / (SAMPLES - 1))));
  const frames: Frame[] = [];
  let reason: unknown = new Error('the recording has no frames');
  for (let i = 0; i < recording.frameCount; ++i) {
    // All frames are tried until one can be read.
    if (!wanted.has(i) && frames.length > 0) continue;
    try {
      frames.push(recording.frame(i));
    } catch (error) {
      reason = error;
    }
  }
  if (frames.length === 0) throw reason;
  return frames;
}

// How many triangles each hit has.
function countsOf(triangles: Uint32Array, hits: number): Uint32Array {
  const counts = new Uint32Array(hits);
  for (let at = 0; at < triangles.length; at += WORDS_PER_TRIANGLES) ++counts[triangles[at]!]!;
  return counts;
}

// How many leaves a frame has.
const leafCount = (recording: Recording, {inputs}: Frame): number => inputs.reduce((sum, input) => {
  const articulation = recording.articulations[recording.batches[input.batch]!.articulation];
  return sum + countIn(recording, input) * (articulation?.leaves.length ?? 0);
}, 0);
