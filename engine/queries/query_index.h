// The index of run_queries: a tree over the bounds of all instances, sixteen children a node, in one array per level.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "kernels/walk_index.h"
#include "layout/pair_list.h"
#include "layout/tile.h"

namespace cab {

struct WorkerPool;

// An instance or a cluster by where it is: its centre in the index.
struct IndexedPoint {
  float at[3];
  std::uint32_t number;
};

// A number with a key to sort it by.
struct KeyedNumber {
  std::uint32_t key;
  std::uint32_t number;
};

// Up to sixteen instances of one batch that are near each other: the children of a node of the lowest level.
struct QueryCluster {
  std::uint32_t batch;  // index of the batch
  std::uint32_t first;  // index of its first instance in QueryIndex::order
  std::uint32_t count;
};

// How the instances of each batch are arranged: what takes longer saves nodes that queries are compared with.
enum class Arrangement : std::uint8_t {
  kOnCurve,  // along a Z-order curve
  kHalved,   // halved along the axis of most spread, again and again
};

// The bounds of the children of node i of level k are nodes[level_begin[k] + i], with children as lanes: on level 0 the
// instances of cluster i, on others the nodes 16 i to 16 i + 15 of the level below. Positions are relative to `center`
// and multiplied by `scale`, so that all are between -1 and 1, and bounds are larger by kQueryPad.
struct QueryIndex {
  static constexpr std::uint32_t kMostLevels = kernel::IndexNodes::kMostLevels;

  std::uint64_t of_frame = 0;  // Engine::bounds_of_frame, if it holds the instances of that frame
  Arrangement arrangement = Arrangement::kOnCurve;
  std::uint32_t levels = 0;
  std::uint32_t level_begin[kMostLevels + 1] = {};
  double center[3] = {}, scale = 1;
  FixedList<QueryCluster> clusters;
  FixedList<AabbTile> nodes;
  Span<std::uint16_t> used;            // by node: bits of the children that it has
  Span<IndexedPoint> order;            // the instances, by batch, then by cluster
  Span<KeyedNumber> keys, other_keys;  // scratch, for kOnCurve: by instance
  Span<IndexedPoint> cluster_order;    // scratch: the clusters
  FixedList<QueryCluster> unordered;   // scratch: the clusters as batches have them
  Span<InstanceBounds> bounds;         // by batch, then by instance: those of this call
  Span<std::uint32_t> given;           // by index of the batch: how many of its instances were given
  Span<std::uint32_t> batch_begin;     // by index of the batch: where its instances begin in `order`, `bounds`; empty
                                       // if there is one batch

  std::uint32_t begin_of(std::uint32_t batch) const { return batch_begin.empty() ? 0 : batch_begin[batch]; }

  std::uint32_t node_count(std::uint32_t level) const { return level_begin[level + 1] - level_begin[level]; }

  kernel::IndexNodes view() const { return {nodes.data, used.data, level_begin, levels}; }

  // How many children a node has.
  std::uint32_t child_count(std::uint32_t level, std::uint32_t node) const {
    if (level == 0) return clusters.data[node].count;
    const std::uint32_t left = node_count(level - 1) - node * kLanes;
    return left < kLanes ? left : kLanes;
  }

  TileInstances instances_of(const QueryCluster& cluster) const {
    TileInstances out;
    out.count = cluster.count;
    for (std::uint32_t lane = 0; lane < cluster.count; ++lane) out.instance[lane] = order[cluster.first + lane].number;
    return out;
  }
};

// Most nodes of an index with so many clusters.
std::size_t most_nodes(std::size_t clusters);

// The bounds of an instance that takes no part.
inline constexpr InstanceBounds kNoBounds = {{1, 1, 1}, {-1, -1, -1}};
inline bool has_bounds(const InstanceBounds& bounds) { return bounds.lo[0] <= bounds.hi[0]; }

// The number of a point's cell along a curve that fills the index.
std::uint32_t curve_key(const QueryIndex& index, const double* point);

// Sorts by key; equal keys stay in their order. `other` is scratch of the same size.
void sort_by_key(Span<KeyedNumber> order, Span<KeyedNumber> other);

// Sets where the instances of each batch begin: before their bounds are stored.
void lay_out_index(StoredBatches batches, QueryIndex& index);

// Makes the index of all given instances whose bounds are not kNoBounds, arranged as it says.
void build_index(StoredBatches batches, WorkerPool& pool, QueryIndex& index);

// Makes an index of one batch, halved, from index.bounds of its instances alone. slot: index of the batch.
void build_index_of_one(std::uint32_t slot, QueryIndex& index);

// The same, with instances arranged as another index of the batch has them. Returns false, and makes none, if the other
// lacks an instance.
bool build_index_like(const QueryIndex& other, QueryIndex& index);

}  // namespace cab
