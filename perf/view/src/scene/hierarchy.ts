// The levels of a hierarchy of boxes. The root is level 1.
import type {MergeStep} from '../engine/types.js';

export interface Hierarchy {
  leafCount: number;
  /** The level of each node, leaves first. */
  levels: Uint16Array;
  depth: number;
}

export function hierarchyOf(merges: readonly MergeStep[], leafCount: number): Hierarchy {
  const levels = new Uint16Array(leafCount + merges.length);
  levels[levels.length - 1] = 1;
  for (let step = merges.length - 1; step >= 0; --step) {
    const below = levels[leafCount + step]! + 1;
    levels[merges[step]!.left] = below;
    levels[merges[step]!.right] = below;
  }
  return {leafCount, levels, depth: levels.reduce((most, level) => Math.max(most, level), 0)};
}
