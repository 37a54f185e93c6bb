// window.cabPage: what a page around the viewer, or a test, may read and do.
import type {Dial} from '../engine/types.js';
import type {Stats} from '../recording/types.js';

/** A frame that the engine in the page has run. */
export interface RunState {
  frame: number;
  milliseconds: number;
  hits: number;
  boxTests: number;
  /** 16 hexadecimal digits. */
  hash: string;
  sameBits: boolean;
  text: string;
}

export interface RerunState {
  same: number;
  run: number;
  /** -1: none. */
  firstDifferent: number;
  text: string;
}

export interface CabPage {
  /** Settles when a recording is shown and all its frames are read, or when there is none to show. */
  readonly ready: Promise<void>;
  /** Settles when the engine in the page has started, or could not. */
  readonly engineReady: Promise<void>;
  readonly title: string;
  /** Names of the recordings that the page holds. */
  readonly recordings: readonly string[];
  readonly recording: number;
  readonly frame: number;
  readonly frameCount: number;
  readonly playing: boolean;
  /** Of the shown frame, as recorded; null: none is shown. */
  readonly stats: Stats | null;
  readonly hits: number;
  /** 16 hexadecimal digits, as recorded. */
  readonly hash: string;
  readonly dial: Dial;
  /** Of the shown frame in the page; null: it was not run. */
  readonly run: RunState | null;
  /** What the last rerun of all frames found; null: none has ended. */
  readonly rerun: RerunState | null;
  /** Pictures that were drawn in the last second. */
  readonly framesPerSecond: number;
  readonly drawn: {calls: number; triangles: number};
  /** Where the camera looks at, relative to the scene's centre, and from how far. */
  readonly camera: {target: readonly number[]; distance: number};
  /** In words: the problems of the recording, and what went wrong in the page. */
  readonly errors: readonly string[];
  open(recording: number): Promise<void>;
  goTo(frame: number): void;
  play(speed?: number): void;
  pause(): void;
  /** To the next contact, or to the one before. Returns the frame; -1: there is none. */
  jump(forward: boolean): number;
  /** The fields that are given; all others become as recorded. */
  setDial(dial: Dial): void;
  rerunAll(): Promise<RerunState>;
  select(batch: number, instance: number): void;
}

declare global {
  interface Window {
    cabPage: CabPage;
  }
}
