// One frame, from the caller's poses to the sorted hits: the steps in their order.
#include "engine/auto_strategy.h"
#include "engine/broad_phase/broad_phase.h"
#include "engine/call.h"
#include "engine/characters.h"
#include "engine/in_contact.h"
#include "engine/rest.h"
#include "engine/sequences.h"
#include "engine/timed.h"
#include "engine/validate.h"
#include "kernels/float_mode.h"
#include "layout/frame_stats.h"

#include <algorithm>
#include <exception>

namespace cab {
namespace {

// Sets the counts of all workers and the caller's in_contact bytes to 0.
void clear_results(Engine& engine, Span<const BatchInput> inputs) {
  for (const auto& worker : engine.pool.workers) worker->stats = {};
  clear_in_contact(inputs);
}

FrameStats total_stats(const WorkerPool& pool, Clock::time_point start) {
  FrameStats total;
  for (const auto& worker : pool.workers) add_stats(total, worker->stats);
  total.seconds_total = seconds_since(start);
  return total;
}

}  // namespace

Status run_frame(Engine& engine, FrameJob& job) noexcept try {
  const Clock::time_point start = Clock::now();

  // Check: a refused job changes nothing.
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;  // before the checks: they compare floats, which must not trap
  if (const Status status = bind_inputs(engine, call, job.inputs); status != Status::kOk) return status;
  if (const Status status = validate_job(engine, job); status != Status::kOk) return status;
  if (const Status status = begin_rest(engine, job); status != Status::kOk) return status;
  clear_results(engine, job.inputs);
  HitSink sink{&job, &engine.hit_store};

  // Characters: every instance that does not rest is bounded. The grids find the instances whose bounds overlap, and
  // only those are posed again and tested.
  const Policies policies = resolve_characters(engine, job);
  const FrameContext characters = context_of(engine, policies, job.margin, job.report);
  engine.pool.tasks->alone = runs_on_one_thread(engine, job, policies);
  begin_broad_phase(job.rules, engine.stored_batches(), engine.broad_phase, engine.pool);
  bound_characters(characters, job.inputs, engine);
  {
    FrameStats& stats = engine.pool[0].stats;
    const Timed timed(stats.seconds_broad), built(stats.seconds_grid);
    build_grids(engine.stored_batches(), engine.broad_phase, engine.pool);
  }
  pair_characters(characters, engine, sink);

  // Sequences: instance f of one sequence is tested against instance f of another, sixteen at a time.
  run_sequences(context_of(engine, resolve_sequences(engine, job), job.margin, job.report), job, engine, sink);

  // Results: sorted hits, contacts, counts.
  const Status status = finish_hits(characters, engine.pool, sink);
  if (status == Status::kOk) end_rest(engine, job);
  job.stats = total_stats(engine.pool, start);
  return status;
} catch (const std::exception&) {
  return Status::kOutOfMemory;  // TBB throws if it has no memory for its tasks
}

}  // namespace cab
