#include "engine/frame/characters.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"
#include "engine/broad_phase/first_pass.h"
#include "engine/broad_phase/strip_searcher.h"
#include "engine/broad_phase/strips.h"
#include "engine/broad_phase/world_bounds.h"
#include "engine/frame/bands.h"
#include "engine/frame/crowd_tester.h"
#include "engine/frame/posed_tester.h"
#include "engine/frame/surveys.h"
#include "engine/hits/hit_store.h"
#include "engine/session/worker.h"
#include "engine/step/batch_tasks.h"
#include "engine/step/live_instances.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"

#include <algorithm>

namespace cab {
namespace {

// ------------------------------------------------------------------------------------------------ step `bound`

// How many tiles one task bounds, in a batch with words and in one without. Where some rest, a task looks at so many
// instances: a multiple of kLanes, so that no two tasks share a word of live bits.
constexpr std::uint32_t kTilesPerTask = 16, kPosedTilesPerTask = 1;
constexpr std::uint32_t kRestingPerTask = 32 * kLanes;

std::uint32_t tiles_per_task(const InstanceBatch& batch) { return batch.by_words ? kTilesPerTask : kPosedTilesPerTask; }

std::uint32_t tasks_for(std::uint32_t count, std::uint32_t each) { return (count + each - 1) / each; }

// Whether the places of all links in a pose, in floats, have 32 bits.
bool has_short_link_offsets(const InstanceBatch& batch) {
  return std::uint64_t{batch.articulation->link_count} * batch.link_stride / sizeof(float) <= 0xffffffffu;
}

// Whether the instances of a batch are rigid boxes in this frame that are paired by their leaf bounds.
bool can_have_words(const FrameContext& frame, const StoredBatch& stored) {
  const InstanceBatch& batch = stored.batch;
  const BatchInput& input = *batch.input;
  return stored.crowd.is_rigid && batch.strategy == Strategy::kRows && !is_axis_aligned(frame.policies.refit) &&
         frame.margin < kernel::kRigidRange && batch.pairs_between && batch.active == batch.articulation &&
         has_short_link_offsets(batch) && input.poses.format == PoseFormat::kQuaternionTranslation &&
         input.bounds.empty();
}

// Takes all instances of a batch for live and without hits, unless they are listed.
void take_for_live(InstanceBatch& batch) {
  if (!batch.input->instances.empty()) return;
  const std::uint32_t given = active_count(batch);
  std::fill(batch.hit_chains.begin(), batch.hit_chains.end(), HitChain{});
  for (std::uint32_t tile = 0; tile < tile_count(given); ++tile)
    batch.live[tile] = static_cast<std::uint16_t>((2u << (std::min(kLanes, given - tile * kLanes) - 1)) - 1);
}

// Whether the boxes that the step `bound` makes of a batch are those of its tests, and there is room for them.
bool can_keep_boxes(const InstanceBatch& batch) {
  return !batch.leaf_boxes.empty() && !batch.may_rest &&
         refit_scope(batch.strategy, *batch.active) == RefitScope::kLeaves;
}

// Chooses how each batch is bounded in this frame, and gives it its rows.
void begin_rows(FrameRun& run) {
  for_each_crowd_batch(run.engine.stored_batches(), [&run](StoredBatch& stored) {
    InstanceBatch& batch = stored.batch;
    clear_inactive(batch);
    batch.keeps_boxes = can_keep_boxes(batch);
    batch.by_words = can_have_words(*run.characters, stored);
    stored.crowd.is_by_place = batch.by_words && batch.input->moved.empty();
    if (batch.by_words) make_shape(stored, run.job.margin);
    if (stored.crowd.is_by_place) take_for_live(batch);
  });
  lay_out_rows(run.engine.stored_batches(), run.engine.crowd);
  clear_surveys(run.engine.pool);
}

// Counts an instance whose bounds leave those that the caller gives. Boxes of links are larger and say nothing.
void count_beyond_bounds(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t instance,
                         FrameStats& stats) {
  if (batch.input->bounds.empty() || batch.active != batch.articulation) return;
  const InstanceBounds &is = batch.bounds[instance], given = given_bounds(batch, instance, frame.margin);
  bool inside = true;
  for (int c = 0; c < 3; ++c) inside = inside && is.lo[c] >= given.lo[c] && is.hi[c] <= given.hi[c];
  stats.instances_beyond_bounds += !inside;
}

// The first pass over the instances of one task, in a batch whose rows are by instance.
struct FirstPass {
  const FrameContext& frame;
  StoredBatch& stored;
  InstanceBatch& batch;
  Crowd& crowd;
  Worker& worker;

  // Gives an instance its row, if some rule pairs it with others.
  void place(std::uint32_t instance) {
    if (batch.pairs_between)
      place_row(batch, instance, stored.crowd.first_row + instance, crowd, worker.crowd[0].survey);
  }

  // Bounds one tile, and stores which instances are live and their bounds.
  void bound(const TileInstances& instances) {
    for (std::uint32_t lane = 0; lane < instances.count; ++lane) batch.hit_chains[instances.instance[lane]] = {};
    if (batch.by_words)
      set_live(instances,
               bound_by_instance(frame, stored, instances, crowd, worker.crowd[0], worker.pose, worker.stats), batch);
    else
      pose(instances);
  }

  void pose(const TileInstances& instances) {
    PoseScratch& posing = worker.pose;
    BoxTile* const boxes = batch.keeps_boxes ? batch.leaf_boxes.data : posing.boxes.data;
    AabbTile* const bounds = batch.keeps_boxes ? batch.leaf_bounds.data : posing.bounds.data;
    const bool by_leaves = keeps_leaves_as_lanes(batch, frame.policies.refit);
    const RefitScope scope = by_leaves ? RefitScope::kLeavesAsLanes : RefitScope::kLeaves;
    const std::uint32_t live =
        update_and_flag_tile(frame, {&batch, instances, scope, boxes, bounds}, posing, worker.stats);
    set_live(instances, live, batch);
    const std::uint32_t leaves = posed_articulation(*batch.active).leaf_count;
    if (!is_axis_aligned(frame.policies.refit))
      frame.kernels.bound_boxes(boxes, by_leaves ? instances.count * tile_count(leaves) : leaves, bounds);
    (by_leaves ? bound_few_instances : bound_instances)(frame.kernels, batch, instances, bounds);
    for (std::uint32_t left = live; left; left &= left - 1) {
      const std::uint32_t instance = instances.instance[lowest_bit(left)];
      place(instance);
      count_beyond_bounds(frame, batch, instance, worker.stats);
    }
  }

  // Keeps the bounds of an instance that rests.
  void keep(std::uint32_t instance) {
    batch.rest[instance] |= kRests;
    batch.hit_chains[instance] = {};
    if (!batch.input->flags.empty()) batch.input->flags[instance] = kInstanceOk;
    ++worker.stats.instances_resting;
    if (batch.rest[instance] & kKept) {
      ++worker.crowd[0].kept;
    } else {
      worker.crowd[0].resting += batch.pairs_between;
      place(instance);
    }
    count_beyond_bounds(frame, batch, instance, worker.stats);
  }

  // Bounds those that have moved, by tiles of sixteen, where some rest.
  void bound_moved(std::uint32_t begin, std::uint32_t end) {
    TileInstances moved;
    moved.count = 0;
    for (std::uint32_t at = begin; at < end; ++at) {
      const std::uint32_t i = active_instance(batch, at);
      if (still_resting(batch, i)) {
        keep(i);
        if (!batch.by_words || stored.crowd.has_words) continue;
      } else {
        batch.rest[i] = 0;
        clear_live(i, batch);
      }
      prefetch_pose(batch, i);
      moved.instance[moved.count++] = i;
      if (moved.count < kLanes) continue;
      bound(moved);
      moved.count = 0;
    }
    if (moved.count > 0) bound(moved);
  }
};

// ------------------------------------------------------------------------------------------------ step `pair`

// How many sorted rows one task pairs: where all are tested by words, and where some are posed.
constexpr std::uint32_t kRowsPerTask = 256, kPosedRowsPerTask = 128;

std::uint32_t rows_per_task(const Crowd& crowd) { return crowd.only_words ? kRowsPerTask : kPosedRowsPerTask; }

// The tasks of the step that pairs, in their order: seams between the chunks of bands, rows that are kept (only if two
// that rest are tested), and all other sorted rows. Then come batches whose instances are tested within themselves
// alone.
struct PairingTasks {
  std::uint32_t seams, kept, others;

  explicit PairingTasks(const FrameRun& run) {
    const Crowd& crowd = run.engine.crowd;
    const std::uint32_t each = rows_per_task(crowd);
    const bool tests_resting = run.engine.paired.reports_resting && !run.characters->keeps_hits;
    seams = crowd.by_bands ? crowd.bands.chunks - 1 : 0;
    kept = tests_resting ? tasks_for(crowd.kept.end_sorted, each) : 0;
    others = tasks_for(crowd.classes.end_sorted - crowd.classes.first_sorted, each);
  }
  std::uint32_t count() const { return seams + kept + others; }
};

// Tests the candidates of crowds in which some instances have words and some have none.
class MixedTester final : public StripSearcher {
 public:
  MixedTester(FrameRun& run, Worker& worker)
      : StripSearcher(*run.characters, run.engine.crowd, worker.crowd[0]),
        by_words_(*run.characters, run.engine.crowd, worker, run.sink),
        posed_(*run.characters, run.engine.crowd, worker, run.sink) {}

  // Drops those that are known. Candidates with words stay in the list and are tested; the others are handed on.
  void test() override {
    std::uint32_t a[kernel::kMostPairEntries], b[kernel::kMostPairEntries], others = 0, kept = 0;
    const auto by_words = [this](std::uint32_t row) { return frame_.batch(crowd_.sorted_row(row).batch).by_words; };
    for (std::uint32_t n = 0; n < scratch_.count; ++n) {
      const std::uint32_t x = scratch_.a[n], y = scratch_.b[n];
      if (has_left(x) || has_left(y) || is_known(x, y)) continue;
      if (by_words(x) && by_words(y)) {
        scratch_.a[kept] = x;
        scratch_.b[kept++] = y;
      } else {
        a[others] = x;
        b[others++] = y;
      }
    }
    scratch_.count = kept;
    by_words_.test();
    posed_.add(a, b, others);
  }

  // Adds the instances of the sorted rows from `first` to end - 1 with themselves, if a rule asks for it.
  void add_rows_within(std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t row = first; row < end; ++row)
      if (!has_left(row)) posed_.add_within(crowd_.sorted_row(row).batch, crowd_.sorted_row(row).instance);
  }

  // The same for the live ones of consecutive instances of a batch.
  void add_within(std::uint32_t batch, std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t i = first; i < end; ++i)
      if (frame_.batch(batch).live[i / kLanes] >> (i % kLanes) & 1) posed_.add_within(batch, i);
  }

  void finish() {
    test();
    posed_.finish();
  }

 private:
  // Whether a row is kept though its instance rests no more.
  bool has_left(std::uint32_t row) const {
    const CrowdRow& of = crowd_.sorted_row(row);
    return row < crowd_.kept.end_sorted && !(frame_.batch(of.batch).rest[of.instance] & kKept);
  }
  // Whether the hits of two rows are there already, or are not asked for, since both rest.
  bool is_known(std::uint32_t row_x, std::uint32_t row_y) const {
    const CrowdRow &x = crowd_.sorted_row(row_x), &y = crowd_.sorted_row(row_y);
    return rests(frame_.batch(x.batch), x.instance) && rests(frame_.batch(y.batch), y.instance) &&
           (frame_.keeps_hits || frame_.paired.skips_resting(x.batch, y.batch));
  }

  CrowdTester by_words_;
  PosedTester posed_;
};

}  // namespace

std::uint32_t begin_bounding(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  begin_rows(run);
  crowd.by_bands = begin_bands(run);
  if (crowd.by_bands) return crowd.bands.chunks;
  return lay_out_tasks(run.engine.stored_batches(), [](const InstanceBatch& batch) {
    if (!batch.input || batch.kind != BatchKind::kCharacters) return 0u;
    const std::uint32_t given = active_count(batch);
    return batch.may_rest ? tasks_for(given, kRestingPerTask) : tasks_for(tile_count(given), tiles_per_task(batch));
  });
}

void bound_characters(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  Crowd& crowd = run.engine.crowd;
  if (crowd.by_bands) return run_band_task(run, task, w);
  const FrameContext& frame = *run.characters;
  const BatchTask of = batch_task(frame.batches, task);
  StoredBatch& stored = *run.engine.batches[of.batch];
  InstanceBatch& batch = stored.batch;
  Worker& worker = run.worker(w);
  const Timed timed(worker.stats.seconds_update), bounded(worker.stats.seconds_bound);
  FirstPass pass = {frame, stored, batch, crowd, worker};
  const std::uint32_t given = active_count(batch);
  if (batch.may_rest)
    return pass.bound_moved(of.run * kRestingPerTask, std::min(given, (of.run + 1) * kRestingPerTask));
  const std::uint32_t first = of.run * tiles_per_task(batch),
                      end = std::min(tile_count(given), first + tiles_per_task(batch));
  if (stored.crowd.is_by_place) {
    bound_crowd_tiles(frame, stored, first * kLanes, std::min(given, end * kLanes), crowd, worker.crowd[0], worker.pose,
                      worker.stats);
    if (!crowd.only_words) store_bounds(crowd, stored, first * kLanes, std::min(given, end * kLanes));
    return;
  }
  for (std::uint32_t tile = first; tile < end; ++tile) {
    for (std::uint32_t i = (tile + 1) * kLanes; i < std::min(given, (tile + 2) * kLanes); ++i)
      prefetch_pose(batch, active_instance(batch, i));
    pass.bound(instances_of(batch, tile));
  }
}

std::uint32_t begin_sorting(FrameRun& run) {
  Crowd& crowd = run.engine.crowd;
  FrameStats& stats = run.worker(0).stats;
  const Timed timed(stats.seconds_broad), made(stats.seconds_sort);
  if (crowd.row_count == 0) {
    crowd.classes = {};
    return 0;
  }
  if (crowd.by_bands && end_bands(run)) return sort_tasks(crowd);
  if (!crowd.only_words) {  // else nobody rests
    std::size_t kept = 0, resting = 0;
    for (const auto& worker : run.engine.pool.workers) {
      kept += worker->crowd[0].kept;
      resting += worker->crowd[0].resting;
    }
    const std::size_t spare = spare_rows(crowd.capacity);
    if (resting > spare || crowd.kept.end_sorted > kept + spare || crowd.kept_is_stale)
      keep_rows(run.engine.stored_batches(), crowd);
  }
  lay_out_strips(run.engine.stored_batches(), ranges_of(run.engine.pool), crowd);
  return sort_tasks(crowd);
}

void sort_characters(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  FrameStats& stats = run.worker(w).stats;
  const Timed timed(stats.seconds_broad), made(stats.seconds_sort);
  sort_strips(run.engine.crowd, task);
}

std::uint32_t begin_pairing(FrameRun& run) {
  // Without a rule that reports two that rest there is nothing to keep.
  run.characters->keeps_hits = run.has_last_hits && run.engine.paired.reports_resting;
  if (run.characters->keeps_hits) {
    Worker& worker = run.worker(0);
    keep_hits(*run.characters, run.last_blocks, worker.hits.block, worker.stats, run.sink);
  }
  const std::uint32_t each = rows_per_task(run.engine.crowd);
  return lay_out_tasks(
      run.engine.stored_batches(),
      [each](const InstanceBatch& batch) {
        return batch.pairs_within && !batch.pairs_between ? tasks_for(batch.instance_count, each) : 0;
      },
      PairingTasks(run).count());
}

void pair_characters(FrameRun& run, std::uint32_t task, std::uint32_t w) {
  const Crowd& crowd = run.engine.crowd;
  Worker& worker = run.worker(w);
  const Clock::time_point start = Clock::now();
  const auto others = [&worker] {
    return worker.stats.seconds_update + worker.stats.seconds_test + worker.stats.seconds_query;
  };
  const double before = others();
  const PairingTasks tasks(run);
  const std::uint32_t each = rows_per_task(crowd);
  if (task < tasks.seams) {
    pair_seam(run, task, w);
  } else if (task < tasks.count()) {
    const std::uint32_t number = task - tasks.seams;
    const bool is_kept = number < tasks.kept;
    const CrowdClasses& classes = is_kept ? crowd.kept : crowd.classes;
    const std::uint32_t first = classes.first_sorted + (is_kept ? number : number - tasks.kept) * each,
                        end = std::min(classes.end_sorted, first + each);
    if (crowd.only_words) {
      CrowdTester tester(*run.characters, crowd, worker, run.sink);
      pair_rows(tester, classes, first, end);
      tester.test();
    } else {
      MixedTester tester(run, worker);
      tester.add_rows_within(first, end);
      pair_rows(tester, classes, first, end);
      tester.finish();
    }
  } else {
    const BatchTask of = batch_task(run.engine.stored_batches(), task);
    MixedTester tester(run, worker);
    tester.add_within(of.batch, of.run * each,
                      std::min(run.characters->batch(of.batch).instance_count, (of.run + 1) * each));
    tester.finish();
  }
  worker.stats.seconds_broad += seconds_since(start) - (others() - before);
}

std::uint32_t end_pairing(FrameRun& run) {
  const Timed timed(run.worker(0).stats.seconds_broad);
  Crowd& crowd = run.engine.crowd;
  if (crowd.row_count > 0) keep_order(run.engine);
  for_each_crowd_batch(run.engine.stored_batches(), [&run, &crowd](StoredBatch& stored) {
    stored.crowd.has_words = stored.batch.by_words && !stored.crowd.is_by_place;
    stored.crowd.has_sides = stored.crowd.is_by_place && crowd.only_words;
    if (run.engine.rest.known) store_crowd_bounds(crowd, stored);  // those that rest keep them
  });
  return 0;
}

}  // namespace cab
