// The ways of spheres and points through an index to leaf boxes: which a sphere overlaps, and which is nearest to a
// point.
#pragma once

#include "kernels/query_boxes.h"
#include "kernels/search_index.h"

namespace cab::kernel {

// A point relative to an instance's origin, and how far distances may be off there (docs/proof.md, step 12.8).
struct NearPoint {
  float at[3];
  double off;
};
CAB_INLINE NearPoint at_instance(const double (&apart)[3], float reach, double radius) {
  NearPoint out;
  double size = static_cast<double>(reach);
  for (int c = 0; c < 3; ++c) {
    size += std::fabs(apart[c]);
    out.at[c] = static_cast<float>(-apart[c]);
  }
  out.off = kQueryRounding * (size + 3 * radius) + kQueryBoxDistance * size;
  return out;
}

// ------------------------------------------------------------------------------------------------------- spheres

// A node of the lowest level, and the lanes that are met there.
struct MetNode {
  std::uint32_t node, lanes;
};

// The leaves of one tile of an instance that a sphere meets.
struct MetLeaves {
  std::uint64_t key;  // the index of the batch, then the instance
  std::uint32_t node;
  std::uint16_t lane, tile;  // lane: of the cluster `node`
  std::uint16_t inside;      // bits of those that the sphere overlaps
  std::uint16_t surface;     // of those that it overlaps or not, which a test in double decides
};

// Writes the nodes that are at most as far from a point as `point` says, in any order. Returns how many. out: has room
// for all of the lowest level. opened: is increased by the nodes that were compared.
template <class V>
std::uint32_t meet_nodes(const IndexNodes& index, const PointLanes& point, MetNode* out, std::uint64_t& opened) {
  struct Child {
    std::uint32_t level, number;
  };
  Child stack[IndexNodes::kMostLevels * kLanes];
  std::uint32_t depth = 0, count = 0;
  if (index.levels > 0) stack[depth++] = {index.levels - 1, 0};
  while (depth > 0) {
    const Child child = stack[--depth];
    const std::uint32_t at = index.level_begin[child.level] + child.number;
    alignas(64) float distance_sq[kLanes];
    std::uint32_t met =
        point_bounds<V>(BoundsRow{&index.nodes[at].lo[0][0], kLanes}, point, distance_sq) & index.used[at];
    ++opened;
    if (child.level == 0) {
      if (met) out[count++] = {child.number, met};
      continue;
    }
    const AabbTile* const below = index.nodes + index.level_begin[child.level - 1];
    for (; met; met &= met - 1) {
      const std::uint32_t number = child.number * kLanes + lowest_bit(met);
      prefetch_bytes(below + number, sizeof(AabbTile));
      stack[depth++] = {child.level - 1, number};
    }
  }
  return count;
}

// A sphere and how far it has come in a list of nodes.
struct SphereSearch {
  SearchFilter filter;
  double radius;
  bool any;  // whether one leaf that it surely overlaps is enough
  MetNode* nodes;
  std::uint32_t count, next;  // nodes[next].lanes loses those that are done
  MetLeaves* out;
  std::uint32_t out_count;
  std::uint64_t tested;  // how many instances were
};

// Writes the leaves that a sphere overlaps, or may. Stops where a cluster, nodes[next].node, is not posed.
template <class V>
SearchStop search_sphere(const SearchedIndex& index, SphereSearch& sphere) {
  for (; sphere.next < sphere.count; ++sphere.next) {
    MetNode& node = sphere.nodes[sphere.next];
    const PosedCluster& cluster = index.clusters[node.node];
    if (cluster.generation != index.generation) return SearchStop::kPose;
    if (sphere.next + 1 < sphere.count) {
      const MetNode& ahead = sphere.nodes[sphere.next + 1];
      for (std::uint32_t left = ahead.lanes; left; left &= left - 1)
        read_ahead(index, {ahead.node, lowest_bit(left), 0});
    }
    for (; node.lanes; node.lanes &= node.lanes - 1) {
      const std::uint32_t lane = lowest_bit(node.lanes);
      double apart[3];
      if (!looks_at<V>(index, sphere.filter, cluster, lane, apart)) continue;
      ++sphere.tested;
      const NearPoint point = at_instance(apart, cluster.lanes[lane].reach, sphere.radius);
      const double inner = sphere.radius - point.off;
      const V most_sq(square_above(sphere.radius + point.off)), inner_sq(inner > 0 ? square_below(inner) : -1.0f);
      const Vec3<V> at = {V(point.at[0]), V(point.at[1]), V(point.at[2])};
      const BoxTile* const boxes = cluster.boxes_of(lane);
      const std::uint32_t tiles = tile_count(cluster.leaves);
      for (std::uint32_t tile = 0; tile < tiles; ++tile) {
        std::uint32_t apart_bits = 0, surface = 0;
        for (std::uint32_t first = 0; first < kLanes; first += kWidth<V>) {
          const V distance_sq = distances_sq<V>(boxes[tile], first, at);
          apart_bits |= bits(distance_sq > most_sq) << first;
          surface |= bits(distance_sq > inner_sq) << first;
        }
        const std::uint32_t met = leaf_bits(cluster.leaves, tile) & ~apart_bits;
        if (!met) continue;
        const std::uint64_t key = std::uint64_t{cluster.batch} << 32 | cluster.lanes[lane].instance;
        sphere.out[sphere.out_count++] = {key,
                                          node.node,
                                          static_cast<std::uint16_t>(lane),
                                          static_cast<std::uint16_t>(tile),
                                          static_cast<std::uint16_t>(met & ~surface),
                                          static_cast<std::uint16_t>(met & surface)};
        if (sphere.any && (met & ~surface)) return SearchStop::kEnd;
      }
    }
  }
  return SearchStop::kEnd;
}

// -------------------------------------------------------------------------------------------------------- points

// A point whose nearest leaf is wanted, and how far its search has come.
struct PointSearch {
  static constexpr std::uint32_t kMostMet = 2 * kLanes;

  SearchFilter filter;
  PointLanes lanes;  // in the index
  double scale;      // of the index
  double end;        // what is farther is not wanted
  bool any;          // whether one leaf that is surely within `end` is enough
  bool is_met = false;
  SearchStop stop = SearchStop::kGoesOn;
  SearchWay way;
  MetLeaf met[kMostMet];
  std::uint32_t met_count = 0;
};

// Notes that nothing is wanted that is farther than `most`, the distance of a link, which may be rounded.
CAB_INLINE void shorten(PointSearch& point, double most) {
  const double far = (1 + kOutwards) * most, in_index = point.scale * far;
  const float most_sq = square_above(in_index + (kQueryPad + kQueryRayPad * in_index));
  if (far < point.end) point.end = far;
  if (most_sq < point.lanes.most_sq) point.lanes.most_sq = most_sq;
}

// Tests the leaves of the instance that the point has come to. apart: its origin less where the point is. Those that
// may be the nearest are in point.met.
template <class V>
CAB_INLINE SearchStop test_leaves(const PosedCluster& cluster, const double (&apart)[3], PointSearch& point) {
  constexpr float kMostFloat = std::numeric_limits<float>::max();
  SearchWay& way = point.way;
  const NearPoint near = at_instance(apart, cluster.lanes[way.at.lane].reach, 0);
  const Vec3<V> at = {V(near.at[0]), V(near.at[1]), V(near.at[2])};
  const BoxTile* const boxes = cluster.boxes_of(way.at.lane);
  const std::uint32_t tiles = tile_count(cluster.leaves);
  for (; way.tile < tiles; ++way.tile) {
    if (point.met_count + kLanes > PointSearch::kMostMet) return SearchStop::kTest;
    alignas(64) float distance_sq[kLanes];
    V least(std::numeric_limits<float>::infinity());  // lanes past the last leaf repeat it
    for (std::uint32_t first = 0; first < kLanes; first += kWidth<V>) {
      const V sq = distances_sq<V>(boxes[way.tile], first, at);
      Lanes<V>::store(distance_sq + first, sq);
      least = min(sq, least);
    }
    const float nearest_sq = -horizontal_max(V(0.0f) - least);
    if (nearest_sq > square_above(point.end + near.off)) continue;
    constexpr double kUnderflow = 4 * static_cast<double>(std::numeric_limits<float>::min());  // of squares
    const double most = std::sqrt(static_cast<double>(nearest_sq) + kUnderflow) + near.off;
    if (most <= point.end) {
      point.is_met = true;
      if (point.any) return SearchStop::kEnd;
      shorten(point, (1 + kOutwards) * most);
    }
    const V most_sq(square_above(point.end + near.off));
    std::uint32_t farther = 0;
    for (std::uint32_t first = 0; first < kLanes; first += kWidth<V>)
      farther |= bits(Lanes<V>::load(distance_sq + first) > most_sq) << first;
    for (std::uint32_t met = leaf_bits(cluster.leaves, way.tile) & ~farther; met; met &= met - 1) {
      const std::uint32_t lane = lowest_bit(met);
      const float sq = distance_sq[lane] < kMostFloat ? distance_sq[lane] : kMostFloat;  // it may have overflowed
      const double least_sq = static_cast<double>(sq) - kUnderflow;
      const double distance = std::sqrt(least_sq > 0 ? least_sq : 0) - near.off;
      point.met[point.met_count++] = {float_below(distance > 0 ? distance : 0), way.at.node, way.at.lane,
                                      way.tile * kLanes + lane};
    }
  }
  way.is_within = false;
  return SearchStop::kGoesOn;
}

}  // namespace cab::kernel
