// The measure of `cab continuity`: the distance of two boxes is right, known jumps are found, and no jump is found
// where the derivation excludes jumps. Numbers are the same on every instruction set.
#include "perf/continuity/sweep.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace cab::tests {
namespace {

using namespace cab::perf;

constexpr Box kUnit = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

const SweepCase& figure(const std::vector<SweepCase>& all, const char* name) {
  return *std::find_if(all.begin(), all.end(), [&](const SweepCase& one) { return one.name == name; });
}

Continuity measured(const char* name, Refit refit, std::uint32_t steps) {
  return measure_continuity(figure(sweep_cases(), name), {{refit}}, steps, Isa::kAuto)[0];
}

std::vector<Policies> all_refits() {
  std::vector<Policies> out;
  for (std::uint32_t refit = 0; refit < policy_table()[0].value_count; ++refit)
    for (const Extents extents : {Extents::kChildren, Extents::kLeaves})
      out.push_back({static_cast<Refit>(refit), {}, {}, extents});
  return out;
}

auto numbers_of(const Continuity& c) {
  return std::make_tuple(c.jump, c.jump_motion, c.closer_jump, c.closer_motion, c.ratio, c.volume_change, c.area_change,
                         c.steps_above);
}

}  // namespace

TEST_CASE("the distance of boxes is that of the sets, in either order") {
  Box other = kUnit;
  CHECK(box_change(kUnit, other) == 0);
  other.center[0] = 0.25f;
  CHECK(box_change(kUnit, other) == 0.25);
  other.center[1] = 3;
  CHECK(box_change(kUnit, other) == std::hypot(0.25, 3.0));
  Box renamed = kUnit;  // the same cube with its axes in another order and of other signs
  renamed.axis[0][0] = renamed.axis[1][1] = 0;
  renamed.axis[0][1] = 1;
  renamed.axis[1][0] = -1;
  CHECK(box_change(kUnit, renamed) == 0);
  Box inside = kUnit;  // only the corners of the outer box are outside the other
  for (float& half : inside.half) half = 0.5f;
  CHECK(box_change(kUnit, inside) == std::sqrt(0.75));
  CHECK(box_change(inside, kUnit) == std::sqrt(0.75));
}

// lo and hi of an axis-aligned box are minima and maxima of corner coordinates, each of which moves by no more than its
// corner; three of them at once move a corner of the box by at most sqrt(3) times that. Rounding adds some ulps per
// step, below a hundredth of the motion in steps as large as these. Measured: at most 1.13.
TEST_CASE("axis-aligned boxes move no more than sqrt(3) times as far as the farthest leaf corner") {
  for (const SweepCase& one : sweep_cases()) {
    CAPTURE(one.name);
    for (const Refit refit : {Refit::kAabbHull, Refit::kAabbVertices}) {
      const Continuity seen = measure_continuity(one, {{refit}}, 200, Isa::kAuto)[0];
      CHECK(seen.ratio <= 1.01 * std::sqrt(3.0));
      CHECK(seen.ratio > 0.5);
    }
  }
}

TEST_CASE("limbs folded through 60 degrees: cab jumps by a third of a box however little they move, cab_sum does not") {
  const Continuity cab = measured("sixty", Refit::kCab, 2000);
  CHECK(cab.jump > 0.3);
  CHECK(cab.closer_jump > 0.3);
  CHECK(cab.closer_motion < cab.jump_motion / 16);
  CHECK(cab.closer_motion < 1e-5);
  CHECK(cab.ratio > 1000);
  const Continuity sum = measured("sixty", Refit::kCabSum, 2000);
  CHECK(sum.steps_above == 0);
  CHECK(sum.closer_jump < 2 * sum.closer_motion);
  CHECK(sum.ratio < 2);
}

TEST_CASE("a joint through the mid-plane of a child: one jump of cab, none of the refits that do not look at joints") {
  CHECK(measured("mid-plane", Refit::kCab, 2000).steps_above == 1);
  CHECK(measured("mid-plane", Refit::kCabSum, 2000).steps_above == 1);
  for (const Refit refit : {Refit::kCovariance, Refit::kAabbHull, Refit::kAabbVertices}) {
    CAPTURE(static_cast<int>(refit));
    const Continuity seen = measured("mid-plane", refit, 2000);
    CHECK(seen.steps_above == 0);
    CHECK(seen.closer_jump < seen.jump / 8);
  }
}

TEST_CASE("every number is the same on every instruction set") {
  for (const SweepCase& one : sweep_cases()) {
    CAPTURE(one.name);
    const std::vector<Continuity> expected = measure_continuity(one, all_refits(), 300, Isa::kScalar);
    for (std::uint8_t i = 0; i < kIsaCount; ++i) {
      const Isa isa = static_cast<Isa>(i);
      if (!isa_available(isa)) continue;
      CAPTURE(to_string(isa));
      const std::vector<Continuity> got = measure_continuity(one, all_refits(), 300, isa);
      REQUIRE(got.size() == expected.size());
      for (std::size_t p = 0; p < got.size(); ++p) CHECK(numbers_of(got[p]) == numbers_of(expected[p]));
    }
  }
}

}  // namespace cab::tests
