#include "perf/measure/sweep/cells.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <tuple>
#include <utility>

#include "engine/frame/all_pairs.h"
#include "engine/step/instance_batch.h"
#include "layout/bit_hash.h"
#include "perf/base/option_values.h"
#include "perf/base/report.h"

namespace cab::perf {
namespace {

// Up to this many leaf pairs the judge tests all of them. Beyond, it tests those whose boxes overlap, found by brute
// force.
constexpr std::uint64_t kMostJudgedPairs = 300000;

// A run that takes longer than kLongSeconds is measured in at most kLongRounds rounds: noise averages out within it.
constexpr double kLongSeconds = .1;
constexpr std::size_t kLongRounds = 3;

// A run that takes longer than this is not measured again after the run that counts.
constexpr double kLongestSeconds = 1;

// A turn has as many runs as take about this long: at least two, at most kMostRuns.
constexpr double kTurnSeconds = 3e-3;
constexpr int kMostRuns = 20;

// A share of time saved that is smaller than this does not count as a gain.
constexpr double kLeastGain = .05;

// The same policies, but with the default for every field that the strategy does not read.
Policies without_unread(Policies policies) {
  const Policies defaults;
  if (is_axis_aligned(policies.refit)) policies.sat = defaults.sat;
  if (policies.strategy == Strategy::kTree) return policies;
  policies.extents = defaults.extents;
  if (!is_axis_aligned(policies.refit)) policies.refit = defaults.refit;  // all oriented refits have the same leaves
  return policies;
}

bool same(const Policies& a, const Policies& b) {
  for (std::uint32_t row = 0; row < policy_table().size; ++row)
    if (policy_get(a, row) != policy_get(b, row)) return false;
  return true;
}

void set(Policies& policies, std::uint32_t row, std::uint32_t value) {
  policy_set(policies, row, policy_table()[row].values[value].name);
}

Policies with_exact(Policies policies, Exact exact) {
  policies.exact = exact;
  return policies;
}

std::uint64_t hash_of(const std::vector<SweepHit>& hits) {
  cab::BitHash hash;
  for (const SweepHit& hit : hits)
    for (const std::uint32_t number :
         {hit.frame, hit.group_a, hit.instance_a, hit.link_a, hit.group_b, hit.instance_b, hit.link_b})
      hash.add(number);
  return hash.value();
}

// Which exact test judges cells with these policies: convex, since it is fast, unless it is itself among the judged.
Exact judge_of(const std::vector<Policies>& judged) {
  const bool is_judged = std::any_of(judged.begin(), judged.end(),
                                     [](const Policies& policies) { return policies.exact == Exact::kConvex; });
  return is_judged ? Exact::kFcl : Exact::kConvex;
}

// Finds which links touch by an exact test, and how many leaf pairs of a cell are apart by it.
class Judge {
 public:
  Judge(SweepWorld& world, Exact exact) : world_(world), exact_(exact) {
    Policies policies;
    const bool all = world.most_leaf_pairs() <= kMostJudgedPairs;
    policies.strategy = Strategy::kBrute;
    policies.exact = exact;
    world.run(policies, &hits_, all ? run_all_pairs : run_frame);
    name_ = policy_value(policies, "exact") + (all ? " on all pairs" : " on the pairs of brute");
  }
  const std::vector<SweepHit>& hits() const { return hits_; }
  const std::string& name() const { return name_; }

  void judge(const std::vector<SweepHit>& found, SweepCell& cell) {
    cell.misses = count_missing(hits_, found);
    if (cell.policies.exact != Exact::kNone) {
      cell.false_positives = cell.counts.false_positives;
      return;
    }
    // Cells with as many leaf pairs and the same hits have the same leaf pairs.
    const auto [known, is_new] = false_positives_.try_emplace({cell.counts.leaf_pairs, cell.hits_hash});
    if (is_new) known->second = world_.run(with_exact(cell.policies, exact_)).false_positives;
    cell.false_positives = known->second;
  }

 private:
  SweepWorld& world_;
  Exact exact_;
  std::vector<SweepHit> hits_;
  std::string name_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> false_positives_;
};

// A cell's turn in a round: the fastest of its runs. The first run finds the caches as other cells left them, and other
// work of the machine disturbs some runs.
FrameStats turn(SweepWorld& world, const SweepCell& cell) {
  const double seconds = cell.counts.seconds_total;
  const double runs =
      seconds > kLongSeconds ? 1 : std::clamp(std::ceil(kTurnSeconds / seconds), 2.0, double{kMostRuns});
  FrameStats fastest = world.run(cell.policies);
  for (int r = 1; r < static_cast<int>(runs); ++r) {
    const FrameStats stats = world.run(cell.policies);
    if (stats.seconds_total < fastest.seconds_total) fastest = stats;
  }
  return fastest;
}

std::tuple<Isa, std::uint32_t, Exact> group_of(const SweepCell& cell) {
  return {cell.isa, cell.thread_count, cell.policies.exact};
}

// Whether two cells do the same work, although their strategies have different names.
bool is_same_work(const SweepCell& a, const SweepCell& b) {
  Policies policies = a.policies;
  policies.strategy = b.policies.strategy;
  return group_of(a) == group_of(b) && same(policies, b.policies) && a.hits_hash == b.hits_hash &&
         a.counts.box_tests == b.counts.box_tests && a.counts.leaf_pairs == b.counts.leaf_pairs &&
         a.counts.candidates == b.counts.candidates;
}

}  // namespace

std::uint64_t count_missing(const std::vector<SweepHit>& hits, const std::vector<SweepHit>& found) {
  std::vector<SweepHit> missing;
  std::set_difference(hits.begin(), hits.end(), found.begin(), found.end(), std::back_inserter(missing));
  return missing.size();
}

std::vector<double> SweepCell::totals() const {
  std::vector<double> out;
  for (const FrameStats& round : rounds) out.push_back(round.seconds_total);
  return out;
}

std::vector<Policies> choose_policies(const std::vector<std::vector<std::uint32_t>>& values) {
  std::vector<Policies> combined = {Policies()};
  for (std::uint32_t row = 0; row < policy_table().size; ++row) {
    std::vector<std::uint32_t> chosen = values[row];
    if (chosen.empty() && std::string(policy_table()[row].name) == "exact") {
      chosen = {policy_get(Policies(), row)};
    } else if (chosen.empty()) {
      for (std::uint32_t v = 0; v < policy_table()[row].value_count; ++v) chosen.push_back(v);
    }
    std::vector<Policies> more;
    for (const Policies& policies : combined)
      for (const std::uint32_t value : chosen) {
        more.push_back(policies);
        set(more.back(), row, value);
      }
    combined = std::move(more);
  }
  std::vector<Policies> out;
  const auto add = [&out](const Policies& policies) {
    if (std::none_of(out.begin(), out.end(), [&](const Policies& other) { return same(policies, other); }))
      out.push_back(policies);
  };
  for (const Policies& policies : combined) add(with_exact(Policies(), policies.exact));
  for (const Policies& policies : combined) add(without_unread(policies));
  return out;
}

SweepRun run_sweep(const SweepScene& scene, const SweepPlan& plan) {
  SweepRun run;
  run.scene = scene.name;
  run.character_count = scene.character_count();
  run.most_leaves = scene.most_leaves();
  run.frame_count = scene.frame_count;

  SweepWorld judges(scene, Isa::kAuto, 1);
  Judge judge(judges, judge_of(plan.policies));
  run.true_hits = judge.hits().size();
  run.judge = judge.name();

  std::vector<std::unique_ptr<SweepWorld>> worlds;
  std::vector<std::pair<SweepCell*, SweepWorld*>> turns;
  run.cells.reserve(plan.isas.size() * plan.thread_counts.size() * plan.policies.size());
  for (const Isa isa : plan.isas)
    for (const std::uint32_t thread_count : plan.thread_counts) {
      worlds.push_back(std::make_unique<SweepWorld>(scene, isa, thread_count));
      for (const Policies& policies : plan.policies) {
        run.cells.push_back({});
        SweepCell& cell = run.cells.back();
        cell.policies = policies;
        cell.isa = worlds.back()->isa();
        cell.thread_count = worlds.back()->thread_count();
        turns.emplace_back(&cell, worlds.back().get());
      }
    }

  ProgressBar bar(scene.name, turns.size() * (plan.rounds + 1));
  bar.begin_long_step();
  for (const auto& [cell, world] : turns) {
    std::vector<SweepHit> hits;
    cell->counts = world->run(cell->policies, &hits);
    cell->hits = hits.size();
    cell->hits_hash = hash_of(hits);
    if (cell->counts.seconds_total > kLongestSeconds) cell->rounds.push_back(cell->counts);
    judge.judge(hits, *cell);
    bar.advance(1);
  }
  mark_same_work(run.cells);
  for (std::uint32_t r = 0; r < plan.rounds; ++r)
    for (const auto& [cell, world] : turns) {
      bar.advance(1);
      if (cell->same_work_as) continue;
      if (cell->counts.seconds_total > kLongestSeconds) continue;
      if (r >= kLongRounds && cell->counts.seconds_total > kLongSeconds) continue;
      cell->rounds.push_back(turn(*world, *cell));
    }
  for (SweepCell& cell : run.cells)
    if (cell.same_work_as)
      cell.rounds = std::find_if(run.cells.begin(), run.cells.end(), [&](const SweepCell& other) {
                      return other.policies.strategy == *cell.same_work_as && is_same_work(other, cell);
                    })->rounds;
  mark_front(run.cells);
  return run;
}

void mark_same_work(std::vector<SweepCell>& cells) {
  for (SweepCell& cell : cells)
    for (const SweepCell& other : cells)
      if (other.policies.strategy < cell.same_work_as.value_or(cell.policies.strategy) && is_same_work(cell, other))
        cell.same_work_as = other.policies.strategy;
}

void mark_front(std::vector<SweepCell>& cells) {
  for (SweepCell& cell : cells)
    cell.on_front =
        cell.misses == 0 && !cell.same_work_as && std::none_of(cells.begin(), cells.end(), [&](const SweepCell& other) {
          if (group_of(other) != group_of(cell) || other.misses > 0) return false;
          const double mine = cell.total_seconds(), theirs = other.total_seconds();
          return theirs <= mine && other.false_positives <= cell.false_positives &&
                 (theirs < mine || other.false_positives < cell.false_positives);
        });
}

Spread time_ratio(const SweepCell& a, const SweepCell& b) { return ratio_of(b.totals(), a.totals()); }

std::optional<std::size_t> better_cell(const std::vector<SweepCell>& cells, std::size_t of,
                                       std::uint64_t most_false_positives) {
  std::optional<std::size_t> best;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const SweepCell& cell = cells[c];
    if (c == of || group_of(cell) != group_of(cells[of]) || cell.misses > 0 ||
        cell.false_positives > most_false_positives || cell.same_work_as || is_same_work(cell, cells[of]))
      continue;
    std::size_t faster = 0;
    const std::size_t rounds = std::min(cell.rounds.size(), cells[of].rounds.size());
    for (std::size_t r = 0; r < rounds; ++r) faster += cell.rounds[r].seconds_total < cells[of].rounds[r].seconds_total;
    // A gain must show in the median and in at least three of four rounds.
    if (time_ratio(cells[of], cell).median > 1 - kLeastGain || 4 * faster < 3 * rounds) continue;
    if (!best || cell.total_seconds() < cells[*best].total_seconds()) best = c;
  }
  return best;
}

}  // namespace cab::perf
