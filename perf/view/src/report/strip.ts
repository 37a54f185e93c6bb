// A small timeline of a row: when it is in contact, from the first to the last frame of its recording.
import {svg} from '../ui/dom.js';
import type {ReportInterval} from './types.js';

const WIDTH = 160;
const HEIGHT = 12;
const LEAST_WIDTH = 3;

const rectangle = (kind: string, x: number, width: number, height: number): SVGElement =>
  svg('rect', {class: kind, x, y: HEIGHT - height, width, height});

/** The numbers that it shows are in the cells beside it, so it is not read aloud. */
export function makeStrip(intervals: readonly Pick<ReportInterval, 'first' | 'last'>[], worstFrame: number,
                          frames: number): SVGElement {
  const strip = svg('svg', {
    class: 'report-strip', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: 'none', 'aria-hidden': 'true',
  });
  const at = (frame: number): number => WIDTH * frame / Math.max(frames, 1);
  for (const {first, last} of intervals) {
    const width = Math.max(at(last + 1) - at(first), LEAST_WIDTH);
    strip.append(rectangle('touch', Math.min(at(first), WIDTH - width), width, HEIGHT));
  }
  const worst = Math.min(at(worstFrame), WIDTH - LEAST_WIDTH);
  strip.append(rectangle('worst', worst, LEAST_WIDTH, HEIGHT / 2));
  return strip;
}
