// Candidates from the caller's bounds, before anything is posed: step 2 of a frame alone.
#include "engine/broad_phase/broad_phase.h"
#include "engine/broad_phase/search.h"
#include "engine/call.h"
#include "engine/in_contact.h"
#include "engine/live_instances.h"
#include "engine/rest.h"
#include "engine/update.h"
#include "engine/validate.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <tuple>

namespace cab {
namespace {

// Up to this many instances the calling thread works alone.
constexpr std::uint32_t kInstancesAlone = 1024;

// How many grid entries one task searches for.
constexpr std::uint32_t kEntriesPerTask = 128;

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

InstancePair pair_of(const GridEntry& x, const GridEntry& y) {
  const bool in_order = instance_key(x.batch, x.instance) < instance_key(y.batch, y.instance);
  const GridEntry &a = in_order ? x : y, &b = in_order ? y : x;
  return {{a.batch + 1}, a.instance, {b.batch + 1}, b.instance};
}

// Writes the pairs that the entries of one task report.
void search_entries(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairWriter& writer) {
  constexpr std::size_t kBuffer = 128;
  InstancePair found[kBuffer];
  std::size_t count = 0;
  const GridEntry* const entries = frame.broad_phase.grid.entries.data;
  for (std::uint32_t at = begin; at < end; ++at)
    for_each_later(frame, frame.broad_phase.grid, at, [&](std::uint32_t other) {
      const GridEntry &x = entries[at], &y = entries[other];
      if (!layers_match(frame.batch(x.batch), x.instance, frame.batch(y.batch), y.instance)) return;
      for (const GridEntry* entry : {&x, &y}) set_in_contact(frame, entry->batch, entry->instance);
      found[count++] = pair_of(x, y);
      if (count < kBuffer) return;
      writer.write(found, kBuffer);
      count = 0;
    });
  writer.write(found, count);
}

// Takes the given bounds of all characters of a batch.
void take_bounds(const FrameJob& job, InstanceBatch& batch, WorkerPool& pool) {
  clear_not_given(batch);
  pool.tasks->for_each(tile_count(given_count(batch)), [&](std::uint32_t tile, std::uint32_t w) {
    const TileInstances instances = instances_of(batch, tile);
    set_live(instances, (1u << instances.count) - 1, batch);
    take_given_bounds(batch, instances, job.margin, pool[w].histogram);
  });
}

// Puts the instances into the grid. Nothing rests, so the kept grid stays empty.
void build_grid(StoredBatches batches, BroadPhase& broad, WorkerPool& pool) {
  begin_keeping(batches, broad, pool);
  pool.tasks->for_each(begin_counting(batches, broad, pool), [&](std::uint32_t task, std::uint32_t w) {
    count_entries(batches, broad, broad.grid, task, pool[w]);
  });
  pool.tasks->for_each(begin_inserting(batches, broad, broad.grid, pool), [&](std::uint32_t task, std::uint32_t w) {
    insert_entries(batches, broad, broad.grid, task, pool[w]);
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
  for (const BatchInput& input : job.inputs) given += given_count(engine.batch(input.batch));
  engine.pool.tasks->alone = given <= kInstancesAlone;
  begin_broad_phase(job.rules, engine.stored_batches(), engine.broad_phase, engine.pool);
  for (const BatchInput& input : job.inputs)
    if (InstanceBatch& batch = engine.batch(input.batch); batch.kind == BatchKind::kCharacters) {
      engine.batches[slot_of(input.batch).value - 1]->crowd.has_sides = false;
      take_bounds(job, batch, engine.pool);
    }
  build_grid(engine.stored_batches(), engine.broad_phase, engine.pool);

  const FrameContext frame = context_of(engine, job.policies, job.margin, job.report);
  const std::uint32_t entries = engine.broad_phase.grid.count;
  PairWriter writer(out.pairs);
  engine.pool.tasks->for_each(
      (entries + kEntriesPerTask - 1) / kEntriesPerTask, [&](std::uint32_t task, std::uint32_t) {
        search_entries(frame, task * kEntriesPerTask, std::min(entries, (task + 1) * kEntriesPerTask), writer);
      });
  out.needed = writer.found();
  out.count = out.needed > out.pairs.size ? 0 : out.needed;
  std::sort(out.pairs.data, out.pairs.data + out.count, [](const InstancePair& x, const InstancePair& y) {
    return std::tie(x.batch_a.value, x.instance_a, x.batch_b.value, x.instance_b) <
           std::tie(y.batch_a.value, y.instance_a, y.batch_b.value, y.instance_b);
  });
  return out.needed > out.pairs.size ? Status::kPairsOverflow : Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
