// Films what is shown, by the browser's own recorder.

/** Formats, the best first. */
const TYPES = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
const FRAMES_PER_SECOND = 30;
const BITS_PER_SECOND = 8_000_000;

const typeHere = (): string | undefined =>
  typeof MediaRecorder === 'undefined' ? undefined : TYPES.find((type) => MediaRecorder.isTypeSupported(type));

export const canFilm = (): boolean => typeHere() !== undefined && 'captureStream' in HTMLCanvasElement.prototype;

export class Film {
  readonly #recorder: MediaRecorder;
  readonly #parts: Blob[] = [];

  /** Begins to film a canvas. */
  constructor(canvas: HTMLCanvasElement) {
    const mimeType = typeHere();
    this.#recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_SECOND),
                                       {videoBitsPerSecond: BITS_PER_SECOND, ...(mimeType && {mimeType})});
    this.#recorder.addEventListener('dataavailable', ({data}) => this.#parts.push(data));
    this.#recorder.start();
  }

  /** Ends it. */
  stop(): Promise<Blob> {
    return new Promise((done) => {
      this.#recorder.addEventListener('stop', () => done(new Blob(this.#parts, {type: 'video/webm'})));
      this.#recorder.stop();
      for (const track of this.#recorder.stream.getTracks()) track.stop();
    });
  }
}
