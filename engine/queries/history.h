// The poses that a batch had at its last moments, and which instances are where between two of them.
#pragma once

#include "engine/queries/query_index.h"
#include "layout/arena.h"

#include <cab/query.h>

#include <memory>
#include <vector>

namespace cab {

// What a history keeps of a link: the quaternion, then the translation.
inline constexpr std::uint32_t kTickFloats = 7;

// One moment. All spans are by instance; those of instances that it lacks are stale.
struct HistoryTick {
  double time;
  bool has_orientations, has_scales, has_layers;
  Span<float> poses;  // kTickFloats per link
  Span<float> orientations;
  Span<float> scales;
  Span<double> origins;
  Span<std::uint32_t> layers;
  QueryIndex at;     // the instances that it has
  QueryIndex since;  // those that the moment before has too, as they are between the two
};

struct StoredHistory {
  explicit StoredHistory(const Allocator& allocator) : arena(allocator) {}

  // Whether the slot holds a history.
  bool in_use() const { return batch.value != 0; }

  std::uint16_t generation = 0;  // how many histories the slot held before
  Arena arena;                   // owns the spans below and those of the moments
  BatchId batch;                 // never a bare slot
  const Articulation* articulation = nullptr;
  std::uint32_t instances = 0;         // of the batch
  Span<HistoryTick> ring;              // one more than are kept: that of a call that fails is none of them
  std::uint32_t first = 0, count = 0;  // of the moments that are kept
  Span<float> reach;                   // by link: how far its leaf boxes are from its origin, at most
  Span<InstanceBounds> bounds, next;   // by instance: those of the last moment, and of the one that is recorded
  Span<InstanceBounds> between;        // by instance: of both moments and what is between them
  Span<IndexedPoint> cluster_order;    // scratch of all indexes
  FixedList<QueryCluster> unordered;   // likewise

  const HistoryTick& tick(std::uint32_t i) const { return ring[(first + i) % ring.size]; }
  const HistoryTick& last() const { return tick(count - 1); }
};

// Where a time is in a history: at `from`, which then is `to` as well, or between two moments that follow each other.
struct HistoryMoment {
  const HistoryTick* from;
  const HistoryTick* to;
  double part;  // of the way from `from` to `to`
  const QueryIndex* index;
  bool is_clamped;

  bool is_between() const { return from != to; }
  bool has_orientations() const { return from->has_orientations || to->has_orientations; }
  bool has_scales() const { return from->has_scales || to->has_scales; }

  double origin(std::uint32_t instance, std::uint32_t c) const {
    const double at = from->origins[3 * std::size_t{instance} + c];
    return is_between() ? at + part * (to->origins[3 * std::size_t{instance} + c] - at) : at;
  }
};

// The history has at least one moment.
HistoryMoment moment_of(const StoredHistory& history, double time);

// The orientation and the scale of an instance, which are the identity where the caller gave none.
const float* orientation_of(const HistoryTick& tick, std::uint32_t instance);
inline float scale_of(const HistoryTick& tick, std::uint32_t instance) {
  return tick.has_scales ? tick.scales[instance] : 1.0f;
}

inline float scale_at(const HistoryMoment& moment, std::uint32_t instance) {
  const float from = scale_of(*moment.from, instance), part = static_cast<float>(moment.part);
  return part > 0 ? (1 - part) * from + part * scale_of(*moment.to, instance) : from;
}

}  // namespace cab
