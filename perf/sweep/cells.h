// The cells of `cab sweep`: policies by instruction sets by thread counts on one scene, counted, judged and timed in
// turns.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/statistics.h"
#include "perf/sweep/scenes.h"

namespace cab::perf {

// One policy on one instruction set and thread count.
struct SweepCell {
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;

  FrameStats counts;       // of all frames, once
  std::uint64_t hits = 0;  // link pairs, of all frames
  std::uint64_t hits_hash = 0;
  std::uint64_t misses = 0;           // true hits that are not among them
  std::uint64_t false_positives = 0;  // leaf pairs whose boxes overlap and whose shapes are apart, by FCL
  std::vector<FrameStats> rounds;     // times of all frames, the fastest of a turn
  double area = 0;                    // of inner boxes, where the strategy is the tree; 0: none
  bool on_front = false;              // none of its group that misses nothing is as fast with as few false positives
  // The strategy that does the same work under the name that stands first in the table, where that is not its own, as
  // `auto` does that of what it chooses. Such a cell is not timed again and is on no front.
  std::optional<Strategy> same_work_as;

  double total_seconds() const;  // median
};

struct SweepRun {
  std::string scene;
  std::uint32_t character_count = 0;
  std::size_t most_leaves = 0;
  std::uint32_t frame_count = 0;
  std::uint64_t true_hits = 0;
  std::string judge;           // what found them
  double covariance_area = 0;  // of inner boxes, with Refit::kCovariance and extents of children
  double least_area = 0;       // by the best orientations that were found; 0: not searched
  std::vector<SweepCell> cells;
};

struct SweepPlan {
  std::vector<Policies> policies;
  std::vector<Isa> isas;
  std::vector<std::uint32_t> thread_counts;
  std::uint32_t rounds = 0;
};

// Every combination of values of the rows of policy_table() (values[row], none: every one that the scene can tell apart
// without an exact test), and the defaults, which come first. Left out: exact_all without an exact test, which reports
// every pair, and of strategies that descend no hierarchy what differs in inner boxes alone.
std::vector<Policies> choose_policies(const std::vector<std::vector<std::uint32_t>>& values);

// Counts, judges, then times: in each round every cell has its turn, of some runs of which the fastest counts. A cell
// whose run takes long is timed in fewer rounds, one run each.
SweepRun run_sweep(const SweepScene& scene, const SweepPlan& plan);

// Notes of each counted cell whose work it does.
void mark_same_work(std::vector<SweepCell>& cells);

// Marks who is on the front of time against false positives, among cells of one instruction set, thread count and exact
// test. What misses a hit is on none.
void mark_front(std::vector<SweepCell>& cells);

// How many of sorted `hits` are not in sorted `found`.
std::uint64_t count_missing(const std::vector<SweepHit>& hits, const std::vector<SweepHit>& found);

// The cell to take instead of cells[of]: the fastest of those with the same instruction set, thread count and exact
// test that miss nothing, have at most most_false_positives, and are faster by 5 % in the median and in three of four
// rounds. Without a value cells[of] is best.
std::optional<std::size_t> better_cell(const std::vector<SweepCell>& cells, std::size_t of,
                                       std::uint64_t most_false_positives);

// Time of b over that of a, round by round.
Spread time_ratio(const SweepCell& a, const SweepCell& b);

}  // namespace cab::perf
