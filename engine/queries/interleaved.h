// Several queries that want one link or none, on their way through the index by turns: what one of them reads next
// comes from memory while the others are tested.
#pragma once

#include "engine/queries/search.h"

#include <cstddef>
#include <new>
#include <type_traits>

namespace cab {

// How many queries are interleaved.
inline constexpr std::uint32_t kInterleaved = 8;

// Whether a query may be interleaved with others of its kind: it asks the job's inputs for the nearest link.
inline bool may_be_interleaved(const Query& query) {
  return (query.kind == QueryKind::kRay || query.kind == QueryKind::kPoint) && query.want != QueryWant::kAll &&
         query.time == kNow;
}

// One of the queries.
template <class Probe>
class InTurn {
 public:
  InTurn(const QueryRun& run, std::uint32_t number)
      : run_(run),
        query_(run.job.queries[number]),
        buffer_({&closest_, 1}, query_.want == QueryWant::kAny ? 0 : 1),
        hits_(run, query_, number, buffer_),
        probe_(run, query_, hits_) {
    if (probe_.enter()) go_on();
  }
  InTurn(const InTurn&) = delete;

  bool is_at_end() const { return is_at_end_; }

  // Tests the instance that the way has come to, and goes on to the next.
  void take_turn() {
    test_lane(run_, query_, met_.node, met_.lane, probe_);
    go_on();
  }

  // Hands over the hit, if there is one and it is wanted.
  QueryResult end(FixedList<QueryHit>& to) {
    run_.own.stats.nodes += walk_.opened;
    hits_.end();
    const auto count = static_cast<std::uint32_t>(buffer_.count());
    const bool is_stored = to.size + count <= to.capacity;
    if (count > 0 && is_stored) to.push(closest_);
    return {0, 0, count, is_stored, hits_.is_found()};
  }

 private:
  void go_on() {
    is_at_end_ = probe_.is_done() || !probe_.next(walk_, &met_);
    if (!is_at_end_) prefetch_lane(run_, met_.node, met_.lane);
  }

  const QueryRun& run_;
  const Query& query_;
  QueryHit closest_;
  HitBuffer buffer_;
  LinkHits hits_;
  Probe probe_;
  kernel::IndexWalk walk_;
  kernel::MetBounds met_ = {};
  bool is_at_end_ = true;
};

// Answers `numbers`, at most kInterleaved queries of one kind that may be interleaved. Calls take(i, result) for each;
// its hit is then the last of `to`.
template <class Probe, class Take>
void answer_together(const QueryRun& run, Span<const std::uint32_t> numbers, FixedList<QueryHit>& to, Take&& take) {
  alignas(InTurn<Probe>) std::byte storage[kInterleaved][sizeof(InTurn<Probe>)];
  InTurn<Probe>* turns[kInterleaved];
  std::uint32_t order[kInterleaved], left = 0;
  for (std::uint32_t i = 0; i < numbers.size; ++i) {
    turns[i] = new (storage[i]) InTurn<Probe>(run, numbers[i]);
    if (!turns[i]->is_at_end()) order[left++] = i;
  }
  while (left > 0) {
    std::uint32_t still = 0;
    for (std::uint32_t k = 0; k < left; ++k) {
      InTurn<Probe>& turn = *turns[order[k]];
      turn.take_turn();
      order[still] = order[k];
      still += !turn.is_at_end();
    }
    left = still;
  }
  static_assert(std::is_trivially_destructible_v<InTurn<Probe>>);
  for (std::uint32_t i = 0; i < numbers.size; ++i) take(i, turns[i]->end(to));
}

}  // namespace cab
