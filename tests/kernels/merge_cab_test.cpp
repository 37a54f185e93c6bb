// The CAB merge against its promises and against an independent merge in double.
#include "kernels/refit_tree.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/merge_regimes.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 20040601;

// Sixteen merges of one kind (all with a joint or all without), in tiles.
struct MergeTile {
  std::vector<oracle::MergeCase> cases;
  BoxTile nodes[3];
  PointTile joint;
};

void fill(MergeTile& tile) {
  std::memset(tile.nodes, 0, sizeof(tile.nodes));
  std::memset(&tile.joint, 0, sizeof(tile.joint));
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const oracle::MergeCase& one = tile.cases[std::min<std::size_t>(lane, tile.cases.size() - 1)];
    put(tile.nodes[0], lane, one.child1);
    put(tile.nodes[1], lane, one.child2);
    for (std::size_t c = 0; c < 3; ++c) tile.joint.at[c][lane] = one.joint[c];
  }
}

void merge(const kernel::KernelTable& kernels, MergeTile& tile) {
  const MergeProgram program = pair_program(tile.cases[0].has_joint);
  kernels.refit_boxes[0][0]({&program, &tile.joint, tile.nodes});
}

oracle::OracleBox<float> kernel_parent(const oracle::OracleBox<float>& child1, const oracle::OracleBox<float>& child2,
                                       const float* joint) {
  MergeTile tile;
  oracle::MergeCase one{child1, child2, joint != nullptr, {0, 0, 0}};
  if (joint) std::copy(joint, joint + 3, one.joint);
  tile.cases.push_back(one);
  fill(tile);
  merge(*kernel::find_kernels(Isa::kAuto), tile);
  return get(tile.nodes[2], 0);
}

// Collects random cases of a regime into full tiles. Cases with a joint and cases without one are in different tiles.
std::vector<MergeTile> make_tiles(oracle::Random& random, oracle::MergeRegime regime, std::size_t count) {
  std::vector<MergeTile> out;
  MergeTile pending[2];
  for (std::size_t i = 0; i < count; ++i) {
    const oracle::MergeCase one = oracle::make_merge_case(random, regime, kernel_parent);
    MergeTile& tile = pending[one.has_joint];
    tile.cases.push_back(one);
    if (tile.cases.size() < kLanes) continue;
    fill(tile);
    out.push_back(tile);
    tile.cases.clear();
  }
  for (MergeTile& tile : pending) {
    if (tile.cases.empty()) continue;
    fill(tile);
    out.push_back(tile);
  }
  return out;
}

struct Worst {
  double excess_ulps = -1e300;
  double orthonormal_ulps = 0;
  std::size_t violations = 0;
  std::size_t disagreements = 0;
  std::size_t crooked = 0;
  std::string why;
};

void judge(const MergeTile& tile, Worst& worst) {
  for (std::uint32_t lane = 0; lane < tile.cases.size(); ++lane) {
    const oracle::MergeCase& one = tile.cases[lane];
    const oracle::OracleBox<float> parent = get(tile.nodes[2], lane);
    for (const auto* child : {&one.child1, &one.child2}) {
      const oracle::ContainmentVerdict verdict = oracle::judge_containment(parent, *child);
      worst.violations += !verdict.inside;
      worst.excess_ulps = std::max(worst.excess_ulps, verdict.excess_ulps);
    }
    worst.orthonormal_ulps =
        std::max(worst.orthonormal_ulps, oracle::orthonormality_error(parent) / oracle::kFloatRoundoff);
    worst.crooked += !(oracle::frame_error(parent) <= 1);
    std::string why;
    if (oracle::matches_any(oracle::merge_cab_candidates(one), oracle::convert<double>(parent), &why)) continue;
    ++worst.disagreements;
    if (worst.why.empty()) worst.why = why;
  }
}

}  // namespace

TEST_CASE("a merged box contains both children, is orthonormal and is the paper's, in every regime") {
  const auto per_regime = static_cast<std::size_t>(rounds(100000));
  const kernel::KernelTable& kernels = *kernel::find_kernels(Isa::kAuto);
  for (unsigned regime = 0; regime < oracle::kMergeRegimeCount; ++regime) {
    oracle::Random random(kSeed + regime);
    Worst worst;
    for (MergeTile& tile : make_tiles(random, static_cast<oracle::MergeRegime>(regime), per_regime)) {
      merge(kernels, tile);
      judge(tile, worst);
    }
    MESSAGE("regime " << regime << ": worst excess " << worst.excess_ulps << " u (S + M), |R^T R - I| "
                      << worst.orthonormal_ulps << " u");
    CAPTURE(regime);
    CAPTURE(kSeed);
    CAPTURE(worst.why);
    CHECK(worst.violations == 0);
    CHECK(worst.crooked == 0);
    CHECK(worst.disagreements == 0);
  }
}

// docs/numerics.md, "ties": E first, then a1. At right angles E is longer than a1 by less than a float can tell.
TEST_CASE("where E and a1 are of one length the main axis is E, on every instruction set") {
  constexpr float kShort = 0x1p-13f, kThin = 0x1p-15f;
  MergeTile tile;
  tile.cases.push_back({{{1, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, kThin, kThin}},
                        {{0, kShort, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {kThin, kShort, kThin}},
                        true,
                        {0, 0, 0}});
  fill(tile);
  for (const kernel::KernelTable* kernels : available_kernels()) {
    CAPTURE(name_of(*kernels));
    merge(*kernels, tile);
    const oracle::OracleBox<float> parent = get(tile.nodes[2], 0);
    CHECK(parent.axis[0][0] == 1);
    CHECK(parent.axis[0][1] == -kShort);  // with a1 it would be 0
    CHECK(parent.axis[0][2] == 0);
  }
}

TEST_CASE("a merge gives the same bits on every instruction set") {
  for (unsigned regime = 0; regime < oracle::kMergeRegimeCount; ++regime) {
    oracle::Random random(kSeed + 100 + regime);
    for (MergeTile& tile : make_tiles(random, static_cast<oracle::MergeRegime>(regime), 5000)) {
      MergeTile expected = tile;
      merge(*kernel::find_kernels(Isa::kScalar), expected);
      for (const kernel::KernelTable* kernels : available_kernels()) {
        MergeTile got = tile;
        merge(*kernels, got);
        CAPTURE(name_of(*kernels));
        CAPTURE(regime);
        REQUIRE(same_bits(got.nodes[2], expected.nodes[2]));
      }
    }
  }
}

TEST_CASE("a lane's merge does not depend on its neighbours") {
  oracle::Random random(kSeed + 200);
  for (MergeTile& tile : make_tiles(random, oracle::MergeRegime::kLimbs, 2000)) {
    for (const kernel::KernelTable* kernels : available_kernels()) {
      MergeTile alone = tile;
      for (auto& node : alone.nodes)
        for (std::uint32_t lane = 0; lane < kLanes; ++lane)
          if (lane != 5) put(node, lane, get(tile.nodes[0], 0));
      MergeTile together = tile;
      merge(*kernels, together);
      merge(*kernels, alone);
      const oracle::OracleBox<float> a = get(together.nodes[2], 5), b = get(alone.nodes[2], 5);
      REQUIRE(same_bits(a, b));
    }
  }
}

}  // namespace cab::tests
