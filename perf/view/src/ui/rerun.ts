// Runs all frames again in the page, and compares each with what was recorded.
import type {Dial, EngineInPage} from '../engine/types.js';
import type {Recording} from '../recording/types.js';
import {hitAt, hitCount} from '../scene/hits.js';
import {firstDifference, isAsRecorded} from './dial_state.js';
import {count, plural} from './format.js';
import type {Names} from './names.js';
import {inSlices, type Progress} from './slices.js';

export interface RerunResult {
  /** Frames that were run and whose hash is the recorded one. */
  same: number;
  run: number;
  damaged: number;
  milliseconds: number;
  /** -1: none. */
  firstDifferent: number;
  text: string;
}

export async function rerunAll(recording: Recording, engine: EngineInPage, dial: Dial, names: Names,
                               onProgress: (progress: Progress) => void, signal: AbortSignal): Promise<RerunResult> {
  let same = 0;
  let run = 0;
  let damaged = 0;
  let milliseconds = 0;
  let firstDifferent = -1;
  let difference = '';
  await inSlices(recording.frameCount, (index) => {
    let frame;
    try {
      frame = recording.frame(index);
    } catch {
      ++damaged;
      return;
    }
    const result = engine.run(frame, dial);
    ++run;
    milliseconds += result.milliseconds;
    if (result.hash === frame.hash) {
      ++same;
    } else if (firstDifferent < 0) {
      firstDifferent = index;
      difference = describe(frame.hits, result.hits, frame.inputs.map(({batch}) => batch), recording, names);
    }
  }, onProgress, signal);
  const stopped = signal.aborted ? ' Stopped before the end.' : '';
  const unread = damaged > 0 ? ` ${plural(damaged, 'damaged frame')} left out.` : '';
  const head = same === run ?
    `${count(same)} of ${count(run)} frames: same bits in your browser.` :
    `${count(same)} of ${count(run)} frames have the same bits. The first that differs is frame ` +
    `${count(firstDifferent)}: ${difference}.${isAsRecorded(dial) ? '' : ' The settings are not those recorded.'}`;
  return {same, run, damaged, milliseconds, firstDifferent, text: head + unread + stopped};
}

function describe(recorded: Uint32Array, here: Uint32Array, batches: readonly number[], recording: Recording,
                  names: Names): string {
  const index = firstDifference(recorded, here);
  if (index < 0) return 'the hits are the same, their contacts differ';
  const batchOfSlot = new Map(batches.map((batch) => [recording.batches[batch]!.slot, batch]));
  const name = (words: Uint32Array): string => {
    if (index >= hitCount(words)) return 'no hit';
    const hit = hitAt(words, index);
    return names.pair(batchOfSlot.get(hit.slotA) ?? -1, hit, batchOfSlot.get(hit.slotB) ?? -1);
  };
  return `hit ${index} was recorded as ${name(recorded)}, and here is ${name(here)}`;
}
