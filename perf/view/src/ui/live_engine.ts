// The engine in the page beside the recording: runs the shown frame with the dial's settings, or all frames.
import {isRefusal} from '../engine/recorded_world.js';
import type {Dial, EngineInPage, RunResult} from '../engine/types.js';
import type {Frame, Recording} from '../recording/types.js';
import {hitCount} from '../scene/hits.js';
import {DialPanel} from './dial_panel.js';
import {isAsRecorded, verdictOf} from './dial_state.js';
import {hash, wordsOf} from './format.js';
import type {Names} from './names.js';
import type {RerunState, RunState} from './page_api.js';
import {rerunAll} from './rerun.js';

const RUN_DELAY_MS = 50;

export class LiveEngine {
  readonly panel: DialPanel;
  /** Settles when the engine runs, or cannot. */
  readonly ready: Promise<void>;
  readonly #recording: Recording;
  readonly #names: Names;
  readonly #onChange: () => void;
  #engine: EngineInPage | null = null;
  #dial: Dial = {};
  #frame: Frame | null = null;
  #result: {frame: Frame; result: RunResult} | null = null;
  #runWhilePlaying = false;
  #timer = 0;
  #rerun: RerunState | null = null;
  #stop: AbortController | null = null;
  #destroyed = false;

  /** `onChange` is called when the dial or a result has changed. `onTrouble` is told why there is no engine. */
  constructor(recording: Recording, names: Names, engine: Promise<EngineInPage>, onChange: () => void,
              onTrouble: (words: string) => void) {
    this.#recording = recording;
    this.#names = names;
    this.#onChange = onChange;
    this.panel = new DialPanel({
      onDial: (dial) => this.setDial(dial),
      onRunWhilePlaying: (on) => (this.#runWhilePlaying = on),
      onRerunAll: () => void this.rerunAll(),
      onStop: () => this.#stop?.abort(),
    });
    this.panel.setDial(this.#dial);
    this.ready = engine.then((started) => this.#take(started), (error: unknown) => {
      const words = `The engine did not start, so nothing can be run again here: ${wordsOf(error)}`;
      this.panel.setProblem(words);
      onTrouble(words);
    });
  }

  #take(engine: EngineInPage): void {
    if (this.#destroyed) {
      engine.destroy();
      return;
    }
    this.#engine = engine;
    this.panel.setEngine(`cab ${engine.version} as WebAssembly, ${
      engine.isa === 'wasm128' ? 'with SIMD' : 'without SIMD'}.`);
    if (this.#frame) this.#run(this.#frame);
    this.#onChange();
  }

  get engine(): EngineInPage | null {
    return this.#engine;
  }

  get dial(): Dial {
    return this.#dial;
  }

  get rerun(): RerunState | null {
    return this.#rerun;
  }

  /** What the shown frame gave here; null: it was not run. */
  get result(): RunResult | null {
    return this.#result && this.#result.frame === this.#frame ? this.#result.result : null;
  }

  /** Triangles of skins that touch, of hits of a frame. Null: there is no engine, or it refuses them. */
  touchingTriangles(frame: Frame, hits: Uint32Array): Uint32Array | null {
    try {
      return this.#engine?.touchingTriangles(frame, hits) ?? null;
    } catch (error) {
      if (!isRefusal(error)) throw error;
      // Running the frame says why.
      return null;
    }
  }

  get state(): RunState | null {
    const {result} = this;
    if (!result || !this.#frame) return null;
    return {
      frame: this.#frame.index,
      milliseconds: result.milliseconds,
      hits: hitCount(result.hits),
      boxTests: result.boxTests,
      hash: hash(result.hash),
      sameBits: result.hash === this.#frame.hash,
      text: verdictOf(this.#frame, result, this.#dial).text,
    };
  }

  setDial(dial: Dial): void {
    this.#dial = dial;
    this.#result = null;
    this.panel.setDial(dial);
    if (this.#frame) this.#run(this.#frame);
    this.#onChange();
  }

  /**
   * A frame is shown. With other settings it is run at once, so that what is drawn is theirs. Else it is run a little
   * later, so that scrubbing is not held up, or not at all while frames are played.
   */
  show(frame: Frame, playing: boolean): void {
    clearTimeout(this.#timer);
    const isNew = frame !== this.#frame;
    this.#frame = frame;
    this.panel.showRecorded(frame);
    if (!this.#engine || (!isNew && this.result)) return;
    if (!isAsRecorded(this.#dial) || (playing && this.#runWhilePlaying)) {
      this.#run(frame);
      return;
    }
    this.panel.showStale();
    if (!playing) {
      this.#timer = window.setTimeout(() => {
        this.#run(frame);
        this.#onChange();
      }, RUN_DELAY_MS);
    }
  }

  /** No frame is shown. */
  hide(): void {
    clearTimeout(this.#timer);
    this.#frame = null;
    this.panel.showStale();
  }

  #run(frame: Frame): void {
    if (!this.#engine) return;
    try {
      const result = this.#engine.run(frame, this.#dial);
      this.#result = {frame, result};
      this.panel.showResult(frame, result);
    } catch (error) {
      this.#result = null;
      this.panel.setProblem(`The engine refused frame ${frame.index} with these settings: ${wordsOf(error)}`);
    }
  }

  /** Links whose boxes overlap and whose shapes are apart; null where they cannot be found. */
  falsePositives(frame: Frame): Uint32Array | null {
    try {
      return this.#engine?.falsePositives(frame, this.#dial) ?? null;
    } catch (error) {
      this.panel.setProblem(`False positives of frame ${frame.index} cannot be found: ${wordsOf(error)}`);
      return null;
    }
  }

  async rerunAll(): Promise<RerunState> {
    await this.ready;
    this.#stop?.abort();
    const stop = new AbortController();
    this.#stop = stop;
    this.#rerun = await this.#rerunUntil(stop.signal);
    this.panel.showRerun(null, this.#rerun.text, this.#rerun.same === this.#rerun.run && this.#rerun.run > 0);
    this.#onChange();
    return this.#rerun;
  }

  async #rerunUntil(signal: AbortSignal): Promise<RerunState> {
    const none = {same: 0, run: 0, firstDifferent: -1};
    if (!this.#engine) return {...none, text: 'There is no engine.'};
    try {
      return await rerunAll(this.#recording, this.#engine, this.#dial, this.#names,
                            (progress) => this.panel.showRerun(progress, '', true), signal);
    } catch (error) {
      return {...none, text: `The engine refused a frame: ${wordsOf(error)}`};
    }
  }

  destroy(): void {
    this.#destroyed = true;
    clearTimeout(this.#timer);
    this.#stop?.abort();
    this.#engine?.destroy();
    this.#engine = null;
  }
}
