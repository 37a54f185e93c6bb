// One frame, from the caller's poses to the sorted hits: the steps in their order.
#include "engine/broad_phase/pair_rules.h"
#include "engine/frame/auto_strategy.h"
#include "engine/frame/characters.h"
#include "engine/frame/contacts.h"
#include "engine/frame/frame_run.h"
#include "engine/frame/sequences.h"
#include "engine/hits/hit_store.h"
#include "engine/session/rest.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/profiled.h"
#include "engine/step/task_roll.h"
#include "kernels/float_mode.h"
#include "layout/frame_stats.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

namespace cab {
namespace {

// ------------------------------------------------------------------------------------------------ before the steps

// Sets the counts of all workers and the caller's in_contact bytes to 0, and lets no worker have hits.
void clear_results(Engine& engine, Span<const BatchInput> inputs) {
  for (const auto& worker : engine.pool.workers) {
    begin_counting(*worker);
    worker->hits.block = {};
  }
  clear_in_contact(inputs);
}

// Checks the job and makes the frame ready for its first step. A refused job changes nothing. caller_runs_tasks:
// whether workers other than the calling thread take part in any case.
Status start(FrameRun& run, bool caller_runs_tasks) {
  Engine& engine = run.engine;
  const FrameJob& job = run.job;
  if (const Status status = bind_inputs(engine, run.call, job.inputs); status != Status::kOk) return status;
  if (const Status status = validate_job(engine, job); status != Status::kOk) return status;
  if (const Status status = begin_rest(engine, job, run.failed_before); status != Status::kOk) return status;
  run.has_last_hits = std::exchange(engine.hit_store.holds_last, false);
  run.last_blocks = begin_storing(run.sink);
  clear_results(engine, job.inputs);
  ++engine.bounds_of_frame;
  const Policies policies = resolve_characters(engine, job);
  run.characters.emplace(context_of(engine, policies, job));
  run.sequences.emplace(context_of(engine, resolve_sequences(engine, job), job));
  engine.pool.tasks->alone = !caller_runs_tasks && runs_on_one_thread(engine, job, policies);
  run.sink.alone = engine.pool.working_count() == 1;
  note_rules(job.rules, engine.stored_batches(), engine.paired);
  return Status::kOk;
}

// ------------------------------------------------------------------------------------------------------- the steps

std::uint32_t begin_counting(FrameRun& run) { return begin_counting_hits(run.engine.stored_batches()); }
void count_stored(FrameRun& run, std::uint32_t task, std::uint32_t) { count_hits(run.engine.stored_batches(), task); }

std::uint32_t begin_writing(FrameRun& run) {
  std::uint64_t in_open_blocks = 0;
  for (const auto& worker : run.engine.pool.workers) in_open_blocks += worker->hits.block.hits;
  return begin_writing_hits(run.engine.stored_batches(), in_open_blocks, run.sink);
}
void write_stored(FrameRun& run, std::uint32_t task, std::uint32_t worker) {
  write_hits(*run.characters, task, run.worker(worker).stats, run.sink);
}

constexpr FrameStep kFrameSteps[] = {
    // Characters: every instance that does not rest is bounded. Strips find those whose bounds overlap, and only these
    // are posed again and tested.
    {"bound", begin_bounding, bound_characters},
    {"sort", begin_sorting, sort_characters},
    {"pair", begin_pairing, pair_characters},
    {"keep order", end_pairing, pair_characters},
    {"count hits", begin_counting, count_stored},
    {"write hits", begin_writing, write_stored},

    // Sequences: instance f of one sequence is tested against instance f of another, sixteen at a time.
    {"sequences", begin_sequences, run_sequence_tile},

    // Results: sorted hits, contacts.
    {"contacts", begin_contacts, add_contacts},
};
constexpr std::uint32_t kStepCount = std::size(kFrameSteps);

// Goes on to the next step that has tasks. Returns false if there is none.
bool next_step(FrameRun& run) {
  run.task_count = 0;
  while (run.task_count == 0 && run.steps_begun < kStepCount) {
    const FrameStep& step = kFrameSteps[run.steps_begun++];
    run.task_count = step.begin(run);
  }
  return run.task_count > 0;
}

void run_step_task(FrameRun& run, std::uint32_t task, std::uint32_t worker) {
  const FrameStep& step = kFrameSteps[run.steps_begun - 1];
  const Profiled profiled(run.engine.profiler, step.name, worker);
  step.task(run, task, worker);
}

// ------------------------------------------------------------------------------------------------- after the steps

// Notes whose bounds this frame has stored, for QueryJob::reuse_bounds. Those of Refit::kAabbVertices hold no boxes.
void note_bounds(Engine& engine, const FrameContext& frame, Span<const BatchInput> inputs) {
  if (frame.policies.refit == Refit::kAabbVertices) return;
  for (const BatchInput& input : inputs) engine.batch(input.batch).bounded_by = engine.bounds_of_frame;
}

Status finish(FrameRun& run) {
  FrameJob& job = run.job;
  drop_hits(run);
  const Status status = run.sink.out_of_memory            ? Status::kOutOfMemory
                        : job.hits_needed > job.hits.size ? Status::kHitsOverflow
                                                          : Status::kOk;
  if (status == Status::kOk) {
    end_rest(run.engine, job);
    run.sink.store->holds_last = job.report != Report::kInContact;
    note_bounds(run.engine, *run.characters, job.inputs);
  }
  job.stats = {};
  for (const auto& worker : run.engine.pool.workers) add_stats(job.stats, worker->stats);
  job.stats.seconds_total = seconds_since(run.start);
  return status;
}

Status run_all_steps(Engine& engine, FrameJob& job) try {
  const std::uint64_t failed_before = engine.frames_failed.load(std::memory_order_relaxed);
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;  // before the checks: they compare floats, which must not trap
  FrameRun run(std::move(call), engine, job);
  run.failed_before = failed_before;
  const Profiled profiled(engine.profiler, "frame", 0);  // ends before `run` lets the engine go
  if (const Status status = start(run, false); status != Status::kOk) return status;
  while (next_step(run))
    engine.pool.tasks->for_each(run.task_count,
                                [&run](std::uint32_t task, std::uint32_t worker) { run_step_task(run, task, worker); });
  return finish(run);
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace

Status run_frame(Engine& engine, FrameJob& job) noexcept { return note_answer(engine, run_all_steps(engine, job)); }

// ------------------------------------------------------------------------------- frames whose tasks the caller runs

struct FrameInProgress {
  explicit FrameInProgress(std::uint32_t workers) : roll(workers) {}

  std::optional<FrameRun> run;
  TaskRoll roll;

  // Gives the caller the next tasks of the step, or the first ones of the next step.
  void give_tasks() {
    run->first_task += run->tasks_given;
    if (run->first_task == run->task_count) {
      run->first_task = 0;
      next_step(*run);
    }
    run->tasks_given = std::min(TaskRoll::kMostTasks, run->task_count - run->first_task);
    run->tasks_ended = 0;
    roll.open(run->tasks_given);
  }

  // Lets go of the frame, and then of the engine.
  void end() {
    roll.open(0);
    const Call held = std::move(run->call);
    run.reset();
  }
};

void FrameInProgressDelete::operator()(FrameInProgress* frame) const { delete frame; }

FrameInProgressPtr make_frame_in_progress(std::uint32_t workers) {
  return FrameInProgressPtr(new FrameInProgress(workers));
}

Status begin_frame(Engine& engine, FrameJob& job) noexcept {
  const std::uint64_t failed_before = engine.frames_failed.load(std::memory_order_relaxed);
  Call call(engine);
  if (!call.admitted()) return note_answer(engine, Status::kBusy);
  const kernel::FloatMode mode;
  FrameInProgress& frame = *engine.frame;
  frame.run.emplace(std::move(call), engine, job);
  frame.run->failed_before = failed_before;
  const Status status = note_answer(engine, start(*frame.run, true));
  if (status != Status::kOk) frame.end();
  return status;
}

Status next_tasks(Engine& engine, std::uint32_t* count) noexcept {
  if (!engine.frame->run) return Status::kNoFrame;
  if (!count) return Status::kBadOutput;
  FrameRun& run = *engine.frame->run;
  if (run.tasks_ended != run.tasks_given) return Status::kTasksLeft;
  const kernel::FloatMode mode;
  engine.frame->give_tasks();
  *count = run.tasks_given;
  return Status::kOk;
}

Status run_task(Engine& engine, std::uint32_t task, std::uint32_t worker) noexcept {
  if (!engine.frame->run) return Status::kNoFrame;
  FrameInProgress& frame = *engine.frame;
  if (!frame.roll.begin(task, worker)) return Status::kBadTask;
  const kernel::FloatMode mode;
  run_step_task(*frame.run, frame.run->first_task + task, worker);
  frame.roll.end(worker);
  ++frame.run->tasks_ended;
  return Status::kOk;
}

Status end_frame(Engine& engine) noexcept {
  if (!engine.frame->run) return Status::kNoFrame;
  FrameRun& run = *engine.frame->run;
  const kernel::FloatMode mode;
  const bool complete = run.tasks_ended == run.tasks_given && run.first_task + run.tasks_given == run.task_count &&
                        run.steps_begun == kStepCount;
  const Status status = note_answer(engine, complete ? finish(run) : Status::kTasksLeft);
  engine.frame->end();
  return status;
}

}  // namespace cab
