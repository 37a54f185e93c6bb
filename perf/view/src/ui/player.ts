// Which frame is shown, and how frames follow each other in time. It knows nothing of the page.

const SECONDS_WITHOUT_TIMES = 1 / 30;

export class Player {
  readonly frameCount: number;
  speed = 1;
  #frame = 0;
  #playing = false;
  #secondsPerFrame: number;
  #hasTimes: boolean;
  #times: Float64Array | null = null;
  // While playing: the time of the recording that was shown at a time of the page.
  #from = {page: 0, recording: 0};
  readonly #onChange: () => void;

  /** `secondsPerFrame` 0: unknown. */
  constructor(frameCount: number, secondsPerFrame: number, onChange: () => void) {
    this.frameCount = frameCount;
    this.#hasTimes = secondsPerFrame > 0;
    this.#secondsPerFrame = secondsPerFrame > 0 ? secondsPerFrame : SECONDS_WITHOUT_TIMES;
    this.#onChange = onChange;
  }

  get frame(): number {
    return this.#frame;
  }

  get playing(): boolean {
    return this.#playing;
  }

  /** The times of all frames, once they are known. Those that do not rise are not used. */
  setTimes(times: Float64Array): void {
    for (let i = 1; i < times.length; ++i) {
      if (!(times[i]! > times[i - 1]!)) return;
    }
    if (times.length > 1) {
      this.#times = times;
      this.#hasTimes = true;
    }
    this.#restart();
  }

  /** Whether frames follow each other in time. Else they are states, which are shown one after the other. */
  get hasTimes(): boolean {
    return this.#hasTimes;
  }

  timeOf(frame: number): number {
    return this.#times ? this.#times[frame] ?? 0 : frame * this.#secondsPerFrame;
  }

  #frameAt(time: number): number {
    if (!this.#times) return Math.floor(time / this.#secondsPerFrame + 1e-6);
    let low = 0;
    let high = this.#times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.#times[middle]! <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  goTo(frame: number): void {
    const last = Math.max(0, this.frameCount - 1);
    const wanted = Math.min(Math.max(Math.round(frame) || 0, 0), last);
    if (wanted !== this.#frame) {
      this.#frame = wanted;
      this.#onChange();
    }
    this.#restart();
  }

  step(by: number): void {
    this.pause();
    this.goTo(this.#frame + by);
  }

  play(): void {
    if (this.#playing || this.frameCount < 2) return;
    if (this.#frame === this.frameCount - 1) this.#frame = 0;
    this.#playing = true;
    this.#restart();
    this.#onChange();
  }

  pause(): void {
    if (!this.#playing) return;
    this.#playing = false;
    this.#onChange();
  }

  toggle(): void {
    if (this.#playing) this.pause();
    else this.play();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.#restart();
  }

  #restart(): void {
    this.#from = {page: performance.now(), recording: this.timeOf(this.#frame)};
  }

  /** Shows the frame that is due, and begins again behind the last one. */
  tick(now: number): void {
    if (!this.#playing) return;
    let time = this.#from.recording + Math.max(0, now - this.#from.page) / 1000 * this.speed;
    const begin = this.timeOf(0), end = this.timeOf(this.frameCount - 1) + this.#secondsPerFrame;
    if (time >= end) {
      // Not at the first frame: a recording that is shorter than a picture takes would stand still.
      time = begin + (time - begin) % (end - begin);
      this.#from = {page: now, recording: time};
    }
    const due = Math.min(this.#frameAt(time), this.frameCount - 1);
    if (due === this.#frame) return;
    this.#frame = due;
    this.#onChange();
  }
}
