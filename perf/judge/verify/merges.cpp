// Verifies merges: every oriented refit with every value of `extents`, by the kernels, on pairs of children of every
// regime and on the parents of two such pairs. By an exact judge, every parent must contain both children, or all
// leaves below.
#include <algorithm>
#include <iterator>

#include "kernels/refit_tree.h"
#include "layout/error_bounds.h"
#include "perf/judge/oracle/box_tile.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/merge_regimes.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

using Box3f = oracle::OracleBox<float>;

// The number of tiles of one regime per round. In each tile every method makes three merges in 16 lanes.
constexpr std::uint32_t kTiles = 32;

// One of five tiles merges without a joint.
constexpr std::uint32_t kTilesPerFree = 5;

constexpr std::uint32_t kLeafCount = 4, kNodeCount = 7;

constexpr std::uint32_t kRuleCount = std::extent_v<decltype(kernel::KernelTable::refit_boxes)>;

const std::vector<RefitMethod>& methods() {
  static const std::vector<RefitMethod> all = refit_methods(kRuleCount);
  return all;
}

// Two pairs of leaves, each merged, and the two parents merged: all at the joint of link 0, or all without a joint.
MergeProgram two_limbs(bool has_joint) {
  static constexpr MergeStep kAtJoint[] = {{0, 1, 0}, {2, 3, 0}, {4, 5, 0}};
  static constexpr MergeStep kFree[] = {{0, 1, kNoJoint}, {2, 3, kNoJoint}, {4, 5, kNoJoint}};
  static constexpr std::uint16_t kCounts[] = {1, 1, 1, 1, 2, 2, 4}, kFirst[] = {0, 1, 2, 3, 0, 2, 0};
  static constexpr std::uint16_t kLeafSequence[] = {0, 1, 2, 3};
  return {
      {has_joint ? kAtJoint : kFree, 3}, {kCounts, kNodeCount}, {kFirst, kNodeCount}, {kLeafSequence, kLeafCount}, 2};
}

// The nodes that a parent must contain, by extents.
std::vector<std::uint32_t> below(Extents extents, std::uint32_t parent) {
  if (parent < 6) return {2 * (parent - kLeafCount), 2 * (parent - kLeafCount) + 1};
  if (extents == Extents::kChildren) return {4, 5};
  return {0, 1, 2, 3};
}

// A child of another limb at the same joint: rotated about the joint, and with another size. Its axes are not rotated
// if their rounding would make them less orthonormal than a merge accepts.
Box3f rotated_about(const float (&joint)[3], const double (&turn)[3][3], double size, const Box3f& child) {
  const auto rotated = [&](const oracle::Vec3<double>& v) {
    return v[0] * oracle::to_vec3(turn[0]) + v[1] * oracle::to_vec3(turn[1]) + v[2] * oracle::to_vec3(turn[2]);
  };
  const auto pivot = oracle::convert<double>(oracle::to_vec3(joint));
  const auto wide = oracle::convert<double>(child);
  Box3f out = child;
  for (std::size_t k = 0; k < 3; ++k) {
    store(oracle::convert<float>(rotated(axis_of(wide, k))), out.axis[k]);
    out.half[k] = static_cast<float>(size * wide.half[k]);
  }
  if (oracle::orthonormality_error(out) > oracle::kOrthonormalityLimit)
    for (std::size_t k = 0; k < 3; ++k) store(axis_of(child, k), out.axis[k]);
  store(oracle::convert<float>(pivot + size * rotated(center_of(wide) - pivot)), out.center);
  return out;
}

// Leaves and joints of sixteen lanes, and what kernels make of them.
struct MergeWork {
  BoxTile nodes[kNodeCount];
  PointTile joint;
};

void make_leaves(Task& task, MergeWork& work) {
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const auto one = oracle::make_merge_case(task.random, static_cast<oracle::MergeRegime>(task.regime));
    double turn[3][3];
    task.random.rotation(turn);
    const double size = task.random.log_uniform(0.5, 2.0);
    put(work.nodes[0], lane, one.child1);
    put(work.nodes[1], lane, one.child2);
    put(work.nodes[2], lane, rotated_about(one.joint, turn, size, one.child1));
    put(work.nodes[3], lane, rotated_about(one.joint, turn, size, one.child2));
    for (std::size_t c = 0; c < 3; ++c) work.joint.at[c][lane] = one.joint[c];
  }
}

// The padding that the merge gave a box. The bound speaks of S and M before padding; each half extent then grew by it.
double padding_of(const Box3f& parent) {
  const auto wide = oracle::convert<double>(parent);
  const double size = static_cast<double>(kMergePadSize);
  const double fixed = static_cast<double>(kMergePadCenter) * center_max(wide) + static_cast<double>(kMergePadTiny);
  return (size * half_sum(wide) + fixed) / (1 + 3 * size);
}

void judge_parent(Task& task, std::size_t method, std::uint32_t index, const Box3f& parent,
                  const std::vector<Box3f>& inside) {
  Tally one;
  one.judged = 1;
  bool good = true;
  double excess = -1e300;  // in the boxes' unit
  for (const Box3f& child : inside) {
    const oracle::ContainmentVerdict verdict = oracle::judge_containment(parent, child);
    good = good && verdict.inside;
    one.excess = std::max(one.excess, std::min(verdict.excess_ulps, 1e300));
    excess = std::max(excess, std::min(verdict.excess, 1e300));
  }
  const auto wide = oracle::convert<double>(parent);
  const double ulp = oracle::kFloatRoundoff * (half_sum(wide) + center_max(wide));
  const double padding = padding_of(parent);
  const double crooked = oracle::orthonormality_error(parent);
  one.axes = crooked / oracle::kFloatRoundoff;
  one.share = (excess + padding) / padding;
  one.rounding = ulp > 0 ? (excess + padding) / ulp : 0;
  one.padding = ulp > 0 ? padding / ulp : 0;
  task.tallies[method].add(one);
  if (good && crooked <= oracle::kOrthonormalityLimit) return;
  std::string text = good ? "axes off orthonormal by more than 23 u" : "a child sticks out";
  text += "; method " + methods()[method].name + ", index " + std::to_string(index) + ", parent: " + to_text(parent);
  for (const Box3f& child : inside) text += "; child: " + to_text(child);
  task.violation(method, text);
}

void run(Task& task) {
  MergeWork work{};
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    make_leaves(task, work);
    const MergeProgram program = two_limbs(tile % kTilesPerFree != kTilesPerFree - 1);
    for (std::size_t m = 0; m < methods().size(); ++m) {
      const Policies& policies = methods()[m].policies;
      const auto rule = static_cast<std::size_t>(policies.refit), extents = static_cast<std::size_t>(policies.extents);
      task.subject->kernels->refit_boxes[rule][extents]({&program, &work.joint, work.nodes});
      for (std::uint32_t parent = kLeafCount; parent < kNodeCount; ++parent) {
        const std::vector<std::uint32_t> held = below(policies.extents, parent);
        std::vector<Box3f> inside(held.size());
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
          for (std::size_t i = 0; i < held.size(); ++i) inside[i] = oracle::get(work.nodes[held[i]], lane);
          const std::uint32_t index = (tile * kLanes + lane) * 3 + parent - kLeafCount;
          judge_parent(task, m, index, oracle::get(work.nodes[parent], lane), inside);
        }
      }
    }
  }
}

}  // namespace

// The regimes are those of oracle::MergeRegime, in its order.
VerifyPart merges_part() {
  std::vector<std::string> regimes = {
      "limbs",         "straight", "folded",        "aspect 1e3 to 1e6", "plates, lines, points",
      "tiny and huge", "far",      "1e-30 to 1e18", "drifting axes",     "parents"};
  return {"merges", "merges", Columns::kMerges, std::move(regimes), names_of(methods()), run};
}

}  // namespace cab::perf
