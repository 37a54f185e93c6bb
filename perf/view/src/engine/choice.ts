// What a frame is run with: its settings, as a dial changes them, and what is not possible in the page.
import type {FrameJob, Policies} from 'cab-collision';
import type {Settings} from '../recording/types.js';
import type {Dial} from './types.js';

export interface Choice {
  policies: Policies;
  job: Pick<FrameJob, 'margin' | 'minDepth' | 'report' | 'containment' | 'contacts'>;
  /** What differs from what was asked for, in words. */
  notes: string[];
}

const FIELDS = ['refit', 'strategy', 'exact', 'extents', 'sat'] as const;

/** What bodies have that an exact test may ask for. */
export interface Shapes {
  /** No level of detail is of nodes. */
  hasShapes: boolean;
  hasSkins: boolean;
}

export function choose(settings: Settings, dial: Dial, {hasShapes, hasSkins}: Shapes): Choice {
  const notes: string[] = [];
  const chosen: Record<string, string> = {};
  for (const field of FIELDS) {
    const value = dial[field] ?? settings.policies[field];
    if (value !== undefined) chosen[field] = value;
  }
  if (chosen['exact'] === 'fcl') {
    chosen['exact'] = 'convex';
    notes.push('The exact test fcl is not in this page: convex takes its place, whose bits are its own.');
  }
  if (hasSkins && chosen['exact'] === 'convex') {
    chosen['exact'] = 'surface';
    notes.push('A skin is tested by its triangles: surface takes the place of convex.');
  }
  if (!hasShapes && chosen['exact'] !== undefined && chosen['exact'] !== 'none') {
    chosen['exact'] = 'none';
    notes.push('A level of nodes has no shapes, so there is no exact test.');
  }
  const isExact = (chosen['exact'] ?? 'none') !== 'none';
  if (!isExact && settings.minDepth > 0) notes.push('Without an exact test no hit is dropped for its depth.');
  if (!isExact && settings.report === 'distances') {
    notes.push('Without an exact test there are no distances: all links within the margin are reported.');
  }
  if (!isExact && settings.report === 'hits' && settings.contacts) {
    notes.push('Without an exact test there are no contacts.');
  }
  return {
    // The module refuses names that it does not know.
    policies: chosen as Policies,
    job: {
      margin: dial.margin ?? settings.margin,
      minDepth: isExact ? settings.minDepth : 0,
      report: isExact ? settings.report : 'hits',
      containment: settings.containment,
      contacts: isExact && settings.contacts,
    },
    notes,
  };
}

/** The same, for link pairs that touch by boxes alone, or by an exact test. */
export function chooseForFalsePositives(settings: Settings, dial: Dial, hasSkins: boolean):
    {byBoxes: Choice; byShapes: Choice} {
  const {policies, job, notes} = choose(settings, dial, {hasShapes: true, hasSkins});
  const both = {...job, minDepth: 0, report: 'hits', contacts: false} as const;
  const isExact = policies.exact !== undefined && policies.exact !== 'none';
  const exact = isExact ? policies.exact : hasSkins ? 'surface' : 'convex';
  return {
    byBoxes: {policies: {...policies, exact: 'none'}, job: both, notes},
    byShapes: {policies: {...policies, exact: exact!}, job: both, notes},
  };
}
