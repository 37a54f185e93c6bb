// The CAB merge in double. A decision is a list of options, the prescribed one first.
#include "perf/judge/oracle/merge_cab_double.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <functional>
#include <limits>
#include <sstream>

namespace cab::oracle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Axes count as parallel up to this |u1 x u2|^2 / (|u1|^2 |u2|^2), which is the paper's dot product of 1 - 1e-5.
constexpr double kParallelSquare = 2e-5;

// Below this sine the plane of the children is badly determined in float. The tolerances of axes above and below it.
constexpr double kNearParallelSine = 0.05;
constexpr double kAxisTolerance = 2e-6;
constexpr double kNearParallelAxisTolerance = 2e-5;

// The ways that a decision may go, the prescribed one first, and its margin.
template <class T>
struct Decision {
  std::vector<T> options;
  double margin;
};

// The relative difference of two values that are not negative. It is infinity for two zeros, whose order cannot change.
double relative_gap(double a, double b) {
  const double top = larger(a, b);
  return top > 0.0 ? magnitude(a - b) / top : kInfinity;
}

// The index of the greatest value, first of equals, and those that come close to it.
Decision<std::size_t> decide_greatest(const double (&values)[3], double threshold) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (values[k] > values[best]) best = k;
  }
  Decision<std::size_t> out{{best}, kInfinity};
  for (std::size_t k = 0; k < 3; ++k) {
    if (k == best) continue;
    const double gap = relative_gap(values[best], values[k]);
    if (gap < threshold) out.options.push_back(k);
    if (gap < out.margin) out.margin = gap;
  }
  return out;
}

// The sign that makes an axis point away from the joint. outward: centre - joint. An exact 0 keeps the stored sign.
Decision<double> decide_sign(const Vec3<double>& axis, const Vec3<double>& outward, double threshold) {
  const double along = dot(axis, outward);
  const double length = norm(axis) * norm(outward);
  const double sign = along < 0.0 ? -1.0 : 1.0;
  Decision<double> out{{sign}, length > 0.0 ? magnitude(along) / length : 0.0};
  if (out.margin < threshold) out.options.push_back(-sign);
  return out;
}

// Whether the merge copies a child's frame, given the children's unit axes.
Decision<bool> decide_parallel(const Vec3<double>& u1, const Vec3<double>& u2, bool degenerate, double threshold) {
  if (degenerate) return {{true}, kInfinity};
  const Vec3<double> normal = cross(u1, u2);
  const double square = dot(normal, normal) / (dot(u1, u1) * dot(u2, u2));
  const bool parallel = !(square > kParallelSquare);
  Decision<bool> out{{parallel}, magnitude(square - kParallelSquare) / 2};
  if (out.margin < threshold && square > 0.0) out.options.push_back(!parallel);
  return out;
}

// The three half extents of a box, longest first.
std::array<double, 3> sorted_halves(const OracleBox<double>& box) {
  std::array<double, 3> sorted = {box.half[0], box.half[1], box.half[2]};
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  return sorted;
}

// Whose frame the merge copies if it copies one.
Decision<MergeBranch> decide_fallback(const OracleBox<double>& child1, const OracleBox<double>& child2,
                                      double threshold) {
  const std::array<double, 3> sorted[2] = {sorted_halves(child1), sorted_halves(child2)};
  const double longest[2] = {sorted[0][0], sorted[1][0]};
  const double second[2] = {sorted[0][1], sorted[1][1]};
  const bool by_second = second[0] != second[1];
  const bool child2_wins = by_second ? second[1] > second[0] : longest[1] > longest[0];
  const bool seconds_are_zero = !(second[0] > 0.0) && !(second[1] > 0.0);
  const double margin = seconds_are_zero ? relative_gap(longest[0], longest[1]) : relative_gap(second[0], second[1]);
  const MergeBranch branch[2] = {MergeBranch::kFallbackChild1, MergeBranch::kFallbackChild2};
  Decision<MergeBranch> out{{branch[child2_wins ? 1 : 0]}, margin};
  if (margin < threshold) out.options.push_back(branch[child2_wins ? 0 : 1]);
  return out;
}

// The children's longest axes with their signs and scales, by the paper's symbols.
struct LongestAxes {
  Vec3<double> u1, u2;  // unit
  Vec3<double> a1, a2;  // times the longest halves, over the larger of the two
};

// Which of E, a1, a2 is the main axis.
Decision<MergeBranch> decide_main_axis(const LongestAxes& axes, double threshold) {
  const double length[3] = {norm(axes.a1 - axes.a2), norm(axes.a1), norm(axes.a2)};
  const MergeBranch branch[3] = {MergeBranch::kEndpoint, MergeBranch::kChild1Axis, MergeBranch::kChild2Axis};
  const Decision<std::size_t> greatest = decide_greatest(length, threshold);
  Decision<MergeBranch> out{{}, greatest.margin};
  for (const std::size_t k : greatest.options) out.options.push_back(branch[k]);
  return out;
}

// Sets orthonormal axes of a box: along the first direction, in the plane of both, and across the plane.
void set_orthonormal(const Vec3<double>& first, const Vec3<double>& second, OracleBox<double>& box) {
  const Vec3<double> axis0 = normalized(first);
  const Vec3<double> axis1 = normalized(second - dot(second, axis0) * axis0);
  store(axis0, box.axis[0]);
  store(axis1, box.axis[1]);
  store(cross(axis0, axis1), box.axis[2]);
}

// The projected radius of a box along a direction.
double radius(const OracleBox<double>& box, const Vec3<double>& direction) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) { sum += box.half[k] * magnitude(dot(direction, axis_of(box, k))); }
  return sum;
}

// Equation 4, measured from child 1's centre: halves and centre for the axes already in the parent.
void set_extents(const OracleBox<double>& child1, const OracleBox<double>& child2, OracleBox<double>& parent) {
  const Vec3<double> offset = center_of(child2) - center_of(child1);
  Vec3<double> center = center_of(child1);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<double> axis = axis_of(parent, k);
    const double radius1 = radius(child1, axis);
    const double radius2 = radius(child2, axis);
    const double along = dot(axis, offset);
    const double high = larger(radius1, along + radius2);
    const double low = -larger(radius1, radius2 - along);
    parent.half[k] = 0.5 * (high - low);
    center = center + (0.5 * (high + low)) * axis;
  }
  store(center, parent.center);
}

// The parent of one branch.
OracleBox<double> build_parent(const OracleBox<double>& child1, const OracleBox<double>& child2,
                               const LongestAxes& axes, MergeBranch branch) {
  OracleBox<double> parent{};
  const Vec3<double> normal = cross(axes.u1, axes.u2);
  switch (branch) {
    case MergeBranch::kEndpoint: set_orthonormal(axes.a1 - axes.a2, normal, parent); break;
    case MergeBranch::kChild1Axis: set_orthonormal(axes.a1, normal, parent); break;
    case MergeBranch::kChild2Axis: set_orthonormal(axes.a2, normal, parent); break;
    case MergeBranch::kFallbackChild1: set_orthonormal(axis_of(child1, 0), axis_of(child1, 1), parent); break;
    case MergeBranch::kFallbackChild2: set_orthonormal(axis_of(child2, 0), axis_of(child2, 1), parent); break;
  }
  set_extents(child1, child2, parent);
  return parent;
}

// Everything that the last decisions of a merge need.
struct MergeInputs {
  const OracleBox<double>& child1;
  const OracleBox<double>& child2;
  const MarginThresholds& thresholds;
  double longest1, longest2;  // half extents
};

// Appends the parents for settled longest axes and signs.
void append_parents(const MergeInputs& in, const Vec3<double>& u1, const Vec3<double>& u2, DecisionMargins margins,
                    std::vector<OracleMerge>& out) {
  const double least1 = sorted_halves(in.child1)[2], least2 = sorted_halves(in.child2)[2];
  const bool degenerate = !(in.longest1 > least2) || !(in.longest2 > least1);
  const double scale = larger(in.longest1, in.longest2);
  const LongestAxes axes = {u1, u2, (in.longest1 / scale) * u1, (in.longest2 / scale) * u2};
  const double sine = norm(cross(u1, u2)) / (norm(u1) * norm(u2));
  const Decision<bool> parallel = decide_parallel(u1, u2, degenerate, in.thresholds.dot);
  margins.parallel = parallel.margin;
  for (const bool falls_back : parallel.options) {
    const Decision<MergeBranch> branches = falls_back ? decide_fallback(in.child1, in.child2, in.thresholds.relative)
                                                      : decide_main_axis(axes, in.thresholds.relative);
    margins.fallback = falls_back ? branches.margin : kInfinity;
    margins.main_axis = falls_back ? kInfinity : branches.margin;
    for (const MergeBranch branch : branches.options) {
      out.push_back({build_parent(in.child1, in.child2, axes, branch), branch, margins, sine});
    }
  }
}

// Appends the parents for settled longest axes.
void append_signs(const MergeInputs& in, std::size_t k1, std::size_t k2, const double* joint, DecisionMargins margins,
                  std::vector<OracleMerge>& out) {
  const Vec3<double> c1 = center_of(in.child1);
  const Vec3<double> c2 = center_of(in.child2);
  const Vec3<double> from1 = joint != nullptr ? Vec3<double>{{joint[0], joint[1], joint[2]}} : c2;
  const Vec3<double> from2 = joint != nullptr ? from1 : c1;
  const Vec3<double> axis1 = axis_of(in.child1, k1);
  const Vec3<double> axis2 = axis_of(in.child2, k2);
  const Decision<double> sign1 = decide_sign(axis1, c1 - from1, in.thresholds.relative);
  const Decision<double> sign2 = decide_sign(axis2, c2 - from2, in.thresholds.relative);
  margins.sign1 = sign1.margin;
  margins.sign2 = sign2.margin;
  for (const double s1 : sign1.options) {
    for (const double s2 : sign2.options) append_parents(in, s1 * axis1, s2 * axis2, margins, out);
  }
}

// Writes the reason if why is not null, and returns false.
bool differs(std::string* why, const char* what, std::size_t index, double off, double limit) {
  if (why != nullptr) {
    std::ostringstream text;
    text << what << ' ' << index << " is off by " << off << ", limit " << limit;
    *why = text.str();
  }
  return false;
}

}  // namespace

std::vector<OracleMerge> merge_cab_candidates(const OracleBox<double>& child1, const OracleBox<double>& child2,
                                              const double* joint, const MarginThresholds& thresholds) {
  const Decision<std::size_t> longest1 = decide_greatest(child1.half, thresholds.relative);
  const Decision<std::size_t> longest2 = decide_greatest(child2.half, thresholds.relative);
  DecisionMargins margins{longest1.margin, longest2.margin, kInfinity, kInfinity, kInfinity, kInfinity, kInfinity};
  std::vector<OracleMerge> out;
  for (const std::size_t k1 : longest1.options) {
    for (const std::size_t k2 : longest2.options) {
      const MergeInputs in = {child1, child2, thresholds, child1.half[k1], child2.half[k2]};
      append_signs(in, k1, k2, joint, margins, out);
    }
  }
  return out;
}

OracleMerge merge_cab(const OracleBox<double>& child1, const OracleBox<double>& child2, const double* joint) {
  return merge_cab_candidates(child1, child2, joint, MarginThresholds{0.0, 0.0}).front();
}

double merge_padding(const OracleBox<double>& unpadded) {
  return 0x1p-18 * half_sum(unpadded) + 0x1p-23 * center_max(unpadded) + 4.0 * static_cast<double>(FLT_MIN);
}

OracleBox<float> padded_to_float(const OracleBox<double>& unpadded) {
  OracleBox<double> padded = unpadded;
  for (double& half : padded.half) half += merge_padding(unpadded);
  return convert<float>(padded);
}

MergeTolerances merge_tolerances(const OracleMerge& merge) {
  const bool falls_back = merge.branch == MergeBranch::kFallbackChild1 || merge.branch == MergeBranch::kFallbackChild2;
  const bool ill_determined = !falls_back && merge.sine < kNearParallelSine;
  return {ill_determined ? kNearParallelAxisTolerance : kAxisTolerance, 6e-6, 4.0 * kFloatRoundoff};
}

bool same_box(const OracleBox<double>& expected, const OracleBox<double>& got, const MergeTolerances& tolerances,
              std::string* why) {
  const double padding = merge_padding(expected);
  const double limit = tolerances.per_half_sum * half_sum(expected) + tolerances.per_center * center_max(expected) +
                       static_cast<double>(FLT_MIN);
  for (std::size_t k = 0; k < 3; ++k) {
    // The chord between unit vectors is their angle to second order, and 2 where the sign differs.
    const double turn = norm(normalized(axis_of(got, k)) - axis_of(expected, k));
    if (!(turn <= tolerances.axis)) return differs(why, "axis", k, turn, tolerances.axis);
    const double stretch = magnitude(got.half[k] - padding - expected.half[k]);
    if (!(stretch <= limit)) return differs(why, "half extent", k, stretch, limit);
    const double shift = magnitude(got.center[k] - expected.center[k]);
    if (!(shift <= limit)) return differs(why, "centre coordinate", k, shift, limit);
  }
  return true;
}

bool matches_any(const std::vector<OracleMerge>& candidates, const OracleBox<double>& got, std::string* why) {
  bool first = true;
  for (const OracleMerge& candidate : candidates) {
    std::string* reason = first ? why : nullptr;
    if (same_box(candidate.box, got, merge_tolerances(candidate), reason)) return true;
    first = false;
  }
  return false;
}

}  // namespace cab::oracle
