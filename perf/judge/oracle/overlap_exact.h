// The judge of overlap of two boxes by the 15 separating axes of parallelepipeds. All numbers are taken as exact reals.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>

#include "perf/judge/oracle/oracle_box.h"

namespace cab::oracle {

// Axes 0..2 are A's face normals A_k+1 x A_k+2, 3..5 are B's, and 6 + 3 i + j is A_i x B_j.
inline constexpr std::size_t kSeparatingAxisCount = 15;

// The signed distance between the boxes' projections on each axis, in the boxes' unit; -infinity if the axis vanishes.
using AxisGaps = std::array<double, kSeparatingAxisCount>;

// Whether two boxes overlap, and by how much they overlap or are apart.
struct OverlapVerdict {
  bool overlap;         // touching counts as overlapping, up to the judge's own rounding of 2^-100 of the sizes
  double gap;           // the largest of the axis gaps: negative depth, or a lower bound of the distance
  double gap_relative;  // gap / (Sa + Sb); infinite for distinct points
  std::size_t axis;     // the axis of that gap
};

// Judges in Quad. offset: B's centre minus A's in the frame of the axes; the boxes' own centres are not read. Both
// boxes must be finite, with half extents of 0 or more, and with axes so nearly orthonormal that every component is
// below 2.
OverlapVerdict judge_overlap(const OracleBox<float>& a, const OracleBox<float>& b, const Vec3<Quad>& offset);

// The same for boxes whose centres share one origin.
OverlapVerdict judge_overlap(const OracleBox<float>& a, const OracleBox<float>& b);

// The same answer as judge_overlap(...).overlap, for every pair of boxes that judge_overlap takes. Clear cases are
// decided in double.
bool judge_overlap_filtered(const OracleBox<float>& a, const OracleBox<float>& b, const Vec3<Quad>& offset);

// |offset . L| - rA - rB on all axes L, which is the gap times the length of L, in double. Good to 2^-46 of |offset|_1
// and the sizes for axes that are orthonormal to 2^-10.
AxisGaps axis_numerators(const OracleBox<double>& a, const OracleBox<double>& b, const Vec3<double>& offset);

// The lengths of all axes, in double, where cross products of float components keep their relative accuracy.
AxisGaps axis_lengths(const OracleBox<double>& a, const OracleBox<double>& b);

// The gaps on all axes, in double: good to 2^-48 of the sizes over the length of the axis.
AxisGaps axis_gaps(const OracleBox<double>& a, const OracleBox<double>& b, const Vec3<double>& offset);

// The axes that separate, in double: those with a positive gap.
std::bitset<kSeparatingAxisCount> separating_axes(const OracleBox<double>& a, const OracleBox<double>& b,
                                                  const Vec3<double>& offset);

}  // namespace cab::oracle
