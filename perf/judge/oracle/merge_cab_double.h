// The CAB merge of two boxes in double, unpadded (Schmidl, Walker, Lin 2004, section 3.2.1). docs/numerics.md, "The
// merge", has the rules that the paper leaves open.
#pragma once

#include <string>
#include <vector>

#include "perf/judge/oracle/oracle_box.h"

namespace cab::oracle {

// Where the parent's frame comes from.
enum class MergeBranch {
  kEndpoint,        // the main axis joins the ends of the children
  kChild1Axis,      // the main axis is child 1's longest
  kChild2Axis,      // the main axis is child 2's longest
  kFallbackChild1,  // copy of child 1's frame
  kFallbackChild2,  // copy of child 2's frame
};

// The margin of each decision: how far it is from going the other way. Infinity if it was not taken or cannot.
struct DecisionMargins {
  double longest1;   // child 1's two longest halves, difference over the larger
  double longest2;   // the same of child 2
  double sign1;      // |cos| of child 1's axis against centre - joint
  double sign2;      // the same of child 2
  double parallel;   // |q - 2e-5| / 2, q = |u1 x u2|^2 / (|u1|^2 |u2|^2): the distance in terms of 1 - |dot|
  double main_axis;  // the two longest of E, a1, a2, difference over the larger
  double fallback;   // second extents, difference over the larger; both 0: longest extents
};

// One parent that the rules allow.
struct OracleMerge {
  OracleBox<double> box;  // unpadded, right-handed, orthonormal to double
  MergeBranch branch;
  DecisionMargins margins;
  double sine;  // of the angle between the children's longest axes
};

// Decisions with smaller margins than these may go either way in float.
struct MarginThresholds {
  double relative = 1e-5;  // for every decision but the parallel test
  double dot = 1e-6;       // for the parallel test
};

// How far a float merge may be from the oracle.
struct MergeTolerances {
  double axis;          // radians
  double per_half_sum;  // extents and centre, times S
  double per_center;    // extents and centre, times M
};

// The parent that the rules prescribe. joint: x, y, z in the boxes' frame, or null if the children share no joint.
OracleMerge merge_cab(const OracleBox<double>& child1, const OracleBox<double>& child2, const double* joint);

// Every parent that follows if decisions with a margin below their threshold go either way. The prescribed one comes
// first.
std::vector<OracleMerge> merge_cab_candidates(const OracleBox<double>& child1, const OracleBox<double>& child2,
                                              const double* joint, const MarginThresholds& thresholds = {});

// The padding that a refit adds to each half extent of an unpadded parent: 2^-18 S + 2^-23 M + 4 FLT_MIN.
double merge_padding(const OracleBox<double>& unpadded);

// The parent with its padding, rounded to float.
OracleBox<float> padded_to_float(const OracleBox<double>& unpadded);

// The tolerances for a merge. They are wider for nearly parallel children, whose axes are less well determined.
MergeTolerances merge_tolerances(const OracleMerge& merge);

// Whether `got`, a padded merge, equals `expected`, an unpadded one, within tolerances. Axes are compared in order and
// sign. If not, *why (may be null) receives the reason. merge_tolerances are wider than the padding, so missing padding
// shows only in judge_containment or under tighter tolerances.
bool same_box(const OracleBox<double>& expected, const OracleBox<double>& got, const MergeTolerances& tolerances,
              std::string* why);

// Whether `got`, a padded merge, equals any of the candidates. If not, *why (may be null) receives how it differs from
// the first one.
bool matches_any(const std::vector<OracleMerge>& candidates, const OracleBox<double>& got, std::string* why);

}  // namespace cab::oracle
