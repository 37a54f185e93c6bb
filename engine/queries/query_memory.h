// The memory of run_queries: the index, what is kept per query, and what each worker keeps.
#pragma once

#include "engine/queries/query_index.h"
#include "layout/tile.h"

#include <cab/query.h>

#include <memory>
#include <vector>

namespace cab {

// A cluster whose leaf boxes a worker has posed, with leaves as lanes: those of lane i begin at boxes[i *
// tile_count(leaves)].
struct PosedCluster {
  struct Lane {
    double origin[3];  // of the instance, in the world
    float reach;       // the largest coordinate of any leaf's bounds
    std::uint32_t instance;
  };

  std::uint32_t generation;  // of the worker's set; any other: not posed
  std::uint32_t live;        // bits of the lanes whose pose is valid
  std::uint32_t batch;       // index of the batch
  std::uint32_t leaves;      // of each instance
  const BoxTile* boxes;
  Lane lanes[kLanes];

  const BoxTile* boxes_of(std::uint32_t lane) const { return boxes + std::size_t{lane} * tile_count(leaves); }
};

// The clusters that a worker has posed, until there is no room for another.
struct PosedClusters {
  Span<PosedCluster> clusters;  // by index of the cluster
  FixedList<BoxTile> boxes;
  std::uint32_t generation = 1;
};

// An instance whose bounds a query meets: lane `lane` of a node of the index's lowest level.
struct MetInstance {
  std::uint32_t batch, instance;  // batch: its index
  std::uint32_t node, lane;
};

// A worker keeps two hits per query that there is room for, and so many more: queries that want all may find many.
inline constexpr std::size_t kSpareHits = 32768;

// What one worker keeps for run_queries. Worker has the memory for posing.
struct QueryWorker {
  explicit QueryWorker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  PosedClusters posed;
  FixedList<MetInstance> met;       // by one query, where hits have no distance
  FixedList<QueryHit> hits;         // of the queries of a chunk, until they are written in order
  FixedList<QueryHit> of_instance;  // of one query and instance: one per link
  Span<std::uint32_t> at_link;      // by link: 1 + its index in of_instance; 0 between instances
  QueryStats stats;
};

// Where the hits of a query are.
struct QueryResult {
  std::uint32_t worker, begin;  // in QueryWorker::hits, if `is_stored`
  std::uint32_t count;
  bool is_stored, is_found;
};

struct QueryMemory {
  explicit QueryMemory(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  std::size_t queries = 0;  // how many are worked on at a time
  QueryIndex index;
  Span<KeyedNumber> order, other_order;  // of the queries of a chunk along the index's curve
  Span<QueryResult> results;             // by query of a chunk
  Span<std::size_t> hit_begin;           // by query of a chunk: how many hits of the job come before its own
  std::vector<std::unique_ptr<QueryWorker>> workers;
};

}  // namespace cab
