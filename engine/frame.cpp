// One frame, step by step: pose, broad phase, refit, pairs, exact, results.
#include "engine/frame.h"

#include "engine/auto_strategy.h"
#include "engine/in_contact.h"
#include "engine/link_pairs.h"
#include "engine/posed_set.h"
#include "engine/report.h"
#include "engine/search_grid.h"
#include "engine/timed.h"
#include "engine/traverse.h"
#include "engine/update.h"
#include "engine/validate.h"
#include "kernels/descend_tiles.h"
#include "kernels/float_mode.h"
#include "kernels/pose_leaves.h"

#include <algorithm>
#include <exception>

namespace cab {
namespace {

bool is_within(const PairRule& rule) { return rule.pairing == Pairing::kWithin; }

// Whether a frame is over before other threads would begin. Measured with uniform crowds and two threads of TBB, whose
// start takes about 5 microseconds for each of a frame's five loops: they are even at about 300 characters.
bool is_small(Engine& engine, const FrameJob& job, const Policies& policies) {
  constexpr std::uint32_t kSmall = 320;
  if (policies.strategy != Strategy::kRows || policies.exact != Exact::kNone) return false;
  std::uint32_t count = 0;
  for (const BatchInput& input : job.inputs) {
    if (engine.batch(input.batch).kind != BatchKind::kCharacters) return false;
    count += std::min(engine.batch(input.batch).instance_count, kSmall + 1);
    if (count > kSmall) return false;
  }
  return true;
}

// ------------------------------------------------------------------------------------------------- characters

// Step 1, all character batches: bounds every instance, by posing its leaves.
void bound_characters(Engine& engine, const FrameJob& job, Policies policies) {
  if (policies.strategy != Strategy::kExactAll)
    policies.strategy = Strategy::kBrute;  // of whose boxes only leaves are made
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    engine.tasks->for_each(tile_count(batch.instance_count), [&](std::uint32_t tile, std::uint32_t w) {
      Worker& worker = *engine.workers[w];
      const Timed timed(worker.stats.seconds_update);
      for (std::uint32_t i = (tile + 1) * kLanes; i < std::min(batch.instance_count, (tile + 2) * kLanes); ++i)
        prefetch_pose(batch, i);
      batch.live[tile] =
          static_cast<std::uint16_t>(update_tile(engine, batch, policies, job.margin, instances_of(batch, tile), true,
                                                 worker, worker.boxes.data, worker.bounds.data));
      if (!is_axis_aligned(policies.refit))
        engine.kernels->bound_boxes(worker.boxes.data, batch.active->leaf_count, worker.bounds.data);
      bound_instances(engine, batch, tile, worker.bounds.data, worker);
      std::fill_n(batch.stored.data + tile * kLanes, std::min(kLanes, batch.instance_count - tile * kLanes),
                  StoredHits{});
    });
  }
}

// Calls report(candidate, pairs) for the pairs of each candidate of a list that is grouped by candidates.
template <class ReportPairs>
void for_each_candidate(const Worker& worker, const FixedList<LeafPair>& list, ReportPairs&& report) {
  for (LeafPair* begin = list.begin(); begin != list.end();) {
    LeafPair* end = begin;
    while (end != list.end() && end->candidate == begin->candidate) ++end;
    report(worker.candidates.data[begin->candidate], Span<LeafPair>{begin, static_cast<std::size_t>(end - begin)});
    begin = end;
  }
}

// Steps 4 to 6 for the candidates of which boxes overlap: leaves, or by strategy links those of links so far.
void report_candidates(Engine& engine, const Policies& policies, bool first_only, std::uint32_t task, Worker& worker,
                       HitSink& sink) {
  if (policies.strategy != Strategy::kLinks) {
    const Timed timed(worker.stats.seconds_query);
    for_each_candidate(worker, worker.found, [&](const Candidate& candidate, Span<LeafPair> pairs) {
      report_candidate(engine, candidate, pairs, task, worker, sink);
    });
    return;
  }
  std::swap(worker.found, worker.link_pairs);
  for_each_candidate(worker, worker.link_pairs, [&](const Candidate& candidate, Span<LeafPair> links) {
    if (first_only && is_already_reported(engine, candidate)) return;
    {
      const Timed timed(worker.stats.seconds_test);
      find_pairs_of_links(engine, policies, sink.job->margin, candidate, {links.data, links.size}, first_only, worker);
    }
    const Timed timed(worker.stats.seconds_query);
    if (!worker.found.empty())
      report_candidate(engine, candidate, {worker.found.data, worker.found.size}, task, worker, sink);
  });
}

// The end of the candidates from `begin` on whose leaf pairs the worker's list can hold; one always fits.
std::uint32_t candidates_at_once(const Engine& engine, const Worker& worker, std::uint32_t begin) {
  std::size_t leaf_pairs = 0;
  std::uint32_t end = begin;
  for (; end < worker.candidates.size; ++end) {
    const Candidate& candidate = worker.candidates.data[end];
    leaf_pairs += std::size_t{engine.batches[candidate.batch_a]->batch.active->leaf_count} *
                  engine.batches[candidate.batch_b]->batch.active->leaf_count;
    if (end > begin && leaf_pairs > worker.found.capacity - kLanes) break;
  }
  return end;
}

// Steps 3 to 6 for the candidates that a worker has gathered.
void test_candidates(Engine& engine, const Policies& policies, std::uint32_t task, Worker& worker, HitSink& sink) {
  if (worker.candidates.empty()) return;
  worker.stats.candidates += worker.candidates.size;
  {
    const Timed timed(worker.stats.seconds_update);
    pose_set(engine, policies, sink.job->margin, worker);
  }
  const bool first_only = sink.job->report == Report::kInContact && policies.exact == Exact::kNone;
  for (std::uint32_t begin = 0, end; begin < worker.candidates.size; begin = end) {
    end = candidates_at_once(engine, worker, begin);
    {
      const Timed timed(worker.stats.seconds_test);
      find_leaf_pairs(engine, policies, first_only && policies.strategy != Strategy::kLinks, begin, end, worker);
    }
    report_candidates(engine, policies, first_only, task, worker, sink);
  }
  worker.candidates.clear();
  clear_set(worker);
}

// Candidates that are tested at a time where only touching is asked for: what a test tells spares others.
constexpr std::uint32_t kInContactCandidates = 64;

// An instance and where it is.
struct PlacedInstance {
  std::uint32_t batch, instance;
  const Placement& placement;
};

// One task's way to its candidates: they are tested whenever as many are gathered as a worker can hold.
struct Gathering {
  Engine& engine;
  const Policies& policies;
  std::uint32_t task;
  Worker& worker;
  HitSink& sink;

  // Adds two instances, of which a has the lower key, or one against itself.
  void add(const PlacedInstance& a, const PlacedInstance& b) {
    Candidate candidate = {a.batch, a.instance, b.batch, b.instance};
    const bool in_contact = sink.job->report == Report::kInContact;
    if (in_contact && is_already_reported(engine, candidate)) return;
    if (worker.candidates.size >= (in_contact ? kInContactCandidates : kChunkCandidates) ||
        !has_room(engine, candidate, worker))
      test_candidates(engine, policies, task, worker, sink);
    candidate.slot_a = acquire_slot(engine, policies, a.batch, a.instance, a.placement, worker);
    candidate.slot_b = acquire_slot(engine, policies, b.batch, b.instance, b.placement, worker);
    worker.candidates.push(candidate);
  }
};

// Gathers everything that one instance is tested against: itself, and its partners with a higher key, in the order of
// hits.
void gather_in_key_order(Gathering& gathering, const PlacedInstance& placed) {
  Engine& engine = gathering.engine;
  const InstanceBatch& batch = engine.batches[placed.batch]->batch;
  if (batch.pairs_within) gathering.add(placed, placed);
  if (!batch.pairs_between) return;
  std::uint64_t after = instance_key(placed.batch, placed.instance);
  const bool all = gathering.policies.strategy == Strategy::kExactAll;
  for (bool complete = false; !complete;) {
    Worker& worker = gathering.worker;
    complete = find_partners(engine, placed.batch, placed.placement.bounds, after, all, worker);
    for (const Partner& partner : worker.partners) {
      const auto index = static_cast<std::uint32_t>(partner.key >> 32),
                 instance = static_cast<std::uint32_t>(partner.key);
      const InstanceBatch& other = engine.batches[index]->batch;
      if (!layers_match(batch, placed.instance, other, instance)) continue;
      const Placement placement =
          partner.entry == kNoEntry ? placement_of(other, instance) : engine.grid.placements[partner.entry];
      gathering.add(placed, {index, instance, placement});
    }
    if (!complete) after = worker.partners.data[worker.partners.size - 1].key;
  }
}

// Gathers what the instance of one grid entry is tested against: itself, and the entries that it finds.
void gather_in_spatial_order(Gathering& gathering, std::uint32_t entry) {
  const Engine& engine = gathering.engine;
  const Grid& grid = engine.grid;
  const auto placed = [&grid](std::uint32_t at) {
    return PlacedInstance{grid.entries[at].batch, grid.entries[at].instance, grid.placements[at]};
  };
  const PlacedInstance one = placed(entry);
  const InstanceBatch& batch = engine.batches[one.batch]->batch;
  if (batch.pairs_within) gathering.add(one, one);
  for_each_later(engine, entry, [&](std::uint32_t other_entry) {
    const PlacedInstance other = placed(other_entry);
    if (!layers_match(batch, one.instance, engine.batches[other.batch]->batch, other.instance)) return;
    if (instance_key(one.batch, one.instance) < instance_key(other.batch, other.instance))
      gathering.add(one, other);
    else
      gathering.add(other, one);
  });
}

// Pairs characters of one task: gather(gathering) brings its candidates. Time is split between the steps.
template <class Gather>
void timed_task(Engine& engine, const Policies& policies, std::uint32_t task, std::uint32_t w, HitSink& sink,
                Gather&& gather) {
  Worker& worker = *engine.workers[w];
  const Clock::time_point start = Clock::now();
  const auto others = [&worker] {
    return worker.stats.seconds_update + worker.stats.seconds_test + worker.stats.seconds_query;
  };
  const double before = others();
  Gathering gathering = {engine, policies, task, worker, sink};
  gather(gathering);
  test_candidates(engine, policies, task, worker, sink);
  worker.stats.seconds_broad += seconds_since(start) - (others() - before);
}

constexpr std::uint32_t kInstancesPerTask = 128;

std::uint32_t task_count(std::uint32_t instances) { return (instances + kInstancesPerTask - 1) / kInstancesPerTask; }

// Gathers for a run of instances of a batch that follow each other.
void gather_run(Gathering& gathering, std::uint32_t index, std::uint32_t run) {
  const InstanceBatch& batch = gathering.engine.batches[index]->batch;
  const std::uint32_t first = run * kInstancesPerTask;
  for (std::uint32_t i = first; i < std::min(batch.instance_count, first + kInstancesPerTask); ++i) {
    if (!(batch.live[i / kLanes] >> (i % kLanes) & 1)) continue;
    const Placement placement = placement_of(batch, i);
    gather_in_key_order(gathering, {index, i, placement});
  }
}

// Steps 2 to 6 of all character batches, in the order of hits.
void pair_in_key_order(Engine& engine, const Policies& policies, HitSink& sink) {
  std::uint32_t tasks = 0;
  for (const auto& slot : engine.batches) {
    slot->batch.first_task = tasks;
    if (slot->batch.pairs_within || slot->batch.pairs_between) tasks += task_count(slot->batch.instance_count);
  }
  engine.tasks->for_each_in_turn(tasks, [&](std::uint32_t task, std::uint32_t w) {
    const auto above = std::upper_bound(engine.batches.begin(), engine.batches.end(), task,
                                        [](std::uint32_t t, const auto& slot) { return t < slot->batch.first_task; });
    const std::uint32_t index = static_cast<std::uint32_t>(above - engine.batches.begin()) - 1;
    const std::uint32_t run = task - engine.batches[index]->batch.first_task;
    timed_task(engine, policies, task, w, sink, [&](Gathering& gathering) { gather_run(gathering, index, run); });
    finish_task(task, *engine.workers[w], sink);
  });
}

// The same in spatial order, that of the grid's entries: what is posed and read for one character is still in cache for the next.
// False when the store is too small for the hits, of which none are left then.
bool pair_in_spatial_order(Engine& engine, const Policies& policies, HitSink& sink) {
  sink.in_spatial_order = true;
  for (const auto& worker : engine.workers) worker->stats_before = worker->stats;
  const Grid& grid = engine.grid;
  engine.tasks->for_each(task_count(grid.count), [&](std::uint32_t task, std::uint32_t w) {
    if (sink.store_full) return;
    timed_task(engine, policies, task, w, sink, [&](Gathering& gathering) {
      const std::uint32_t end = std::min(grid.count, (task + 1) * kInstancesPerTask);
      for (std::uint32_t entry = task * kInstancesPerTask; entry < end; ++entry)
        gather_in_spatial_order(gathering, entry);
    });
    store_hits(engine, *engine.workers[w], sink);
  });
  for (std::uint32_t index = 0; index < engine.batches.size(); ++index) {
    const InstanceBatch& batch = engine.batches[index]->batch;
    if (!batch.pairs_within || batch.pairs_between) continue;  // not in the grid
    engine.tasks->for_each(task_count(batch.instance_count), [&](std::uint32_t task, std::uint32_t w) {
      if (sink.store_full) return;
      timed_task(engine, policies, task, w, sink, [&](Gathering& gathering) { gather_run(gathering, index, task); });
      store_hits(engine, *engine.workers[w], sink);
    });
  }
  sink.in_spatial_order = false;
  if (!sink.store_full) return true;
  for (const auto& worker : engine.workers) {
    worker->stats = worker->stats_before;
    worker->words.clear();
  }
  return false;
}

// Steps 2 to 6 of all character batches.
void pair_characters(Engine& engine, const Policies& policies, HitSink& sink) {
  constexpr std::uint32_t kFramesInKeyOrder = 16;  // after one whose hits the store could not hold
  if (policies.strategy == Strategy::kExactAll) {  // the grid is not asked
    pair_in_key_order(engine, policies, sink);
    return;
  }
  if (engine.frames_in_key_order > 0) {
    --engine.frames_in_key_order;
  } else if (pair_in_spatial_order(engine, policies, sink)) {
    write_stored_hits(engine, sink);
    return;
  } else {
    engine.frames_in_key_order = kFramesInKeyOrder;
  }
  pair_in_key_order(engine, policies, sink);
}

// ----------------------------------------------------------------------------------------------------- sequences

std::uint32_t tile_of(const InstanceBatch& batch, std::uint32_t tile) { return batch.instance_count == 1 ? 0 : tile; }

// Differences of origins in one tile, b less a; false when every one is zero.
bool shift_of(const InstanceBatch& a, const InstanceBatch& b, std::uint32_t tile, ShiftTile* out) {
  if (a.input->origins.empty() && b.input->origins.empty()) return false;
  bool any = false;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t in_a = std::min(tile_of(a, tile) * kLanes + lane, a.instance_count - 1);
    const std::uint32_t in_b = std::min(tile_of(b, tile) * kLanes + lane, b.instance_count - 1);
    for (std::uint32_t c = 0; c < 3; ++c) {
      out->by[c][lane] = origin_of(b, in_b, c) - origin_of(a, in_a, c);
      any = any || out->by[c][lane] != 0;
    }
  }
  return any;
}

// The lanes of one tile whose instances have matching layers. Lanes past the last instance repeat it.
std::uint32_t lanes_with_matching_layers(const InstanceBatch& a, const InstanceBatch& b, std::uint32_t tile) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t in_a = std::min(tile_of(a, tile) * kLanes + lane, a.instance_count - 1);
    const std::uint32_t in_b = std::min(tile_of(b, tile) * kLanes + lane, b.instance_count - 1);
    out |= std::uint32_t{layers_match(a, in_a, b, in_b)} << lane;
  }
  return out;
}

// Step 4 for one rule and one tile: both hierarchies, frames as lanes.
template <class Tile>
void descend(Worker& worker, const InstanceBatch& a, const InstanceBatch& b, const Tile* nodes,
             void (*kernel)(kernel::TileDescent<Tile>&), const ShiftTile* shift, std::uint32_t lanes, bool self) {
  kernel::TileDescent<Tile> descent;
  descent.articulation_a = a.articulation;
  descent.articulation_b = b.articulation;
  descent.nodes_a = nodes + a.worker_nodes;
  descent.nodes_b = nodes + b.worker_nodes;
  descent.shift = shift;
  descent.lanes = lanes;
  descent.self = self;
  descent.stack = worker.tile_stack;
  descent.found = worker.tile_found;
  descent.found.clear();
  descent.box_tests = 0;
  kernel(descent);
  worker.tile_found.size = descent.found.size;
  worker.stats.box_tests += descent.box_tests;
}

// The same without boxes: every leaf pair that is not ignored, in all lanes.
void list_all_pairs(Worker& worker, const InstanceBatch& a, const InstanceBatch& b, std::uint32_t lanes, bool self) {
  worker.tile_found.clear();
  const Articulation &art_a = *a.articulation, &art_b = *b.articulation;
  for (std::uint32_t i = 0; i < art_a.leaf_count; ++i)
    for (std::uint32_t j = self ? i + 1 : 0; j < art_b.leaf_count; ++j)
      if (!self || !is_ignored(art_a, art_a.leaf_link[i], art_a.leaf_link[j]))
        worker.tile_found.push({static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), lanes});
}

void test_sequences(Engine& engine, const Policies& policies, const PairRule& rule, std::uint32_t tile, Worker& worker,
                    HitSink& sink) {
  const std::uint32_t index_a = std::min(rule.a.value, rule.b.value) - 1,
                      index_b = std::max(rule.a.value, rule.b.value) - 1;
  const InstanceBatch& a = engine.batches[index_a]->batch;
  const InstanceBatch& b = engine.batches[index_b]->batch;
  const std::uint32_t instances = std::max(a.instance_count, b.instance_count);
  if (tile >= tile_count(instances)) return;
  const std::uint32_t in_tile = (2u << (std::min(kLanes, instances - tile * kLanes) - 1)) - 1;
  const auto live = [&](const InstanceBatch& batch, std::uint32_t index) {
    return batch.instance_count == 1 && instances > 1 ? (worker.live[index] & 1 ? 0xffffu : 0u) : worker.live[index];
  };
  std::uint32_t lanes = in_tile & live(a, index_a) & live(b, index_b);
  if (!is_within(rule)) lanes &= lanes_with_matching_layers(a, b, tile);
  const auto candidate_of = [&](std::uint32_t lane) -> Candidate {
    const std::uint32_t frame = tile * kLanes + lane;
    return {index_a, a.instance_count == 1 ? 0 : frame, index_b, b.instance_count == 1 ? 0 : frame};
  };
  if (sink.job->report == Report::kInContact)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      if ((lanes >> lane & 1) && is_already_reported(engine, candidate_of(lane))) lanes &= ~(1u << lane);
  if (!lanes) return;
  {
    const Timed timed(worker.stats.seconds_test);
    const bool self = is_within(rule), brute = policies.strategy != Strategy::kTree;
    const kernel::KernelTable& kernels = *engine.kernels;
    ShiftTile shift;
    const ShiftTile* by = !self && shift_of(a, b, tile, &shift) ? &shift : nullptr;
    if (policies.strategy == Strategy::kExactAll)
      list_all_pairs(worker, a, b, lanes, self);
    else if (is_axis_aligned(policies.refit))
      descend(worker, a, b, worker.bounds.data, brute ? kernels.brute_aabbs : kernels.descend_aabbs, by, lanes, self);
    else
      descend(worker, a, b, worker.boxes.data,
              (brute ? kernels.brute_boxes : kernels.descend_boxes)[static_cast<std::size_t>(policies.sat)], by, lanes,
              self);
  }
  const Timed timed(worker.stats.seconds_query);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    worker.found.clear();
    for (const TilePair& pair : worker.tile_found)
      if (pair.lanes >> lane & 1) worker.found.push({lane, pair.a, pair.b});
    if (worker.found.empty()) continue;
    report_candidate(engine, candidate_of(lane), {worker.found.data, worker.found.size}, tile, worker, sink);
  }
}

// All steps for sequences, a tile at a time while it is in cache: update every batch's tile, then test it.
void run_sequences(Engine& engine, const FrameJob& job, const Policies& policies, HitSink& sink) {
  std::uint32_t tiles = 0;
  for (const BatchInput& input : job.inputs)
    if (engine.batch(input.batch).kind == BatchKind::kSequence)
      tiles = std::max(tiles, tile_count(engine.batch(input.batch).instance_count));
  if (tiles == 0) return;
  sink.turn = 0;
  sink.sorted = false;
  engine.tasks->for_each_in_turn(tiles, [&](std::uint32_t tile, std::uint32_t w) {
    Worker& worker = *engine.workers[w];
    for (const BatchInput& input : job.inputs) {
      const InstanceBatch& batch = engine.batch(input.batch);
      if (batch.kind != BatchKind::kSequence || tile_of(batch, tile) >= tile_count(batch.instance_count)) continue;
      const Timed timed(worker.stats.seconds_update);
      const bool report = tile == tile_of(batch, tile);  // a table is posed again for every tile, and reported once
      worker.live[input.batch.value - 1] =
          update_tile(engine, batch, policies, job.margin, instances_of(batch, tile_of(batch, tile)), report, worker,
                      worker.boxes.data + batch.worker_nodes, worker.bounds.data + batch.worker_nodes);
    }
    for (const PairRule& rule : job.rules)
      if (engine.batch(rule.a).kind == BatchKind::kSequence) test_sequences(engine, policies, rule, tile, worker, sink);
    finish_task(tile, worker, sink);
  });
}

// ---------------------------------------------------------------------------------------------------- results

void add(FrameStats& sum, const FrameStats& part) {
  sum.candidates += part.candidates;
  sum.box_tests += part.box_tests;
  sum.leaf_pairs += part.leaf_pairs;
  sum.exact_tests += part.exact_tests;
  sum.false_positives += part.false_positives;
  sum.instances_masked += part.instances_masked;
  sum.seconds_update += part.seconds_update;
  sum.seconds_broad += part.seconds_broad;
  sum.seconds_test += part.seconds_test;
  sum.seconds_query += part.seconds_query;
  sum.seconds_contact += part.seconds_contact;
}

}  // namespace

Call::Call(Engine& engine) : engine_(engine), admitted_(!engine.busy.test_and_set(std::memory_order_acquire)) {}

Call::~Call() {
  if (!admitted_) return;
  for (const auto& slot : engine_.batches) {
    slot->batch.input = nullptr;
    slot->batch.pairs_between = slot->batch.pairs_within = false;
  }
  engine_.busy.clear(std::memory_order_release);
}

void Call::bind(const BatchInput& input) {
  InstanceBatch& batch = engine_.batch(input.batch);
  batch.input = &input;
  batch.active = batch.articulation;
  const std::size_t pose_bytes = kernel::pose_float_count(input.poses.format) * sizeof(float);
  batch.link_stride = input.poses.link_stride ? input.poses.link_stride : pose_bytes;
  batch.instance_stride =
      input.poses.instance_stride ? input.poses.instance_stride : batch.articulation->link_count * batch.link_stride;
}

Status run_frame(Engine& engine, FrameJob& job) noexcept try {
  const Clock::time_point start = Clock::now();
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;  // before the checks: they compare numbers too, and must not trap
  if (const Status status = bind_inputs(engine, call, job.inputs); status != Status::kOk) return status;
  if (const Status status = validate_job(engine, job); status != Status::kOk) return status;
  for (const auto& worker : engine.workers) worker->stats = {};
  for (const BatchInput& input : job.inputs)
    std::fill(input.in_contact.begin(), input.in_contact.end(), std::uint8_t{0});

  HitSink sink{&job};
  const Policies policies = resolve_characters(engine, job);
  for (const BatchInput& input : job.inputs)
    if (policies.strategy == Strategy::kLinks && engine.batch(input.batch).kind == BatchKind::kCharacters)
      engine.batch(input.batch).active = &engine.batch(input.batch).link_bounds->links;
  engine.tasks->alone = is_small(engine, job, policies);
  begin_grid(engine, job);
  bound_characters(engine, job, policies);
  {
    const Timed timed(engine.workers[0]->stats.seconds_broad);
    build_grid(engine);
  }
  pair_characters(engine, policies, sink);
  run_sequences(engine, job, resolve_sequences(engine, job), sink);
  const Status status = finish_hits(engine, sink);

  job.stats = {};
  for (const auto& worker : engine.workers) add(job.stats, worker->stats);
  job.stats.seconds_total = seconds_since(start);
  return status;
} catch (const std::exception&) {
  return Status::kOutOfMemory;  // what TBB throws when it finds no memory for its tasks
}

}  // namespace cab
