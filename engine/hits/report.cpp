// Reports candidates, and appends and sorts the hits of sequences.
#include "engine/hits/report.h"

#include "engine/exact/touching_links.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace cab {
namespace {

// The promised order of hits.
auto key_order(const Hit& hit) {
  return std::tie(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a, hit.link_b);
}

// Adds a hit to a list. If it is full, it is appended to the caller's buffer first.
void push_hit(const Hit& hit, FixedList<Hit>& hits, HitSink& sink) {
  if (hits.size == hits.capacity) append_hits(hits, sink);
  hits.push(hit);
}

}  // namespace

void report_candidate(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, HitScratch& scratch,
                      FrameStats& stats, HitSink& sink) {
  stats.leaf_pairs += pairs.size;
  if (frame.report == Report::kInContact) {
    if (!is_already_reported(frame, candidate) && any_touching(frame, candidate, pairs, stats))
      set_in_contact(frame, candidate);
  } else if (frame.batch(candidate.batch_a).kind == BatchKind::kCharacters) {
    add_group(frame, candidate, pairs, scratch.block, stats, sink);
  } else {
    for_each_touching(frame, candidate, pairs, stats,
                      [&](const LinkedPair& pair) { push_hit(hit_of(candidate, pair), scratch.hits, sink); });
  }
}

void append_hits(FixedList<Hit>& hits, HitSink& sink) {
  const std::uint64_t found = sink.found.fetch_add(hits.size, std::memory_order_relaxed);
  const auto at = static_cast<std::size_t>(std::min<std::uint64_t>(found, sink.job->hits.size));
  std::copy(hits.begin(), hits.begin() + std::min<std::size_t>(sink.job->hits.size - at, hits.size),
            sink.job->hits.data + at);
  hits.clear();
}

void sort_hits(Span<Hit> hits) {
  std::sort(hits.begin(), hits.end(), [](const Hit& x, const Hit& y) { return key_order(x) < key_order(y); });
}

void finish_hits(HitSink& sink) {
  FrameJob& job = *sink.job;
  constexpr std::uint64_t kMost = std::numeric_limits<std::size_t>::max();
  job.hits_needed = static_cast<std::size_t>(std::min(sink.found.load(), kMost));
  job.hit_count = 0;
  if (job.hits_needed > job.hits.size || sink.out_of_memory) return;
  job.hit_count = job.hits_needed;
  if (!sink.sorted) sort_hits({job.hits.data, job.hit_count});
}

}  // namespace cab
