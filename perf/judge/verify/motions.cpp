// Verifies motions of random robots by check_motions, with and without first moments. The judge in long double leaves a
// motion open if it only comes within its slack of touching.
#include <array>

#include "perf/base/report.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/motion_judge.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

constexpr std::size_t kMotions = 24;  // of a robot

// By how much each variable changes at most, in radians or in lengths, by regime.
constexpr double kChange[] = {0.1, 0.6, 4};

struct Method {
  const char* name;
  double resolution;
  bool first;  // whether it asks for first moments
};
constexpr Method kMethods[] = {
    {"any, 1e-2", 1e-2, false}, {"any, 1e-3", 1e-3, false}, {"first, 1e-2", 1e-2, true}, {"first, 1e-3", 1e-3, true}};

// Within how many resolutions links are where they are too close or may touch (docs/proof.md, 17.2). The largest of
// 9100 rounds is 1.02.
constexpr long double kNear = 1.54L;

// Motions of a robot, among what stands around it.
struct Motions {
  oracle::JointedRig robot;
  std::vector<Leaf> fixed;
  float margin = 0;  // links that are as near as this touch
  std::vector<std::vector<double>> from, to;
};

Motions random_motions(oracle::Random& random, double change) {
  Motions out;
  out.robot = oracle::random_jointed_rig(random, 10, 2, 0.5);
  oracle::JointedBody& body = out.robot.body;
  for (JointDesc& joint : body.joints)
    for (double& x : joint.anchor) x *= 0.2;
  for (Leaf& leaf : out.robot.rig.leaves)
    for (float& half : leaf.box.half) half *= 0.8f;
  for (std::uint32_t link = 0; link < body.parents.size(); ++link)
    if (body.parents[link] >= 0)
      out.robot.rig.ignored.push_back({static_cast<std::uint32_t>(body.parents[link]), link});
  if (random.chance(0.5))
    out.fixed.push_back({0, oracle::random_box(random, random.uniform(0.5, 2) * random.unit_vector(), 0.1, 1), {}});
  if (random.chance(0.3)) out.margin = static_cast<float>(random.log_uniform(1e-3, 0.1));
  for (std::size_t m = 0; m < kMotions; ++m) {
    std::vector<double>&from = out.from.emplace_back(), &to = out.to.emplace_back();
    for (std::uint32_t v = 0; v < body.variable_count; ++v) {
      from.push_back(random.uniform(-3, 3));
      to.push_back(from[v] + change * random.uniform(-1, 1));
    }
  }
  return out;
}

// What is true of a motion.
struct Truth {
  oracle::MotionJudge judge;
  long double margin;
  oracle::Approach near, touch;  // within the slack of touching, and deeper than it

  Truth(const Motions& motions, std::size_t m)
      : judge(motions.robot, motions.fixed, motions.from[m], motions.to[m]),
        margin(motions.margin),
        near(judge.first_within(margin + 2 * judge.slack(), 0)),
        touch(near) {
    if (near.kind == oracle::Approach::kFound) touch = judge.first_within(margin - judge.slack(), near.moment);
  }
  bool touches() const { return touch.kind == oracle::Approach::kFound; }
  bool is_free() const { return near.kind == oracle::Approach::kNever; }
};

// Counts the answer to a motion. name: that of the motion. moment: of kColliding and kTooClose, if the method asks for
// it.
void compare(Task& task, std::size_t method, const std::string& name, const Truth& truth, MotionAnswer answer,
             double moment) {
  const auto violation = [&](std::string what) {
    what += std::string("; method ") + kMethods[method].name + ", motion " + name;
    if (truth.touches()) what += ", which touches at " + shortest(static_cast<double>(truth.touch.moment));
    task.violation(method, what);
  };
  const auto finds = [&truth](long double level) {
    return truth.judge.first_within(truth.margin + level, 0).kind == oracle::Approach::kFound;
  };
  const long double resolution = kMethods[method].resolution, near = kNear * resolution + 2 * truth.judge.slack();
  Tally& tally = task.tallies[method];
  ++tally.judged;
  tally.touching += truth.touches();
  tally.undecided += !truth.touches() && !truth.is_free();
  switch (answer) {
    case MotionAnswer::kFree:
      ++tally.free;
      if (!truth.touches()) return;
      ++tally.lost;
      return violation("links touch in a motion that is called free");
    case MotionAnswer::kColliding:
      ++tally.colliding;
      if (truth.is_free()) {
        ++tally.false_positives;
        violation("no links touch in a motion that is called colliding");
      }
      break;
    case MotionAnswer::kTooClose:
      ++tally.too_close;
      if (truth.is_free() && !finds(near)) violation("no links come near in a motion called too close");
      if (truth.touches() && finds(-resolution)) violation("links touch deeply in a motion called too close");
      break;
    case MotionAnswer::kNotTested: return violation("a motion is not tested");
  }
  if (!kMethods[method].first) return;
  if (truth.touches() && truth.touch.moment < moment)
    violation("links touch before the first moment, " + shortest(moment));
  const long double apart = truth.judge.separation(moment) - truth.margin;
  if (!(moment >= 0 && moment <= 1) || apart > near)
    violation("no links are near each other at the first moment, " + shortest(moment) + ": they are " +
              shortest(static_cast<double>(apart)) + " apart");
}

using Answers = std::array<std::array<MotionAnswer, kMotions>, std::size(kMethods)>;
using Moments = std::array<std::array<double, kMotions>, std::size(kMethods)>;

// Asks all motions by all methods.
void ask(const Task& task, CollisionChecker& checker, const Motions& motions, Answers& answers, Moments& moments) {
  std::vector<double> from, to;
  for (std::size_t m = 0; m < kMotions; ++m) {
    from.insert(from.end(), motions.from[m].begin(), motions.from[m].end());
    to.insert(to.end(), motions.to[m].begin(), motions.to[m].end());
  }
  for (std::size_t i = 0; i < std::size(kMethods); ++i) {
    MotionSearch search;
    search.resolution = kMethods[i].resolution;
    if (kMethods[i].first) search.first_moments = moments[i];
    oracle::require(task.subject->check_motions(checker, from, to, answers[i], search));
  }
}

void run(Task& task) {
  Motions motions = random_motions(task.random, kChange[task.regime]);
  const oracle::JointedRig& robot = motions.robot;
  EngineDesc desc;
  desc.isa = task.subject->kernels->isa;
  CollisionChecker checker(desc);
  oracle::require(checker.set_robot(robot.rig.desc(), robot.body.desc()));
  constexpr std::int32_t kRoot[] = {-1};
  constexpr float kPose[] = {0, 0, 0, 1, 0, 0, 0};
  if (!motions.fixed.empty()) oracle::require(checker.add_fixed({kRoot, {}, motions.fixed, {}}, kPose));
  checker.world().job().margin = motions.margin;
  Answers answers;
  Moments moments{};
  std::array<bool, kMotions> goes_on;
  goes_on.fill(true);
  // First the motions as they are, then those that touch on the way as far as a little before that moment.
  for (int pass = 0; pass < 2; ++pass) {
    ask(task, checker, motions, answers, moments);
    for (std::size_t m = 0; m < kMotions; ++m) {
      if (!goes_on[m]) continue;
      const Truth truth(motions, m);
      const std::string name = std::to_string(m) + (pass > 0 ? ", shortened" : "");
      for (std::size_t i = 0; i < std::size(kMethods); ++i) compare(task, i, name, truth, answers[i][m], moments[i][m]);
      goes_on[m] = truth.touches() && truth.touch.moment > 0;
      if (!goes_on[m]) continue;
      const double part = static_cast<double>(truth.touch.moment) * (1 - task.random.log_uniform(1e-7, 0.3));
      for (std::size_t v = 0; v < motions.to[m].size(); ++v)
        motions.to[m][v] = motions.from[m][v] + part * (motions.to[m][v] - motions.from[m][v]);
    }
  }
}

}  // namespace

VerifyPart motions_part() {
  std::vector<std::string> methods;
  for (const Method& method : kMethods) methods.emplace_back(method.name);
  return {"motions", "motions", Columns::kMotions, {"short", "middle", "turns"}, methods, run};
}

}  // namespace cab::perf
