// Why a recording, or a part of one, cannot be read.

export class RecordingError extends Error {
  override readonly name = 'RecordingError';

  /** `chunk`: which one, counted from 0; null for the file as a whole. `byte`: where it begins in the file. */
  constructor(readonly file: string, readonly chunk: number | null, readonly byte: number, readonly reason: string) {
    super(`${file}: ${chunk === null ? '' : `chunk ${chunk} `}at byte ${byte}: ${reason}`);
  }
}
