// The way of a ray or a point through an index of bounds, sixteen children a node, the nearest first.
#pragma once

#include "kernels/query_bounds.h"
#include "layout/compiler.h"

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

// The lane of those that are set in `lanes` with the least entry; of equal ones the lowest. lanes: not 0.
inline std::uint32_t nearest_lane(std::uint32_t lanes, const float (&entry)[kLanes]) {
  auto out = lowest_bit(lanes);
  for (lanes &= lanes - 1; lanes; lanes &= lanes - 1) {
    const auto lane = lowest_bit(lanes);
    if (entry[lane] < entry[out]) out = lane;
  }
  return out;
}

// Goes on to the next child of level 0 that is met, and writes it. Returns false if there is none, or none that is
// wanted. meets(row, entry): the lanes that a query meets, and when it enters each. skips(entry): whether what is
// entered then is not wanted any more.
template <class Meets, class Skips>
CAB_INLINE bool walk_on(const IndexNodes& index, const Meets& meets, const Skips& skips, IndexWalk& walk,
                        MetBounds* out) {
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
    }
    std::uint32_t lane = 0;
    for (; walk.depth > 0; --walk.depth) {
      const IndexWalk::Node& last = walk.nodes[walk.depth - 1];
      if (!last.met) continue;
      lane = nearest_lane(last.met, last.entry);
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

// A ray on its way, and a point or a sphere.
template <class V>
struct RayWalk {
  const RayLanes& ray;

  CAB_INLINE std::uint32_t operator()(const BoundsRow& row, float* entry) const {
    return ray_bounds<V>(row, ray, entry);
  }
};
template <class V>
struct PointWalk {
  const PointLanes& point;

  CAB_INLINE std::uint32_t operator()(const BoundsRow& row, float* entry) const {
    return point_bounds<V>(row, point, entry);
  }
};

// walk_on for them.
template <class V>
bool walk_ray(const IndexNodes& index, const RayLanes& ray, IndexWalk& walk, MetBounds* out) {
  return walk_on(
      index, RayWalk<V>{ray}, [&ray](float entry) { return entry > ray.end; }, walk, out);
}
template <class V>
bool walk_point(const IndexNodes& index, const PointLanes& point, IndexWalk& walk, MetBounds* out) {
  return walk_on(
      index, PointWalk<V>{point}, [&point](float entry) { return entry > point.most_sq; }, walk, out);
}

}  // namespace cab::kernel
