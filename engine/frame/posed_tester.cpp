#include "engine/frame/posed_tester.h"

#include "engine/broad_phase/world_bounds.h"
#include "engine/exact/convex.h"
#include "engine/exact/touching_links.h"
#include "engine/pairs/link_pairs.h"
#include "engine/pairs/traverse.h"
#include "engine/session/worker.h"
#include "engine/step/in_contact.h"
#include "engine/step/live_instances.h"
#include "engine/step/timed.h"
#include "engine/step/update.h"
#include "layout/compiler.h"

#include <algorithm>
#include <tuple>

namespace cab {

namespace {

// Runs the exact test on what a worker has found of the candidates `begin` to `end` - 1: worker.pairs.found keeps the
// leaf pairs that touch, and gets those of what is inside.
void confirm(const FrameContext& frame, const Candidate* candidates, std::uint32_t begin, std::uint32_t end,
             Worker& worker) {
  if (tests_lists(frame.policies.exact))
    keep_touching(frame, candidates, worker.pairs.found, worker.exact, worker.stats);
  add_inside(frame, candidates, begin, end, worker.pairs.found, worker.exact, worker.stats);
}

}  // namespace

void report_leaves(const FrameContext& frame, const Candidate* candidates, std::uint32_t begin, std::uint32_t end,
                   Worker& worker, HitSink& sink) {
  confirm(frame, candidates, begin, end, worker);
  for_each_candidate(candidates, worker.pairs.found, [&](const Candidate& candidate, Span<LeafPair> pairs) {
    report_candidate(frame, candidate, pairs, worker.hits, worker.stats, sink);
  });
}

namespace {

// Tests and reports the candidates `begin` to `end` - 1 where batches have strategy `links`: worker.pairs.found has
// link pairs whose boxes overlap, and leaf pairs of candidates without link boxes.
void report_links(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, Worker& worker, HitSink& sink) {
  PairScratch& own = worker.pairs;
  std::swap(own.found, own.link_pairs);
  const LeafPair* next = own.link_pairs.begin();
  for (std::uint32_t i = begin; i < end; ++i) {
    const Candidate& candidate = own.candidates.data[i];
    const LeafPair* const first = next;
    while (next != own.link_pairs.end() && next->candidate == i) ++next;
    const Span<const LeafPair> pairs = {first, static_cast<std::size_t>(next - first)};
    if (pairs.empty() && !searches_inside(frame, candidate)) continue;
    if (opens_links(frame, candidate)) {
      if (frame.first_only() && is_already_reported(frame, candidate)) continue;
      const Timed timed(worker.stats.seconds_test);
      find_pairs_of_links(frame, candidate, pairs, own, worker.stats);
    } else {
      own.found.size = static_cast<std::uint32_t>(pairs.size);
      std::copy(pairs.begin(), pairs.end(), own.found.data);
    }
    const Timed timed(worker.stats.seconds_query);
    confirm(frame, own.candidates.data, i, i + 1, worker);
    if (!own.found.empty())
      report_candidate(frame, candidate, {own.found.data, own.found.size}, worker.hits, worker.stats, sink);
  }
}

// Returns the end of the candidates that can be tested together from `begin` on: worker.pairs.found has room for all
// their leaf pairs. A single candidate always fits.
std::uint32_t candidates_at_once(const FrameContext& frame, const Worker& worker, std::uint32_t begin) {
  std::size_t leaf_pairs = 0;
  std::uint32_t end = begin;
  for (; end < worker.pairs.candidates.size; ++end) {
    const Candidate& candidate = worker.pairs.candidates.data[end];
    leaf_pairs += std::size_t{frame.batch(candidate.batch_a).active->leaf_count} *
                  frame.batch(candidate.batch_b).active->leaf_count;
    if (end > begin && leaf_pairs > worker.pairs.found.capacity - kLanes) break;
  }
  return end;
}

// How many candidates are tested at a time with Report::kInContact. Fewer than kChunkCandidates, since every instance
// that is found in contact saves later tests.
constexpr std::uint32_t kInContactCandidates = 64;

// Whether no rule tests an instance within itself in this frame, or it rests and its hits are kept.
bool skips_within(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t instance) {
  return !batch.pairs_within || ((batch.skips_within || frame.keeps_hits) && rests(batch, instance));
}

}  // namespace

// Poses, tests and reports the candidates that the worker has collected. Empties the list and the sets afterwards.
void PosedTester::test() {
  if (worker_.pairs.candidates.empty()) return;
  worker_.stats.candidates += worker_.pairs.candidates.size;
  const bool has_links = frame_.policies.strategy != Strategy::kRows &&
                         std::any_of(worker_.pairs.candidates.begin(), worker_.pairs.candidates.end(),
                                     [this](const Candidate& candidate) { return opens_links(frame_, candidate); });
  {
    const Timed timed(worker_.stats.seconds_update);
    worker_.stats.instances_posed += pose_set(frame_, worker_.pairs.posed, worker_.pose);
  }
  for (std::uint32_t begin = 0, end; begin < worker_.pairs.candidates.size; begin = end) {
    end = candidates_at_once(frame_, worker_, begin);
    {
      const Timed timed(worker_.stats.seconds_test);
      find_leaf_pairs(frame_, begin, end, worker_.pairs, worker_.stats);
    }
    if (has_links) {
      report_links(frame_, begin, end, worker_, sink_);
    } else {
      const Timed timed(worker_.stats.seconds_query);
      report_leaves(frame_, worker_.pairs.candidates.data, begin, end, worker_, sink_);
    }
  }
  worker_.pairs.candidates.clear();
  clear_set(worker_.pairs.posed);
  clear_links(worker_.pairs.posed_links);
}

// Adds a candidate: two instances, where a has the lower key, or twice the same instance.
void PosedTester::add(const CrowdRow& a, const CrowdRow& b) {
  Candidate candidate = {a.batch, a.instance, b.batch, b.instance};
  const bool in_contact = frame_.report == Report::kInContact;
  if (in_contact && is_already_reported(frame_, candidate)) return;
  if (worker_.pairs.candidates.size >= (in_contact ? kInContactCandidates : kChunkCandidates) ||
      !has_room(frame_, candidate, worker_.pairs.posed))
    test();
  candidate.slot_a = acquire_slot(frame_, a.batch, a.instance, worker_.pairs.posed);
  candidate.slot_b = acquire_slot(frame_, b.batch, b.instance, worker_.pairs.posed);
  worker_.pairs.candidates.push(candidate);
}

void PosedTester::add(const RowPair& pair) {
  const CrowdRow &x = crowd_.sorted_row(pair.a), &y = crowd_.sorted_row(pair.b);
  const bool in_order = instance_key(x.batch, x.instance) <= instance_key(y.batch, y.instance);
  add(in_order ? x : y, in_order ? y : x);
}

// Adds the candidates that wait: those between the same two runs of sixteen rows one after the other, so that few
// instances are posed more than once.
void PosedTester::add_waiting() {
  const auto runs = [](const RowPair& pair) { return std::uint64_t{pair.a / kLanes} << 32 | pair.b / kLanes; };
  std::sort(worker_.pairs.waiting.begin(), worker_.pairs.waiting.end(), [&runs](const RowPair& x, const RowPair& y) {
    return std::make_tuple(runs(x), x.a, x.b) < std::make_tuple(runs(y), y.a, y.b);
  });
  for (const RowPair& pair : worker_.pairs.waiting) add(pair);
  worker_.pairs.waiting.clear();
}

bool PosedTester::has_large(const RowPair& pair) const {
  return is_large(*frame_.batch(crowd_.sorted_row(pair.a).batch).articulation) ||
         is_large(*frame_.batch(crowd_.sorted_row(pair.b).batch).articulation);
}

// Whether the bounds of two sorted rows overlap in double.
bool PosedTester::is_candidate(const RowPair& pair) const {
  const CrowdRow &a = crowd_.sorted_row(pair.a), &b = crowd_.sorted_row(pair.b);
  return overlap(frame_.batch(a.batch).bounds[a.instance], frame_.batch(b.batch).bounds[b.instance]);
}

void PosedTester::add(const std::uint32_t* a, const std::uint32_t* b, std::uint32_t count) {
  for (std::uint32_t n = 0; n < count; ++n)
    for (const std::uint32_t row : {a[n], b[n]}) {
      const CrowdRow& of = crowd_.sorted_row(row);
      prefetch_line(&frame_.batch(of.batch).bounds[of.instance]);
    }
  for (std::uint32_t n = 0; n < count; ++n) {
    const RowPair pair = {a[n], b[n]};
    if (!is_candidate(pair)) continue;
    if (!has_large(pair)) {
      add(pair);
      continue;
    }
    if (worker_.pairs.waiting.size == worker_.pairs.waiting.capacity) add_waiting();
    worker_.pairs.waiting.push(pair);
  }
}

void PosedTester::add_within(std::uint32_t batch, std::uint32_t instance) {
  const CrowdRow one = {batch, instance, 0};
  if (!skips_within(frame_, frame_.batch(batch), instance)) add(one, one);
}

void PosedTester::finish() {
  add_waiting();
  test();
}

}  // namespace cab
