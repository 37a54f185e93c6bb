#include "engine/frame/all_pairs.h"

#include "engine/exact/convex.h"
#include "engine/exact/touching_links.h"
#include "engine/frame/contacts.h"
#include "engine/frame/frame_run.h"
#include "engine/hits/report.h"
#include "engine/session/rest.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

namespace cab {
namespace {

// The tests of one call. Candidates wait in the first worker's lists, with all their leaf pairs, until these are full.
// Frames leave leaf pairs there, but expect no candidates.
class AllPairs {
 public:
  explicit AllPairs(FrameRun& run)
      : frame_(*run.characters), job_(run.job), worker_(run.worker(0)), live_(run.engine.batches.size()) {
    clear();
  }
  ~AllPairs() { clear(); }
  AllPairs(const AllPairs&) = delete;
  AllPairs& operator=(const AllPairs&) = delete;

  // Poses the given instances of a batch, writes their flags and notes which of them are not masked.
  void find_live(std::uint32_t index) {
    const Timed timed(worker_.stats.seconds_update);
    const InstanceBatch& batch = frame_.batch(index);
    live_[index].resize(batch.instance_count);
    for (std::uint32_t tile = 0; tile < tile_count(active_count(batch)); ++tile) {
      const TileInstances instances = instances_of(batch, tile);
      const std::uint32_t live = update_and_flag_tile(
          frame_, {&batch, instances, RefitScope::kNone, worker_.pose.boxes.data, worker_.pose.bounds.data},
          worker_.pose, worker_.stats);
      for (std::uint32_t lane = 0; lane < instances.count; ++lane)
        live_[index][instances.instance[lane]] = live >> lane & 1;
    }
  }

  // Adds all candidates of a rule.
  void add(const PairRule& rule) {
    const std::uint32_t slot_a = slot_of(rule.a).value, slot_b = slot_of(rule.b).value;
    const std::uint32_t a = std::min(slot_a, slot_b) - 1, b = std::max(slot_a, slot_b) - 1;
    const std::uint32_t count_a = frame_.batch(a).instance_count, count_b = frame_.batch(b).instance_count;
    if (rule.pairing == Pairing::kWithin) {
      for (std::uint32_t i = 0; i < count_a; ++i) add({a, i, a, i});
    } else if (frame_.batch(a).kind == BatchKind::kSequence) {
      for (std::uint32_t i = 0; i < (count_a && count_b ? std::max(count_a, count_b) : 0); ++i)
        add({a, count_a == 1 ? 0 : i, b, count_b == 1 ? 0 : i});
    } else {
      for (std::uint32_t i = 0; i < count_a; ++i)
        for (std::uint32_t j = a == b ? i + 1 : 0; j < count_b; ++j) add({a, i, b, j});
    }
  }

  // Tests the candidates that wait.
  void test() {
    const Timed timed(worker_.stats.seconds_query);
    worker_.stats.candidates += worker_.pairs.candidates.size;
    if (tests_lists(frame_.policies.exact))
      keep_touching(frame_, worker_.pairs.candidates.data, worker_.pairs.found, worker_.exact, worker_.stats);
    add_inside(frame_, worker_.pairs.candidates.data, 0, worker_.pairs.candidates.size, worker_.pairs.found,
               worker_.exact, worker_.stats);
    for_each_candidate(worker_.pairs.candidates.data, worker_.pairs.found,
                       [this](const Candidate& candidate, Span<LeafPair> pairs) { report(candidate, pairs); });
    clear();
  }

  // Sorts the hits, and writes them to the caller's buffer if they fit.
  void write_hits() {
    sort_hits(hits_);
    job_.hits_needed = hits_.size();
    job_.hit_count = hits_.size() > job_.hits.size ? 0 : hits_.size();
    std::copy_n(hits_.begin(), job_.hit_count, job_.hits.data);
  }

 private:
  void clear() {
    worker_.pairs.found.clear();
    worker_.pairs.candidates.clear();
  }

  bool is_live(std::uint32_t batch, std::uint32_t instance) const { return live_[batch][instance] != 0; }

  // Adds a candidate with all its leaf pairs, unless it cannot touch or nothing is asked about it.
  void add(const Candidate& candidate) {
    const InstanceBatch &batch_a = frame_.batch(candidate.batch_a), &batch_b = frame_.batch(candidate.batch_b);
    const bool within = is_within(candidate);
    if (!is_live(candidate.batch_a, candidate.instance_a) || !is_live(candidate.batch_b, candidate.instance_b)) return;
    if (!within && !layers_match(batch_a, candidate.instance_a, batch_b, candidate.instance_b)) return;
    if (frame_.report == Report::kInContact && is_already_reported(frame_, candidate)) return;
    const Articulation &a = *batch_a.articulation, &b = *batch_b.articulation;
    FixedList<LeafPair>& found = worker_.pairs.found;
    if (worker_.pairs.candidates.size == worker_.pairs.candidates.capacity ||
        found.size + std::size_t{a.leaf_count} * b.leaf_count > found.capacity)
      test();
    for (std::uint32_t i = 0; i < a.leaf_count; ++i)
      for (std::uint32_t j = within ? i + 1 : 0; j < b.leaf_count; ++j)
        if (!within || !is_ignored(a, a.leaf_link[i], a.leaf_link[j]))
          found.push({worker_.pairs.candidates.size, static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j)});
    worker_.pairs.candidates.push(candidate);
  }

  // Reports a candidate by its leaf pairs; with Exact::kConvex and kSurface by those that touch.
  void report(const Candidate& candidate, Span<LeafPair> pairs) {
    worker_.stats.leaf_pairs += pairs.size;
    if (frame_.report == Report::kInContact) {
      if (!is_already_reported(frame_, candidate) && any_touching(frame_, candidate, pairs, worker_.stats))
        set_in_contact(frame_, candidate);
      return;
    }
    for_each_touching(frame_, candidate, pairs, worker_.stats,
                      [&](const LinkedPair& pair) { hits_.push_back(hit_of(candidate, pair)); });
  }

  const FrameContext& frame_;
  FrameJob& job_;
  Worker& worker_;
  std::vector<std::vector<std::uint8_t>> live_;  // by batch and instance: whether it is given and not masked
  std::vector<Hit> hits_;
};

// Checks the job and makes the engine ready. A refused job changes nothing.
Status start(FrameRun& run) {
  Engine& engine = run.engine;
  const FrameJob& job = run.job;
  if (const Status status = bind_inputs(engine, run.call, job.inputs); status != Status::kOk) return status;
  if (const Status status = validate_job(engine, job); status != Status::kOk) return status;
  forget_rest(engine);
  ++engine.bounds_of_frame;
  for (const auto& worker : engine.pool.workers) begin_counting(*worker);
  clear_in_contact(job.inputs);
  run.characters.emplace(context_of(engine, job.policies, job));
  return Status::kOk;
}

Status run_all(Engine& engine, FrameJob& job) try {
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  FrameRun run(std::move(call), engine, job);
  if (const Status status = start(run); status != Status::kOk) return status;
  AllPairs pairs(run);
  for (const BatchInput& input : job.inputs) pairs.find_live(slot_of(input.batch).value - 1);
  for (const PairRule& rule : job.rules) pairs.add(rule);
  pairs.test();
  pairs.write_hits();
  for (std::uint32_t task = 0; needs_contacts(job) && task * std::size_t{kContactsPerTask} < job.hit_count; ++task)
    add_contacts(run, task, 0);
  drop_hits(run);
  job.stats = run.worker(0).stats;
  job.stats.seconds_total = seconds_since(run.start);
  return job.hits_needed > job.hits.size ? Status::kHitsOverflow : Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace

Status run_all_pairs(Engine& engine, FrameJob& job) noexcept { return note_answer(engine, run_all(engine, job)); }

}  // namespace cab
