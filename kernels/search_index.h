// A search of an index down to the leaf boxes of instances: what it reads, and where it stops.
#pragma once

#include "kernels/posed_cluster.h"
#include "kernels/walk_index.h"

#include <cmath>

namespace cab::kernel {

// An index and its clusters. layers: by index of the batch, then by instance; null: of every instance all bits.
struct SearchedIndex {
  IndexNodes nodes;
  const PosedCluster* clusters;  // by node of level 0
  std::uint32_t generation;      // of the clusters that are posed
  const std::uint32_t* const* layers;
};

// Where a query is, and which instances it looks at.
struct SearchFilter {
  double position[3];
  std::uint32_t layer_mask;
  std::uint32_t ignored_batch;  // index of the batch; none has it: nothing is ignored
  std::uint32_t ignored_instance;
  bool only_static;
};

// Why a search has stopped.
enum class SearchStop : std::uint8_t {
  kGoesOn,
  kEnd,   // nothing is left that is wanted
  kPose,  // the cluster of the instance that it has come to is not posed; it goes on when that is done
  kTest,  // it has met leaves that have to be tested before it goes on
};

// A leaf whose box a query may meet. entry: at which distance, or less.
struct MetLeaf {
  float entry;
  std::uint32_t node, lane, leaf;  // lane: of the cluster `node`
};

// The order in which they are tested: the nearest first.
struct MetNearer {
  bool operator()(const MetLeaf& x, const MetLeaf& y) const {
    if (x.entry != y.entry) return x.entry < y.entry;
    if (x.node != y.node) return x.node < y.node;
    return x.lane != y.lane ? x.lane < y.lane : x.leaf < y.leaf;
  }
};

// The way of a search: to the next instance, then through its leaves.
struct SearchWay {
  IndexWalk walk;
  MetBounds at = {};         // the instance
  bool is_within = false;    // whether `at` is to be tested, or gone on with
  bool is_counted = false;   // whether `tested` has it
  std::uint32_t tile = 0;    // of its leaves, sixteen each
  std::uint64_t tested = 0;  // how many instances were
};

// For walk_on: prefetches what a search reads next, where a node is met.
struct ReadAhead {
  const SearchedIndex& index;

  CAB_INLINE void operator()(std::uint32_t level, std::uint32_t number, std::uint32_t met) const {
    if (level > 0) {
      const AabbTile* const below = index.nodes.nodes + index.nodes.level_begin[level - 1] + number * kLanes;
      for (; met; met &= met - 1) {
        prefetch_line(below + lowest_bit(met));
        if (level == 1) prefetch_line(index.clusters + number * kLanes + lowest_bit(met));
      }
    }
  }
};

// Prefetches an instance.
CAB_INLINE void read_ahead(const SearchedIndex& index, const MetBounds& at) {
  const PosedCluster& cluster = index.clusters[at.node];
  if (cluster.generation != index.generation) return;
  prefetch_line(&cluster.lanes[at.lane]);
  prefetch_bytes(cluster.boxes_of(at.lane), sizeof(BoxTile));
}

// Whether a query looks at an instance of a cluster that is posed. apart: receives the instance's origin less the
// query's position.
template <class V>
CAB_INLINE bool looks_at(const SearchedIndex& index, const SearchFilter& filter, const PosedCluster& cluster,
                         std::uint32_t lane, double (&apart)[3]) {
  const PosedCluster::Lane& of = cluster.lanes[lane];
  if (!(cluster.live >> lane & 1) || (filter.only_static && !cluster.is_static)) return false;
  if (cluster.batch == filter.ignored_batch && of.instance == filter.ignored_instance) return false;
  const std::uint32_t* const layers = index.layers[cluster.batch];
  if (((layers ? layers[of.instance] : ~0u) & filter.layer_mask) == 0) return false;
  bool is_in_reach = true;
  for (int c = 0; c < 3; ++c) {
    apart[c] = of.origin[c] - filter.position[c];
    is_in_reach = is_in_reach && std::fabs(apart[c]) <= kMaxQueryCoordinate;
  }
  return is_in_reach;
}

// The bits of the leaves of a tile.
CAB_INLINE std::uint32_t leaf_bits(std::uint32_t leaves, std::uint32_t tile) {
  const std::uint32_t left = leaves - tile * kLanes;
  return left < kLanes ? (1u << left) - 1 : (1u << kLanes) - 1;
}

}  // namespace cab::kernel
