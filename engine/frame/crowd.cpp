#include "engine/frame/crowd.h"

#include "engine/batch_tasks.h"
#include "engine/characters.h"
#include "engine/frame/bands.h"
#include "engine/frame/crowd_batch.h"
#include "engine/frame/crowd_scratch.h"
#include "engine/frame/first_pass.h"
#include "engine/frame/pairing.h"
#include "engine/frame/strips.h"
#include "engine/hit_store.h"
#include "engine/in_contact.h"
#include "engine/live_instances.h"
#include "engine/timed.h"
#include "engine/worker.h"

#include <algorithm>

namespace cab {
namespace {

// How many tiles one task bounds, how many strips one sorts, and how many sorted rows one pairs.
constexpr std::uint32_t kTilesPerTask = 16;
constexpr std::uint32_t kSortTasks = 32;
constexpr std::uint32_t kRowsPerTask = 256;

// Whether the places of all links in a pose, in floats, have 32 bits.
bool has_short_link_offsets(const InstanceBatch& batch) {
  return std::uint64_t{batch.articulation->link_count} * batch.link_stride / sizeof(float) <= 0xffffffffu;
}

// Whether the frame's characters are rigid boxes that are paired by their leaf bounds alone.
bool is_for_crowd(const FrameRun& run) {
  const FrameContext& frame = *run.characters;
  const Policies& policies = frame.policies;
  if (policies.strategy != Strategy::kRows || is_axis_aligned(policies.refit) || frame.report != Report::kHits ||
      run.engine.hit_store.frames_in_key_order > 0 || !(frame.margin < kernel::kRigidRange))
    return false;
  bool any = false;
  for (const BatchInput& given : run.job.inputs) {
    const StoredBatch& stored = *run.engine.batches[slot_of(given.batch).value - 1];
    const InstanceBatch& batch = stored.batch;
    if (batch.kind != BatchKind::kCharacters) continue;
    const BatchInput& input = *batch.input;
    if (!stored.crowd.is_rigid || !batch.pairs_between || batch.pairs_within || batch.may_rest ||
        batch.active != batch.articulation || !has_short_link_offsets(batch) ||
        input.poses.format != PoseFormat::kQuaternionTranslation || !input.orientations.empty() ||
        !input.scales.empty() || !input.bounds.empty() || !batch.margins.empty())
      return false;
    any = true;
  }
  return any;
}

// Gives the frame up to the other one, which begins anew.
void give_up(FrameRun& run) {
  run.by_crowd = run.has_last_hits = false;
  run.sink.in_spatial_order = false;
  run.engine.crowd.bands.ready = false;
  for (const auto& worker : run.engine.pool.workers) worker->stats = {};
  clear_in_contact(run.job.inputs);
}

// Takes all instances of a batch for live and without hits.
void clear_batch(InstanceBatch& batch) {
  clear_not_given(batch);
  if (!batch.input->instances.empty()) return;
  const std::uint32_t given = given_count(batch);
  std::fill(batch.hit_chains.begin(), batch.hit_chains.end(), HitChain{});
  for (std::uint32_t tile = 0; tile < tile_count(given); ++tile)
    batch.live[tile] = static_cast<std::uint16_t>((2u << (std::min(kLanes, given - tile * kLanes) - 1)) - 1);
}

// Gives every batch its rows and words, and makes its shape for this frame.
void lay_out_rows(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  std::uint32_t row = 0, words = 0, batches = 0;
  bool layers = false;
  for (std::size_t i = 0; i < run.engine.batches.size(); ++i)
    run.engine.batches[i]->crowd.index = static_cast<std::uint32_t>(i);
  for_each_crowd_batch(run.engine, [&](StoredBatch& stored) {
    const InstanceBatch& batch = stored.batch;
    CrowdBatch& own = stored.crowd;
    own.row_count = given_count(batch);
    own.first_row = row;
    own.first_words = words;
    row += tile_count(own.row_count) * kLanes;
    words += own.row_count * own.blocks;
    ++batches;
    crowd.last_batch = own.index;
    layers = layers || !batch.input->layers.empty() || !batch.input->layer_masks.empty();
    if (!batch.input->instances.empty() || own.order.size != own.row_count) own.ordered = false;
    const std::size_t stride = batch.link_stride / sizeof(float);
    if (own.margin != run.job.margin || own.stride != stride)
      make_shape(*batch.articulation, run.job.margin, stride, own);
    clear_batch(stored.batch);
  });
  crowd.row_count = row;
  crowd.one_batch = batches == 1;
  crowd.takes_all = batches == 1 && !layers;
}

}  // namespace

std::uint32_t begin_bounding_crowd(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  run.by_crowd = is_for_crowd(run);
  for (const auto& stored : run.engine.batches) {
    if (run.by_crowd && !stored->batch.input) store_crowd_bounds(crowd, *stored);
    if (stored->batch.input) stored->crowd.has_sides = false;
  }
  if (!run.by_crowd) return 0;
  lay_out_rows(run);
  for (const auto& worker : run.engine.pool.workers) {
    clear_survey(worker->crowd[0].survey);
    worker->crowd[0].count = 0;
  }
  run.sink.in_spatial_order = true;
  crowd.by_bands = begin_bands(run);
  if (crowd.by_bands) return crowd.bands.chunks;
  return lay_out_tasks(run.engine.stored_batches(), [](const InstanceBatch& batch) {
    if (!batch.input || batch.kind != BatchKind::kCharacters) return 0u;
    return (tile_count(given_count(batch)) + kTilesPerTask - 1) / kTilesPerTask;
  });
}

void bound_crowd(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  if (run.engine.crowd.by_bands) return run_band_task(run, task, w);
  const BatchTask of = batch_task(run.engine.stored_batches(), task);
  StoredBatch& stored = *run.engine.batches[of.batch];
  Worker& worker = run.worker(w);
  const Timed timed(worker.stats.seconds_update), bounded(worker.stats.seconds_bound);
  const std::uint32_t first = of.run * kTilesPerTask * kLanes,
                      end = std::min(given_count(stored.batch), first + kTilesPerTask * kLanes);
  for (std::uint32_t place = first; place < end; place += kLanes)
    bound_crowd_tile(*run.characters, stored, place, run.engine.crowd, worker);
}

namespace {

// How many strips one task sorts.
std::uint32_t strips_per_task(const Crowd& crowd) {
  return std::max(1u, (crowd.strip_count - crowd.first_strip + kSortTasks - 1) / kSortTasks);
}

}  // namespace

std::uint32_t begin_sorting_crowd(FrameRun& run) {
  if (!run.by_crowd) return 0;
  Crowd& crowd = run.engine.crowd;
  FrameStats& stats = run.worker(0).stats;
  const Timed timed(stats.seconds_broad), made(stats.seconds_grid);
  if (run.sink.store_full) return 0;
  if (!(crowd.by_bands && end_bands(run)) && !lay_out_strips(run)) {
    give_up(run);
    return 0;
  }
  return (crowd.strip_count - crowd.first_strip + strips_per_task(crowd) - 1) / strips_per_task(crowd);
}

void sort_crowd(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  FrameStats& stats = run.worker(w).stats;
  const Timed timed(stats.seconds_broad), made(stats.seconds_grid);
  Crowd& crowd = run.engine.crowd;
  const std::uint32_t first = crowd.first_strip + task * strips_per_task(crowd),
                      end = std::min(crowd.strip_count, first + strips_per_task(crowd));
  for (std::uint32_t strip = first; strip < end; ++strip) sort_strip(crowd, strip);
}

namespace {

// Seams between chunks are paired first.
std::uint32_t seam_count(const Crowd& crowd) { return crowd.by_bands ? crowd.bands.chunks - 1 : 0; }

}  // namespace

std::uint32_t begin_pairing_crowd(FrameRun& run) {
  if (!run.by_crowd || run.sink.store_full) return 0;
  const Crowd& crowd = run.engine.crowd;
  return seam_count(crowd) + (crowd.end_sorted - crowd.first_sorted + kRowsPerTask - 1) / kRowsPerTask;
}

void pair_crowd(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  if (run.sink.store_full) return;
  const Crowd& crowd = run.engine.crowd;
  Worker& worker = run.worker(w);
  const Clock::time_point start = Clock::now();
  const auto others = [&worker] { return worker.stats.seconds_test + worker.stats.seconds_query; };
  const double before = others();
  if (task < seam_count(crowd)) {
    pair_seam(run, task, w);
  } else {
    CrowdTester tester(run, worker);
    const std::uint32_t first = crowd.first_sorted + (task - seam_count(crowd)) * kRowsPerTask;
    pair_rows(tester, first, std::min(crowd.end_sorted, first + kRowsPerTask));
    tester.test();
  }
  store_groups(*run.characters, worker, run.sink);
  worker.stats.seconds_broad += seconds_since(start) - (others() - before);
}

std::uint32_t end_crowd(FrameRun& run) {
  if (!run.by_crowd) return 0;
  if (run.sink.store_full) {
    end_spatial_order(run);
    ++run.engine.hit_store.frames_in_key_order;  // this frame is one
    run.sink.store_full = false;
    give_up(run);
    return 0;
  }
  const Timed timed(run.worker(0).stats.seconds_broad);
  keep_order(run);
  for_each_crowd_batch(run.engine, [&run](StoredBatch& stored) {
    stored.crowd.has_sides = true;
    if (run.engine.rest.known) store_crowd_bounds(run.engine.crowd, stored);  // those that rest keep them
  });
  return 0;
}

}  // namespace cab
