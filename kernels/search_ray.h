// The way of a ray, or of a sphere that is moved along it, through an index to the leaf boxes that it may meet first.
#pragma once

#include "kernels/query_boxes.h"
#include "kernels/search_index.h"
#include "layout/rounded_up.h"

#include <limits>

namespace cab::kernel {

// A ray and how far it has come. Lengths are in the caller's unit and count from where it begins, but for `lanes`.
struct RaySearch {
  static constexpr std::uint32_t kMostMet = 2 * kLanes;

  SearchFilter filter;
  RayLanes lanes;   // in the index
  double entered;   // at which parameter it enters the index, in the index's scale
  double scale;     // of the index, a power of two
  double unit;      // one over that, which is a little less where it would be infinite
  double along[3];  // its direction, of length 1
  double radius;
  double end;           // what is entered later is not wanted
  bool box_decides;     // whether a leaf is met where its box is, and the nearest is wanted
  bool any;             // whether one leaf that is surely met is enough
  bool is_met = false;  // if box_decides: whether there is such a leaf
  SearchStop stop = SearchStop::kGoesOn;
  SearchWay way;
  MetLeaf met[kMostMet];
  std::uint32_t met_count = 0;
};

// Notes that nothing is wanted that is farther than `most`, the distance of a link that is met, which may be rounded.
CAB_INLINE void shorten(RaySearch& ray, double most) {
  const double far = (1 + kOutwards) * most, in_index = ray.scale * far - ray.entered;
  const float end = float_above(in_index + kQueryPad * (1 + std::fabs(in_index)));
  if (far < ray.end) ray.end = far;
  if (end < ray.lanes.end) ray.lanes.end = end;
}

// Takes the ray to an instance. Its parameter then begins at `*first`, where it enters the instance's bounds.
CAB_INLINE BoxRay at_instance(const RaySearch& ray, const double (&apart)[3], float reach, double* first) {
  const double t = (ray.entered + static_cast<double>(ray.way.at.entry)) * ray.unit;
  BoxRay out;
  double size = static_cast<double>(reach), away = t;
  for (int c = 0; c < 3; ++c) {
    const double at = t * ray.along[c] - apart[c];
    size += std::fabs(at);
    away += std::fabs(apart[c]);
    out.at[c] = static_cast<float>(at);
    out.direction[c] = static_cast<float>(ray.along[c]);
  }
  out.radius = float_above(ray.radius);
  out.rounding =
      float_above(kQueryRounding * away + kQueryBoxPad * (size + ray.radius)) + 4 * std::numeric_limits<float>::min();
  out.begin = 0;
  out.end = float_above(ray.end - t);
  *first = t;
  return out;
}

// Tests the leaves of the instance that the ray has come to. apart: its origin less where the ray begins. Leaves that
// it met are in ray.met: if ray.box_decides, all that may be the nearest one, else those of one instance, which may be
// none, or of a part of it if ray.way.is_within.
template <class V>
CAB_INLINE SearchStop test_leaves(const PosedCluster& cluster, const double (&apart)[3], RaySearch& ray) {
  SearchWay& way = ray.way;
  double first;
  BoxRay local = at_instance(ray, apart, cluster.lanes[way.at.lane].reach, &first);
  const BoxTile* const boxes = cluster.boxes_of(way.at.lane);
  const std::uint32_t tiles = tile_count(cluster.leaves);
  for (; way.tile < tiles; ++way.tile) {
    if (ray.met_count + kLanes > RaySearch::kMostMet) return SearchStop::kTest;
    alignas(64) float entry[kLanes];
    std::uint32_t met = ray_resized_boxes<V, BoxSize::kLarger>(boxes[way.tile], local, local.end, entry) &
                        leaf_bits(cluster.leaves, way.tile);
    if (!met) continue;
    if (ray.box_decides) {
      alignas(64) float surely[kLanes];
      const std::uint32_t sure =
          ray_resized_boxes<V, BoxSize::kSmaller>(boxes[way.tile], local, float_below(ray.end - first), surely) & met;
      if (sure) {
        ray.is_met = true;
        if (ray.any) return SearchStop::kEnd;
        const double most = (1 + kOutwards) * (first + static_cast<double>(surely[nearest_lane<V>(sure, surely)]));
        if (most < ray.end) {
          shorten(ray, most);
          local.end = float_above(ray.end - first);
        }
      }
    }
    for (; met; met &= met - 1) {
      const std::uint32_t lane = lowest_bit(met);
      const float at = float_below(first + static_cast<double>(entry[lane]));
      if (static_cast<double>(at) <= ray.end)
        ray.met[ray.met_count++] = {at, way.at.node, way.at.lane, way.tile * kLanes + lane};
    }
  }
  way.is_within = false;
  return ray.box_decides ? SearchStop::kGoesOn : SearchStop::kTest;
}

}  // namespace cab::kernel
