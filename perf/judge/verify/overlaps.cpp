// Verifies the overlap test of the kernels on nearly touching pairs of boxes of every regime. By an exact judge, no
// pair that touches may be called apart. Pairs that are apart and called touching are counted.
#include "kernels/gather_pairs.h"
#include "perf/base/report.h"
#include "perf/judge/oracle/box_tile.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/touching_pairs.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

// The number of tiles, of sixteen pairs each, of one regime per round.
constexpr std::uint32_t kTiles = 120;

// The range of gaps in u (Sa + Sb): most pairs overlap a little, some are apart within the slack.
constexpr double kDeepest = -20, kWidest = 2;

// One way to call the test: the bits of BoxPairs::leaves, and which axes are tested.
struct Use {
  std::string name;
  std::uint32_t leaves;
  std::size_t sat;
};

const std::vector<Use>& uses() {
  static const std::vector<Use> all = [] {
    std::vector<Use> out;
    for (const RefitMethod& method : sat_methods()) {
      const std::string suffix = method.policies.sat == Sat::kAll15 ? "" : ", " + method.name;
      out.push_back({"leaves" + suffix, 0xffff, static_cast<std::size_t>(method.policies.sat)});
      out.push_back({"inner boxes" + suffix, 0, static_cast<std::size_t>(method.policies.sat)});
    }
    return out;
  }();
  return all;
}

void report_miss(Task& task, std::size_t use, std::uint32_t index, const oracle::BoxPair& pair) {
  const auto three = [](const double(&v)[3]) {
    return "(" + shortest(v[0]) + " " + shortest(v[1]) + " " + shortest(v[2]) + ")";
  };
  task.violation(use, std::string("boxes that touch are called apart; as ") + uses()[use].name + ", index " +
                          std::to_string(index) + ", origins " + three(pair.origin_a) + " " + three(pair.origin_b) +
                          "; A: " + to_text(pair.a) + "; B: " + to_text(pair.b));
}

void run(Task& task) {
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    oracle::BoxPair pairs[kLanes];
    BoxAos a[kLanes], b[kLanes];
    ShiftTile shift;
    kernel::BoxPairs<BoxAos> block;
    block.shift = &shift;
    std::uint32_t touching = 0;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      oracle::BoxPair& pair = pairs[lane];
      pair = oracle::near_touching_pair(task.random, static_cast<oracle::TouchRegime>(task.regime),
                                        task.random.uniform(kDeepest, kWidest));
      if (oracle::judge_overlap_filtered(pair.a, pair.b, oracle::exact_offset(pair))) touching |= 1u << lane;
      a[lane] = oracle::to_aos(pair.a);
      b[lane] = oracle::to_aos(pair.b);
      block.a[lane] = &a[lane];
      block.b[lane] = &b[lane];
      for (std::size_t c = 0; c < 3; ++c) shift.by[c][lane] = pair.origin_b[c] - pair.origin_a[c];
    }
    for (std::size_t use = 0; use < uses().size(); ++use) {
      block.leaves = uses()[use].leaves;
      const std::uint32_t reported = task.subject->kernels->overlap_boxes[uses()[use].sat](block);
      Tally& tally = task.tallies[use];
      tally.judged += kLanes;
      tally.touching += static_cast<std::uint64_t>(__builtin_popcount(touching));
      tally.false_positives += static_cast<std::uint64_t>(__builtin_popcount(reported & ~touching));
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        if ((touching & ~reported) >> lane & 1u) report_miss(task, use, tile * kLanes + lane, pairs[lane]);
    }
  }
}

}  // namespace

// The regimes are those of oracle::TouchRegime, in its order.
VerifyPart overlaps_part() {
  std::vector<std::string> regimes = {"ordinary",    "aspect to 1e6", "plates",           "lines",
                                      "points",      "tiny and huge", "parallel edges",   "nearly parallel edges",
                                      "far centres", "far origins",   "one axis decides", "1e-30 to 1e18"};
  std::vector<std::string> methods;
  for (const Use& use : uses()) methods.push_back(use.name);
  return {"overlaps", "tests", Columns::kPairs, std::move(regimes), std::move(methods), run};
}

}  // namespace cab::perf
