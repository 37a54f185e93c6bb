// The way of a ray or a point through an index of bounds, sixteen children a node, the nearest first.
#pragma once

#include "kernels/query_bounds.h"
#include "layout/compiler.h"

#include <limits>

namespace cab::kernel {

// An index as engine/queries/query_index.h makes it: the bounds of the children of node i of level k are
// nodes[level_begin[k] + i], and bit c of `used` of it is set if it has a child c. On level 0 children are instances,
// on others child c of node i is node 16 i + c of the level below.
struct IndexNodes {
  static constexpr std::uint32_t kMostLevels = 8;  // 16^8 instances

  const AabbTile* nodes;
  const std::uint16_t* used;
  const std::uint32_t* level_begin;
  std::uint32_t levels;
};

// A child of a node of level 0 whose bounds a query meets, and where the query enters them, or less.
struct MetBounds {
  std::uint32_t node, lane;
  float entry;
};

// How far a query has come. It can be left off and gone on with.
struct IndexWalk {
  struct Node {
    alignas(64) float entry[kLanes];
    std::uint32_t met;  // the lanes that are left
    std::uint32_t level, number;
  };

  bool has_begun = false;
  std::uint32_t depth = 0;
  std::uint64_t opened = 0;  // how many nodes were compared with the query
  Node nodes[IndexNodes::kMostLevels];
};

// The lane of those that are set in `lanes` with the least entry, or a NaN; of such ones the lowest. lanes: not 0.
template <class V>
CAB_INLINE std::uint32_t nearest_lane(std::uint32_t lanes, const float (&entry)[kLanes]) {
  if (!(lanes & (lanes - 1))) return lowest_bit(lanes);
  V least(std::numeric_limits<float>::infinity());
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    least = min(select(MaskFromBits<V>::get(lanes >> lane), Lanes<V>::load(entry + lane),
                       V(std::numeric_limits<float>::infinity())),
                least);
  const V nearest(-horizontal_max(V(0.0f) - least));
  std::uint32_t farther = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    farther |= bits(Lanes<V>::load(entry + lane) > nearest) << lane;
  return lowest_bit(lanes & ~farther);
}

// For walk_on: does nothing about what a walk reads next.
struct ReadNothingAhead {
  CAB_INLINE void operator()(std::uint32_t, std::uint32_t, std::uint32_t) const {}
};

// For walk_on: prefetches the nodes below a node that are met.
struct ReadNodesAhead {
  const IndexNodes& index;

  CAB_INLINE void operator()(std::uint32_t level, std::uint32_t number, std::uint32_t met) const {
    if (level == 0) return;
    const AabbTile* const below = index.nodes + index.level_begin[level - 1] + number * kLanes;
    for (; met; met &= met - 1) prefetch_bytes(below + lowest_bit(met), sizeof(AabbTile));
  }
};

// Goes on to the next child of level 0 that is met, and writes it. Returns false if there is none, or none that is
// wanted. meets(row, entry): the lanes that a query meets, and when it enters each. skips(entry): whether what is
// entered then is not wanted any more.
template <class V, class Meets, class Skips, class Ahead>
CAB_INLINE bool walk_on(const IndexNodes& index, const Meets& meets, const Skips& skips, const Ahead& ahead,
                        IndexWalk& walk, MetBounds* out) {
  bool opens = !walk.has_begun && index.levels > 0;
  std::uint32_t level = index.levels - 1, number = 0;
  walk.has_begun = true;
  for (;; opens = true) {
    if (opens) {
      const std::uint32_t at = index.level_begin[level] + number;
      IndexWalk::Node& node = walk.nodes[walk.depth++];
      node.level = level;
      node.number = number;
      node.met = meets(BoundsRow{&index.nodes[at].lo[0][0], kLanes}, node.entry) & index.used[at];
      ++walk.opened;
      ahead(level, number, node.met);
    }
    std::uint32_t lane = 0;
    for (; walk.depth > 0; --walk.depth) {
      const IndexWalk::Node& last = walk.nodes[walk.depth - 1];
      if (!last.met) continue;
      lane = nearest_lane<V>(last.met, last.entry);
      if (!skips(last.entry[lane])) break;
    }
    if (walk.depth == 0) return false;
    IndexWalk::Node& node = walk.nodes[walk.depth - 1];
    node.met &= ~(1u << lane);
    if (node.level == 0) {
      *out = {node.number, lane, node.entry[lane]};
      return true;
    }
    level = node.level - 1;
    number = node.number * kLanes + lane;
  }
}

// A point or a sphere that is compared with many bounds.
template <class V>
struct PointWalk {
  const PointLanes& point;

  CAB_INLINE std::uint32_t operator()(const BoundsRow& row, float* entry) const {
    return point_bounds<V>(row, point, entry);
  }
};

// How they are compared with bounds.
template <class V>
CAB_INLINE RayWalk<V> walk_of(const RayLanes& ray) {
  return RayWalk<V>(ray);
}
template <class V>
CAB_INLINE PointWalk<V> walk_of(const PointLanes& point) {
  return {point};
}

// walk_on for a ray, and for a point or a sphere.
template <class V>
bool walk_ray(const IndexNodes& index, const RayLanes& ray, IndexWalk& walk, MetBounds* out) {
  return walk_on<V>(
      index, walk_of<V>(ray), [&ray](float entry) { return ray.skips(entry); }, ReadNodesAhead{index}, walk, out);
}
template <class V>
bool walk_point(const IndexNodes& index, const PointLanes& point, IndexWalk& walk, MetBounds* out) {
  return walk_on<V>(
      index, walk_of<V>(point), [&point](float entry) { return point.skips(entry); }, ReadNothingAhead(), walk, out);
}

}  // namespace cab::kernel
