// One frame, step by step: pose, broad phase, refit, pairs, exact, results.
#include "engine/frame.h"

#include "engine/broad_phase.h"
#include "engine/report.h"
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

// What `auto` stands for in this frame.
Policies resolved(const Engine& engine, const FrameJob& job) {
  Policies out = job.policies;
  if (out.strategy != Strategy::kAuto) return out;
  out.strategy = Strategy::kRows;
  for (const BatchInput& input : job.inputs)
    if (engine.batches[input.batch.value - 1]->batch.articulation->leaf_count > kRowsMaxLeaves)
      out.strategy = Strategy::kTree;
  return out;
}

// ------------------------------------------------------------------------------------------------- characters

// Steps 1 and 3, all character batches: poses and refits every tile into rows, and bounds its instances.
void update_characters(Engine& engine, const FrameJob& job, const Policies& policies) {
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    engine.schedule->for_each(tile_count(batch.instance_count), [&](std::uint32_t tile, std::uint32_t w) {
      Worker& worker = *engine.workers[w];
      const Timed timed(worker.stats.seconds_update);
      const kernel::KernelTable& kernels = *engine.kernels;
      const std::uint32_t nodes = batch.articulation->node_count, leaves = batch.articulation->leaf_count;
      const std::uint32_t first = tile * kLanes;
      const std::uint32_t live = std::min(kLanes, batch.instance_count - first);
      batch.live[tile] = static_cast<std::uint16_t>(
          update_tile(engine, batch, policies, tile, true, worker, worker.boxes.data, worker.bounds.data));
      const std::size_t row = std::size_t{first} * nodes;
      const std::uint32_t made = policies.strategy == Strategy::kTree ? nodes : leaves;
      if (is_axis_aligned(policies.refit)) {
        kernels.aabbs_to_rows(worker.bounds.data, made, live, aabb_rows(batch) + row, nodes);
      } else {
        kernels.boxes_to_rows(worker.boxes.data, made, live, batch.rows.data + row, nodes);
        kernels.bound_boxes(worker.boxes.data, leaves, worker.bounds.data);
      }
      bound_instances(engine, batch, tile, worker.bounds.data);
      if (policies.strategy == Strategy::kRows)
        kernels.bounds_to_leaf_rows(worker.bounds.data, leaves, live,
                                    batch.leaf_rows.data + first * leaf_row_floats(leaves));
    });
  }
}

// Steps 4 to 6 for the candidates that a worker has gathered.
void test_candidates(const Engine& engine, const Policies& policies, std::uint32_t task, Worker& worker,
                     HitSink& sink) {
  if (worker.candidates.empty()) return;
  worker.stats.candidates += worker.candidates.size;
  {
    const Timed timed(worker.stats.seconds_test);
    find_leaf_pairs(engine, policies, worker);
  }
  const Timed timed(worker.stats.seconds_query);
  for (LeafPair* begin = worker.found.begin(); begin != worker.found.end();) {
    LeafPair* end = begin;
    while (end != worker.found.end() && end->slot == begin->slot) ++end;
    report_candidate(engine, worker.candidates.data[begin->slot], {begin, static_cast<std::size_t>(end - begin)}, task,
                     worker, sink);
    begin = end;
  }
  worker.candidates.clear();
}

// Everything that one instance is tested against: itself, and its partners with a higher place in the order of hits.
void pair_instance(const Engine& engine, const Policies& policies, std::uint32_t index, std::uint32_t instance,
                   std::uint32_t task, Worker& worker, HitSink& sink) {
  const InstanceBatch& batch = engine.batches[index]->batch;
  const auto gather = [&](std::uint32_t other_index, std::uint32_t other) {
    worker.candidates.push({index, instance, other_index, other});
    if (worker.candidates.size == engine.chunk_candidates) test_candidates(engine, policies, task, worker, sink);
  };
  if (batch.pairs_within) gather(index, instance);
  if (!batch.pairs_between) return;
  std::uint64_t after = instance_key(index, instance);
  for (bool complete = false; !complete;) {
    complete = find_partners(engine, index, instance, after, policies.strategy == Strategy::kExactAll, worker);
    for (const std::uint64_t key : worker.partners)
      gather(static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key));
    if (!complete) after = worker.partners.data[worker.partners.size - 1];
  }
}

// Steps 4 to 6 of all character batches, in the order of hits.
void pair_characters(Engine& engine, const Policies& policies, HitSink& sink) {
  constexpr std::uint32_t kInstancesPerTask = 64;
  std::uint32_t tasks = 0;
  for (const auto& slot : engine.batches) {
    slot->batch.first_task = tasks;
    if (slot->batch.pairs_within || slot->batch.pairs_between)
      tasks += (slot->batch.instance_count + kInstancesPerTask - 1) / kInstancesPerTask;
  }
  engine.schedule->for_each_in_turn(tasks, [&](std::uint32_t task, std::uint32_t w) {
    const auto above = std::upper_bound(engine.batches.begin(), engine.batches.end(), task,
                                        [](std::uint32_t t, const auto& slot) { return t < slot->batch.first_task; });
    const std::uint32_t index = static_cast<std::uint32_t>(above - engine.batches.begin()) - 1;
    const InstanceBatch& batch = engine.batches[index]->batch;
    const std::uint32_t first = (task - batch.first_task) * kInstancesPerTask;
    Worker& worker = *engine.workers[w];
    const Clock::time_point start = Clock::now();
    const double others = worker.stats.seconds_test + worker.stats.seconds_query;
    for (std::uint32_t i = first; i < std::min(batch.instance_count, first + kInstancesPerTask); ++i)
      if (batch.live[i / kLanes] >> (i % kLanes) & 1) pair_instance(engine, policies, index, i, task, worker, sink);
    test_candidates(engine, policies, task, worker, sink);
    worker.stats.seconds_broad +=
        seconds_since(start) - (worker.stats.seconds_test + worker.stats.seconds_query - others);
    finish_task(task, worker, sink);
  });
}

// ----------------------------------------------------------------------------------------------------- frames

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

void test_frames(Engine& engine, const Policies& policies, const PairRule& rule, std::uint32_t tile, Worker& worker,
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
  const std::uint32_t lanes = in_tile & live(a, index_a) & live(b, index_b);
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
      descend(worker, a, b, worker.boxes.data, brute ? kernels.brute_boxes : kernels.descend_boxes, by, lanes, self);
  }
  const Timed timed(worker.stats.seconds_query);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    worker.found.clear();
    for (const TilePair& pair : worker.tile_found)
      if (pair.lanes >> lane & 1) worker.found.push({lane, pair.a, pair.b});
    if (worker.found.empty()) continue;
    const std::uint32_t frame = tile * kLanes + lane;
    const Candidate candidate = {index_a, a.instance_count == 1 ? 0 : frame, index_b,
                                 b.instance_count == 1 ? 0 : frame};
    report_candidate(engine, candidate, {worker.found.data, worker.found.size}, tile, worker, sink);
  }
}

// All steps for frame batches, a tile at a time while it is in cache: update every batch's tile, then test it.
void run_frame_batches(Engine& engine, const FrameJob& job, const Policies& policies, HitSink& sink) {
  std::uint32_t tiles = 0;
  for (const BatchInput& input : job.inputs)
    if (engine.batch(input.batch).kind == BatchKind::kFrames)
      tiles = std::max(tiles, tile_count(engine.batch(input.batch).instance_count));
  if (tiles == 0) return;
  sink.turn = 0;
  sink.sorted = false;
  engine.schedule->for_each_in_turn(tiles, [&](std::uint32_t tile, std::uint32_t w) {
    Worker& worker = *engine.workers[w];
    for (const BatchInput& input : job.inputs) {
      const InstanceBatch& batch = engine.batch(input.batch);
      if (batch.kind != BatchKind::kFrames || tile_of(batch, tile) >= tile_count(batch.instance_count)) continue;
      const Timed timed(worker.stats.seconds_update);
      const bool report = tile == tile_of(batch, tile);  // a table is posed again for every tile, and reported once
      worker.live[input.batch.value - 1] =
          update_tile(engine, batch, policies, tile_of(batch, tile), report, worker,
                      worker.boxes.data + batch.worker_nodes, worker.bounds.data + batch.worker_nodes);
    }
    for (const PairRule& rule : job.rules)
      if (engine.batch(rule.a).kind == BatchKind::kFrames) test_frames(engine, policies, rule, tile, worker, sink);
    finish_task(tile, worker, sink);
  });
}

// ---------------------------------------------------------------------------------------------------- results

void add(FrameStats& sum, const FrameStats& part) {
  sum.candidates += part.candidates;
  sum.box_tests += part.box_tests;
  sum.leaf_pairs += part.leaf_pairs;
  sum.exact_tests += part.exact_tests;
  sum.false_alarms += part.false_alarms;
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

  HitSink sink{&job};
  const Policies policies = resolved(engine, job);
  update_characters(engine, job, policies);
  {
    const Timed timed(engine.workers[0]->stats.seconds_broad);
    build_grid(engine, job);
  }
  pair_characters(engine, policies, sink);
  run_frame_batches(engine, job, policies, sink);
  const Status status = finish_hits(engine, sink);

  job.stats = {};
  for (const auto& worker : engine.workers) add(job.stats, worker->stats);
  job.stats.seconds_total = seconds_since(start);
  return status;
} catch (const std::exception&) {
  return Status::kOutOfMemory;  // what TBB throws when it finds no memory for its tasks
}

}  // namespace cab
