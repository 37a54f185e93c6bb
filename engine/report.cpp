#include "engine/report.h"

#include "engine/timed.h"

#include <algorithm>
#include <thread>
#include <tuple>

namespace cab {
namespace {

// A leaf pair with the links that its leaves ride on; within one instance the lower link comes first.
struct LinkedPair {
  std::uint16_t link_a, link_b;
  std::uint16_t leaf_a, leaf_b;
};

LinkedPair linked(const Articulation& a, const Articulation& b, const LeafPair& pair, bool within) {
  const LinkedPair out = {a.leaf_link[pair.a], b.leaf_link[pair.b], pair.a, pair.b};
  if (within && out.link_b < out.link_a) return {out.link_b, out.link_a, out.leaf_b, out.leaf_a};
  return out;
}

auto order(const LinkedPair& pair) { return std::tie(pair.link_a, pair.link_b, pair.leaf_a, pair.leaf_b); }

auto order(const Hit& hit) {
  return std::tie(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

ExactLeaf exact_leaf(const Engine& engine, std::uint32_t batch_index, std::uint32_t instance, std::uint32_t leaf) {
  const InstanceBatch& batch = engine.batches[batch_index]->batch;
  return {engine.articulations[batch.articulation_index]->shapes.get(), &batch, instance, leaf};
}

void wait_for_turn(std::uint32_t task, const HitSink& sink) {
  while (sink.turn.load(std::memory_order_acquire) != task) std::this_thread::yield();
}

// Copies a worker's hits into the caller's buffer; only the task whose turn it is may.
void hand_over(Worker& worker, HitSink& sink) {
  const std::size_t at = sink.found.load(std::memory_order_relaxed);
  const std::size_t room = at < sink.job->hits.size ? sink.job->hits.size - at : 0;
  std::copy(worker.hits.begin(), worker.hits.begin() + std::min<std::size_t>(room, worker.hits.size),
            sink.job->hits.data + (room ? at : 0));
  sink.found.store(at + worker.hits.size, std::memory_order_relaxed);
  worker.hits.clear();
}

void push_hit(HitSink& sink, const Candidate& candidate, const LinkedPair& pair, std::uint32_t task, Worker& worker) {
  if (worker.hits.size == worker.hits.capacity) {
    wait_for_turn(task, sink);
    hand_over(worker, sink);
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

void report_candidate(const Engine& engine, const Candidate& candidate, Span<LeafPair> pairs, std::uint32_t task,
                      Worker& worker, HitSink& sink) {
  const Articulation& a = *engine.batches[candidate.batch_a]->batch.articulation;
  const Articulation& b = *engine.batches[candidate.batch_b]->batch.articulation;
  const bool within = is_within(candidate);
  const bool exact = sink.job->policies.exact == Exact::kFcl;
  worker.stats.leaf_pairs += pairs.size;
  const auto in_order = [&](const LeafPair& x, const LeafPair& y) {
    const LinkedPair lx = linked(a, b, x, within), ly = linked(a, b, y, within);
    return order(lx) < order(ly);
  };
  const auto by_leaves = [](const LeafPair& x, const LeafPair& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); };
  const bool same_order = a.leaves_by_link && b.leaves_by_link && !within;
  if (!same_order || !std::is_sorted(pairs.begin(), pairs.end(), by_leaves))
    std::sort(pairs.begin(), pairs.end(), in_order);
  LinkedPair last_hit = {0xffff, 0xffff, 0, 0};
  for (const LeafPair& pair : pairs) {
    const LinkedPair at = linked(a, b, pair, within);
    if (at.link_a == last_hit.link_a && at.link_b == last_hit.link_b) continue;
    if (exact) {
      ++worker.stats.exact_tests;
      if (!leaves_touch(exact_leaf(engine, candidate.batch_a, candidate.instance_a, at.leaf_a),
                        exact_leaf(engine, candidate.batch_b, candidate.instance_b, at.leaf_b))) {
        ++worker.stats.false_alarms;
        continue;
      }
    }
    push_hit(sink, candidate, at, task, worker);
    last_hit = at;
  }
}

void finish_task(std::uint32_t task, Worker& worker, HitSink& sink) {
  wait_for_turn(task, sink);
  hand_over(worker, sink);
  sink.turn.store(task + 1, std::memory_order_release);
}

Status finish_hits(const Engine& engine, HitSink& sink) {
  FrameJob& job = *sink.job;
  job.hits_needed = sink.found.load();
  job.hit_count = 0;
  if (job.hits_needed > job.hits.size) return Status::kHitsOverflow;
  job.hit_count = job.hits_needed;
  if (!sink.sorted)
    std::sort(job.hits.data, job.hits.data + job.hit_count,
              [](const Hit& x, const Hit& y) { return order(x) < order(y); });
  if (job.contacts.empty()) return Status::kOk;
  engine.schedule->for_each(static_cast<std::uint32_t>(job.hit_count), [&](std::uint32_t i, std::uint32_t w) {
    FrameStats& stats = engine.workers[w]->stats;
    const Timed query(stats.seconds_query), contact(stats.seconds_contact);
    const Hit& hit = job.hits[i];
    job.contacts[i] = leaf_contact(exact_leaf(engine, hit.batch_a.value - 1, hit.instance_a, hit.leaf_a),
                                   exact_leaf(engine, hit.batch_b.value - 1, hit.instance_b, hit.leaf_b));
  });
  return Status::kOk;
}

}  // namespace cab
