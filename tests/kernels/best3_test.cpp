// best3 against its description, computed independently in double: the axes of CAB or of a child, whichever box has the
// least surface.
#include "kernels/refit_tree.h"
#include "perf/judge/oracle/merge_regimes.h"
#include "perf/judge/oracle/rotation_limit.h"
#include "tests/kernels/isas.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>

namespace cab::tests {
namespace {

using Wide = oracle::OracleBox<double>;

constexpr std::uint64_t kSeed = 33;

// A chosen box may have this much more surface than the least of the three, in units of 16 u S (S + M). It comes from
// the rounding of half extents (20 u S and 2 u M of each) times the circumference of the box. Worst measured: 0.61.
constexpr double kTolerance = 1;

// Two pairs of leaves, each merged, and then the two parents merged, so that merges of merged boxes are tested.
constexpr std::uint32_t kNodes = 7;
constexpr MergeStep kAtJoint[] = {{0, 1, 0}, {2, 3, 0}, {4, 5, 0}};
constexpr MergeStep kFree[] = {{0, 1, kNoJoint}, {2, 3, kNoJoint}, {4, 5, kNoJoint}};
constexpr std::uint16_t kCounts[] = {1, 1, 1, 1, 2, 2, 4}, kFirst[] = {0, 1, 2, 3, 0, 2, 0},
                        kLeafSequence[] = {0, 1, 2, 3};

struct Tile {
  BoxTile nodes[kNodes];
  PointTile joint;
};

Tile random_tile(oracle::Random& random, oracle::MergeRegime regime, bool has_joint) {
  Tile tile{};
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    oracle::MergeCase one;
    for (std::uint32_t pair = 0; pair < 2; ++pair) {
      do one = oracle::make_merge_case(random, regime);
      while (one.has_joint != has_joint);
      put(tile.nodes[2 * pair], lane, one.child1);
      put(tile.nodes[2 * pair + 1], lane, one.child2);
    }
    for (std::size_t c = 0; c < 3; ++c) tile.joint.at[c][lane] = one.joint[c];
  }
  return tile;
}

void refit(Refit rule, Extents extents, const MergeProgram& program, Tile& tile) {
  kernel::find_kernels(Isa::kAuto)
      ->refit_boxes[static_cast<std::size_t>(rule)][static_cast<std::size_t>(extents)](
          {&program, &tile.joint, tile.nodes});
}

// The surface of the box that a merge makes along given axes, padding included.
double made_surface(const std::vector<Wide>& inside, const Wide& axes) {
  double half[3], center[3] = {0, 0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (const Wide& box : inside) {
      double reach = 0;
      for (std::size_t i = 0; i < 3; ++i) reach += box.half[i] * std::fabs(dot(axis_of(box, i), axis_of(axes, k)));
      lo = std::min(lo, dot(center_of(box), axis_of(axes, k)) - reach);
      hi = std::max(hi, dot(center_of(box), axis_of(axes, k)) + reach);
    }
    half[k] = (hi - lo) / 2;
    for (std::size_t c = 0; c < 3; ++c) center[c] += (hi + lo) / 2 * axes.axis[k][c];
  }
  const double far = std::max({std::fabs(center[0]), std::fabs(center[1]), std::fabs(center[2])});
  const double pad = 0x1p-18 * (half[0] + half[1] + half[2]) + 0x1p-23 * far + 0x1p-124;
  for (double& h : half) h += pad;
  return oracle::surface_of(half);
}

bool same_axes(const oracle::OracleBox<float>& a, const oracle::OracleBox<float>& b) {
  return std::equal(&a.axis[0][0], &a.axis[0][0] + 9, &b.axis[0][0]);
}

}  // namespace

TEST_CASE("best3 takes the axes of CAB or of a child, those whose box has the least surface, at every level") {
  constexpr int kRounds = 150;
  double worst = 0;
  for (unsigned regime = 0; regime < oracle::kMergeRegimeCount; ++regime) {
    oracle::Random random(kSeed + regime);
    std::array<std::size_t, 3> chosen = {0, 0, 0};
    std::size_t others = 0, larger = 0, wrong = 0;
    for (int round = 0; round < kRounds; ++round) {
      const bool has_joint = round % 4 != 0;
      const Extents extents = round % 2 ? Extents::kLeaves : Extents::kChildren;
      const MergeProgram program = {
          {has_joint ? kAtJoint : kFree, 3}, {kCounts, kNodes}, {kFirst, kNodes}, {kLeafSequence, 4}, 2};
      Tile tile = random_tile(random, static_cast<oracle::MergeRegime>(regime), has_joint);
      refit(Refit::kBest3, extents, program, tile);
      for (std::size_t s = 0; s < 3; ++s) {
        const MergeStep& step = program.steps.data[s];
        // The CAB merge of the same two children.
        const MergeStep alone = {0, 1, step.joint_link};
        const MergeProgram one_merge = {{&alone, 1}, {kCounts, 3}, {kFirst, 3}, {kLeafSequence, 2}, 1};
        Tile cab{};
        cab.nodes[0] = tile.nodes[step.left];
        cab.nodes[1] = tile.nodes[step.right];
        cab.joint = tile.joint;
        refit(Refit::kCab, Extents::kChildren, one_merge, cab);
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
          const auto parent = get(tile.nodes[4 + s], lane), by_cab = get(cab.nodes[2], lane);
          const oracle::OracleBox<float> axes[3] = {by_cab, get(tile.nodes[step.left], lane),
                                                    get(tile.nodes[step.right], lane)};
          std::vector<Wide> inside;
          if (extents == Extents::kChildren || s < 2)
            inside = {oracle::convert<double>(axes[1]), oracle::convert<double>(axes[2])};
          else
            for (std::uint32_t leaf = 0; leaf < 4; ++leaf)
              inside.push_back(oracle::convert<double>(get(tile.nodes[leaf], lane)));
          double surface[3];
          for (std::size_t i = 0; i < 3; ++i) surface[i] = made_surface(inside, oracle::convert<double>(axes[i]));
          const double least = std::min({surface[0], surface[1], surface[2]});
          const Wide made = oracle::convert<double>(parent);
          // Of the parent: 8 h.h' is at most 16 S times what a half extent may be off by.
          const double unit = oracle::kFloatRoundoff * 16 * half_sum(made) * (half_sum(made) + center_max(made));
          const std::size_t which = static_cast<std::size_t>(
              std::find_if(axes, axes + 3, [&](const auto& box) { return same_axes(box, parent); }) - axes);
          if (which == 3) {
            ++others;
            continue;
          }
          ++chosen[which];
          const double over = (surface[which] - least) / unit;
          worst = std::max(worst, over);
          wrong += !(over <= kTolerance);
          if (extents == Extents::kChildren)
            larger += oracle::surface_of(made.half) >
                      (1 + 16 * oracle::kFloatRoundoff) * oracle::surface_of(oracle::convert<double>(by_cab).half);
        }
      }
    }
    CAPTURE(regime);
    CAPTURE(kSeed);
    CHECK(others == 0);
    CHECK(wrong == 0);
    CHECK(larger == 0);
    for (const std::size_t times : chosen) CHECK(times > 100);
  }
  MESSAGE("largest surface over the least of three: " << worst << " of " << kTolerance);
}

}  // namespace cab::tests
