// All events of a recording over time: the worse, the taller. A click opens the event.
import {el, svg} from '../ui/dom.js';
import {seconds} from '../ui/format.js';
import {type ReportEvent, worstOf} from './events.js';
import {severityText} from './texts.js';
import type {ReportFile} from './types.js';

const WIDTH = 1000;
const HEIGHT = 44;
const LEAST_WIDTH = 4;
const LEAST_HEIGHT = 8;
const MARKS = 5;

/** How bad an event is, beside others of its file: its depth, else its triangles, else its frames. */
function badness(event: ReportEvent): number {
  const worst = worstOf(event);
  return Math.max(worst.worst_depth ?? worst.worst_triangles ?? worst.frames, 0);
}

/** The list below has the same events in words, so the strip is not read aloud. */
export function makeEventStrip(events: readonly ReportEvent[], file: ReportFile,
                               onOpen: (event: ReportEvent) => void): HTMLElement {
  const frames = Math.max(file.frames, 1);
  const most = events.reduce((sum, event) => Math.max(sum, badness(event)), 0) || 1;
  const strip = svg('svg', {
    class: 'report-event-strip', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: 'none', 'aria-hidden': 'true',
  });
  // The mildest are drawn first, so that no worse one is hidden.
  for (const event of [...events].reverse()) {
    const width = Math.max((event.last + 1 - event.first) / frames * WIDTH, LEAST_WIDTH);
    const height = LEAST_HEIGHT + badness(event) / most * (HEIGHT - LEAST_HEIGHT);
    const worst = worstOf(event);
    const when = worst.worst_seconds === null ? `frame ${worst.worst_frame}` : seconds(worst.worst_seconds);
    const bar = svg('rect', {
      class: event === events[0] ? 'bar worst' : 'bar', x: Math.min(event.first / frames * WIDTH, WIDTH - width),
      y: HEIGHT - height, width, height,
    }, svg('title', {}, `${severityText(worst, file)} at ${when}`));
    bar.addEventListener('click', () => onOpen(event));
    strip.append(bar);
  }
  const marks = Array.from({length: MARKS}, (_, mark) =>
    el('span', {}, seconds(frames * file.seconds_per_frame * mark / (MARKS - 1))));
  return el('div', {}, strip, el('div', {class: 'report-axis quiet', 'aria-hidden': 'true'}, ...marks));
}
