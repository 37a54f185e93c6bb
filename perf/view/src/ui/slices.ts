// Long work in short slices, so that the page stays alive.

const SLICE_MS = 14;

export interface Progress {
  done: number;
  of: number;
  /** Seconds that are left if it goes on like this. */
  secondsLeft: number;
}

/** Calls `work` for 0 to `of` - 1, unless it is stopped. Between slices the page draws and answers. */
export async function inSlices(of: number, work: (index: number) => void, onProgress: (progress: Progress) => void,
                               signal: AbortSignal): Promise<void> {
  const began = performance.now();
  let sliceBegan = began;
  for (let index = 0; index < of; ++index) {
    if (signal.aborted) return;
    work(index);
    const now = performance.now();
    if (now - sliceBegan < SLICE_MS) continue;
    const done = index + 1;
    onProgress({done, of, secondsLeft: (now - began) / 1000 / done * (of - done)});
    await new Promise((resolve) => setTimeout(resolve));
    sliceBegan = performance.now();
  }
  onProgress({done: of, of, secondsLeft: 0});
}
