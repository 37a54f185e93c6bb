// The cells of `cab sweep`: policies by instruction sets by thread counts on one scene, counted, judged and timed in
// turns.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/statistics.h"
#include "perf/measure/sweep/scenes.h"

namespace cab::perf {

// One policy on one instruction set and thread count.
struct SweepCell {
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;

  FrameStats counts;       // of all frames, once
  std::uint64_t hits = 0;  // link pairs, of all frames
  std::uint64_t hits_hash = 0;
  std::uint64_t misses = 0;           // true hits that this cell did not find
  std::uint64_t false_positives = 0;  // leaf pairs whose boxes overlap and whose shapes are apart
  std::vector<FrameStats> rounds;     // times of all frames: per round, the fastest run of the cell's turn
  bool on_front = false;              // no cell of its group that misses nothing is as fast with as few false positives
  // The first strategy of the table that does the same work, if it is another strategy: `auto` does the work of the
  // strategy that it chooses. Such a cell is not timed again and is on no front.
  std::optional<Strategy> same_work_as;

  std::vector<double> totals() const;  // seconds of each round
  double total_seconds() const { return median(totals()); }
};

struct SweepRun {
  std::string scene;
  std::uint32_t character_count = 0;
  std::size_t most_leaves = 0;
  std::uint32_t frame_count = 0;
  std::uint64_t true_hits = 0;
  std::string judge;  // the exact test that found the true hits, and on which pairs
  std::vector<SweepCell> cells;
};

struct SweepPlan {
  std::vector<Policies> policies;
  std::vector<Isa> isas;
  std::vector<std::uint32_t> thread_counts;
  std::uint32_t rounds = 0;
};

// The defaults first, then every combination of values of the rows of policy_table(). A row has the values values[row].
// If that is empty, it has all values, or for `exact` the default. Left out are, for strategies that descend no
// hierarchy, those that differ only in inner boxes.
std::vector<Policies> choose_policies(const std::vector<std::vector<std::uint32_t>>& values);

// Counts, judges, then times. In each round every cell has a turn: some runs, of which the fastest counts. A cell whose
// run takes long is timed in fewer rounds, with one run per turn.
SweepRun run_sweep(const SweepScene& scene, const SweepPlan& plan);

// Sets same_work_as of every counted cell.
void mark_same_work(std::vector<SweepCell>& cells);

// Marks the cells on the Pareto front of time and false positives, among the cells of one instruction set, thread count
// and exact test. A cell that misses a hit is on no front.
void mark_front(std::vector<SweepCell>& cells);

// How many of sorted `hits` are not in sorted `found`.
std::uint64_t count_missing(const std::vector<SweepHit>& hits, const std::vector<SweepHit>& found);

// The cell to take instead of cells[of], or no value if cells[of] is best. It is the fastest of the cells that have the
// same instruction set, thread count and exact test, miss nothing, and have at most most_false_positives. It must take
// 5 % less time in the median, and less time in three of four rounds.
std::optional<std::size_t> better_cell(const std::vector<SweepCell>& cells, std::size_t of,
                                       std::uint64_t most_false_positives);

// The time of b over that of a, round by round.
Spread time_ratio(const SweepCell& a, const SweepCell& b);

}  // namespace cab::perf
