// The judge of overlap. The face normals of the Minkowski sum of two parallelepipeds are among 15 cross products of
// edges. A box with half extents 0 is the limit of thin boxes, so the same 15 suffice for plates, segments and points.
#include "perf/judge/oracle/overlap_exact.h"

#include <limits>

namespace cab::oracle {
namespace {

// Rounding of a numerator in Quad relative to |offset|_1 + Sa + Sb, above what a count of operations gives.
constexpr double kQuadRounding = 0x1p-100;

// The same in double, for axes whose components are below 1.5 (e = 2^-53, o = |offset|_1, S = Sa + Sb, first order).
// Products of two components are exact in double, since both are floats, so a component of a normal is off by 4.5 e and
// not above 4.5. |normal . axis|: at most 20.3, off by 20.3 e for its normal, 20.3 e for its products, 40.5 e for its
// sums: 81 e. |offset . normal|: at most 4.5 o, off by 4.5 e o each for the offset, the normal and the products and by
// 9 e o for the sums: 22.5 e o. |(offset x a_i) . b_j|: at most 4.5 o, its cross off by 9 e o in all, times 1.5, and
// 4.5 e o and 9 e o for products and sums: 27 e o. A radius: at most 20.3 S, off by 81 e S and three more roundings of
// 20.3 e S. The last two subtractions round sums of at most 4.5 o + 20.3 S. Together below 37 e o + 183 e S.
constexpr double kDoubleRounding = 0x1p-44;  // 512 e
constexpr double kLargestComponent = 1.5;

// Face normals of a box: normal[k] = axis[k + 1] x axis[k + 2].
template <class T>
std::array<Vec3<T>, 3> face_normals(const OracleBox<T>& box) {
  return {cross(axis_of(box, 1), axis_of(box, 2)), cross(axis_of(box, 2), axis_of(box, 0)),
          cross(axis_of(box, 0), axis_of(box, 1))};
}

// Products of one box's normals with the other's axes: out[i][j] = |normal_i . axis_j|.
template <class T>
std::array<std::array<T, 3>, 3> normal_products(const std::array<Vec3<T>, 3>& normals, const OracleBox<T>& other) {
  std::array<std::array<T, 3>, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[i][j] = magnitude(dot(normals[i], axis_of(other, j)));
  }
  return out;
}

// |offset . L| - rA - rB on the 15 axes L, not divided by |L|.
template <class T>
std::array<T, kSeparatingAxisCount> numerators(const OracleBox<T>& a, const OracleBox<T>& b, const Vec3<T>& offset) {
  std::array<T, kSeparatingAxisCount> out{};
  const auto normal_a = face_normals(a);
  const auto normal_b = face_normals(b);
  const auto a_to_b = normal_products(normal_a, b);
  const auto b_to_a = normal_products(normal_b, a);
  const T volume_a = magnitude(dot(normal_a[0], axis_of(a, 0)));
  const T volume_b = magnitude(dot(normal_b[0], axis_of(b, 0)));
  for (std::size_t k = 0; k < 3; ++k) {
    out[k] = magnitude(dot(offset, normal_a[k])) - a.half[k] * volume_a -
             (b.half[0] * a_to_b[k][0] + b.half[1] * a_to_b[k][1] + b.half[2] * a_to_b[k][2]);
    out[3 + k] = magnitude(dot(offset, normal_b[k])) - b.half[k] * volume_b -
                 (a.half[0] * b_to_a[k][0] + a.half[1] * b_to_a[k][1] + a.half[2] * b_to_a[k][2]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3<T> rotated = cross(offset, axis_of(a, i));
    const std::size_t i1 = (i + 1) % 3;
    const std::size_t i2 = (i + 2) % 3;
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t j1 = (j + 1) % 3;
      const std::size_t j2 = (j + 2) % 3;
      // A_i1 . (A_i x B_j) = -B_j . normal_i2, A_i2 . (A_i x B_j) = B_j . normal_i1, and likewise for B.
      const T radius_a = a.half[i1] * a_to_b[i2][j] + a.half[i2] * a_to_b[i1][j];
      const T radius_b = b.half[j1] * b_to_a[j2][i] + b.half[j2] * b_to_a[j1][i];
      out[6 + 3 * i + j] = magnitude(dot(rotated, axis_of(b, j))) - radius_a - radius_b;
    }
  }
  return out;
}

// Whether the bound in double holds for the axes of both boxes.
bool in_filter_range(const OracleBox<double>& a, const OracleBox<double>& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    largest = larger(largest, larger(norm_max(axis_of(a, k)), norm_max(axis_of(b, k))));
  return largest < kLargestComponent;
}

// Whether A's axis i and B's axis j are parallel bit for bit: their cross product is zero and can never separate.
bool same_line(const OracleBox<double>& a, std::size_t i, const OracleBox<double>& b, std::size_t j) {
  const Vec3<double> one = axis_of(a, i), other = axis_of(b, j);
  const bool same = one[0] == other[0] && one[1] == other[1] && one[2] == other[2];
  return same || (one[0] == -other[0] && one[1] == -other[1] && one[2] == -other[2]);
}

// A numerator over the length of its axis.
double gap_on_axis(double numerator, double length) {
  return length > 0.0 ? numerator / length : -std::numeric_limits<double>::infinity();
}

}  // namespace

OverlapVerdict judge_overlap(const OracleBox<float>& a, const OracleBox<float>& b, const Vec3<Quad>& offset) {
  const auto numerator = numerators(convert<Quad>(a), convert<Quad>(b), offset);
  const AxisGaps length = axis_lengths(convert<double>(a), convert<double>(b));
  const double size = half_sum(convert<double>(a)) + half_sum(convert<double>(b));
  const Quad rounding = Quad(kQuadRounding) * (norm_1(offset) + Quad(size));
  OverlapVerdict out{true, -std::numeric_limits<double>::infinity(), 0.0, 0};
  for (std::size_t k = 0; k < kSeparatingAxisCount; ++k) {
    if (numerator[k] > rounding) out.overlap = false;
    const double gap = gap_on_axis(static_cast<double>(numerator[k]), length[k]);
    if (!(gap > out.gap)) continue;
    out.gap = gap;
    out.axis = k;
  }
  out.gap_relative = out.gap == 0.0 ? 0.0 : out.gap / size;
  return out;
}

OverlapVerdict judge_overlap(const OracleBox<float>& a, const OracleBox<float>& b) {
  return judge_overlap(a, b, convert<Quad>(center_of(b)) - convert<Quad>(center_of(a)));
}

bool judge_overlap_filtered(const OracleBox<float>& a, const OracleBox<float>& b, const Vec3<Quad>& offset) {
  const OracleBox<double> wide_a = convert<double>(a), wide_b = convert<double>(b);
  const Vec3<double> rounded = convert<double>(offset);
  const auto numerator = numerators(wide_a, wide_b, rounded);
  // Below 2^-900 products could underflow.
  const double bound = kDoubleRounding * (norm_1(rounded) + half_sum(wide_a) + half_sum(wide_b)) + 0x1p-900;
  if (!in_filter_range(wide_a, wide_b)) return judge_overlap(a, b, offset).overlap;
  bool clear = true;
  for (std::size_t k = 0; k < kSeparatingAxisCount; ++k) {
    if (numerator[k] > 2.0 * bound) return false;  // twice: judge_overlap itself asks for more than 2^-100 of the sizes
    const bool vanishes = k >= 6 && same_line(wide_a, (k - 6) / 3, wide_b, (k - 6) % 3);
    clear = clear && (vanishes || numerator[k] < -bound);
  }
  return clear || judge_overlap(a, b, offset).overlap;
}

AxisGaps axis_numerators(const OracleBox<double>& a, const OracleBox<double>& b, const Vec3<double>& offset) {
  return numerators(a, b, offset);
}

AxisGaps axis_lengths(const OracleBox<double>& a, const OracleBox<double>& b) {
  AxisGaps out{};
  const auto normal_a = face_normals(a);
  const auto normal_b = face_normals(b);
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = norm(normal_a[i]);
    out[3 + i] = norm(normal_b[i]);
    for (std::size_t j = 0; j < 3; ++j) { out[6 + 3 * i + j] = norm(cross(axis_of(a, i), axis_of(b, j))); }
  }
  return out;
}

AxisGaps axis_gaps(const OracleBox<double>& a, const OracleBox<double>& b, const Vec3<double>& offset) {
  AxisGaps out = axis_lengths(a, b);
  const auto numerator = numerators(a, b, offset);
  for (std::size_t k = 0; k < kSeparatingAxisCount; ++k) { out[k] = gap_on_axis(numerator[k], out[k]); }
  return out;
}

std::bitset<kSeparatingAxisCount> separating_axes(const OracleBox<double>& a, const OracleBox<double>& b,
                                                  const Vec3<double>& offset) {
  std::bitset<kSeparatingAxisCount> out;
  const AxisGaps gaps = axis_gaps(a, b, offset);
  for (std::size_t k = 0; k < kSeparatingAxisCount; ++k) out[k] = gaps[k] > 0.0;
  return out;
}

}  // namespace cab::oracle
