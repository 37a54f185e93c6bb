// Steps 1 to 6 of a frame for characters: bounds, collecting candidates, and the order in which tasks pair instances.
#include "engine/characters.h"

#include "engine/batch_tasks.h"
#include "engine/broad_phase/broad_phase.h"
#include "engine/broad_phase/search.h"
#include "engine/exact_convex.h"
#include "engine/in_contact.h"
#include "engine/link_pairs.h"
#include "engine/live_instances.h"
#include "engine/rest.h"
#include "engine/timed.h"
#include "engine/traverse.h"
#include "engine/update.h"
#include "layout/compiler.h"

#include <algorithm>
#include <tuple>

namespace cab {
namespace {

// ----------------------------------------------------------------------------- steps 3 to 6: a worker's candidates

// Calls report(candidate, its pairs) for every candidate in a list of leaf pairs, which must be sorted by candidate.
template <class ReportPairs>
void for_each_candidate(const Worker& worker, const FixedList<LeafPair>& list, ReportPairs&& report) {
  for (LeafPair* begin = list.begin(); begin != list.end();) {
    LeafPair* end = begin;
    while (end != list.end() && end->candidate == begin->candidate) ++end;
    report(worker.candidates.data[begin->candidate], Span<LeafPair>{begin, static_cast<std::size_t>(end - begin)});
    begin = end;
  }
}

}  // namespace

void report_leaves(const FrameContext& frame, Worker& worker, HitSink& sink) {
  if (frame.policies.exact == Exact::kConvex) keep_touching(frame, worker);
  for_each_candidate(worker, worker.found, [&](const Candidate& candidate, Span<LeafPair> pairs) {
    report_candidate(frame, candidate, pairs, worker, sink);
  });
}

namespace {

// Steps 4 to 6 where batches have strategy `links`: worker.found has link pairs whose boxes overlap, and leaf pairs of
// candidates without link boxes.
void report_links(const FrameContext& frame, Worker& worker, HitSink& sink) {
  std::swap(worker.found, worker.link_pairs);
  for_each_candidate(worker, worker.link_pairs, [&](const Candidate& candidate, Span<LeafPair> pairs) {
    if (opens_links(frame, candidate)) {
      if (frame.first_only() && is_already_reported(frame, candidate)) return;
      const Timed timed(worker.stats.seconds_test);
      find_pairs_of_links(frame, candidate, {pairs.data, pairs.size}, worker);
    } else {
      worker.found.size = static_cast<std::uint32_t>(pairs.size);
      std::copy(pairs.begin(), pairs.end(), worker.found.data);
    }
    const Timed timed(worker.stats.seconds_query);
    if (frame.policies.exact == Exact::kConvex) keep_touching(frame, worker);
    if (!worker.found.empty()) report_candidate(frame, candidate, {worker.found.data, worker.found.size}, worker, sink);
  });
}

// Returns the end of the candidates that can be tested together from `begin` on: worker.found has room for all their
// leaf pairs. A single candidate always fits.
std::uint32_t candidates_at_once(const FrameContext& frame, const Worker& worker, std::uint32_t begin) {
  std::size_t leaf_pairs = 0;
  std::uint32_t end = begin;
  for (; end < worker.candidates.size; ++end) {
    const Candidate& candidate = worker.candidates.data[end];
    leaf_pairs += std::size_t{frame.batch(candidate.batch_a).active->leaf_count} *
                  frame.batch(candidate.batch_b).active->leaf_count;
    if (end > begin && leaf_pairs > worker.found.capacity - kLanes) break;
  }
  return end;
}

// Steps 3 to 6 for the candidates that a worker has collected. Empties the list and the sets afterwards.
void test_candidates(const FrameContext& frame, Worker& worker, HitSink& sink) {
  if (worker.candidates.empty()) return;
  worker.stats.candidates += worker.candidates.size;
  const bool has_links = frame.policies.strategy != Strategy::kRows &&
                         std::any_of(worker.candidates.begin(), worker.candidates.end(),
                                     [&frame](const Candidate& candidate) { return opens_links(frame, candidate); });
  {
    const Timed timed(worker.stats.seconds_update);
    pose_set(frame, worker);
  }
  for (std::uint32_t begin = 0, end; begin < worker.candidates.size; begin = end) {
    end = candidates_at_once(frame, worker, begin);
    {
      const Timed timed(worker.stats.seconds_test);
      find_leaf_pairs(frame, begin, end, worker);
    }
    if (has_links) {
      report_links(frame, worker, sink);
    } else {
      const Timed timed(worker.stats.seconds_query);
      report_leaves(frame, worker, sink);
    }
  }
  worker.candidates.clear();
  clear_set(worker.posed);
  clear_links(worker.posed_links);
}

// ----------------------------------------------------------------------------------- step 2: candidates of a task

// How many candidates are tested at a time with Report::kInContact. Fewer than kChunkCandidates, since every instance
// that is found in contact saves later tests.
constexpr std::uint32_t kInContactCandidates = 64;

// An instance, and where it is in the world.
struct PlacedInstance {
  std::uint32_t batch, instance;
  const Placement& placement;
};

// The candidates of one task. They are tested whenever the worker's list or its set of posed instances is full.
struct CandidateCollector {
  const FrameContext& frame;
  Worker& worker;
  HitSink& sink;

  // Adds a candidate: two instances, where a has the lower key, or twice the same instance.
  void add(const PlacedInstance& a, const PlacedInstance& b) {
    Candidate candidate = {a.batch, a.instance, b.batch, b.instance};
    const bool in_contact = frame.report == Report::kInContact;
    if (in_contact && is_already_reported(frame, candidate)) return;
    if (worker.candidates.size >= (in_contact ? kInContactCandidates : kChunkCandidates) ||
        !has_room(frame, candidate, worker.posed))
      test_candidates(frame, worker, sink);
    candidate.slot_a = acquire_slot(frame, a.batch, a.instance, a.placement, worker.posed);
    candidate.slot_b = acquire_slot(frame, b.batch, b.instance, b.placement, worker.posed);
    worker.candidates.push(candidate);
  }

  // The instance of a grid entry.
  PlacedInstance placed(std::uint32_t entry) const {
    const Grid& grid = frame.broad_phase.grid;
    return {grid.entries[entry].batch, grid.entries[entry].instance, grid.placements[entry]};
  }

  // Adds the candidate of two entries, or of one twice.
  void add(const EntryPair& pair) {
    const PlacedInstance x = placed(pair.a), y = placed(pair.b);
    const bool in_order = instance_key(x.batch, x.instance) <= instance_key(y.batch, y.instance);
    add(in_order ? x : y, in_order ? y : x);
  }

  // Adds the candidate of two entries now, or later if it is of large articulations.
  void add_or_wait(const EntryPair& pair) {
    if (!has_large(pair)) return add(pair);
    if (worker.waiting.size == worker.waiting.capacity) add_waiting();
    worker.waiting.push(pair);
  }

  // Adds the candidates that wait: those between the same two runs of sixteen entries one after the other, so that few
  // instances are posed more than once.
  void add_waiting() {
    const auto runs = [](const EntryPair& pair) { return std::uint64_t{pair.a / kLanes} << 32 | pair.b / kLanes; };
    std::sort(worker.waiting.begin(), worker.waiting.end(), [&runs](const EntryPair& x, const EntryPair& y) {
      return std::make_tuple(runs(x), x.a, x.b) < std::make_tuple(runs(y), y.a, y.b);
    });
    for (const EntryPair& pair : worker.waiting) add(pair);
    worker.waiting.clear();
  }

 private:
  bool has_large(const EntryPair& pair) const {
    const Grid& grid = frame.broad_phase.grid;
    return is_large(*frame.batch(grid.entries[pair.a].batch).articulation) ||
           is_large(*frame.batch(grid.entries[pair.b].batch).articulation);
  }
};

// Whether no rule tests an instance within itself in this frame, or it rests and its hits are kept.
bool skips_within(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t instance) {
  return !batch.pairs_within || ((batch.skips_within || frame.keeps_hits) && rests(batch, instance));
}

// Whether two instances are not tested since both rest: their rule skips them, or their hits are kept.
bool skips_resting(const FrameContext& frame, std::uint32_t batch_x, std::uint32_t x, std::uint32_t batch_y,
                   std::uint32_t y) {
  return rests(frame.batch(batch_x), x) && rests(frame.batch(batch_y), y) &&
         (frame.keeps_hits || frame.broad_phase.skips_resting(batch_x, batch_y));
}

// Collects all candidates with `one` as instance a: with itself, then with its partners of higher keys in the order of
// keys.
void collect_in_key_order(CandidateCollector& collector, const PlacedInstance& one) {
  const FrameContext& frame = collector.frame;
  const InstanceBatch& batch = frame.batch(one.batch);
  if (!skips_within(frame, batch, one.instance)) collector.add(one, one);
  if (!batch.pairs_between) return;
  FixedList<Partner>& partners = collector.worker.partners;
  std::uint64_t after = instance_key(one.batch, one.instance);
  for (bool complete = false; !complete;) {
    complete = find_partners(frame, {one.batch, one.placement.bounds, after}, partners);
    for (const Partner& partner : partners) {
      const auto index = static_cast<std::uint32_t>(partner.key >> 32),
                 instance = static_cast<std::uint32_t>(partner.key);
      const InstanceBatch& other = frame.batch(index);
      if (!layers_match(batch, one.instance, other, instance)) continue;
      if (skips_resting(frame, one.batch, one.instance, index, instance)) continue;
      const Placement placement =
          partner.entry == kNoEntry ? placement_of(other, instance) : frame.broad_phase.grid.placements[partner.entry];
      collector.add(one, {index, instance, placement});
    }
    if (!complete) after = partners.data[partners.size - 1].key;
  }
}

// Collects the candidates that a grid entry reports: its instance with itself, with the instances that for_each_later
// finds in its grid, and with those of the kept grid if it is not in that itself.
void collect_in_spatial_order(CandidateCollector& collector, std::uint32_t entry) {
  const FrameContext& frame = collector.frame;
  const BroadPhase& broad = frame.broad_phase;
  const GridEntry* const entries = broad.grid.entries.data;
  const GridEntry& one = entries[entry];
  const InstanceBatch& batch = frame.batch(one.batch);
  const auto take = [&](std::uint32_t other) {
    const GridEntry& found = entries[other];
    if (layers_match(batch, one.instance, frame.batch(found.batch), found.instance) &&
        !skips_resting(frame, one.batch, one.instance, found.batch, found.instance))
      collector.add_or_wait({entry, other});
  };
  const bool in_kept = entry < broad.kept.count;
  if (in_kept && !is_kept(frame, one)) return;
  if (!skips_within(frame, batch, one.instance)) collector.add_or_wait({entry, entry});
  if (in_kept) {
    for_each_later(frame, broad.kept, entry, [&](std::uint32_t other) {
      if (is_kept(frame, entries[other])) take(other);
    });
  } else {
    for_each_later(frame, broad.grid, entry, take);
    if (frame.keeps_hits && rests(batch, one.instance)) return;  // as all that the kept grid would find
    for_each_kept(frame, one.batch, broad.grid.placements[entry].bounds, take);
  }
}

// How many instances one task pairs with others.
constexpr std::uint32_t kInstancesPerTask = 128;

std::uint32_t task_count(std::uint32_t instances) { return (instances + kInstancesPerTask - 1) / kInstancesPerTask; }

// Collects all candidates of the live instances of one task, in key order: kInstancesPerTask consecutive instances of
// the batch `index`, from run * kInstancesPerTask on.
void collect_run(CandidateCollector& collector, std::uint32_t index, std::uint32_t run) {
  const InstanceBatch& batch = collector.frame.batch(index);
  const std::uint32_t first = run * kInstancesPerTask;
  for (std::uint32_t i = first; i < std::min(batch.instance_count, first + kInstancesPerTask); ++i) {
    if (!(batch.live[i / kLanes] >> (i % kLanes) & 1)) continue;
    const Placement placement = placement_of(batch, i);
    collect_in_key_order(collector, {index, i, placement});
  }
}

// The entries of the grids that are paired with others: those of the kept grid only if two that rest are tested.
struct EntryRange {
  std::uint32_t begin, end;
};
EntryRange entries_to_pair(const FrameContext& frame) {
  const BroadPhase& broad = frame.broad_phase;
  const bool tests_resting = broad.reports_resting && !frame.keeps_hits;
  return {tests_resting ? 0 : broad.kept.count, broad.kept.count + broad.grid.count};
}

// Runs one task: collect(collector) adds its candidates, and the last ones are tested at its end. Time outside of steps
// 3 to 6 counts as broad phase.
template <class Collect>
void run_task(const FrameContext& frame, std::uint32_t task, Worker& worker, HitSink& sink, Collect&& collect) {
  worker.task = task;
  const Clock::time_point start = Clock::now();
  const auto others = [&worker] {
    return worker.stats.seconds_update + worker.stats.seconds_test + worker.stats.seconds_query;
  };
  const double before = others();
  CandidateCollector collector = {frame, worker, sink};
  collect(collector);
  collector.add_waiting();
  test_candidates(frame, worker, sink);
  worker.stats.seconds_broad += seconds_since(start) - (others() - before);
}

// ------------------------------------------------------------------------------------------------ step 1: bounds

// Counts an instance whose bounds leave those that the caller gives. Boxes of links are larger and say nothing.
void count_beyond_bounds(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t instance,
                         FrameStats& stats) {
  if (batch.input->bounds.empty() || batch.active != batch.articulation) return;
  const InstanceBounds &is = batch.bounds[instance], given = given_bounds(batch, instance, frame.margin);
  bool inside = true;
  for (int c = 0; c < 3; ++c) inside = inside && is.lo[c] >= given.lo[c] && is.hi[c] <= given.hi[c];
  stats.instances_beyond_bounds += !inside;
}

// Poses one tile, and stores which instances are live and their bounds.
void bound_tile(const FrameContext& frame, const TileInstances& instances, InstanceBatch& batch, Worker& worker) {
  const std::uint32_t live = update_and_flag_tile(
      frame, {&batch, instances, RefitScope::kLeaves, worker.boxes.data, worker.bounds.data}, worker);
  set_live(instances, live, batch);
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) batch.hit_chains[instances.instance[lane]] = {};
  if (!is_axis_aligned(frame.policies.refit))
    frame.kernels.bound_boxes(worker.boxes.data, posed_articulation(*batch.active).leaf_count, worker.bounds.data);
  bound_instances(frame.kernels, batch, instances, live, worker.bounds.data, worker.histogram);
  for (std::uint32_t left = live; left; left &= left - 1)
    count_beyond_bounds(frame, batch, instances.instance[lowest_bit(left)], worker.stats);
}

// Keeps the bounds of an instance that rests.
void keep_instance(const FrameContext& frame, std::uint32_t instance, InstanceBatch& batch, Worker& worker) {
  batch.rest[instance] |= kRests;
  batch.hit_chains[instance] = {};
  if (!batch.input->flags.empty()) batch.input->flags[instance] = kInstanceOk;
  ++worker.stats.instances_resting;
  keep_bounds(batch, instance, worker);
  count_beyond_bounds(frame, batch, instance, worker.stats);
}

// How many instances one task looks at where some rest. A multiple of kLanes, so that no two tasks share a word of live
// bits.
constexpr std::uint32_t kRestingPerTask = 32 * kLanes;

// Bounds the instances of one task in a batch where some rest: those that have moved, by tiles of sixteen.
void bound_moved(const FrameContext& frame, std::uint32_t task, InstanceBatch& batch, Worker& worker) {
  TileInstances moved;
  moved.count = 0;
  const std::uint32_t end = std::min(given_count(batch), (task + 1) * kRestingPerTask);
  for (std::uint32_t place = task * kRestingPerTask; place < end; ++place) {
    const std::uint32_t i = given_instance(batch, place);
    if (goes_on_resting(batch, i)) {
      keep_instance(frame, i, batch, worker);
      continue;
    }
    batch.rest[i] = 0;
    clear_live(i, batch);
    prefetch_pose(batch, i);
    moved.instance[moved.count++] = i;
    if (moved.count < kLanes) continue;
    bound_tile(frame, moved, batch, worker);
    moved.count = 0;
  }
  if (moved.count > 0) bound_tile(frame, moved, batch, worker);
}

}  // namespace

std::uint32_t begin_bounding(FrameRun& run) {
  for (const BatchInput& input : run.job.inputs)
    if (InstanceBatch& batch = run.engine.batch(input.batch); batch.kind == BatchKind::kCharacters)
      clear_not_given(batch);
  return lay_out_tasks(run.engine.stored_batches(), [](const InstanceBatch& batch) {
    if (!batch.input || batch.kind != BatchKind::kCharacters) return 0u;
    return batch.may_rest ? (given_count(batch) + kRestingPerTask - 1) / kRestingPerTask
                          : tile_count(given_count(batch));
  });
}

void bound_characters(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  const FrameContext& frame = *run.characters;
  const BatchTask of = batch_task(frame.batches, task);
  InstanceBatch& batch = run.engine.batches[of.batch]->batch;
  Worker& worker = run.worker(w);
  const Timed timed(worker.stats.seconds_update), bounded(worker.stats.seconds_bound);
  if (batch.may_rest) return bound_moved(frame, of.run, batch, worker);
  for (std::uint32_t i = (of.run + 1) * kLanes; i < std::min(given_count(batch), (of.run + 2) * kLanes); ++i)
    prefetch_pose(batch, given_instance(batch, i));
  bound_tile(frame, instances_of(batch, of.run), batch, worker);
}

std::uint32_t begin_spatial_order(FrameRun& run) {
  std::uint32_t& frames_in_key_order = run.engine.hit_store.frames_in_key_order;
  run.in_key_order = frames_in_key_order > 0;
  if (run.in_key_order) {
    --frames_in_key_order;
    return 0;
  }
  run.sink.in_spatial_order = true;
  for (const auto& worker : run.engine.pool.workers) worker->stats_before = worker->stats;
  // Without a rule that reports two that rest there is nothing to keep.
  run.characters->keeps_hits = run.has_last_hits && run.engine.broad_phase.reports_resting;
  if (run.characters->keeps_hits) keep_hits(run);
  const EntryRange entries = entries_to_pair(*run.characters);
  return lay_out_tasks(
      run.engine.stored_batches(),
      [](const InstanceBatch& batch) {  // those that are in no grid
        return batch.pairs_within && !batch.pairs_between ? task_count(batch.instance_count) : 0;
      },
      task_count(entries.end - entries.begin));
}

void pair_in_spatial_order(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  if (run.sink.store_full) return;
  const FrameContext& frame = *run.characters;
  const EntryRange entries = entries_to_pair(frame);
  const std::uint32_t first = entries.begin + task * kInstancesPerTask;
  run_task(frame, task, run.worker(w), run.sink, [&](CandidateCollector& collector) {
    if (task < task_count(entries.end - entries.begin)) {
      const std::uint32_t end = std::min(entries.end, first + kInstancesPerTask);
      for (std::uint32_t entry = first; entry < end; ++entry) collect_in_spatial_order(collector, entry);
    } else {
      const BatchTask of = batch_task(frame.batches, task);
      collect_run(collector, of.batch, of.run);
    }
  });
  store_groups(frame, run.worker(w), run.sink);
}

std::uint32_t begin_key_order(FrameRun& run) {
  if (!run.in_key_order) return 0;
  begin_turns(run.sink);
  return lay_out_tasks(run.engine.stored_batches(), [](const InstanceBatch& batch) {
    return batch.pairs_within || batch.pairs_between ? task_count(batch.instance_count) : 0;
  });
}

void pair_in_key_order(FrameRun& run, std::uint32_t, std::uint32_t w) {
  const std::uint32_t task = run.sink.next++;
  const BatchTask of = batch_task(run.characters->batches, task);
  run_task(*run.characters, task, run.worker(w), run.sink,
           [&](CandidateCollector& collector) { collect_run(collector, of.batch, of.run); });
  finish_task(run.worker(w), run.sink);
}

void end_spatial_order(FrameRun& run) {
  constexpr std::uint32_t kFramesInKeyOrder = 16;  // frames to pair in key order after hits did not fit into the store
  run.sink.in_spatial_order = false;
  if (!run.sink.store_full) return;
  for (const auto& worker : run.engine.pool.workers) {
    worker->stats = worker->stats_before;
    worker->words.clear();
  }
  run.in_key_order = true;
  run.characters->keeps_hits = false;  // all are tested
  run.engine.hit_store.frames_in_key_order = kFramesInKeyOrder;
}

}  // namespace cab
