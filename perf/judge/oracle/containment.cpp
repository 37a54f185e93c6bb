// Judge of containment, by Cramer's rule over the parent's axes.
#include "perf/judge/oracle/containment.h"

#include <cmath>
#include <limits>

namespace cab::oracle {
namespace {

// Bounds on the rounding of worst_excess relative to its magnitude, above what a count of operations gives for axes
// whose components are below 1.5.
constexpr double kScreenRounding = 0x1p-44;
constexpr double kQuadRounding = 0x1p-100;

// Rounding a child to double moves its corners by at most 2^-53 of its centre and 2^-52 of each half extent times an
// axis no longer than 2.6. A normal of the parent is no longer than 7.8, over a determinant above 0.5: 15.6 times 2^-53
// of the centre, 82 times of the half extents.
constexpr double kNarrowingRounding = 0x1p-46;

// A parent whose axes span less volume than this contains nothing. Axes that are orthonormal to 23 u span about 1.
constexpr double kLeastDeterminant = 0x1p-4;

// The largest |x_k| - half[k], and the magnitude to which its rounding error is proportional.
template <class T>
struct Excess {
  T worst;
  T magnitude;
  T determinant;  // of the parent's axes
};

// Since x is linear, the maximum of |x_k| over the child's corners is |x_k(center)| + sum_j half_j |x_k(axis_j)|.
template <class T>
Excess<T> worst_excess(const OracleBox<T>& parent, const OracleBox<T>& child) {
  const Vec3<T> offset = center_of(child) - center_of(parent);
  const T determinant = dot(axis_of(parent, 0), cross(axis_of(parent, 1), axis_of(parent, 2)));
  const T reach = norm_1(offset) + half_sum(child) * T(2) + half_sum(parent);
  Excess<T> out{T(0), reach, determinant};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<T> normal = cross(axis_of(parent, (k + 1) % 3), axis_of(parent, (k + 2) % 3));
    T x = magnitude(dot(normal, offset));
    for (std::size_t j = 0; j < 3; ++j) { x = x + child.half[j] * magnitude(dot(normal, axis_of(child, j))); }
    const T excess = x / magnitude(determinant) - parent.half[k];
    out.worst = k == 0 ? excess : larger(out.worst, excess);
  }
  return out;
}

// Whether every number is finite in double and no half extent is negative.
template <class T>
bool is_box(const OracleBox<T>& box) {
  bool good = true;
  for (std::size_t k = 0; k < 3; ++k) {
    good = good && std::isfinite(static_cast<double>(box.center[k]));
    good = good && std::isfinite(static_cast<double>(box.half[k])) && box.half[k] >= T(0);
    for (std::size_t c = 0; c < 3; ++c) { good = good && std::isfinite(static_cast<double>(box.axis[k][c])); }
  }
  return good;
}

// The verdict for a given excess in the boxes' unit.
ContainmentVerdict verdict(const OracleBox<float>& parent, bool inside, double excess) {
  const OracleBox<double> wide = convert<double>(parent);
  const double ulp = kFloatRoundoff * (half_sum(wide) + center_max(wide));
  return {inside, excess, excess == 0.0 ? 0.0 : excess / ulp};
}

// The verdict for a box that cannot be judged.
ContainmentVerdict outside() {
  const double infinity = std::numeric_limits<double>::infinity();
  return {false, infinity, infinity};
}

}  // namespace

ContainmentVerdict judge_containment_exactly(const OracleBox<float>& parent, const OracleBox<Quad>& child) {
  if (!is_box(parent) || !is_box(child)) return outside();
  const Excess<Quad> excess = worst_excess(convert<Quad>(parent), child);
  if (!(magnitude(excess.determinant) >= Quad(kLeastDeterminant))) return outside();
  const bool inside = excess.worst <= Quad(kQuadRounding) * excess.magnitude;
  return verdict(parent, inside, static_cast<double>(excess.worst));
}

namespace {

// Decides in double if the child is clearly inside, and in Quad otherwise. narrowing: what rounding the child to double
// adds to the judge's own rounding.
template <class T>
ContainmentVerdict screen_containment(const OracleBox<float>& parent, const OracleBox<T>& child, double narrowing) {
  const OracleBox<double> wide = convert<double>(parent), rounded = convert<double>(child);
  const Excess<double> screen = worst_excess(wide, rounded);
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = larger(largest, norm_max(axis_of(wide, k)));
    largest = larger(largest, norm_max(axis_of(rounded, k)));
  }
  const double bound = kScreenRounding * screen.magnitude + narrowing * (screen.magnitude + norm_1(center_of(rounded)));
  const bool near_orthonormal = screen.determinant > 0.5 && largest < 1.5;
  if (near_orthonormal && is_box(wide) && is_box(rounded) && screen.worst < -bound)
    return verdict(parent, true, screen.worst);
  return judge_containment_exactly(parent, convert<Quad>(child));
}

}  // namespace

ContainmentVerdict judge_containment(const OracleBox<float>& parent, const OracleBox<float>& child) {
  return screen_containment(parent, child, 0.0);
}

ContainmentVerdict judge_containment(const OracleBox<float>& parent, const OracleBox<long double>& child) {
  return screen_containment(parent, child, kNarrowingRounding);
}

}  // namespace cab::oracle
