// The false positives that padding and slack add are counted, kept apart, and limited by gates.
#include "perf/measure/paper/added_false_positives.h"
#include "scenes/vec3d.h"

#include <doctest/doctest.h>

#include <array>
#include <vector>

namespace cab::tests {
namespace {

constexpr double kU = 0x1p-24;
constexpr std::array<float, 4> kTurn = {0.125f, 0.25f, 0.5f, 0.75f};

// Two cubes with halves of 1, rotated alike and side by side. Each frame has a gap between their faces, in u of their
// sizes (6).
scenes::Scene cubes_apart(const std::vector<double>& gaps) {
  scenes::Character still;
  still.link_parents = {-1};
  still.leaves.push_back({0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {}});
  scenes::Character moving = still;
  still.poses = {kTurn[0], kTurn[1], kTurn[2], kTurn[3], 0, 0, 0};
  still.is_static = true;
  const scenes::Quat turn = scenes::normalized({kTurn[0], kTurn[1], kTurn[2], kTurn[3]});
  for (const double gap : gaps) {
    moving.poses.insert(moving.poses.end(), kTurn.begin(), kTurn.end());
    for (const double at : scenes::rotate(turn, {2 + 6 * kU * gap, 0.5, 0.25}))
      moving.poses.push_back(static_cast<float>(at));
  }
  scenes::Scene scene;
  scene.frame_count = static_cast<std::uint32_t>(gaps.size());
  scene.characters = {still, moving};
  return scene;
}

}  // namespace

TEST_CASE("pairs found beyond those that touch are counted by what added them") {
  // Padding takes 32 u of a cube's size on either side, the slack on a face at least 48 u of both.
  const perf::AddedFalsePositives added =
      perf::count_added_false_positives(cubes_apart({-1000, -10, -5, 5, 20, 50, 70, 500, 1e6}), Isa::kAuto);
  CHECK(added.touching == 3);
  CHECK(added.by_padding == 2);
  CHECK(added.by_slack == 2);
  CHECK(added.missed == 0);
  CHECK(added.found == 7);
  CHECK(added.percent() == doctest::Approx(400.0 / 3));
}

TEST_CASE("a missed pair fails its gate, and so does adding too much on a full run") {
  perf::AddedFalsePositives added;
  added.found = added.touching = 10000;
  added.by_padding = 4;
  added.by_slack = 5;
  const auto passed = [&](bool full_run) {
    std::vector<bool> out;
    for (const perf::Gate& gate : perf::false_positive_gates(added, full_run)) out.push_back(gate.passed);
    return out;
  };
  CHECK(passed(true) == std::vector<bool>{true, true});
  ++added.by_slack;
  CHECK(passed(true) == std::vector<bool>{true, false});
  CHECK(passed(false) == std::vector<bool>{true});
  ++added.missed;
  CHECK(passed(false) == std::vector<bool>{false});
}

}  // namespace cab::tests
