// Tests of the oracles themselves, against cases worked out by hand and against slower, simpler computations.
#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/merge_cab_double.h"
#include "perf/judge/oracle/merge_regimes.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/touching_pairs.h"

namespace {

using cab::oracle::BoxPair;
using cab::oracle::convert;
using cab::oracle::MergeBranch;
using cab::oracle::MergeCase;
using cab::oracle::MergeRegime;
using cab::oracle::MergeTolerances;
using cab::oracle::OracleBox;
using cab::oracle::OracleMerge;
using cab::oracle::OverlapVerdict;
using cab::oracle::Quad;
using cab::oracle::Random;
using cab::oracle::to_vec3;
using cab::oracle::TouchRegime;
using cab::oracle::Vec3;

// The tolerance of the merge in double; the worst measured error is 1e-15.
constexpr double kDoubleTolerance = 1e-14;

// A box with axes along the coordinate axes.
template <class T>
OracleBox<T> aligned_box(const Vec3<T>& center, const Vec3<T>& half) {
  return {{center[0], center[1], center[2]},
          {{T(1), T(0), T(0)}, {T(0), T(1), T(0)}, {T(0), T(0), T(1)}},
          {half[0], half[1], half[2]}};
}

// Rotates a box's frame about z by an angle in radians.
OracleBox<double> rotated_about_z(OracleBox<double> box, double angle) {
  store(Vec3<double>{{std::cos(angle), std::sin(angle), 0.0}}, box.axis[0]);
  store(Vec3<double>{{-std::sin(angle), std::cos(angle), 0.0}}, box.axis[1]);
  return box;
}

// Whether two vectors are equal up to rounding in double.
bool near(const Vec3<double>& a, const Vec3<double>& b) { return norm_max(a - b) <= kDoubleTolerance; }

// A float box in a random frame with halves in [0.1, 1) and a centre within a few units of the origin.
OracleBox<float> random_box(Random& random) {
  OracleBox<float> box{};
  double axis[3][3];
  random.rotation(axis);
  set_frame(axis, box);
  for (float& half : box.half) half = static_cast<float>(random.uniform(0.1, 1.0));
  for (float& c : box.center) c = static_cast<float>(random.uniform(-1.2, 1.2));
  return box;
}

// The point of a box nearest to a point, for orthonormal axes.
Vec3<double> nearest_point(const OracleBox<double>& box, const Vec3<double>& point) {
  Vec3<double> nearest = center_of(box);
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = dot(point - center_of(box), axis_of(box, k));
    nearest = nearest + std::fmax(-box.half[k], std::fmin(x, box.half[k])) * axis_of(box, k);
  }
  return nearest;
}

// The distance of two boxes by projecting a point to and fro between them. In the limit it is 0 if they overlap.
double distance_by_projections(const OracleBox<double>& a, const OracleBox<double>& b) {
  Vec3<double> on_a = center_of(a);
  Vec3<double> on_b = center_of(b);
  for (int i = 0; i < 2000; ++i) {
    on_b = nearest_point(b, on_a);
    on_a = nearest_point(a, on_b);
  }
  return norm(on_a - on_b);
}

// Coordinate k of the child's worst corner in the parent's axes, by elimination in long double.
double worst_excess_by_elimination(const OracleBox<float>& parent, const OracleBox<float>& child) {
  using Wide = long double;
  const OracleBox<Wide> outer = convert<Wide>(parent);
  const OracleBox<Wide> inner = convert<Wide>(child);
  Wide worst = -std::numeric_limits<Wide>::infinity();
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3<Wide> right = corner(inner, i) - center_of(outer);
    Wide m[3][4];
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k) m[row][k] = outer.axis[k][row];
      m[row][3] = right[row];
    }
    for (std::size_t p = 0; p < 3; ++p) {
      std::size_t best = p;
      for (std::size_t row = p + 1; row < 3; ++row) {
        if (std::fabs(m[row][p]) > std::fabs(m[best][p])) best = row;
      }
      std::swap(m[p], m[best]);
      for (std::size_t row = 0; row < 3; ++row) {
        if (row == p) continue;
        const Wide factor = m[row][p] / m[p][p];
        for (std::size_t c = p; c < 4; ++c) m[row][c] -= factor * m[p][c];
      }
    }
    for (std::size_t k = 0; k < 3; ++k) { worst = std::fmax(worst, std::fabs(m[k][3] / m[k][k]) - outer.half[k]); }
  }
  return static_cast<double>(worst);
}

// Two equal links of half length 1 along +x and +y from a joint at the origin.
struct Elbow {
  OracleBox<double> child1 = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  OracleBox<double> child2 = aligned_box<double>({{0.0, 1.0, 0.0}}, {{0.1, 1.0, 0.1}});
  double joint[3] = {0.0, 0.0, 0.0};
};

}  // namespace

TEST_CASE("the random numbers are those of splitmix64") {
  Random random(0);
  CHECK(random.next_u64() == 0xE220A8397B1DCDAFu);
  CHECK(random.next_u64() == 0x6E789E6AA1B965F4u);
  CHECK(random.next_u64() == 0x06C45D188009454Fu);
}

TEST_CASE("random rotations are orthonormal and right-handed") {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    OracleBox<double> box{};
    random.rotation(box.axis);
    REQUIRE(orthonormality_error(box) < kDoubleTolerance);
    REQUIRE(near(cross(axis_of(box, 0), axis_of(box, 1)), axis_of(box, 2)));
  }
}

TEST_CASE("a drifting frame is off orthonormal, but by no more than the kernels' frames") {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    OracleBox<float> box = random_box(random);
    REQUIRE(orthonormality_error(box) < 4 * cab::oracle::kFloatRoundoff);
    drift_frame(random, box);
    REQUIRE(cab::oracle::frame_error(box) >= 0.25);
    REQUIRE(cab::oracle::frame_error(box) <= 1);
    REQUIRE(orthonormality_error(box) <= cab::oracle::kOrthonormalityLimit);
  }
}

TEST_CASE("corner bit k chooses the side of axis k") {
  const auto box = aligned_box<float>({{1.0f, 2.0f, 3.0f}}, {{0.5f, 0.25f, 0.125f}});
  const Vec3<float> lowest = corner(box, 0);
  const Vec3<float> first = corner(box, 1);
  CHECK(lowest[0] == 0.5f);
  CHECK(lowest[1] == 1.75f);
  CHECK(lowest[2] == 2.875f);
  CHECK(first[0] == 1.5f);
  CHECK(first[1] == 1.75f);
  CHECK(first[2] == 2.875f);
}

TEST_CASE("a box contains itself, and no longer when one half extent is an ulp shorter") {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const OracleBox<float> child = random_box(random);
    CHECK(judge_containment(child, child).inside);
    for (std::size_t k = 0; k < 3; ++k) {
      OracleBox<float> parent = child;
      parent.half[k] = std::nextafter(parent.half[k], 0.0f);
      const auto verdict = judge_containment(parent, child);
      REQUIRE_FALSE(verdict.inside);
      REQUIRE(verdict.excess > 0.0);
    }
  }
}

TEST_CASE("a child that sticks out by 2^-60 of its size is outside") {
  const auto parent = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 1.0f}});
  const auto child = aligned_box<float>({{0.0f, 0x1p-60f, 0.0f}}, {{1.0f, 1.0f, 1.0f}});
  CHECK_FALSE(judge_containment(parent, child).inside);
  CHECK(judge_containment(parent, child).excess == 0x1p-60);
}

TEST_CASE("the excess of a containment is the length that sticks out, in the unit and in ulps") {
  const auto parent = aligned_box<float>({{4.0f, 0.0f, 0.0f}}, {{1.0f, 2.0f, 1.0f}});
  const auto child = aligned_box<float>({{4.5f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 0.5f}});
  const auto verdict = judge_containment(parent, child);
  CHECK_FALSE(verdict.inside);
  CHECK(verdict.excess == 0.5);
  CHECK(verdict.excess_ulps == 0.5 / (cab::oracle::kFloatRoundoff * 8.0));
  const auto small = aligned_box<float>({{4.25f, 0.0f, 0.0f}}, {{0.25f, 1.0f, 0.5f}});
  CHECK(judge_containment(parent, small).excess == -0.5);
}

TEST_CASE("containment over skewed axes uses the parent's own coordinates") {
  // Axes (1, 0, 0), (0.5, 1, 0), (0, 0, 1): A_0 + A_1 is (1.5, 1, 0), though its projection on A_0 is 1.5.
  auto parent = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 0.0f}});
  parent.axis[1][0] = 0.5f;
  const auto in = aligned_box<float>({{1.5f, 1.0f, 0.0f}}, {{0.0f, 0.0f, 0.0f}});
  const auto out = aligned_box<float>({{1.0f, -1.0f, 0.0f}}, {{0.0f, 0.0f, 0.0f}});
  CHECK(judge_containment(parent, in).inside);
  CHECK_FALSE(judge_containment(parent, out).inside);
  CHECK(judge_containment(parent, out).excess == 0.5);
}

TEST_CASE("the containment judge agrees with elimination on each of the eight corners") {
  Random random(4);
  for (int i = 0; i < 500; ++i) {
    const OracleBox<float> parent = random_box(random);
    const OracleBox<float> child = random_box(random);
    const double slow = worst_excess_by_elimination(parent, child);
    const auto verdict = judge_containment_exactly(parent, convert<Quad>(child));
    REQUIRE(verdict.excess == doctest::Approx(slow).epsilon(1e-12));
    REQUIRE(verdict.inside == (slow <= 0.0));
    REQUIRE(judge_containment(parent, child).inside == verdict.inside);
  }
}

TEST_CASE("a box with a NaN, an infinity or a negative half is never inside and holds nothing") {
  const auto good = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 1.0f}});
  auto poisoned = good;
  poisoned.axis[2][0] = std::numeric_limits<float>::quiet_NaN();
  auto endless = good;
  endless.half[1] = std::numeric_limits<float>::infinity();
  auto negative = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{0.5f, 0.5f, -0.5f}});
  auto flat_axes = good;
  flat_axes.axis[2][2] = 0.0f;
  CHECK_FALSE(judge_containment(good, poisoned).inside);
  CHECK_FALSE(judge_containment(poisoned, good).inside);
  CHECK_FALSE(judge_containment(endless, good).inside);
  CHECK_FALSE(judge_containment(good, negative).inside);
  CHECK_FALSE(judge_containment(flat_axes, good).inside);
}

TEST_CASE("two perpendicular equal links merge along the line between their ends") {
  const Elbow elbow;
  const OracleMerge merge = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  const double r = std::sqrt(0.5);
  CHECK(merge.branch == MergeBranch::kEndpoint);
  CHECK(merge.sine == doctest::Approx(1.0));
  CHECK(near(axis_of(merge.box, 0), {{r, -r, 0.0}}));
  CHECK(near(axis_of(merge.box, 1), {{0.0, 0.0, 1.0}}));
  CHECK(near(axis_of(merge.box, 2), {{-r, -r, 0.0}}));
  CHECK(near(to_vec3(merge.box.half), {{2.1 * r, 0.1, 1.1 * r}}));
  CHECK(near(center_of(merge.box), {{0.5, 0.5, 0.0}}));
}

TEST_CASE("stored signs do not matter where the joint tells which way is out") {
  Elbow elbow;
  const OracleMerge before = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  for (std::size_t k = 0; k < 3; ++k) store(-1.0 * axis_of(elbow.child1, k), elbow.child1.axis[k]);
  const OracleMerge after = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  for (std::size_t k = 0; k < 3; ++k) CHECK(near(axis_of(after.box, k), axis_of(before.box, k)));
}

TEST_CASE("an axis square to the way to the joint keeps its stored sign") {
  Elbow elbow;
  store(Vec3<double>{{1.0, 1.0, 0.0}}, elbow.child2.center);
  elbow.joint[0] = 0.5;
  elbow.joint[1] = 1.0;
  const double r = std::sqrt(0.5);
  const OracleMerge stored = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  CHECK(stored.margins.sign2 == 0.0);
  CHECK(near(axis_of(stored.box, 0), {{r, -r, 0.0}}));
  store(Vec3<double>{{0.0, -1.0, 0.0}}, elbow.child2.axis[1]);
  const OracleMerge mirrored = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  CHECK(near(axis_of(mirrored.box, 0), {{r, r, 0.0}}));
}

TEST_CASE("without a joint the axes point away from the other child's centre") {
  const Elbow elbow;
  const OracleMerge merge = merge_cab(elbow.child1, elbow.child2, nullptr);
  const double r = std::sqrt(0.5);
  CHECK(near(axis_of(merge.box, 0), {{r, -r, 0.0}}));
  OracleBox<double> left = elbow.child1;
  left.center[0] = -1.0;
  CHECK(near(axis_of(merge_cab(left, elbow.child2, nullptr).box, 0), {{-r, -r, 0.0}}));
  OracleBox<double> upside_down = elbow.child2;
  store(Vec3<double>{{0.0, -1.0, 0.0}}, upside_down.axis[1]);
  CHECK(near(axis_of(merge_cab(elbow.child1, upside_down, nullptr).box, 0), {{r, -r, 0.0}}));
}

TEST_CASE("links folded to 60 degrees take the axis of the longer one") {
  const double third = std::acos(0.5);
  const auto longer = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  auto shorter = aligned_box<double>({{0.25, std::sqrt(0.1875), 0.0}}, {{0.5, 0.1, 0.1}});
  shorter = rotated_about_z(shorter, third);
  const double joint[3] = {0.0, 0.0, 0.0};
  const OracleMerge merge = merge_cab(longer, shorter, joint);
  CHECK(merge.branch == MergeBranch::kChild1Axis);
  CHECK(near(axis_of(merge.box, 0), {{1.0, 0.0, 0.0}}));
  CHECK(near(axis_of(merge.box, 1), {{0.0, 0.0, 1.0}}));
  CHECK(near(axis_of(merge.box, 2), {{0.0, -1.0, 0.0}}));
  CHECK(merge.margins.main_axis == doctest::Approx(1.0 - std::sqrt(0.75)));
  CHECK(merge_cab(shorter, longer, joint).branch == MergeBranch::kChild2Axis);
}

TEST_CASE("ties of the longest axis go to the lowest index") {
  const auto cube1 = aligned_box<double>({{1.0, 1.0, 0.0}}, {{1.0, 1.0, 0.5}});
  auto cube2 = aligned_box<double>({{1.0, -1.0, 0.0}}, {{0.9, 0.9, 0.45}});
  cube2 = rotated_about_z(cube2, 0.3);
  const double joint[3] = {0.0, 0.0, 0.0};
  // Second axes would give a parent along y.
  const OracleMerge merge = merge_cab(cube1, cube2, joint);
  CHECK(merge.branch == MergeBranch::kChild1Axis);
  CHECK(near(axis_of(merge.box, 0), {{1.0, 0.0, 0.0}}));
  CHECK(near(axis_of(merge.box, 1), {{0.0, 0.0, 1.0}}));
  CHECK(merge.margins.longest1 == 0.0);
}

TEST_CASE("ties of the main axis go to the line between the ends, then to child 1") {
  // Axes of length sqrt 2 and sqrt 5, so that the ties are exact.
  auto link1 = aligned_box<double>({{1.0, 1.0, 0.0}}, {{1.0, 0.1, 0.1}});
  auto link2 = aligned_box<double>({{0.0, 1.0, 1.0}}, {{1.0, 0.1, 0.1}});
  const double joint[3] = {0.0, 0.0, 0.0};
  store(center_of(link1), link1.axis[0]);
  store(center_of(link2), link2.axis[0]);
  CHECK(merge_cab(link1, link2, joint).branch == MergeBranch::kEndpoint);
  CHECK(merge_cab(link1, link2, joint).margins.main_axis == 0.0);
  store(Vec3<double>{{2.0, 1.0, 0.0}}, link1.axis[0]);
  store(Vec3<double>{{1.0, 2.0, 0.0}}, link2.axis[0]);
  CHECK(merge_cab(link1, link2, joint).branch == MergeBranch::kChild1Axis);
  CHECK(merge_cab(link2, link1, joint).branch == MergeBranch::kChild1Axis);
}

TEST_CASE("a straight limb falls back to the child with the larger second extent") {
  const auto thin = aligned_box<double>({{-1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  const auto thick = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.2, 0.3}});
  const double joint[3] = {0.0, 0.0, 0.0};
  const OracleMerge merge = merge_cab(thin, thick, joint);
  CHECK(merge.branch == MergeBranch::kFallbackChild2);
  CHECK(near(to_vec3(merge.box.half), {{2.0, 0.2, 0.3}}));
  CHECK(near(center_of(merge.box), {{0.0, 0.0, 0.0}}));
  for (std::size_t k = 0; k < 3; ++k) CHECK(near(axis_of(merge.box, k), axis_of(thick, k)));
  CHECK(merge_cab(thick, thin, joint).branch == MergeBranch::kFallbackChild1);
}

TEST_CASE("equal second extents fall back to the longer child, equal children to the first") {
  const auto shorter = aligned_box<double>({{-1.0, 0.0, 0.0}}, {{1.0, 0.2, 0.1}});
  const auto longer = aligned_box<double>({{2.0, 0.0, 0.0}}, {{2.0, 0.2, 0.1}});
  const double joint[3] = {0.0, 0.0, 0.0};
  CHECK(merge_cab(shorter, longer, joint).branch == MergeBranch::kFallbackChild2);
  CHECK(merge_cab(longer, shorter, joint).branch == MergeBranch::kFallbackChild1);
  CHECK(merge_cab(shorter, shorter, joint).branch == MergeBranch::kFallbackChild1);
}

TEST_CASE("the parallel test is two-sided and stands at a dot product of 1 - 1e-5") {
  const auto link = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  const double joint[3] = {0.0, 0.0, 0.0};
  const double limit = std::asin(std::sqrt(2e-5));
  for (const double side : {0.0, std::acos(-1.0)}) {
    const auto other = aligned_box<double>({{std::cos(side), 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
    const auto within = merge_cab(link, rotated_about_z(other, side + 0.999 * limit), joint);
    const auto beyond = merge_cab(link, rotated_about_z(other, side + 1.001 * limit), joint);
    CHECK(within.branch == MergeBranch::kFallbackChild1);
    CHECK(beyond.branch != MergeBranch::kFallbackChild1);
    CHECK(beyond.margins.parallel == doctest::Approx(2e-8).epsilon(0.01));
  }
}

TEST_CASE("a point merges in the other child's frame, and two points along the first's axes") {
  auto link = aligned_box<double>({{0.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  link = rotated_about_z(link, 0.5);
  const auto point = aligned_box<double>({{0.0, 0.0, 2.0}}, {{0.0, 0.0, 0.0}});
  const auto origin = aligned_box<double>({{0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}});
  const OracleMerge merge = merge_cab(point, link, nullptr);
  CHECK(merge.branch == MergeBranch::kFallbackChild2);
  CHECK(near(axis_of(merge.box, 0), axis_of(link, 0)));
  CHECK(near(to_vec3(merge.box.half), {{1.0, 0.1, 1.05}}));
  const OracleMerge points = merge_cab(origin, point, nullptr);
  CHECK(points.branch == MergeBranch::kFallbackChild1);
  CHECK(near(to_vec3(points.box.half), {{0.0, 0.0, 1.0}}));
  CHECK(near(center_of(points.box), {{0.0, 0.0, 1.0}}));
}

TEST_CASE("clear decisions leave one candidate, and a close one adds its other branch") {
  Elbow elbow;
  CHECK(merge_cab_candidates(elbow.child1, elbow.child2, elbow.joint).size() == 1);
  elbow.child1.half[1] = 1.0 - 5e-6;
  const auto candidates = merge_cab_candidates(elbow.child1, elbow.child2, elbow.joint);
  // Child 1's second axis has no clear sign either, and is parallel to child 2's: the two signs fall back alike.
  REQUIRE(candidates.size() == 3);
  CHECK(candidates[0].branch == MergeBranch::kEndpoint);
  CHECK(candidates[1].branch == MergeBranch::kFallbackChild1);
  CHECK(candidates[0].margins.longest1 == doctest::Approx(5e-6));
  elbow.child1.half[1] = 1.0 - 2e-5;
  CHECK(merge_cab_candidates(elbow.child1, elbow.child2, elbow.joint).size() == 1);
}

TEST_CASE("a merge near the parallel limit may go either way") {
  const auto link = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.2}});
  const double joint[3] = {0.0, 0.0, 0.0};
  const double angle = std::asin(std::sqrt(2.1e-5));
  auto other = aligned_box<double>({{-1.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}});
  other = rotated_about_z(other, angle);
  const auto candidates = merge_cab_candidates(link, other, joint);
  REQUIRE(candidates.size() == 2);
  CHECK(candidates[0].branch == MergeBranch::kEndpoint);
  CHECK(candidates[1].branch == MergeBranch::kFallbackChild1);
}

TEST_CASE("a straight limb of nearly equal links may copy the frame of either") {
  const auto link1 = aligned_box<double>({{-1.0, 0.0, 0.0}}, {{1.0, 0.2, 0.1}});
  const auto link2 = aligned_box<double>({{1.0, 0.0, 0.0}}, {{1.0, 0.200001, 0.1}});
  const auto candidates = merge_cab_candidates(link1, link2, nullptr);
  REQUIRE(candidates.size() == 2);
  CHECK(candidates[0].branch == MergeBranch::kFallbackChild2);
  CHECK(candidates[1].branch == MergeBranch::kFallbackChild1);
}

TEST_CASE("a merge is recognised with its padding on, and not when anything in it is off") {
  const Elbow elbow;
  const OracleMerge merge = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  const MergeTolerances tolerances = merge_tolerances(merge);
  const OracleBox<double> good = convert<double>(padded_to_float(merge.box));
  std::string why;
  CHECK(same_box(merge.box, good, tolerances, &why));
  OracleBox<double> flipped = good;
  store(-1.0 * axis_of(good, 2), flipped.axis[2]);
  CHECK_FALSE(same_box(merge.box, flipped, tolerances, &why));
  CHECK(why.find("axis 2") != std::string::npos);
  OracleBox<double> longer = good;
  longer.half[1] += 1e-5 * half_sum(merge.box);
  CHECK_FALSE(same_box(merge.box, longer, tolerances, &why));
  CHECK(why.find("half extent 1") != std::string::npos);
  OracleBox<double> moved = good;
  moved.center[0] -= 1e-5 * half_sum(merge.box);
  CHECK_FALSE(same_box(merge.box, moved, tolerances, &why));
  CHECK(why.find("centre coordinate 0") != std::string::npos);
  OracleBox<double> poisoned = good;
  poisoned.half[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(same_box(merge.box, poisoned, tolerances, nullptr));
}

TEST_CASE("tolerances tighter than the padding tell whether it was added") {
  const Elbow elbow;
  const OracleMerge merge = merge_cab(elbow.child1, elbow.child2, elbow.joint);
  const MergeTolerances tight = {1e-6, 3e-6, cab::oracle::kFloatRoundoff};
  CHECK(same_box(merge.box, convert<double>(padded_to_float(merge.box)), tight, nullptr));
  CHECK_FALSE(same_box(merge.box, merge.box, tight, nullptr));
}

TEST_CASE("the padding is 2^-18 S + 2^-23 M + 4 FLT_MIN") {
  const auto box = aligned_box<double>({{-8.0, 2.0, 0.0}}, {{1.0, 2.0, 1.0}});
  CHECK(cab::oracle::merge_padding(box) == 0x1p-16 + 0x1p-20 + 4.0 * static_cast<double>(FLT_MIN));
}

TEST_CASE("in every regime the oracle's padded merge holds its children and passes as itself") {
  for (unsigned regime = 0; regime < cab::oracle::kMergeRegimeCount; ++regime) {
    CAPTURE(regime);
    Random random(100 + regime);
    for (int i = 0; i < 1000; ++i) {
      const MergeCase merge_case = make_merge_case(random, static_cast<MergeRegime>(regime));
      const auto candidates = merge_cab_candidates(merge_case);
      const OracleBox<float> parent = padded_to_float(candidates.front().box);
      REQUIRE(orthonormality_error(merge_case.child1) <= cab::oracle::kOrthonormalityLimit);
      REQUIRE(orthonormality_error(merge_case.child2) <= cab::oracle::kOrthonormalityLimit);
      REQUIRE(orthonormality_error(candidates.front().box) < kDoubleTolerance);
      REQUIRE(judge_containment(parent, merge_case.child1).inside);
      REQUIRE(judge_containment(parent, merge_case.child2).inside);
      std::string why;
      REQUIRE_MESSAGE(matches_any(candidates, convert<double>(parent), &why), why);
    }
  }
}

TEST_CASE("the regimes reach every branch, with and without a joint") {
  Random random(5);
  int seen[5] = {};
  int with_joint = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto regime = static_cast<MergeRegime>(random.index(cab::oracle::kMergeRegimeCount));
    const MergeCase merge_case = make_merge_case(random, regime);
    ++seen[static_cast<int>(merge_cab_candidates(merge_case).front().branch)];
    if (merge_case.has_joint) ++with_joint;
  }
  for (const int count : seen) CHECK(count > 50);
  CHECK(with_joint > 1400);
  CHECK(with_joint < 1800);
}

TEST_CASE("cubes that touch overlap, and an ulp apart they do not") {
  const auto cube = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 1.0f}});
  auto other = aligned_box<float>({{2.0f, 0.5f, 0.0f}}, {{1.0f, 1.0f, 1.0f}});
  const OverlapVerdict touching = judge_overlap(cube, other);
  CHECK(touching.overlap);
  CHECK(touching.gap == 0.0);
  other.center[0] = std::nextafter(2.0f, 3.0f);
  const OverlapVerdict apart = judge_overlap(cube, other);
  CHECK_FALSE(apart.overlap);
  CHECK(apart.axis == 0);
  CHECK(apart.gap == 0x1p-22);
  CHECK(apart.gap_relative == 0x1p-22 / 6.0);
  other.center[0] = 1.5f;
  CHECK(judge_overlap(cube, other).gap == -0.5);
}

TEST_CASE("the given offset counts, not the centres, down to what only Quad can tell") {
  const auto cube = aligned_box<float>({{5.0f, 5.0f, 5.0f}}, {{1.0f, 1.0f, 1.0f}});
  const Vec3<Quad> touching{{Quad(2), Quad(0), Quad(0)}};
  const Vec3<Quad> apart{{Quad(2) + Quad(0x1p-80), Quad(0), Quad(0)}};
  CHECK(judge_overlap(cube, cube, touching).overlap);
  CHECK_FALSE(judge_overlap(cube, cube, apart).overlap);
}

TEST_CASE("segments, plates and points overlap where they should") {
  const auto plate = aligned_box<float>({{0.0f, 0.0f, 0.0f}}, {{1.0f, 1.0f, 0.0f}});
  const auto across = aligned_box<float>({{0.5f, 0.5f, 1.0f}}, {{0.0f, 0.0f, 1.0f}});
  const auto above = aligned_box<float>({{0.5f, 0.5f, 1.125f}}, {{0.0f, 0.0f, 1.0f}});
  const auto beside = aligned_box<float>({{1.5f, 0.0f, 0.0f}}, {{0.25f, 0.25f, 0.0f}});
  const auto point = aligned_box<float>({{1.0f, -1.0f, 0.0f}}, {{0.0f, 0.0f, 0.0f}});
  const auto elsewhere = aligned_box<float>({{1.0f, -1.0f, 0.5f}}, {{0.0f, 0.0f, 0.0f}});
  CHECK(judge_overlap(plate, across).overlap);
  CHECK_FALSE(judge_overlap(plate, above).overlap);
  CHECK_FALSE(judge_overlap(plate, beside).overlap);
  CHECK(judge_overlap(plate, point).overlap);
  CHECK(judge_overlap(point, point).overlap);
  CHECK_FALSE(judge_overlap(point, elsewhere).overlap);
  CHECK(std::isinf(judge_overlap(point, elsewhere).gap_relative));
}

TEST_CASE("each of the 15 axes has a pose that it alone separates") {
  for (std::size_t k = 0; k < cab::oracle::kSeparatingAxisCount; ++k) {
    CAPTURE(k);
    const BoxPair pose = cab::oracle::separating_axis_pose(k);
    const OracleBox<double> a = convert<double>(pose.a);
    const OracleBox<double> b = convert<double>(pose.b);
    const Vec3<double> offset = convert<double>(exact_offset(pose));
    const auto separating = separating_axes(a, b, offset);
    CHECK(separating.count() == 1);
    CHECK(separating[k]);
    const double size = half_sum(a) + half_sum(b);
    const auto gaps = axis_gaps(a, b, offset);
    CHECK(gaps[k] > 0.01 * size);
    CHECK(gaps[k] < 0.05 * size);
    for (std::size_t other = 0; other < cab::oracle::kSeparatingAxisCount; ++other) {
      if (other != k) CHECK(gaps[other] < -0.05 * size);
    }
    const OverlapVerdict verdict = judge_overlap(pose.a, pose.b);
    CHECK_FALSE(verdict.overlap);
    CHECK(verdict.axis == k);
    CHECK(orthonormality_error(pose.a) < 4 * cab::oracle::kFloatRoundoff);
    CHECK(orthonormality_error(pose.b) < 4 * cab::oracle::kFloatRoundoff);
  }
}

TEST_CASE("the overlap judge agrees with projecting to and fro between the boxes") {
  Random random(6);
  int overlapping = 0;
  for (int i = 0; i < 150; ++i) {
    const OracleBox<float> a = random_box(random);
    const OracleBox<float> b = random_box(random);
    const OverlapVerdict verdict = judge_overlap(a, b);
    if (std::fabs(verdict.gap_relative) < 0.01) continue;
    const double distance = distance_by_projections(convert<double>(a), convert<double>(b));
    REQUIRE(verdict.overlap == (verdict.gap < 0.0));
    REQUIRE(verdict.overlap == (distance < 1e-6));
    if (!verdict.overlap) REQUIRE(verdict.gap <= distance + 1e-6);
    if (verdict.overlap) ++overlapping;
  }
  CHECK(overlapping > 30);
  CHECK(overlapping < 120);
}

TEST_CASE("swapping the boxes swaps nothing but the axis") {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    const BoxPair pair = near_touching_pair(random, TouchRegime::kOrdinary, 0.0);
    const OverlapVerdict one = judge_overlap(pair.a, pair.b);
    const OverlapVerdict other = judge_overlap(pair.b, pair.a);
    REQUIRE(one.overlap == other.overlap);
    REQUIRE(one.gap == doctest::Approx(other.gap).epsilon(1e-9));
  }
}

TEST_CASE("the filtered overlap judge says what the one in Quad says, touching exactly included") {
  for (unsigned regime = 0; regime < cab::oracle::kTouchRegimeCount; ++regime) {
    CAPTURE(regime);
    Random random(250 + regime);
    for (int i = 0; i < 1500; ++i) {
      // Most gaps are too small for floats, and some too small for doubles.
      BoxPair pair = near_touching_pair(random, static_cast<TouchRegime>(regime), random.uniform(-1.0, 1.0));
      Vec3<Quad> offset = exact_offset(pair);
      if (i % 3 == 0) {  // B moved along the direction of its gap until they touch to about 2^-50
        const OverlapVerdict verdict = judge_overlap(pair.a, pair.b, offset);
        const double length = norm(convert<double>(offset));
        if (length > 0.0 && std::isfinite(verdict.gap_relative))
          offset = Quad(1.0 - verdict.gap / length * random.uniform(0.0, 2.0)) * offset;
      }
      REQUIRE(judge_overlap_filtered(pair.a, pair.b, offset) == judge_overlap(pair.a, pair.b, offset).overlap);
    }
  }
}

TEST_CASE("the filtered overlap judge is right where only Quad can tell, and for axes beyond its bound") {
  const OracleBox<float> cube = aligned_box<float>({{0, 0, 0}}, {{1, 1, 1}});
  for (const double nudge : {0.0, 0x1p-60, -0x1p-60, 0x1p-44, -0x1p-44, 0x1p-40, -0x1p-40}) {
    CAPTURE(nudge);
    Vec3<Quad> offset{{Quad(2), 0, 0}};
    offset[0] += Quad(nudge);
    CHECK(judge_overlap_filtered(cube, cube, offset) == (nudge <= 0.0));
  }
  OracleBox<float> skewed = cube;
  skewed.axis[0][1] = 1.75f;
  const Vec3<Quad> corner{{Quad(2), Quad(2), 0}};
  CHECK(judge_overlap_filtered(skewed, cube, corner) == judge_overlap(skewed, cube, corner).overlap);
}

TEST_CASE("a child in long double is judged as the same child in Quad is") {
  Random random(45);
  int outside = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto one = cab::oracle::make_merge_case(random, cab::oracle::MergeRegime::kLimbs);
    auto child = convert<long double>(one.child1);
    auto parent = one.child1;
    // Contained or not by about the resolution of float, double or long double, or exactly.
    const double by = random.sign() * random.log_uniform(1e-19, 1e-6);
    if (i % 4 != 0) child.half[i % 3] *= 1.0L + static_cast<long double>(by);
    const auto expected = judge_containment_exactly(parent, convert<Quad>(child));
    const auto got = cab::oracle::judge_containment(parent, child);
    REQUIRE(got.inside == expected.inside);
    if (!got.inside) ++outside;
  }
  CHECK(outside > 500);
  CHECK(outside < 1500);
}

TEST_CASE("near-touching pairs have the gap asked for to a few ulps, and both verdicts") {
  for (unsigned regime = 0; regime < cab::oracle::kTouchRegimeCount; ++regime) {
    CAPTURE(regime);
    Random random(200 + regime);
    int overlapping = 0;
    int near_wanted = 0;
    for (int i = 0; i < 400; ++i) {
      const BoxPair pair = near_touching_pair(random, static_cast<TouchRegime>(regime), 0.0);
      const OverlapVerdict verdict = judge_overlap(pair.a, pair.b, exact_offset(pair));
      REQUIRE(orthonormality_error(pair.a) <= cab::oracle::kOrthonormalityLimit);
      REQUIRE(orthonormality_error(pair.b) <= cab::oracle::kOrthonormalityLimit);
      if (verdict.overlap) ++overlapping;
      if (std::fabs(verdict.gap_relative) < 8 * cab::oracle::kFloatRoundoff) ++near_wanted;
    }
    CHECK(overlapping > 100);
    CHECK(overlapping < 300);
    CHECK(near_wanted >= 399);
  }
}

TEST_CASE("near-touching pairs asked to overlap by two ulps do") {
  for (unsigned regime = 0; regime < cab::oracle::kTouchRegimeCount; ++regime) {
    CAPTURE(regime);
    Random random(300 + regime);
    for (int i = 0; i < 300; ++i) {
      const BoxPair pair = near_touching_pair(random, static_cast<TouchRegime>(regime), -2.0);
      REQUIRE(judge_overlap(pair.a, pair.b, exact_offset(pair)).overlap);
    }
  }
}
