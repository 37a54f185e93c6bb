// The memory of a call of run_queries: what is kept per query, and what each worker keeps.
#pragma once

#include "engine/exact/skin_cache.h"
#include "engine/queries/query_index.h"
#include "engine/session/engine.h"
#include "kernels/posed_cluster.h"
#include "kernels/search_round.h"
#include "kernels/surface/ray_triangles.h"

#include <cab/query.h>

#include <memory>
#include <vector>

namespace cab {

// The clusters that a worker has posed, until there is no room for another.
struct PosedClusters {
  Span<kernel::PosedCluster> clusters;  // by index of the cluster
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
  FixedList<MetInstance> met;               // by one query, where hits have no distance
  FixedList<kernel::MetNode> met_nodes;     // by one sphere
  FixedList<kernel::MetLeaves> met_leaves;  // likewise
  FixedList<kernel::MetLeaves> overlapped;  // of the queries of a chunk, until they are written as hits
  FixedList<QueryHit> hits;                 // of the queries of a chunk, until they are written in order
  FixedList<QueryHit> of_instance;          // of one query and instance: one per link
  Span<std::uint32_t> at_link;              // by link: 1 + its index in of_instance; 0 between instances
  SkinCache skins;                          // of leaves that rays have met; without places if none has triangles
  Span<kernel::MetTriangle> met_triangles;  // by one ray, of one leaf
  QueryStats stats;
};

// Where the hits of a query are: in QueryWorker::hits, or as bits in QueryWorker::overlapped.
struct QueryResult {
  std::uint32_t worker, begin;  // if `is_stored`
  std::uint32_t count;
  std::uint32_t tiles;  // how many it has in QueryWorker::overlapped, if it is answered by bits
  bool is_stored, is_found;
};

struct QueryMemory {
  explicit QueryMemory(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  std::size_t queries = 0;     // how many are worked on at a time
  std::uint32_t together = 1;  // how many queries are searched for by turns: the clusters that they meet have room
  std::uint64_t posed_of = 0;  // StoredIndex::serial of the index that workers have posed clusters of
  Span<const std::uint32_t*> layers;     // by index of the batch: those of its input, or null
  Span<KeyedNumber> order, other_order;  // of the queries of a chunk along the index's curve
  Span<QueryResult> results;             // by query of a chunk
  Span<std::size_t> hit_begin;           // by query of a chunk: how many hits of the job come before its own
  std::vector<std::unique_ptr<QueryWorker>> workers;
};

}  // namespace cab
