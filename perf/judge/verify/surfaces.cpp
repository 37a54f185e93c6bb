// Verifies boxes of skins: every vertex, where a linear blend in long double puts it, must be in the posed box of its
// leaf. What touches what is not judged here.
#include <algorithm>
#include <iterator>

#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/box_tile.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/verify/parts.h"
#include "perf/judge/verify/posed_skin.h"

namespace cab::perf {
namespace {

// Skins of each regime and format per round; each has sixteen instances.
constexpr std::uint32_t kSkins = 16;

struct Method {
  const char* name;
  PoseFormat format;
};
constexpr Method kMethods[] = {{"quaternions", PoseFormat::kQuaternionTranslation},
                               {"matrices, by rows", PoseFormat::kMatrix3x4Rows},
                               {"matrices, by columns", PoseFormat::kMatrix4x4Columns}};

void judge_skin(Task& task, std::size_t method, const oracle::SkinRig& rig, const Articulation& articulation) {
  constexpr double kAngles[] = {0.1, 1, 3.14159265}, kShifts[] = {0, 0.1, 10}, kAway[] = {0, 1, 1e4, 1e7};
  oracle::Random& random = task.random;
  const double angle = kAngles[random.index(3)], shift = kShifts[random.index(3)], away = kAway[random.index(4)];
  const oracle::Poses poses = random_skin_poses(random, rig, kLanes, kMethods[method].format, angle, shift, away);
  const PosedSkin posed = pose_skin(*task.subject->kernels, articulation, poses);
  const ArticulationDesc desc = rig.desc();
  Tally& tally = task.tallies[method];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    if (posed.flags[lane] != kInstanceOk) task.violation(method, "an instance is masked");
    const std::vector<oracle::ExactPose> exact = exact_poses(poses, lane);
    for (std::size_t leaf = 0; leaf < posed.leaves.size(); ++leaf) {
      const auto box = oracle::get(posed.leaves[leaf], lane);
      tally.axes = std::max(tally.axes, oracle::orthonormality_error(box) / oracle::kFloatRoundoff);
      for (const std::uint32_t vertex : rig.triangles[leaf]) {
        const oracle::ContainmentVerdict verdict = judge_containment(box, vertex_box(desc.skin, exact, vertex));
        ++tally.judged;
        tally.excess = std::max(tally.excess, verdict.excess_ulps);
        if (!verdict.inside)
          task.violation(method, "vertex " + std::to_string(vertex) + " is outside of leaf " + std::to_string(leaf) +
                                     ": " + to_text(box));
      }
    }
  }
}

void run(Task& task) {
  for (std::uint32_t i = 0; i < kSkins; ++i) {
    const oracle::SkinRig rig = random_skin(task.random, static_cast<oracle::SkinRegime>(task.regime));
    Arena arena(default_allocator());
    Articulation articulation;
    oracle::require(build_articulation(rig.desc(), arena, &articulation, nullptr));
    for (std::size_t method = 0; method < std::size(kMethods); ++method) judge_skin(task, method, rig, articulation);
  }
}

}  // namespace

// The regimes are those of oracle::SkinRegime, in its order.
VerifyPart surfaces_part() {
  std::vector<std::string> methods;
  for (const Method& method : kMethods) methods.emplace_back(method.name);
  return {"surfaces", "vertices", Columns::kBoxes, {"smooth", "many links", "tiny weights", "one link", "flat"},
          methods,    run};
}

}  // namespace cab::perf
