// Which axis points up.
import type {Header} from '../recording/types.js';
import type {Bounds} from './bounds.js';

export type Axis = 0 | 1 | 2;

/**
 * The header's, or a guess between y and z: a few characters are taller than they are deep, and a crowd, whose bounds
 * are one, is lower than it is deep.
 */
export function upAxis(header: Header, characters: readonly Bounds[], crowd: Bounds): Axis {
  if (header.up !== '') return header.up === 'x' ? 0 : header.up === 'y' ? 1 : 2;
  const extent = (axis: Axis): number => characters.reduce((sum, bounds) => sum + bounds.size(axis), 0);
  const yIsUp = characters.length < 4 ? extent(1) >= extent(2) : crowd.size(1) < crowd.size(2);
  return yIsUp ? 1 : 2;
}
