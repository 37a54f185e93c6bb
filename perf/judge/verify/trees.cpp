// Verifies whole hierarchies of random articulations by compute_boxes: every box, leaves included, must contain every
// leaf box below it, as the exact pose of the caller's data places that box.
#include <algorithm>
#include <cstring>

#include "perf/harness/random_world.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

// How many instances an articulation has, a full tile and one more, and how many of them are judged.
constexpr std::uint32_t kInstances = 17, kJudged = 2;

constexpr unsigned kMostLinks = 256, kMostLeaves = 3;

const std::vector<RefitMethod>& methods() {
  static const std::vector<RefitMethod> all = refit_methods(policy_table()[0].value_count);
  return all;
}

oracle::OracleBox<float> to_oracle(const Box& box) {
  oracle::OracleBox<float> out;
  static_assert(sizeof(out) == sizeof(box), "both are centre, axes, half extents");
  std::memcpy(&out, &box, sizeof(out));
  return out;
}

// Leaves below every node, from the public merge steps.
std::vector<std::vector<std::uint32_t>> leaves_below(const Engine& engine, const oracle::Rig& rig) {
  std::vector<MergeStep> steps(rig.leaf_count() - 1);
  oracle::require(merge_steps(engine, {1}, steps));
  std::vector<std::vector<std::uint32_t>> out;
  for (std::uint32_t leaf = 0; leaf < rig.leaf_count(); ++leaf) out.push_back({leaf});
  for (const MergeStep& step : steps) {
    out.push_back(out[step.left]);
    out.back().insert(out.back().end(), out[step.right].begin(), out[step.right].end());
  }
  return out;
}

oracle::Member random_member(Task& task) {
  oracle::Random& random = task.random;
  oracle::Member out;
  const auto links = static_cast<unsigned>(random.log_uniform(2, kMostLinks + 0.999));
  out.rig =
      oracle::random_rig(random, static_cast<oracle::Topology>(task.regime), links, 1 + random.index(kMostLeaves));
  const oracle::PoseRange range = oracle::any_pose_range(random, false, {}, random.log_uniform(0.1, 1e4));
  out.poses = oracle::random_poses(random, out.rig, kInstances, static_cast<PoseFormat>(random.index(3)), range);
  out.kind = random.chance(0.5) ? BatchKind::kCharacters : BatchKind::kSequence;
  return out;
}

void judge_node(Task& task, std::size_t method, const oracle::OracleBox<float>& box,
                const std::vector<oracle::ExactBox>& leaves, const std::vector<std::uint32_t>& below,
                std::uint32_t instance, std::uint32_t node) {
  Tally& tally = task.tallies[method];
  const auto violation = [&](const std::string& what) {
    task.violation(method, what + "node " + std::to_string(node) + " of instance " + std::to_string(instance) +
                               "; method " + methods()[method].name + ", node: " + to_text(box));
  };
  const double crooked = oracle::orthonormality_error(box);
  tally.axes = std::max(tally.axes, crooked / oracle::kFloatRoundoff);
  if (!(crooked <= oracle::kOrthonormalityLimit)) violation("axes off orthonormal by more than 23 u: ");
  for (const std::uint32_t leaf : below) {
    const oracle::ContainmentVerdict verdict = oracle::judge_containment(box, leaves[leaf]);
    ++tally.judged;
    tally.excess = std::max(tally.excess, std::min(verdict.excess_ulps, 1e300));
    if (!verdict.inside) violation("leaf " + std::to_string(leaf) + " sticks out of ");
  }
}

void run(Task& task) {
  oracle::World world;
  world.members.push_back(random_member(task));
  const oracle::Member& member = world.members[0];
  const oracle::EnginePtr engine = oracle::make_engine_for(world, {.isa = task.subject->kernels->isa});
  const auto below = leaves_below(*engine, member.rig);
  const std::uint32_t nodes = member.rig.node_count();
  std::vector<std::uint32_t> instances;
  std::vector<std::vector<oracle::ExactBox>> exact;
  for (std::uint32_t i = 0; i < kJudged; ++i) {
    instances.push_back(task.random.index(kInstances));
    exact.push_back(oracle::exact_leaf_boxes(member.rig, member.poses, instances.back()));
  }

  std::vector<Box> boxes(std::size_t{kInstances} * nodes);
  for (std::size_t m = 0; m < methods().size(); ++m) {
    oracle::require(task.subject->compute_boxes(*engine, member.poses.input({1}), methods()[m].policies, boxes));
    for (std::uint32_t i = 0; i < kJudged; ++i)
      for (std::uint32_t node = 0; node < nodes; ++node)
        judge_node(task, m, to_oracle(boxes[std::size_t{instances[i]} * nodes + node]), exact[i], below[node],
                   instances[i], node);
  }
}

}  // namespace

// The regimes are those of oracle::Topology, in its order.
VerifyPart trees_part() {
  return {"trees",
          "leaves in boxes",
          Columns::kBoxes,
          {"chains", "stars", "trees", "humanoids", "hands"},
          names_of(methods()),
          run};
}

}  // namespace cab::perf
