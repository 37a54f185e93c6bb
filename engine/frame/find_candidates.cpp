// Candidates from the caller's bounds: the broad phase alone, before anything is posed.
#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"
#include "engine/broad_phase/pair_rules.h"
#include "engine/broad_phase/strip_searcher.h"
#include "engine/broad_phase/strips.h"
#include "engine/broad_phase/world_bounds.h"
#include "engine/frame/surveys.h"
#include "engine/session/call.h"
#include "engine/session/rest.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/live_instances.h"
#include "engine/step/update.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <tuple>

namespace cab {
namespace {

// Up to this many instances the calling thread works alone.
constexpr std::uint32_t kInstancesAlone = 1024;

// How many rows one task searches for.
constexpr std::uint32_t kRowsPerTask = 128;

// The pairs of all tasks, which write to the caller's list side by side.
class PairWriter {
 public:
  explicit PairWriter(Span<InstancePair> pairs) : pairs_(pairs) {}

  void write(const InstancePair* from, std::size_t count) {
    const std::size_t at = found_.fetch_add(count, std::memory_order_relaxed);
    if (at < pairs_.size) std::copy_n(from, std::min(count, pairs_.size - at), pairs_.data + at);
  }
  std::size_t found() const { return found_; }

 private:
  Span<InstancePair> pairs_;
  std::atomic<std::size_t> found_{0};
};

// Writes the pairs that a search finds.
class PairSearcher final : public StripSearcher {
 public:
  PairSearcher(const FrameContext& frame, const Crowd& crowd, CrowdScratch& scratch, PairWriter& writer)
      : StripSearcher(frame, crowd, scratch), writer_(writer) {}

  void test() override {
    InstancePair found[kernel::kMostPairEntries];
    std::size_t count = 0;
    for (std::uint32_t n = 0; n < scratch_.count; ++n) {
      const CrowdRow &x = crowd_.sorted_row(scratch_.a[n]), &y = crowd_.sorted_row(scratch_.b[n]);
      if (!overlap(frame_.batch(x.batch).bounds[x.instance], frame_.batch(y.batch).bounds[y.instance])) continue;
      for (const CrowdRow* row : {&x, &y}) set_in_contact(frame_, row->batch, row->instance);
      const bool in_order = instance_key(x.batch, x.instance) < instance_key(y.batch, y.instance);
      const CrowdRow &a = in_order ? x : y, &b = in_order ? y : x;
      found[count++] = {{a.batch + 1}, a.instance, {b.batch + 1}, b.instance};
    }
    writer_.write(found, count);
    scratch_.count = 0;
  }

 private:
  PairWriter& writer_;
};

// Takes the given bounds of all characters of a batch.
void take_bounds(const FrameJob& job, Crowd& crowd, StoredBatch& stored, WorkerPool& pool) {
  InstanceBatch& batch = stored.batch;
  stored.crowd.has_sides = false;
  clear_inactive(batch);
  pool.tasks->for_each(tile_count(active_count(batch)), [&](std::uint32_t tile, std::uint32_t w) {
    const TileInstances instances = instances_of(batch, tile);
    set_live(instances, (1u << instances.count) - 1, batch);
    for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
      const std::uint32_t instance = instances.instance[lane];
      batch.bounds[instance] = given_bounds(batch, instance, job.margin);
      if (batch.pairs_between)
        place_row(batch, instance, stored.crowd.first_row + instance, crowd, pool[w].crowd[0].survey);
    }
  });
}

}  // namespace

Status find_candidates(Engine& engine, const FrameJob& job, CandidateList& out) noexcept try {
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (const Status status = bind_inputs(engine, call, job.inputs, Needs::kBounds); status != Status::kOk) return status;
  if (const Status status = validate_job(engine, job); status != Status::kOk) return status;
  if (out.pairs.size && !out.pairs.data) return Status::kBadOutput;
  clear_in_contact(job.inputs);
  forget_rest(engine);  // the bounds are others afterwards
  ++engine.bounds_of_frame;
  std::uint64_t given = 0;
  for (const BatchInput& input : job.inputs) given += active_count(engine.batch(input.batch));
  engine.pool.tasks->alone = given <= kInstancesAlone;
  note_rules(job.rules, engine.stored_batches(), engine.paired);
  Crowd& crowd = engine.crowd;
  for_each_crowd_batch(engine.stored_batches(),
                       [](StoredBatch& stored) { stored.batch.by_words = stored.crowd.is_by_place = false; });
  lay_out_rows(engine.stored_batches(), crowd);
  clear_surveys(engine.pool);
  crowd.bands.ready = crowd.by_bands = false;
  for_each_crowd_batch(engine.stored_batches(),
                       [&](StoredBatch& stored) { take_bounds(job, crowd, stored, engine.pool); });
  PairWriter writer(out.pairs);
  if (crowd.row_count > 0) {
    lay_out_strips(engine.stored_batches(), ranges_of(engine.pool), crowd);
    engine.pool.tasks->for_each(sort_tasks(crowd),
                                [&crowd](std::uint32_t task, std::uint32_t) { sort_strips(crowd, task); });
    const FrameContext frame = context_of(engine, job.policies, job);
    const CrowdClasses& classes = crowd.classes;
    const std::uint32_t rows = classes.end_sorted - classes.first_sorted;
    engine.pool.tasks->for_each((rows + kRowsPerTask - 1) / kRowsPerTask, [&](std::uint32_t task, std::uint32_t w) {
      PairSearcher searcher(frame, crowd, engine.pool[w].crowd[0], writer);
      const std::uint32_t first = classes.first_sorted + task * kRowsPerTask;
      pair_rows(searcher, classes, first, std::min(classes.end_sorted, first + kRowsPerTask));
      searcher.test();
    });
  }
  out.pairs_needed = writer.found();
  out.pair_count = out.pairs_needed > out.pairs.size ? 0 : out.pairs_needed;
  std::sort(out.pairs.data, out.pairs.data + out.pair_count, [](const InstancePair& x, const InstancePair& y) {
    return std::tie(x.batch_a.value, x.instance_a, x.batch_b.value, x.instance_b) <
           std::tie(y.batch_a.value, y.instance_a, y.batch_b.value, y.instance_b);
  });
  return out.pairs_needed > out.pairs.size ? Status::kPairsOverflow : Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
