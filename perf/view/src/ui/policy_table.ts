// The choices of the dial, with the words of cab/policy.h. FCL is not part of the engine in the page.
export type PolicyName = 'refit' | 'extents' | 'strategy' | 'sat' | 'exact';

export interface PolicyField {
  name: PolicyName;
  label: string;
  meaning: string;
  values: Readonly<Record<string, string>>;
  /** The values from this one on are the paper's, for comparison. */
  firstForComparison?: string;
}

export const POLICY_TABLE: readonly PolicyField[] = [
  {
    name: 'refit',
    label: 'Refit',
    meaning: 'How inner boxes are made in each frame',
    values: {
      cab: 'the paper\u2019s CAB: oriented boxes along the main axis of two jointed children',
      best3: 'of three oriented boxes the one of least surface',
      cab_sum: 'as cab, but along the sum of both major axes where their ends are closest',
      covariance: 'the paper\u2019s OBB: along the principal axes of the children\u2019s corners',
      aabb_hull: 'the paper\u2019s AABB*: axis-aligned boxes about the leaf boxes, leaves included',
      aabb_vertices: 'the paper\u2019s AABB+: axis-aligned boxes about all vertices below, leaves included',
    },
    firstForComparison: 'cab_sum',
  },
  {
    name: 'extents',
    label: 'Extents',
    meaning: 'How large an inner box is once the refit has chosen its axes',
    values: {children: 'as large as its two children need', leaves: 'as large as the leaf boxes below it need'},
  },
  {
    name: 'strategy',
    label: 'Strategy',
    meaning: 'How overlapping leaf pairs are found',
    values: {
      tree: 'simultaneous descent of two hierarchies',
      rows: 'each leaf\u2019s bounds against all leaf bounds of the other, then boxes',
      links: 'boxes of links by rows, then the leaves of those that overlap',
      brute: 'every leaf of one against every leaf of the other',
      auto: 'rows, links or tree by leaves and links',
    },
  },
  {
    name: 'sat',
    label: 'Axes',
    meaning: 'Which axes can separate two oriented boxes',
    values: {
      all_15: 'six face normals and nine cross products of edges',
      faces_6: 'the six face normals: less time per test, more pairs pass',
    },
  },
  {
    name: 'exact',
    label: 'Exact test',
    meaning: 'What confirms an overlapping leaf pair',
    values: {
      none: 'overlapping leaf boxes are the answer',
      convex: 'the exact shapes of leaves whose boxes overlap are tested',
      surface: 'the same, and of leaves with triangles these',
    },
  },
];
