// The poses that a batch had at its last moments, and which instances are where between two of them.
#pragma once

#include "engine/queries/query_index.h"
#include "layout/arena.h"
#include "layout/center_grid.h"

#include <cab/query.h>

#include <memory>
#include <vector>

namespace cab {

// What a history keeps of a link: the quaternion, then the translation.
inline constexpr std::uint32_t kTickFloats = 7;

// What a history keeps of where the centres of leaf boxes are, besides a dword per leaf.
inline constexpr std::uint32_t kGridWords = sizeof(CenterGrid) / sizeof(std::uint32_t);

// What places an instance at one moment, and which layers it is in. What the caller gave none of is the identity, 1 and
// all bits.
struct alignas(64) KeptPlace {
  std::uint64_t number;  // of the moment; any other: the moment lacks the instance, and all of this is stale
  double origin[3];
  float orientation[4];
  float scale;
  std::uint32_t layers;
  float bulge;  // how far its leaf boxes may leave the straight line from the moment before to this one
};

// One moment.
struct HistoryTick {
  std::uint64_t number;  // of all moments that were ever recorded
  double time;
  bool has_orientations, has_scales;
  std::size_t pose_floats, center_words;  // of one instance
  float* poses;                           // by instance: kTickFloats per link
  std::uint32_t* centers;                 // by instance: cells of its leaf boxes, and at the end their CenterGrid
  KeptPlace* places;                      // by instance
  QueryIndex index;  // its instances, by bounds that also hold all that is between the moment before and this one

  bool has(std::uint32_t instance) const { return place(instance).number == number; }
  float* pose(std::uint32_t instance) const { return poses + instance * pose_floats; }
  std::uint32_t* center(std::uint32_t instance) const { return centers + instance * center_words; }
  CenterGrid& grid(std::uint32_t instance) const {
    return *reinterpret_cast<CenterGrid*>(center(instance) + center_words - kGridWords);
  }
  KeptPlace& place(std::uint32_t instance) const { return places[instance]; }
};

struct StoredHistory {
  explicit StoredHistory(const Allocator& allocator) : arena(allocator) {}

  // Whether the slot holds a history.
  bool in_use() const { return batch.value != 0; }

  std::uint32_t serial = 0;  // of the id
  Arena arena;               // owns the spans below and those of the moments
  BatchId batch;             // never a bare slot
  const Articulation* articulation = nullptr;
  std::uint32_t instances = 0;         // of the batch
  Span<HistoryTick> ring;              // one more than are kept: that of a call that fails is none of them
  std::uint32_t first = 0, count = 0;  // of the moments that are kept
  std::uint64_t recorded = 0;          // how many moments were recorded
  Span<float> reach;                   // by link: how far what it moves is from its origin, at most; -1 if nothing
  Span<float> radius;                  // by leaf: of a ball about its box's centre that holds the posed box
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

  bool has(std::uint32_t instance) const { return from->has(instance) && to->has(instance); }
  bool is_between() const { return from != to; }
  bool has_orientations() const { return from->has_orientations || to->has_orientations; }
  bool has_scales() const { return from->has_scales || to->has_scales; }

  double origin(std::uint32_t instance, std::uint32_t c) const {
    const double at = from->place(instance).origin[c];
    return is_between() ? at + part * (to->place(instance).origin[c] - at) : at;
  }

  float scale(std::uint32_t instance) const {
    const float at = from->place(instance).scale, by = static_cast<float>(part);
    return by > 0 ? (1 - by) * at + by * to->place(instance).scale : at;
  }
};

// The history has at least one moment.
HistoryMoment moment_of(const StoredHistory& history, double time);

// A number below kTimeKeys that does not fall from a time to a later one. It tells times of the history apart.
inline constexpr std::uint32_t kTimeKeys = 1 << 29;
std::uint32_t time_key(const StoredHistory& history, double time);

}  // namespace cab
