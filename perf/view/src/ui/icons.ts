// Icons of buttons, drawn as paths in a square of 24.
import {svg} from './dom.js';

const PATHS = {
  play: 'M7 4 L20 12 L7 20 Z',
  pause: 'M6 4 H10 V20 H6 Z M14 4 H18 V20 H14 Z',
  next: 'M6 4 L16 12 L6 20 Z M17 4 H19 V20 H17 Z',
  previous: 'M18 4 L8 12 L18 20 Z M5 4 H7 V20 H5 Z',
  first: 'M20 4 L11 12 L20 20 Z M11 4 L4 12 L11 20 Z',
  last: 'M4 4 L13 12 L4 20 Z M13 4 L20 12 L13 20 Z',
  nextContact: 'M3 4 L12 12 L3 20 Z M18 7 a5 5 0 1 1 -0.01 0 Z',
  previousContact: 'M21 4 L12 12 L21 20 Z M6 7 a5 5 0 1 1 -0.01 0 Z',
} as const;

export type Icon = keyof typeof PATHS;

export const icon = (name: Icon): SVGElement =>
  svg('svg', {viewBox: '0 0 24 24', 'aria-hidden': 'true'}, svg('path', {d: PATHS[name]}));
