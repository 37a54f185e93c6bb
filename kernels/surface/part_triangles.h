// The triangles of a leaf against one convex part, triangles as lanes.
#pragma once

#include "kernels/convex/gjk.h"
#include "kernels/surface/skin_leaf.h"
#include "kernels/surface/test_triangles.h"
#include "layout/convex_shape.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

// A skinned leaf, and a convex part in world axes about the origin of the leaf's instance.
struct SurfacePart {
  SkinnedLeaf skin;
  const TrianglePatch* patches;
  const ConvexShape* shape;
  // A power of two: the lengths of the pair together, times this, are at most 1 (docs/proof.md, step 21.9).
  float scale;
  float center[3];
  float axis[3][3];
  // Times the scale. Of a round part radius, unused, half length; else of a box about it, along its axes.
  float half[3];
  float stretch;  // the scale, times that of the part's pose
  float reach;    // ConvexShape::reach, times that
  float margin;   // triangles that are as near touch
};

// The corners of triangles in the frame of the part, times the scale.
template <class V>
CAB_INLINE TriangleLanes<V> triangles_in_part(const CornerTile& tile, std::uint32_t lane, const SurfacePart& part) {
  TriangleLanes<V> out;
  const V scale(part.scale);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Vec3<V> to = {scale * (Lanes<V>::load(tile.at[i][0] + lane) - V(part.center[0])),
                        scale * (Lanes<V>::load(tile.at[i][1] + lane) - V(part.center[1])),
                        scale * (Lanes<V>::load(tile.at[i][2] + lane) - V(part.center[2]))};
    const auto on_axis = [&to](const float(&axis)[3]) { return dot(to, Vec3<V>{V(axis[0]), V(axis[1]), V(axis[2])}); };
    out.corner[i] = {on_axis(part.axis[0]), on_axis(part.axis[1]), on_axis(part.axis[2])};
  }
  return out;
}

// Within which distance triangles touch for certain, and beyond which they are apart. The first may be below 0: then a
// point must be that deep in the part.
template <class V>
struct PartLimits {
  V touching, apart;
};

template <class V>
CAB_INLINE ConvexAnswer test_half_space(const TriangleLanes<V>& triangle, const PartLimits<V>& limits) {
  const V lowest = min(min(triangle.corner[0].z, triangle.corner[1].z), triangle.corner[2].z);
  return {bits(lowest > limits.apart), bits(lowest <= limits.touching)};
}

// All points within the radius of a segment along z. Of the ways from triangle to segment the shortest decides: it is
// short enough, or the planes across it are far enough from each other.
template <bool kIsBall, class V>
CAB_INLINE ConvexAnswer test_round(const TriangleLanes<V>& triangle, V radius, V half_length,
                                   const PartLimits<V>& limits) {
  const V zero(0.0f);
  const TriangleShape<V> shape = shape_of(triangle);
  const Vec3<V>(&corner)[3] = triangle.corner;
  // Where the segment is nearest to the plane, or passes through it.
  V along = zero;
  if constexpr (!kIsBall) {
    const V rise = shape.normal.z, tiny(kTriangleTiny);
    const V at = divide(dot(shape.normal, corner[0]), select(abs(rise) > tiny, rise, tiny));
    along = max(min(at, half_length), zero - half_length);
  }
  Mask<V> inside;
  Vec3<V> way = way_to_face(shape, dot(shape.normal, shape.normal) + V(kTriangleTiny),
                            Vec3<V>{zero, zero, along} - corner[0], inside);
  V way_sq = select(inside, dot(way, way), V(kFarTriangles));
  for (int i = 0; i < 3; ++i) {
    Vec3<V> other;
    if constexpr (kIsBall) {
      const V by = weight_of(zero - dot(shape.edge[i], corner[i]), dot(shape.edge[i], shape.edge[i]));
      other = Vec3<V>{zero, zero, zero} - (corner[i] + by * shape.edge[i]);
    } else {
      other = way_of_edges(shape.edge[i], Vec3<V>{zero, zero, half_length + half_length},
                           Vec3<V>{zero, zero, zero - half_length} - corner[i]);
    }
    const V other_sq = dot(other, other);
    const Mask<V> is_shorter = other_sq < way_sq;
    take<V>(is_shorter, other, way);
    take<V>(is_shorter, other_sq, way_sq);
  }
  const V length = sqrt(way_sq);
  const V nearest = zero - max(max(dot(way, corner[0]), dot(way, corner[1])), dot(way, corner[2]));
  const Mask<V> is_apart = nearest - half_length * abs(way.z) > (radius + limits.apart) * length;
  return {bits(both(is_apart, length > V(kPartRounding))), bits(length <= radius + limits.touching)};
}

// How far a triangle and a box are apart along a direction, beyond the limit. begin, end: where the triangle's corners
// lie along it. The limit is multiplied by the sum of the direction's components, which is at least its length.
template <class V>
CAB_INLINE V beyond_box(const Vec3<V>& direction, V begin, V end, const Vec3<V>& half, V limit) {
  const V zero(0.0f);
  const Vec3<V> size = abs(direction);
  return max(begin, zero - end) - (dot(half, size) + (limit * sum(size) + V(kTriangleTiny)));
}

// How far a triangle and a box are apart along an axis of it.
template <class V>
CAB_INLINE V beyond_sides(const TriangleLanes<V>& triangle, const Vec3<V>& half) {
  const V zero(0.0f);
  const Vec3<V>(&corner)[3] = triangle.corner;
  const Vec3<V> least = min(min(corner[0], corner[1]), corner[2]), most = max(max(corner[0], corner[1]), corner[2]);
  return max_component(max(least, Vec3<V>{zero, zero, zero} - most) - half);
}

// The lanes whose triangles are apart from a box: along an axis of it, the normal, or a product of an axis and an edge.
template <class V>
CAB_INLINE Mask<V> apart_from_box(const TriangleLanes<V>& triangle, const TriangleShape<V>& shape, const Vec3<V>& half,
                                  V limit) {
  const V zero(0.0f);
  const Vec3<V>(&corner)[3] = triangle.corner;
  V beyond = beyond_sides(triangle, half) - limit;
  const V heights[3] = {dot(shape.normal, corner[0]), dot(shape.normal, corner[1]), dot(shape.normal, corner[2])};
  beyond = max(beyond, beyond_box(shape.normal, least_of(heights), most_of(heights), half, limit));
  for (int i = 0; i < 3; ++i) {
    // Both ends of an edge are at one place along its product with an axis.
    const Vec3<V>&e = shape.edge[i], &on = corner[i], &third = corner[(i + 2) % 3];
    const auto across = [&](const Vec3<V>& direction) {
      const V at = dot(direction, on), other = dot(direction, third);
      beyond = max(beyond, beyond_box(direction, min(at, other), max(at, other), half, limit));
    };
    across({zero, zero - e.z, e.y});
    across({e.z, zero, zero - e.x});
    across({zero - e.y, e.x, zero});
  }
  return beyond > zero;
}

// The lanes whose triangles have a point in a box or so near to it: on an edge, or where a diagonal passes through the
// triangle.
template <class V>
CAB_INLINE Mask<V> touches_box(const TriangleLanes<V>& triangle, const TriangleShape<V>& shape, const Vec3<V>& half,
                               V limit) {
  const V zero(0.0f), one(1.0f), tiny(kTriangleTiny);
  const V within = max(limit, zero), within_sq = within * within, less = min(limit, zero);
  const Vec3<V> inner = {half.x + less, half.y + less, half.z + less};
  const Vec3<V> none = {zero, zero, zero};
  Mask<V> out = zero > zero;
  for (int i = 0; i < 3; ++i) {
    // The part of the edge between each two sides of the box, and its middle.
    const Vec3<V>&e = shape.edge[i], &from = triangle.corner[i];
    V begin = zero, end = one;
    const auto cut = [&](V at, V by, V side) {
      const V inverse = divide(one, select(abs(by) > tiny, by, tiny));
      const V first = inverse * ((zero - side) - at), second = inverse * (side - at);
      begin = max(begin, min(first, second));
      end = min(end, max(first, second));
    };
    cut(from.x, e.x, inner.x + within);
    cut(from.y, e.y, inner.y + within);
    cut(from.z, e.z, inner.z + within);
    const V middle = max(min(V(0.5f) * (begin + end), one), zero);
    const Vec3<V> outside = max(abs(from + middle * e) - inner, none);
    out = either(out, dot(outside, outside) <= within_sq);
  }
  // The diagonal along which the box is farthest towards the normal.
  const Vec3<V>& n = shape.normal;
  const Vec3<V> to = {select(n.x < zero, zero - half.x, half.x), select(n.y < zero, zero - half.y, half.y),
                      select(n.z < zero, zero - half.z, half.z)};
  const V at = divide(dot(n, triangle.corner[0]), max(dot(n, to), tiny));
  const V kept = max(min(at, one), zero - one);
  Mask<V> inside;
  const Vec3<V> way = way_to_face(shape, dot(n, n) + tiny, kept * to - triangle.corner[0], inside);
  return either(out, both(inside, both(dot(way, way) <= within_sq, limit > zero)));
}

// For parts of any kind but half spaces and round ones: along the axes of a box about them, then by GJK.
template <class V>
CAB_INLINE ConvexAnswer test_by_gjk(const TriangleLanes<V>& triangle, const SurfacePart& part, const Vec3<V>& half,
                                    V margin, const PartLimits<V>& limits, std::uint32_t active) {
  const Vec3<V>(&corner)[3] = triangle.corner;
  const std::uint32_t beyond = bits(beyond_sides(triangle, half) > limits.apart) & active;
  if (beyond == active) return {beyond, 0};
  // The first corner counts as the centre of the triangle, but for where GJK begins.
  const Vec3<V> first = corner[1] - corner[0], second = corner[2] - corner[0];
  const V reach = V(part.reach) + sqrt(max(dot(first, first), dot(second, second)));
  const V rounding = V(kTetrahedronRounding) * ((reach + sqrt(dot(corner[0], corner[0]))) * (reach * reach));
  const ConvexKind kind = part.shape->kind;
  const GjkPair<V> pair = {(corner[0] + corner[1]) + corner[2], margin, V(kPartRounding), rounding};
  constexpr GjkLimits kLimits = {kGjkInFloat.steps, kGjkInFloat.progress, true};
  ConvexAnswer answer = gjk(pair, kLimits, active & ~beyond, [&](const Vec3<V>& d, std::uint32_t lanes) {
    const Vec3<V> farthest = kind == ConvexKind::kHull ? V(part.stretch) * hull_vertices(*part.shape, d, lanes)
                                                       : support_by_size(kind, half, d);
    const V heights[3] = {dot(d, corner[0]), dot(d, corner[1]), dot(d, corner[2])};
    const V lowest = least_of(heights);
    const Vec3<V> other = choose<V>(heights[1] <= lowest, corner[1], corner[2]);
    return farthest - choose<V>(heights[0] <= lowest, corner[0], other);
  });
  answer.apart |= beyond;
  return answer;
}

// active: the lanes that are asked for.
template <class V>
CAB_INLINE ConvexAnswer test_in_part(const TriangleLanes<V>& triangle, const SurfacePart& part, V margin,
                                     std::uint32_t active) {
  const PartLimits<V> limits = {margin - V(kPartRounding), margin + V(kPartRounding)};
  const Vec3<V> half = {V(part.half[0]), V(part.half[1]), V(part.half[2])};
  const ConvexKind kind = part.shape->kind;
  if (kind == ConvexKind::kHalfSpace) return test_half_space(triangle, limits);
  if (kind == ConvexKind::kRound)
    return part.half[2] == 0 ? test_round<true>(triangle, half.x, half.z, limits)
                             : test_round<false>(triangle, half.x, half.z, limits);
  if (kind != ConvexKind::kBox) return test_by_gjk(triangle, part, half, margin, limits, active);
  const TriangleShape<V> shape = shape_of(triangle);
  return {bits(apart_from_box(triangle, shape, half, limits.apart)),
          bits(touches_box(triangle, shape, half, limits.touching))};
}

// Tests triangles of a leaf, each named by kLanes times its patch, and its lane. Returns whether one of them touches
// the part. Else *count becomes that of triangles that are undecided, which are the first ones then, in their order.
template <class V>
bool test_part(const SurfacePart& part, std::uint32_t* triangles, std::uint32_t* count) {
  const V margin = V(part.scale) * V(part.margin);
  std::uint32_t left = 0;
  for (std::uint32_t first = 0; first < *count; first += kLanes) {
    const std::uint32_t used = *count - first < kLanes ? *count - first : kLanes;
    const float* corners[3][kLanes];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t triangle = triangles[first + (lane < used ? lane : 0)];
      for (std::uint32_t i = 0; i < 3; ++i)
        corners[i][lane] =
            part.skin.vertices + std::size_t{4} * part.patches[triangle / kLanes].corner[i][triangle % kLanes];
    }
    CornerTile tile;
    load_corners<V>(corners, tile);
    std::uint32_t open = (2u << (used - 1)) - 1;
    for (std::uint32_t lane = 0; lane < used; lane += kWidth<V>) {
      const ConvexAnswer answer =
          test_in_part(triangles_in_part<V>(tile, lane, part), part, margin, open >> lane & ((1u << kWidth<V>)-1));
      if (answer.touching) return true;
      open &= ~(answer.apart << lane);
    }
    for (std::uint32_t undecided = open; undecided; undecided &= undecided - 1)
      triangles[left++] = triangles[first + lowest_bit(undecided)];
  }
  *count = left;
  return false;
}

}  // namespace cab::kernel
