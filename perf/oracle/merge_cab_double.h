// The CAB merge of two boxes in double, unpadded (Schmidl, Walker, Lin 2004, section 3.2.1; rulings of numerics.md).
#pragma once

#include <string>
#include <vector>

#include "perf/oracle/oracle_box.h"

namespace cab::oracle {

// Where the parent's frame comes from.
enum class MergeBranch {
  kEndpoint,        // the main axis joins the ends of the children
  kChild1Axis,      // the main axis is child 1's longest
  kChild2Axis,      // the main axis is child 2's longest
  kFallbackChild1,  // copy of child 1's frame
  kFallbackChild2,  // copy of child 2's frame
};

// How far each decision is from tipping over; infinity where it was not taken or cannot tip.
struct DecisionMargins {
  double longest1;   // child 1's two longest halves, difference over the larger
  double longest2;   // the same of child 2
  double sign1;      // |cos| of child 1's axis against centre - joint
  double sign2;      // the same of child 2
  double parallel;   // |q - 2e-5| / 2, q = |u1 x u2|^2 / (|u1|^2 |u2|^2): the distance in terms of 1 - |dot|
  double main_axis;  // the two longest of E, a1, a2, difference over the larger
  double fallback;   // second extents, difference over the larger; both 0: longest extents
};

// One parent that the rulings allow.
struct OracleMerge {
  OracleBox<double> box;  // unpadded, right-handed, orthonormal to double
  MergeBranch branch;
  DecisionMargins margins;
  double sine;  // of the angle between the children's longest axes
};

// Decisions closer than these may go either way in float (numerics.md, "Tests this asks for").
struct MarginThresholds {
  double relative = 1e-5;  // for every decision but the parallel test
  double dot = 1e-6;       // for the parallel test
};

// How far a float merge may be from the oracle (numerics.md, "Tests this asks for").
struct MergeTolerances {
  double axis;          // radians
  double per_half_sum;  // extents and centre, times S
  double per_center;    // extents and centre, times M
};

// The parent that the rulings prescribe; joint points to x, y, z in the boxes' frame, null = centre rule.
OracleMerge merge_cab(const OracleBox<double>& child1, const OracleBox<double>& child2, const double* joint);

// Every parent reachable by tipping decisions whose margin is below its threshold; the prescribed one comes first.
std::vector<OracleMerge> merge_cab_candidates(const OracleBox<double>& child1, const OracleBox<double>& child2,
                                              const double* joint, const MarginThresholds& thresholds = {});

// The padding that a refit adds to each half extent of an unpadded parent: 2^-18 S + 2^-23 M + 4 FLT_MIN.
double merge_padding(const OracleBox<double>& unpadded);

// The parent with its padding, rounded to float.
OracleBox<float> padded_to_float(const OracleBox<double>& unpadded);

// The tolerances for a merge: the axes of nearly parallel children are worse determined.
MergeTolerances merge_tolerances(const OracleMerge& merge);

// Whether got, a padded merge, is expected, an unpadded one; axes compared in order and sign; why may be null.
// merge_tolerances are wider than the padding: its absence shows in judge_containment or under tighter tolerances.
bool same_box(const OracleBox<double>& expected, const OracleBox<double>& got, const MergeTolerances& tolerances,
              std::string* why);

// Whether got, a padded merge, is any of the candidates; why tells what the first one misses, and may be null.
bool matches_any(const std::vector<OracleMerge>& candidates, const OracleBox<double>& got, std::string* why);

}  // namespace cab::oracle
