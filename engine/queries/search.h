// How a query goes through the index, from the top to the instances whose bounds it meets.
#pragma once

#include "engine/convex_queues.h"
#include "engine/queries/hit_room.h"
#include "engine/queries/past_room.h"
#include "engine/queries/query_room.h"
#include "engine/worker.h"
#include "kernels/query_bounds.h"
#include "kernels/vec3.h"
#include "layout/leaf_bounds_soa.h"

#include <array>
#include <cmath>

namespace cab {

// What every query of a call reads, and the memory of the worker that answers it.
struct QueryRun {
  const FrameContext& frame;
  const QueryIndex& index;
  const QueryJob& job;
  Worker& worker;
  QueryWorker& own;
  bool asks_static;                        // whether static bodies are among the inputs
  Span<const StoredHistory* const> asked;  // the job's histories
  PastWorker* past;                        // not null if there are histories

  // The same for another index.
  QueryRun in(const QueryIndex& other) const { return {frame, other, job, worker, own, asks_static, asked, past}; }
};

// Where the poses of an instance at a query's time are.
struct PastPlace {
  const PastCandidate& of;
  PoseCoding coding;
  const float* orientation;  // null if it has none
  float scale;
  PastWorker& own;
};

// Whether an instance at `apart` from a query may be found at all.
inline bool is_in_reach(const double (&apart)[3]) {
  return std::fabs(apart[0]) <= kMaxQueryCoordinate && std::fabs(apart[1]) <= kMaxQueryCoordinate &&
         std::fabs(apart[2]) <= kMaxQueryCoordinate;
}

// An instance whose leaf boxes are posed.
struct PosedInstance {
  const InstanceBatch* batch;
  std::uint32_t slot, instance;  // slot: index of the batch
  std::uint32_t leaves;
  const BoxAos* boxes;
  const float* leaf_bounds;
  float reach;                      // the largest coordinate of any leaf's bounds
  double apart[3];                  // its origin less the query's position
  const PastPlace* past = nullptr;  // null: it is posed by the job's inputs
};

// The exact shapes of a leaf, posed.
LeafShapes shapes_of(const QueryRun& run, const PosedInstance& one, std::uint32_t leaf);

// Where the leaf boxes of a posed tile go: lane i has boxes[i * leaves] and the following, and leaf bounds as
// structures of arrays one after the other.
struct PosedLanes {
  BoxAos* boxes;
  float* leaf_bounds;
  float (&reach)[kLanes];  // receives the largest coordinate of any leaf's bounds
};

// Takes the leaf boxes of the first lanes of a tile out of worker.boxes.
void take_posed(const kernel::KernelTable& kernels, Worker& worker, std::uint32_t leaves, std::uint32_t count,
                const PosedLanes& to);

// Poses a cluster, unless it is posed already.
const PosedCluster& posed_cluster(const QueryRun& run, std::uint32_t cluster);

// Forgets all posed clusters: when there is no room for another, and between calls.
void forget_clusters(PosedClusters& posed);

inline bool is_ignored(const Query& query, std::uint32_t slot, std::uint32_t instance) {
  return slot_of(query.ignored_batch).value == slot + 1 && query.ignored_instance == instance;
}

// Whether a query looks at an instance at all.
inline bool looks_at(const Query& query, const InstanceBatch& batch, std::uint32_t slot, std::uint32_t instance) {
  const Span<const std::uint32_t> layers = batch.input->layers;
  if (query.time != kNow && !is_static(batch)) return false;
  return !is_ignored(query, slot, instance) && (query.layer_mask & (layers.empty() ? ~0u : layers[instance])) != 0;
}

// The lane of those that are set in `lanes` with the least entry; of equal ones the lowest. lanes: not 0.
inline std::uint32_t nearest_lane(std::uint32_t lanes, const float (&entry)[kLanes]) {
  auto out = static_cast<std::uint32_t>(__builtin_ctz(lanes));
  for (lanes &= lanes - 1; lanes; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(__builtin_ctz(lanes));
    if (entry[lane] < entry[out]) out = lane;
  }
  return out;
}

// Prefetches memory that is read soon.
inline void prefetch(const void* from, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(static_cast<const char*>(from) + at);
}
inline constexpr std::size_t kPrefetchedFloats = 6 * kLanes;  // of an instance's leaf bounds

// Goes through an index from the top, the nearest nodes first, until probe.is_done(). Calls visit(cluster, met, entry)
// for each cluster with the lanes that are met, at least one. A probe has:
//   enter()             takes the query to the index of its run. False: it meets nothing there
//   meets(row, entry)   the lanes of sixteen bounds of the index that the query meets, and when it enters each, or less
//   skips(entry)        whether what is entered then is not wanted any more
//   test(instance)      tests the leaves
//   is_done()           whether nothing more is wanted
template <class Probe, class Visit>
void walk_index(const QueryIndex& index, QueryStats& stats, Probe& probe, Visit&& visit_cluster) {
  struct Visited {
    float entry;
    std::uint32_t level, node;
  };
  if (index.levels == 0) return;
  Visited stack[QueryIndex::kMostLevels * kLanes];
  std::uint32_t size = 0;
  stack[size++] = {0, index.levels - 1, 0};
  while (size > 0 && !probe.is_done()) {
    const Visited visit = stack[--size];
    if (probe.skips(visit.entry)) continue;
    const AabbTile& node = index.nodes.data[index.level_begin[visit.level] + visit.node];
    alignas(64) float entry[kLanes];
    ++stats.nodes;
    const std::uint32_t used = (1u << index.child_count(visit.level, visit.node)) - 1;
    std::uint32_t met = probe.meets({&node.lo[0][0], kLanes}, entry) & used;
    if (visit.level == 0) {
      if (met) visit_cluster(visit.node, met, entry);
      continue;
    }
    const Visited* const first = stack + size;
    for (; met; met &= met - 1) {  // the nearest comes to the top
      const auto lane = static_cast<std::uint32_t>(__builtin_ctz(met));
      Visited* at = stack + size++;
      for (; at > first && at[-1].entry < entry[lane]; --at) *at = at[-1];
      *at = {entry[lane], visit.level - 1, visit.node * kLanes + lane};
    }
    if (stack + size > first)
      prefetch(index.nodes.data + index.level_begin[visit.level - 1] + stack[size - 1].node, sizeof(AabbTile));
  }
}

// Calls probe.test(instance) for every instance of the job's inputs whose bounds the query meets, the nearest first,
// until probe.is_done().
template <class Probe>
void search_index(const QueryRun& run, const Query& query, Probe& probe) {
  const QueryIndex& index = run.index;
  walk_index(index, run.own.stats, probe, [&](std::uint32_t node, std::uint32_t met, const float(&entry)[kLanes]) {
    const QueryCluster& cluster = index.clusters.data[node];
    const InstanceBatch& batch = run.frame.batch(cluster.batch);
    const PosedCluster* posed = nullptr;
    while (met && !probe.is_done()) {
      const std::uint32_t lane = nearest_lane(met, entry);
      met &= ~(1u << lane);
      if (probe.skips(entry[lane])) break;
      const std::uint32_t instance = index.order[cluster.first + lane].number;
      if (!looks_at(query, batch, cluster.batch, instance)) continue;
      if (!posed) posed = &posed_cluster(run, node);
      if (!(posed->live >> lane & 1)) continue;
      const std::uint32_t leaves = batch.active->leaf_count;
      prefetch(posed->leaf_bounds + lane * leaf_bounds_floats(leaves),
               std::min<std::size_t>(leaf_bounds_floats(leaves), kPrefetchedFloats) * sizeof(float));
      PosedInstance one = {&batch,
                           cluster.batch,
                           instance,
                           leaves,
                           posed->boxes + std::size_t{lane} * leaves,
                           posed->leaf_bounds + lane * leaf_bounds_floats(leaves),
                           posed->reach[lane],
                           {}};
      for (std::uint32_t c = 0; c < 3; ++c) one.apart[c] = origin_of(batch, instance, c) - query.position[c];
      if (!is_in_reach(one.apart)) continue;
      ++run.own.stats.instances;
      probe.test(one);
    }
  });
}

// Calls test(leaf) for the leaves of an instance whose bounds a query meets, of every sixteen the nearest first.
// meets(row, entry), skips(entry): as of a probe. Stops when is_done().
template <class Meets, class Skips, class Test, class IsDone>
void for_each_leaf(const QueryRun& run, const PosedInstance& one, Meets&& meets, Skips&& skips, Test&& test,
                   IsDone&& is_done) {
  const std::uint32_t width = leaf_bounds_width(one.leaves);
  for (std::uint32_t first = 0; first < one.leaves && !is_done(); first += kLanes) {
    alignas(64) float entry[kLanes];
    const std::uint32_t count = std::min(kLanes, one.leaves - first);
    std::uint32_t met = meets({one.leaf_bounds + first, width}, entry) & ((1u << count) - 1);
    while (met && !is_done()) {
      const std::uint32_t lane = nearest_lane(met, entry);
      if (skips(entry[lane])) break;
      met &= ~(1u << lane);
      ++run.own.stats.leaf_tests;
      test(first + lane);
    }
  }
}

// A point or a direction as hits have it.
inline std::array<float, 3> floats(const kernel::Vec3<double>& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Collects the hits of one query, one per link.
class LinkHits {
 public:
  LinkHits(const QueryRun& run, const Query& query, std::uint32_t number, HitRoom& room)
      : run_(run), query_(query), number_(number), room_(room) {}

  // A leaf that the query meets, or a part of one.
  void add(const PosedInstance& one, std::uint32_t leaf, float distance, const std::array<float, 3>& point,
           const std::array<float, 3>& normal, bool inside) {
    is_found_ = true;
    nearest_ = std::min(nearest_, distance);
    if (query_.want == QueryWant::kAny) return;
    QueryHit hit = {number_,
                    {one.slot + 1},
                    one.instance,
                    one.batch->articulation->leaf_link[leaf],
                    static_cast<std::uint16_t>(leaf),
                    distance,
                    {},
                    {},
                    inside};
    std::copy_n(point.data(), 3, hit.point);
    std::copy_n(normal.data(), 3, hit.normal);
    std::uint32_t& at = run_.own.at_link[hit.link];
    FixedList<QueryHit>& hits = run_.own.of_instance;
    if (at == 0) {
      hits.push(hit);
      at = hits.size;
    } else if (QueryHit& other = hits.data[at - 1];
               distance < other.distance || (distance == other.distance && hit.leaf < other.leaf)) {
      other = hit;
    }
  }

  // Ends an instance.
  void finish() {
    FixedList<QueryHit>& hits = run_.own.of_instance;
    for (const QueryHit& hit : hits) {
      run_.own.at_link[hit.link] = 0;
      room_.add(hit);
    }
    hits.clear();
  }

  bool is_found() const { return is_found_; }
  bool is_done() const { return is_found_ && query_.want == QueryWant::kAny; }

  // No link that is farther is wanted any more.
  float most() const { return query_.want == QueryWant::kAll ? room_.most() : nearest_; }

 private:
  const QueryRun& run_;
  const Query& query_;
  std::uint32_t number_;
  HitRoom& room_;
  bool is_found_ = false;
  float nearest_ = std::numeric_limits<float>::infinity();
};

}  // namespace cab
