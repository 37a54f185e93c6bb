// Each bound of docs/proof.md against the worst error that random search and hill climbing find. Errors are in units of
// the bound.
#include "kernels/merge_cab.h"
#include "kernels/merge_covariance.h"
#include "kernels/overlap_sat.h"
#include "kernels/pose_leaves.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/touching_pairs.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using kernel::BoxLanes;
using oracle::OracleBox;
using oracle::Random;
using Real = double;  // 29 bits more than float
using Point = oracle::Vec3<Real>;
using Lanes3 = kernel::Vec3<float>;

constexpr std::uint64_t kSeed = 24;
constexpr Real kU = 0x1p-24;

// The bounds that docs/proof.md derives, in u. What the kernels add is in layout/error_bounds.h.
constexpr Real kDotSize = 1.5, kDotValue = 1.5;                            // 1.1
constexpr Real kCrossAcross = 2.16, kCrossAlong = 2.23;                    // 1.2
constexpr Real kTurnError = 17.8;                                          // 2.2
constexpr Real kPosedAxes = 26.3, kPosedAxesRotated = 46.6;                // 2.5, 2.7
constexpr Real kPosedCenter = 23.3, kPosedCenterRotated = 47.5;            // 2.6, 2.7
constexpr Real kPosedTranslation = 1.74, kPosedTranslationRotated = 39.1;  // 2.6, 2.7
constexpr Real kMarginGrowth = 15.3;                                       // 2.9
constexpr Real kMergeSize = 62.9, kMergePlace = 1.74;                      // 3.6, 3.4
constexpr Real kBoundsSize = 5.1, kBoundsPlace = 1.01;                     // 4.2
constexpr Real kBoundsBoth = 13.1;                                         // 4.3
constexpr Real kWorld = 6.1;                                               // 5.2
constexpr Real kFace = 28.6;                                               // 5.3
constexpr Real kEdge = 37.7, kEdgeAlways = 13.2;                           // 5.6
constexpr Real kLinkSize = 1.20e-3;                                        // 6.5, of S and not in u
constexpr Real kLinkTranslation = 58;                                      // 6.5
constexpr Real kLinkPadding = 2.61, kLinkLimit = 3.99;                     // 6.4, 6.7

// What the kernels add is at least what is derived. Where a leaf is padded, it also covers a part's tolerance (4 u S)
// and the rounding of the sum half + pad (1 u S).
static_assert(kPosePad.body >= (kPosedAxes + 5) * kU && kPosePad.body >= kPosedCenter * kU);
static_assert(kPosePad.translation >= (kPosedTranslation + 1) * kU);
static_assert(kPosePadRotated.body >= (kPosedAxesRotated + 5) * kU);
static_assert(kPosePadRotated.body >= kPosedCenterRotated * kU);
static_assert(kPosePadRotated.translation >= (kPosedTranslationRotated + 1) * kU);
static_assert(2 * Real{kMarginShare} >= 1 + kMarginGrowth * kU);
static_assert(kMergePadSize >= kMergeSize * kU && kMergePadCenter >= kMergePlace * kU);
static_assert(kBoundsPad >= kBoundsBoth * kU && kBoundsBoth >= kBoundsSize && kBoundsBoth >= kBoundsPlace);
static_assert(kSlackWorld >= kWorld * kU);
static_assert(2 * kSlackGrow >= kFace * kU && 2 * kSlackGrow >= kEdge * kU);
static_assert(kSlackEdge >= kEdgeAlways * kU);
static_assert(Real{kLinkGrowSize} >= kLinkSize && Real{kLinkGrowTranslation} >= kLinkTranslation * kU);
static_assert(Real{kLinkTiny} >= Real{kOverlapTiny});
static_assert(Real{kLinkPads} >= kLinkPadding && Real{kLinkRange} >= kLinkLimit);
// The slack for which a link's box was derived. With another slack, step 6.1 has to be derived again.
static_assert(kSlackGrow == 24 * kU && kSlackEdge == 16 * kU);

// The larger of two, or NaN if one is.
Real larger_or_nan(Real a, Real b) { return std::isnan(b) || a < b ? b : a; }

// Numbers on which a claim is tried. The claim says what they mean.
using Numbers = std::vector<float>;

// The worst ratio of error to bound over random numbers. From each start it climbs by changes from an ulp upwards.
// ratio returns a negative value for numbers to which the claim does not apply.
template <class Make, class Ratio>
Real worst_ratio(Make make, Ratio ratio, int starts, int steps) {
  Random random(kSeed);
  Real worst = -1;
  for (int start = 0; start < starts; ++start) {
    Numbers best = make(random);
    Real most = ratio(best);
    REQUIRE_FALSE(std::isnan(most));
    for (int step = 0; step < steps; ++step) {
      Numbers next = best;
      for (unsigned change = 0; change <= random.index(3); ++change) {
        float& number = next[random.index(static_cast<unsigned>(next.size()))];
        if (random.chance(0.4)) {
          number = std::nextafter(number, random.chance(0.5) ? 1e30f : -1e30f);
        } else {
          number += static_cast<float>(random.normal() * random.log_uniform(1e-8, 0.5)) * (number == 0 ? 1.0f : number);
        }
      }
      const Real r = ratio(next);
      REQUIRE_FALSE(std::isnan(r));
      if (r < most) continue;
      most = r;
      best = next;
    }
    worst = std::max(worst, most);
  }
  return worst;
}

Numbers normals(Random& random, std::size_t count) {
  Numbers out(count);
  for (float& v : out) v = static_cast<float>(random.normal());
  return out;
}

Point exact(const Lanes3& v) { return {{v.x, v.y, v.z}}; }
Lanes3 lanes(const Point& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }
Lanes3 lanes_at(const Numbers& from, std::size_t at) { return {from[at], from[at + 1], from[at + 2]}; }
Real length(const Point& p) { return std::sqrt(dot(p, p)); }
Point unit(const Point& p) { return (1 / length(p)) * p; }

struct Rotation {
  Point column[3];
  Point operator()(const Point& p) const { return p[0] * column[0] + p[1] * column[1] + p[2] * column[2]; }
};

Rotation rotation_of(const Numbers& from, std::size_t at) {
  const Real x = from[at], y = from[at + 1], z = from[at + 2], w = from[at + 3],
             s = 2 / (x * x + y * y + z * z + w * w);
  return {{{{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)}},
           {{s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)}},
           {{s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}}}};
}

bool is_quaternion(const Numbers& from, std::size_t at) {
  Real n = 0;
  for (std::size_t i = 0; i < 4; ++i) n += Real{from[at + i]} * from[at + i];
  return n >= 1e-6 && n <= 1e6;
}

void columns_of(const Numbers& from, std::size_t at, Lanes3 (&column)[3]) {
  const float x = from[at], y = from[at + 1], z = from[at + 2], w = from[at + 3];
  kernel::quaternion_columns(x, y, z, w, (x * x + y * y) + (z * z + w * w), column);
}

OracleBox<float> box_of(const BoxLanes<float>& box) {
  OracleBox<float> out{};
  oracle::store(oracle::Vec3<float>{{box.center.x, box.center.y, box.center.z}}, out.center);
  oracle::store(oracle::Vec3<float>{{box.half.x, box.half.y, box.half.z}}, out.half);
  for (std::size_t k = 0; k < 3; ++k)
    oracle::store(oracle::Vec3<float>{{box.axis[k].x, box.axis[k].y, box.axis[k].z}}, out.axis[k]);
  return out;
}

BoxLanes<float> lanes_of(const OracleBox<float>& box) {
  BoxLanes<float> out;
  const auto vector = [](const float(&v)[3]) { return Lanes3{v[0], v[1], v[2]}; };
  out.center = vector(box.center);
  out.half = vector(box.half);
  for (std::size_t k = 0; k < 3; ++k) out.axis[k] = vector(box.axis[k]);
  return out;
}

// A box from 10 numbers: a quaternion, the logarithms of three half extents, a centre.
BoxLanes<float> box_at(const Numbers& from, std::size_t at) {
  BoxLanes<float> box;
  const Rotation rotation = rotation_of(from, at);
  for (std::size_t k = 0; k < 3; ++k) box.axis[k] = lanes(rotation.column[k]);
  const auto half = [&](std::size_t k) { return static_cast<float>(std::exp(3 * Real{from[at + 4 + k]})); };
  box.half = {half(0), half(1), half(2)};
  box.center = lanes_at(from, at + 7);
  return box;
}
bool is_box(const Numbers& from, std::size_t at) {
  if (!is_quaternion(from, at)) return false;
  return std::all_of(from.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                     from.begin() + static_cast<std::ptrdiff_t>(at) + 10, [](float v) { return std::fabs(v) < 5; });
}

// Solves A y = p for y, where A has the given columns.
Point solve(const Point (&column)[3], const Point& p) {
  const Real det = dot(column[0], cross(column[1], column[2]));
  return {{dot(p, cross(column[1], column[2])) / det, dot(p, cross(column[2], column[0])) / det,
           dot(p, cross(column[0], column[1])) / det}};
}

void report(const std::string& step, Real worst) {
  MESSAGE("step " << step << ": worst error found is " << worst << " of its bound");
  CAPTURE(step);
  CAPTURE(kSeed);
  CHECK(worst > 0.1);  // the search found an error, so the bound was tested
  CHECK(worst <= 1);
}

}  // namespace

TEST_CASE("products and frames err no more than derived (proof.md, part 1)") {
  report("1.1", worst_ratio([](Random& random) { return normals(random, 6); },
                            [](const Numbers& n) {
                              const Lanes3 a = lanes_at(n, 0), b = lanes_at(n, 3);
                              const Real value = dot(exact(a), exact(b));
                              const Real bound =
                                  kU * (kDotSize * length(exact(a)) * length(exact(b)) + kDotValue * std::fabs(value));
                              return bound > 0 ? std::fabs(kernel::dot(a, b) - value) / bound : -1;
                            },
                            300, 3000));
  report("1.2", worst_ratio([](Random& random) { return normals(random, 4); },
                            [](const Numbers& n) {
                              if (!is_quaternion(n, 0)) return -1.0;
                              const Rotation r = rotation_of(n, 0);
                              const Lanes3 a = lanes(r.column[0]), b = lanes(r.column[1]);
                              const Point error = exact(kernel::cross(a, b)) - cross(exact(a), exact(b));
                              Real most = 0;
                              for (int k = 0; k < 3; ++k)
                                most = larger_or_nan(most, std::fabs(dot(error, r.column[k])) /
                                                               ((k < 2 ? kCrossAcross : kCrossAlong) * kU));
                              return most;
                            },
                            300, 3000));
  const auto two_boxes = [](Random& random) {
    Numbers out = normals(random, 20);
    if (random.chance(0.3))  // nearly parallel
      for (std::size_t i = 0; i < 4; ++i)
        out[10 + i] = out[i] + static_cast<float>(random.normal() * random.log_uniform(1e-4, 1e-1));
    return out;
  };
  report("1.3", worst_ratio(
                    two_boxes,
                    [](const Numbers& n) {
                      if (!is_box(n, 0) || !is_box(n, 10)) return -1.0;
                      BoxLanes<float> parent = box_at(n, 0);
                      kernel::cab_axes<float, false>(parent, box_at(n, 10), nullptr, parent.axis);
                      return Real{oracle::frame_error(box_of(parent))};
                    },
                    300, 3000));
  report("1.4", worst_ratio(
                    two_boxes,
                    [](const Numbers& n) {
                      if (!is_box(n, 0) || !is_box(n, 10)) return -1.0;
                      BoxLanes<float> parent = box_at(n, 0);
                      kernel::eigen_axes(kernel::corner_covariance(parent, box_at(n, 10)), parent.axis);
                      return Real{oracle::frame_error(box_of(parent))};
                    },
                    200, 2000));
}

// 21 numbers: a pose's quaternion and translation, a leaf's frame, an instance's orientation.
namespace {

enum class Source { kQuaternion, kMatrix };

struct PosedCase {
  Rotation pose, turn;
  Point translation;
  Box local;
  bool rotated;
  BoxLanes<float> got;
};

bool pose_case(const Numbers& n, Source source, bool rotated, PosedCase& out) {
  if (!is_quaternion(n, 0) || !is_quaternion(n, 10) || (rotated && !is_quaternion(n, 14))) return false;
  out.rotated = rotated;
  out.pose = rotation_of(n, 0);
  out.turn = rotated ? rotation_of(n, 14) : Rotation{{{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}}};
  out.translation = exact(lanes_at(n, 4));
  const Rotation frame = rotation_of(n, 10);
  for (std::size_t k = 0; k < 3; ++k) {
    out.local.center[k] = n[7 + k];
    out.local.half[k] = n[18 + k];
    for (std::size_t c = 0; c < 3; ++c) out.local.axis[k][c] = static_cast<float>(frame.column[k][c]);
  }
  kernel::RigidLanes<float> motion;
  if (source == Source::kQuaternion) {
    columns_of(n, 0, motion.column);
  } else {
    for (int k = 0; k < 3; ++k) motion.column[k] = lanes(out.pose.column[k]);
    Point m[3];
    for (int k = 0; k < 3; ++k) m[k] = exact(motion.column[k]);
    out.pose.column[0] = unit(m[0]);
    out.pose.column[1] = unit(m[1] - dot(m[1], out.pose.column[0]) * out.pose.column[0]);
    out.pose.column[2] = cross(out.pose.column[0], out.pose.column[1]);
    kernel::polish(motion.column);
    kernel::polish(motion.column);
  }
  motion.translation = lanes_at(n, 4);
  if (rotated) {
    Lanes3 by[3];
    columns_of(n, 14, by);
    for (auto& column : motion.column) column = kernel::rotate(by, column);
    motion.translation = kernel::rotate(by, motion.translation);
  }
  out.got = kernel::pose_box(motion, out.local, rotated ? kPosePadRotated : kPosePad, float(0.0f));
  return true;
}

// The posed axes against the exact ones, in the posed axes' own coordinates.
Real axes_ratio(const PosedCase& c) {
  Point axis[3];
  for (int k = 0; k < 3; ++k) axis[k] = exact(c.got.axis[k]);
  Real worst = 0;
  for (std::size_t l = 0; l < 3; ++l) {
    const Point y = solve(axis, c.turn(c.pose(oracle::convert<Real>(oracle::to_vec3(c.local.axis[l])))) - axis[l]);
    for (std::size_t k = 0; k < 3; ++k) worst = larger_or_nan(worst, std::fabs(y[k]));
  }
  return worst / (kU * (c.rotated ? kPosedAxesRotated : kPosedAxes));
}

Real frame_ratio(const PosedCase& c) { return oracle::frame_error(box_of(c.got)); }

Real center_ratio(const PosedCase& c) {
  Point axis[3];
  for (int k = 0; k < 3; ++k) axis[k] = exact(c.got.axis[k]);
  const Point local = oracle::convert<Real>(oracle::to_vec3(c.local.center));
  const Point translation = c.turn(c.translation);
  const Real error = norm_max(solve(axis, translation + c.turn(c.pose(local)) - exact(c.got.center)));
  const Real bound = kU * ((c.rotated ? kPosedCenterRotated : kPosedCenter) * norm_1(local) +
                           (c.rotated ? kPosedTranslationRotated : kPosedTranslation) * norm_max(translation));
  return bound > 1e-30 ? error / bound : -1;  // step 2.8 is about smaller ones
}

Numbers pose_numbers(Random& random) {
  Numbers out = normals(random, 21);
  for (std::size_t i = 18; i < 21; ++i) out[i] = std::fabs(out[i]);
  if (random.chance(0.3)) out[3] *= 1e-3f;  // near half turns, where a quaternion's matrix errs most
  if (random.chance(0.3)) out[17] *= 1e-3f;
  if (random.chance(0.3)) out[7] = out[8] = out[9] = 0;
  if (random.chance(0.3)) out[4] = out[5] = out[6] = 0;
  return out;
}

}  // namespace

TEST_CASE("posing errs no more than derived (proof.md, part 2)") {
  report("2.2", worst_ratio(
                    pose_numbers,
                    [](const Numbers& n) {
                      if (!is_quaternion(n, 0)) return -1.0;
                      Lanes3 column[3];
                      columns_of(n, 0, column);
                      const Rotation r = rotation_of(n, 0);
                      const Point direction = unit(exact(lanes_at(n, 7)) + Point{{1e-30, 0, 0}});
                      Point error{};
                      for (std::size_t k = 0; k < 3; ++k)
                        error = error + direction[k] * (exact(column[k]) - r.column[k]);
                      return length(error) / (kTurnError * kU);
                    },
                    200, 4000));
  for (const Source source : {Source::kQuaternion, Source::kMatrix})
    for (const bool rotated : {false, true}) {
      CAPTURE(rotated);
      const auto with = [&](Real (*ratio)(const PosedCase&)) {
        return [source, rotated, ratio](const Numbers& n) {
          PosedCase c;
          return pose_case(n, source, rotated, c) ? ratio(c) : -1;
        };
      };
      report("1.5", worst_ratio(pose_numbers, with(frame_ratio), 100, 2000));
      report(rotated ? "2.7, axes" : "2.5", worst_ratio(pose_numbers, with(axes_ratio), 100, 2000));
      report(rotated ? "2.7, centre" : "2.6", worst_ratio(pose_numbers, with(center_ratio), 100, 2000));
    }
}

TEST_CASE("merging and bounding err no more than derived (proof.md, parts 3 and 4)") {
  // How far the corners of both children stick out of an unpadded parent.
  const auto lacks = [](const Numbers& n, Real& size, Real& place) {
    const BoxLanes<float> first = box_at(n, 0), second = box_at(n, 10);
    Lanes3 axes[3];
    kernel::cab_axes<float, false>(first, second, nullptr, axes);
    const BoxLanes<float> parent = kernel::enclose(first, second, axes);
    place = norm_max(exact(parent.center));
    // half = h + 2^-18 S + ..., so S of the padded is (1 + 3 2^-18) S + ..., good to 1e-9 of S.
    const Point padded = exact(parent.half);
    size = (padded[0] + padded[1] + padded[2] - 3 * kMergePadCenter * place) / (1 + 3 * kMergePadSize);
    const Real pad = kMergePadSize * size + kMergePadCenter * place;
    Point axis[3];
    for (int k = 0; k < 3; ++k) axis[k] = exact(axes[k]);
    Real most = -1e30;
    for (const BoxLanes<float>* child : {&first, &second}) {
      const OracleBox<Real> box = oracle::convert<Real>(box_of(*child));
      for (unsigned i = 0; i < 8; ++i) {
        const Point y = solve(axis, oracle::corner(box, i) - exact(parent.center));
        for (std::size_t k = 0; k < 3; ++k) most = larger_or_nan(most, std::fabs(y[k]) - (padded[k] - pad));
      }
    }
    return most;
  };
  const auto two_boxes = [](Random& random) {
    Numbers out = normals(random, 20);
    const double far = random.chance(0.5) ? 0 : random.log_uniform(1e-2, 1);
    for (const std::size_t at : {0u, 10u})
      for (std::size_t i = 7; i < 10; ++i) out[at + i] *= static_cast<float>(far);
    return out;
  };
  report("3.6", worst_ratio(
                    two_boxes,
                    [&](const Numbers& n) {
                      if (!is_box(n, 0) || !is_box(n, 10)) return -1.0;
                      Real size, place;
                      const Real most = lacks(n, size, place);
                      return most / (kU * (kMergeSize * size + kMergePlace * place));
                    },
                    60, 1500));
  report("4.2", worst_ratio(
                    two_boxes,
                    [](const Numbers& n) {
                      if (!is_box(n, 0)) return -1.0;
                      const BoxLanes<float> box = box_at(n, 0);
                      const kernel::AabbLanes<float> bounds = kernel::bounds_of(box);
                      const OracleBox<Real> e = oracle::convert<Real>(box_of(box));
                      const Real size = half_sum(e), place = norm_max(center_of(e));
                      const Real pad = kBoundsPad * (size + place);
                      Real most = -1e30;
                      for (unsigned i = 0; i < 8; ++i) {
                        const Point corner = oracle::corner(e, i), hi = exact(bounds.hi), lo = exact(bounds.lo);
                        for (std::size_t c = 0; c < 3; ++c)
                          for (const Real beyond : {corner[c] - (hi[c] - pad), lo[c] + pad - corner[c]})
                            most = larger_or_nan(most, beyond);
                      }
                      return most / (kU * (kBoundsSize * size + kBoundsPlace * place));
                    },
                    100, 2000));
}

namespace {

struct SlackNeeds {
  Real face = -1, edge = -1;  // in units of the bounds
};

// The slack that the float tests need to pass a pair that touches, by the formulas of overlap_sat.h.
SlackNeeds slack_needs(const oracle::BoxPair& pair) {
  const BoxLanes<float> a = lanes_of(pair.a), b = lanes_of(pair.b);
  Lanes3 between;
  const double shift[3] = {pair.origin_b[0] - pair.origin_a[0], pair.origin_b[1] - pair.origin_a[1],
                           pair.origin_b[2] - pair.origin_a[2]};
  between = {kernel::difference(b.center.x, a.center.x, &shift[0]),
             kernel::difference(b.center.y, a.center.y, &shift[1]),
             kernel::difference(b.center.z, a.center.z, &shift[2])};
  const float half_a[3] = {a.half.x, a.half.y, a.half.z}, half_b[3] = {b.half.x, b.half.y, b.half.z};
  const Real size_b = half_sum(oracle::convert<Real>(pair.b)), size = half_sum(oracle::convert<Real>(pair.a)) + size_b;
  float r[3][3], q[3][3], t[3];
  for (int i = 0; i < 3; ++i) {
    t[i] = kernel::dot(a.axis[i], between);
    for (int j = 0; j < 3; ++j) {
      r[i][j] = kernel::dot(a.axis[i], b.axis[j]);
      q[i][j] = std::fabs(r[i][j]);
    }
  }
  SlackNeeds out;
  const auto face = [&](float distance, float own, float other) {
    out.face = larger_or_nan(out.face, (Real{std::fabs(distance)} - Real{own + other}) / (kFace * kU * size));
  };
  for (int k = 0; k < 3; ++k) {
    face(t[k], half_a[k], half_b[0] * q[k][0] + half_b[1] * q[k][1] + half_b[2] * q[k][2]);
    face(kernel::dot(b.axis[k], between), half_b[k], half_a[0] * q[0][k] + half_a[1] * q[1][k] + half_a[2] * q[2][k]);
  }
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const float reached =
          (half_a[i1] * q[i2][j] + half_a[i2] * q[i1][j]) + (half_b[j1] * q[i][j2] + half_b[j2] * q[i][j1]);
      const Real length_a = std::hypot(Real{q[i1][j]}, Real{q[i2][j]});
      const Real length_b = std::hypot(Real{q[i][j1]}, Real{q[i][j2]});
      const Real bound = kU * (kEdge * std::min(length_a, length_b) * size + kEdgeAlways * size_b);
      const Real lacks = Real{std::fabs(t[i2] * r[i1][j] - t[i1] * r[i2][j])} - Real{reached};
      if (!(lacks <= 0)) out.edge = larger_or_nan(out.edge, bound > 0 ? lacks / bound : 2.0);
    }
  }
  return out;
}

}  // namespace

TEST_CASE("the overlap test errs no more than derived (proof.md, part 5)") {
  const auto two_boxes = [](Random& random) { return normals(random, 20); };
  report("5.2", worst_ratio(
                    two_boxes,
                    [](const Numbers& n) {
                      if (!is_box(n, 0) || !is_box(n, 10)) return -1.0;
                      const BoxLanes<float> a = box_at(n, 0);
                      BoxLanes<float> b = box_at(n, 10);
                      // Projections on x that just touch: B moves there, and then inwards by an ulp until they touch.
                      const auto shadow = [](const BoxLanes<float>& box) {
                        Real out = 0;
                        for (int k = 0; k < 3; ++k) out += std::fabs(Real{(&box.half.x)[k]} * Real{box.axis[k].x});
                        return out;
                      };
                      const Real most = shadow(a) + shadow(b);
                      b.center.x = static_cast<float>(Real{a.center.x} + most);
                      while (Real{b.center.x} - Real{a.center.x} > most)
                        b.center.x = std::nextafter(b.center.x, a.center.x);
                      const float away = b.center.x - a.center.x;
                      const float reached = kernel::world_half_extents(a).x + kernel::world_half_extents(b).x;
                      const Real size =
                          half_sum(oracle::convert<Real>(box_of(a))) + half_sum(oracle::convert<Real>(box_of(b)));
                      return (Real{away} - Real{reached}) / (kWorld * kU * size);
                    },
                    100, 3000));
  SlackNeeds worst;
  for (unsigned regime = 0; regime < oracle::kTouchRegimeCount; ++regime) {
    Random random(kSeed + regime);
    for (int i = 0; i < 40; ++i) {
      oracle::BoxPair best =
          oracle::near_touching_pair(random, static_cast<oracle::TouchRegime>(regime), random.uniform(-4, 1));
      SlackNeeds most = slack_needs(best);
      const bool aims_at_edge = i % 2 == 0;
      const auto aimed = [&](const SlackNeeds& needs) { return aims_at_edge ? needs.edge : needs.face; };
      if (!oracle::judge_overlap(best.a, best.b, oracle::exact_offset(best)).overlap) most = {};
      for (int step = 0; step < 400; ++step) {
        oracle::BoxPair next = best;
        for (unsigned change = 0; change <= random.index(3); ++change) {
          OracleBox<float>& box = random.chance(0.5) ? next.a : next.b;
          const unsigned which = random.index(5), c = random.index(3);
          float& number = which == 0 ? next.b.center[c] : which == 1 ? box.half[c] : box.axis[which - 2][c];
          for (unsigned ulps = random.index(8); ulps < 8; ++ulps)
            number = std::nextafter(number, random.chance(0.5) ? 1e30f : -1e30f);
          box.half[c] = std::fabs(box.half[c]);
        }
        if (!(oracle::frame_error(next.a) <= 1 && oracle::frame_error(next.b) <= 1)) continue;
        if (!oracle::judge_overlap(next.a, next.b, oracle::exact_offset(next)).overlap) continue;
        const SlackNeeds needs = slack_needs(next);
        REQUIRE_FALSE((std::isnan(needs.face) || std::isnan(needs.edge)));
        if (aimed(needs) < aimed(most)) continue;
        most = needs;
        best = next;
      }
      worst.face = larger_or_nan(worst.face, most.face);
      worst.edge = larger_or_nan(worst.edge, most.edge);
    }
  }
  report("5.3", worst.face);
  report("5.6", worst.edge);
}

}  // namespace cab::tests
