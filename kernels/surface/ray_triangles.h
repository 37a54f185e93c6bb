// The triangles of a leaf that a ray may meet, or a sphere that is moved along it.
#pragma once

#include "kernels/query_bounds.h"
#include "kernels/surface/skin_leaf.h"
#include "layout/error_bounds.h"

#include <limits>

namespace cab::kernel {

// A ray and a skinned leaf. The ray's points are at + t along, relative to the origin of the leaf's instance.
struct SurfaceRay {
  SkinnedLeaf skin;
  const TrianglePatch* patches;
  std::uint32_t patch_count;
  RayLanes lanes;  // of this parameter t
  float at[3];
  float axis[3][3];  // of length 1 and square to each other, to rounding: `along`, then two across it
  float pad;         // the radius, and what rounding may move (docs/proof.md, step 21.5)
};

// A triangle that a ray may meet: kLanes times its patch, and its lane.
struct MetTriangle {
  float entry;  // no t at which the ray touches it is less
  std::uint32_t triangle;
};

// Triangles whose bounds a ray meets, until sixteen of them are tested.
struct MetTriangles {
  std::uint32_t triangles[kLanes];
  std::uint32_t count = 0;
};

// Along the ray triangles are corners in a plane, and the ray is its origin. Writes the lanes whose triangle is not
// wholly beyond the pad from it, and the entry of each.
template <class V>
CAB_INLINE std::uint32_t meet_triangles(const CornerTile& tile, const SurfaceRay& ray, float* entry) {
  const V zero(0.0f), pad(ray.pad);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V along[3], x[3], y[3];
    for (std::uint32_t i = 0; i < 3; ++i) {
      const Vec3<V> to = {Lanes<V>::load(tile.at[i][0] + lane) - V(ray.at[0]),
                          Lanes<V>::load(tile.at[i][1] + lane) - V(ray.at[1]),
                          Lanes<V>::load(tile.at[i][2] + lane) - V(ray.at[2])};
      const auto on_axis = [&](const float(&axis)[3]) { return dot(to, Vec3<V>{V(axis[0]), V(axis[1]), V(axis[2])}); };
      along[i] = on_axis(ray.axis[0]);
      x[i] = on_axis(ray.axis[1]);
      y[i] = on_axis(ray.axis[2]);
    }
    const auto least = [](const V(&v)[3]) { return min(min(v[0], v[1]), v[2]); };
    const auto most = [](const V(&v)[3]) { return max(max(v[0], v[1]), v[2]); };
    const V first = least(along) - pad;
    Lanes<V>::store(entry + lane, first);
    // How far the origin is outside of the corners' bounds, and of lines along edges on either side.
    V outside = max(max(least(x), zero - most(x)), max(least(y), zero - most(y))) - pad;
    outside = max(outside, max(first - V(ray.lanes.end), V(ray.lanes.begin) - (most(along) + pad)));
    V left = zero - V(std::numeric_limits<float>::max()), right = left;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t next = (i + 1) % 3;
      const V edge_x = x[next] - x[i], edge_y = y[next] - y[i];
      const V side = x[i] * edge_y - y[i] * edge_x, within = pad * (abs(edge_x) + abs(edge_y)) + V(kTriangleTiny);
      left = max(left, side - within);
      right = max(right, (zero - side) - within);
    }
    outside = max(outside, min(left, right));
    out |= (~bits(outside > zero) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Tests the triangles that wait, and writes those that may be met.
template <class V>
CAB_NOINLINE std::uint32_t test_met(const SurfaceRay& ray, const MetTriangles& met, MetTriangle* out) {
  const float* corners[3][kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t triangle = met.triangles[lane < met.count ? lane : 0];
    for (std::uint32_t i = 0; i < 3; ++i)
      corners[i][lane] =
          ray.skin.vertices + std::size_t{4} * ray.patches[triangle / kLanes].corner[i][triangle % kLanes];
  }
  CornerTile tile;
  load_corners<V>(corners, tile);
  alignas(64) float entry[kLanes];
  std::uint32_t count = 0;
  for (std::uint32_t lanes = meet_triangles<V>(tile, ray, entry) & ((1u << met.count) - 1); lanes; lanes &= lanes - 1) {
    const std::uint32_t lane = lowest_bit(lanes);
    out[count++] = {entry[lane], met.triangles[lane]};
  }
  return count;
}

// Writes the triangles of a skinned leaf that a ray may meet. Returns how many there are, at most kLanes times
// patch_count.
template <class V>
std::uint32_t ray_triangles(const SurfaceRay& ray, MetTriangle* out) {
  const RayWalk<V> walk(ray.lanes);
  alignas(64) float entry[kLanes];
  // A ray leaves the empty box of an unused lane at minus infinity, so it meets none.
  const auto lanes_met = [&](const AabbTile& bounds) { return walk({&bounds.lo[0][0], kLanes}, entry); };
  MetTriangles waiting;
  std::uint32_t count = 0;
  for (std::uint32_t first = 0; first < ray.patch_count; first += kLanes)
    for (std::uint32_t near = lanes_met(ray.skin.bounds[ray.patch_count + first / kLanes]); near; near &= near - 1) {
      const std::uint32_t patch = first + lowest_bit(near);
      for (std::uint32_t met = lanes_met(ray.skin.bounds[patch]); met; met &= met - 1) {
        waiting.triangles[waiting.count++] = kLanes * patch + lowest_bit(met);
        if (waiting.count < kLanes) continue;
        count += test_met<V>(ray, waiting, out + count);
        waiting.count = 0;
      }
    }
  return waiting.count ? count + test_met<V>(ray, waiting, out + count) : count;
}

}  // namespace cab::kernel
