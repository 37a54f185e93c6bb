// Which axis points up.
import type {Header} from '../recording/types.js';
import type {Bounds} from './bounds.js';

export type Axis = 0 | 1 | 2;

/**
 * The header's, or a guess between y and z by the extents of the scene: a crowd is lower than it is wide, and a few
 * characters stand.
 */
export function upAxis(header: Header, bounds: Bounds, characters: number): Axis {
  if (header.up !== '') return header.up === 'x' ? 0 : header.up === 'y' ? 1 : 2;
  const yIsLonger = bounds.size(1) >= bounds.size(2);
  return yIsLonger === characters < 4 ? 1 : 2;
}
