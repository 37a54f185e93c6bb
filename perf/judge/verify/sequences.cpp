// Verifies whole frames of random worlds by run_frame. Half of the worlds have layers and some have a margin. Every
// strategy and refit must report every pair of links that the exact judge calls touching, or at most the margin apart.
// If two strategies on the same leaf boxes differ in a pair, the judge calls it apart; such pairs are counted, and of
// rows and brute there may be none.
// run_all_pairs, which judges elsewhere, must report all these pairs too: that none is masked or left out.
#include <algorithm>
#include <iterator>

#include "engine/frame/all_pairs.h"
#include "perf/harness/random_world.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {
namespace {

// The most links of a world's articulations: few, so that the judge can test every pair, but many in one of 64 worlds.
constexpr unsigned kFewLinks = 8, kManyLinks = 64;
constexpr double kManyShare = 1.0 / 64;

// The methods of run_frame, and run_all_pairs as the last one.
const std::vector<RefitMethod>& methods() {
  static const std::vector<RefitMethod> all = [] {
    std::vector<RefitMethod> out = frame_methods();
    out.push_back({"all leaf pairs", {}});
    return out;
  }();
  return all;
}

bool is_all_pairs(std::size_t method) { return method + 1 == methods().size(); }

// The method with which a method is compared: it tests the same leaf boxes by the same axes in all pairs.
std::size_t reference_of(std::size_t method) {
  std::size_t m = 0;
  while (methods()[m].policies.strategy != Strategy::kBrute ||
         methods()[m].policies.refit != methods()[method].policies.refit ||
         methods()[m].policies.sat != methods()[method].policies.sat)
    ++m;
  return m;
}

void judge_hits(Task& task, std::size_t method, const std::vector<Hit>& touching, const std::vector<Hit>& hits) {
  Tally& tally = task.tallies[method];
  ++tally.judged;
  tally.touching += touching.size();
  tally.false_positives += oracle::missing_from(hits, touching);
  std::vector<Hit> missed;
  std::set_difference(touching.begin(), touching.end(), hits.begin(), hits.end(), std::back_inserter(missed),
                      oracle::link_less);
  tally.lost += missed.size();
  for (const Hit& hit : missed)
    task.violation(method, "links that touch are not reported; method " + methods()[method].name + ", batch " +
                               std::to_string(hit.batch_a.value) + " instance " + std::to_string(hit.instance_a) +
                               " link " + std::to_string(hit.link_a) + " and batch " +
                               std::to_string(hit.batch_b.value) + " instance " + std::to_string(hit.instance_b) +
                               " link " + std::to_string(hit.link_b));
}

void run(Task& task) {
  oracle::World world;
  const unsigned links = task.random.chance(kManyShare) ? kManyLinks : kFewLinks;
  task.regime == 0 ? oracle::add_characters(task.random, world, links) : oracle::add_frames(task.random, world, links);
  if (task.random.chance(0.5)) oracle::add_layers(task.random, world);
  if (task.random.chance(0.3)) world.margin = static_cast<float>(task.random.log_uniform(1e-6, 1));
  const oracle::EnginePtr engine = oracle::make_engine_for(world, {.isa = task.subject->kernels->isa});
  const std::vector<Hit> touching = oracle::judge_world(world);
  std::vector<std::vector<Hit>> hits;
  for (std::size_t m = 0; m < methods().size(); ++m) {
    const auto frame = is_all_pairs(m) ? run_all_pairs : task.subject->run_frame;
    hits.push_back(oracle::run_on(*engine, world, methods()[m].policies, frame).hits);
    judge_hits(task, m, touching, hits.back());
  }
  for (std::size_t m = 0; m < methods().size(); ++m) {
    if (is_all_pairs(m)) continue;
    const Policies& policies = methods()[m].policies;
    // With fewer axes, separated inner boxes exclude leaf pairs that would have passed: a difference by design.
    if (policies.sat != Sat::kAll15 && policies.strategy != Strategy::kBrute && policies.strategy != Strategy::kRows)
      continue;
    const std::vector<Hit>& reference = hits[reference_of(m)];
    const std::uint64_t differing = oracle::missing_from(hits[m], reference) + oracle::missing_from(reference, hits[m]);
    task.tallies[m].differing += differing;
    // Rows test the same boxes in the same way; trees leave out some pairs by their inner boxes.
    if (policies.strategy == Strategy::kRows && differing > 0)
      task.violation(m, "rows and brute find other links; method " + methods()[m].name);
  }
}

}  // namespace

VerifyPart frames_part() {
  return {"frames", "frames", Columns::kFrames, {"characters", "sequences"}, names_of(methods()), run};
}

}  // namespace cab::perf
