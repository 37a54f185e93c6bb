// Steps 5 and 6 of a frame: reports candidates, appends hits in task order, and sorts them.
#include "engine/report.h"

#include "engine/timed.h"
#include "engine/touching_links.h"
#include "engine/worker.h"

#include <algorithm>
#include <thread>
#include <tuple>

namespace cab {
namespace {

// The promised order of hits.
auto key_order(const Hit& hit) {
  return std::tie(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

void wait_for_turn(std::uint32_t task, const HitSink& sink) {
  while (sink.turn.load(std::memory_order_acquire) != task) std::this_thread::yield();
}

// Appends the hits in worker.hits to the caller's buffer, as far as it has room, and counts them all. Only the task
// whose turn it is may do so.
void append_hits(Worker& worker, HitSink& sink) {
  const std::size_t at = sink.found.load(std::memory_order_relaxed);
  const std::size_t room = at < sink.job->hits.size ? sink.job->hits.size - at : 0;
  std::copy(worker.hits.begin(), worker.hits.begin() + std::min<std::size_t>(room, worker.hits.size),
            sink.job->hits.data + (room ? at : 0));
  sink.found.store(at + worker.hits.size, std::memory_order_relaxed);
  worker.hits.clear();
}

// Adds a hit to worker.hits. If the list is full, it is appended to the caller's buffer first, when the turn of the
// task has come.
void push_hit(HitSink& sink, const Candidate& candidate, const LinkedPair& pair, Worker& worker) {
  if (worker.hits.size == worker.hits.capacity) {
    wait_for_turn(worker.task, sink);
    append_hits(worker, sink);
  }
  worker.hits.push({{candidate.batch_a + 1},
                    candidate.instance_a,
                    {candidate.batch_b + 1},
                    candidate.instance_b,
                    pair.link_a,
                    pair.link_b,
                    pair.leaf_a,
                    pair.leaf_b});
}

}  // namespace

void report_candidate(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
                      HitSink& sink) {
  worker.stats.leaf_pairs += pairs.size;
  if (frame.report == Report::kInContact) {
    if (!is_already_reported(frame, candidate) && any_touching(frame, candidate, pairs, worker.stats))
      set_in_contact(frame, candidate);
  } else if (sink.in_spatial_order) {
    add_group(frame, candidate, pairs, worker, sink);
  } else {
    for_each_touching(frame, candidate, pairs, worker.stats,
                      [&](const LinkedPair& pair) { push_hit(sink, candidate, pair, worker); });
  }
}

void finish_task(Worker& worker, HitSink& sink) {
  wait_for_turn(worker.task, sink);
  append_hits(worker, sink);
  sink.turn.store(worker.task + 1, std::memory_order_release);
}

void finish_hits(HitSink& sink) {
  FrameJob& job = *sink.job;
  job.hits_needed = sink.found.load();
  job.hit_count = 0;
  if (job.hits_needed > job.hits.size) return;
  job.hit_count = job.hits_needed;
  if (!sink.sorted)
    std::sort(job.hits.data, job.hits.data + job.hit_count,
              [](const Hit& x, const Hit& y) { return key_order(x) < key_order(y); });
}

}  // namespace cab
