#include "engine/exact/surface.h"

#include "kernels/surface/test_surfaces.h"
#include "kernels/surface/triangles_in_double.h"
#include "layout/compiler.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {
namespace {

// Farther from each other than this, two origins are those of bodies that are apart: each is within kMaxCoordinate.
constexpr double kMostShift = 4 * static_cast<double>(kMaxCoordinate);

// The skin's vertex at a corner of a triangle. triangle: kLanes times its patch, and its lane.
std::uint32_t vertex_of(const ExactLeaf& leaf, std::uint32_t triangle, std::uint32_t corner) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  const SurfaceLeaf& of = surface.leaves[leaf.leaf];
  const std::uint32_t place = surface.patches[of.patch_begin + triangle / kLanes].corner[corner][triangle % kLanes];
  return surface.blocks[of.block_begin + place / kLanes].vertex[place % kLanes];
}

// The index of a triangle in Leaf::triangles, over 3.
std::uint32_t index_of(const ExactLeaf& leaf, std::uint32_t triangle) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  return surface.patches[surface.leaves[leaf.leaf].patch_begin + triangle / kLanes].triangle[triangle % kLanes];
}

// Two leaves, and who takes the triangles of them that touch.
struct SurfaceTest {
  const ExactLeaf &a, &b;
  double shift[3];
  double margin;
  bool within;
  void* taker;
  TakeTouching take_touching;

  bool share_a_vertex(std::uint32_t triangle_a, std::uint32_t triangle_b) const {
    for (std::uint32_t i = 0; i < 3; ++i)
      for (std::uint32_t k = 0; k < 3; ++k)
        if (vertex_of(a, triangle_a, i) == vertex_of(b, triangle_b, k)) return true;
    return false;
  }

  bool touch_in_double(std::uint32_t triangle_a, std::uint32_t triangle_b) const {
    const PlacedTriangle at_a = triangle_in_double(a, triangle_a, {0, 0, 0}),
                         at_b = triangle_in_double(b, triangle_b, shift);
    const double size = (at_a.size + at_b.size) + ((std::fabs(shift[0]) + std::fabs(shift[1])) + std::fabs(shift[2]));
    return kernel::touch_in_double(at_a.at, at_b.at, kSurfaceErrorDouble * size, margin);
  }

  // Returns whether to go on.
  bool take(const kernel::TrianglePairs& pairs) const {
    for (std::uint32_t lanes = pairs.touching | pairs.undecided; lanes; lanes &= lanes - 1) {
      const std::uint32_t lane = lowest_bit(lanes), triangle_a = pairs.a[lane], triangle_b = pairs.b[lane];
      if (within && share_a_vertex(triangle_a, triangle_b)) continue;
      if (!(pairs.touching >> lane & 1) && !touch_in_double(triangle_a, triangle_b)) continue;
      if (!take_touching(taker, index_of(a, triangle_a), index_of(b, triangle_b))) return false;
    }
    return true;
  }
};

}  // namespace

Double3 skinned_vertex(const ExactLeaf& leaf, std::uint32_t vertex, LinkPoses& poses, double& size) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  const Double3 at = double3(surface.vertices.data + 3 * std::size_t{vertex});
  Double3 sum = {0, 0, 0};
  double weights = 0;
  for (std::size_t i = 0; i < surface.influence_count; ++i) {
    const std::size_t influence = std::size_t{vertex} * surface.influence_count + i;
    const auto weight = static_cast<double>(surface.influence_weights[influence]);
    if (!(weight > 0)) continue;
    const std::uint32_t link = surface.influence_links[influence];
    Double3 bound = at, reach = kernel::abs(at);
    if (!surface.inverse_bind.empty()) {
      const float* const bind = surface.inverse_bind.data + 16 * std::size_t{link};
      const Double3 x = double3(bind), y = double3(bind + 4), z = double3(bind + 8), t = double3(bind + 12);
      bound = ((at.x * x + at.y * y) + at.z * z) + t;
      reach = ((reach.x * kernel::abs(x) + reach.y * kernel::abs(y)) + reach.z * kernel::abs(z)) + kernel::abs(t);
    }
    const kernel::RigidLanes<double>& pose = poses.at(link);
    sum = sum + weight * (pose.translation + kernel::rotate(pose.column, pose.scale * bound));
    weights += weight;
    size = std::max(size, pose.scale * kernel::sum(reach) + kernel::sum(kernel::abs(pose.translation)));
  }
  return (1 / weights) * sum;
}

PlacedTriangle triangle_in_double(const ExactLeaf& leaf, std::uint32_t triangle, const double (&shift)[3]) {
  PlacedTriangle out = {{}, 0};
  LinkPoses poses(leaf);
  for (std::uint32_t i = 0; i < 3; ++i)
    out.at.corner[i] =
        skinned_vertex(leaf, vertex_of(leaf, triangle, i), poses, out.size) + Double3{shift[0], shift[1], shift[2]};
  return out;
}

void find_touching_triangles(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin,
                             SkinCache& cache, FrameStats& stats, void* taker, TakeTouching take) {
  SurfaceTest test = {a,     b,   {}, static_cast<double>(margin), a.batch == b.batch && a.instance == b.instance,
                      taker, take};
  origin_difference(a, b, test.shift);
  for (const double by : test.shift)
    if (std::fabs(by) > kMostShift) return;
  const SkinCounts counts = {stats.leaves_skinned, stats.leaves_replaced};
  const kernel::SkinnedLeaf &skin_a = skinned(frame, a, nullptr, cache, counts),
                            &skin_b = skinned(frame, b, &skin_a, cache, counts);
  kernel::SurfacePair pair = {skin_a,
                              skin_b,
                              patches_of(a),
                              patches_of(b),
                              a.batch->articulation->surface.leaves[a.leaf].patch_count,
                              b.batch->articulation->surface.leaves[b.leaf].patch_count,
                              {},
                              0,
                              margin,
                              0};
  float size = skin_a.size + skin_b.size;
  for (std::uint32_t c = 0; c < 3; ++c) {
    pair.shift[c] = static_cast<float>(test.shift[c]);
    size += std::fabs(pair.shift[c]);
  }
  pair.error = kSurfaceError * size;
  pair.reach = rounded_up(static_cast<double>(pair.error) + test.margin);
  frame.kernels.test_surfaces(pair, &test, [](void* test_of, const kernel::TrianglePairs& pairs) {
    return static_cast<const SurfaceTest*>(test_of)->take(pairs);
  });
}

bool surfaces_touch(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin, SkinCache& cache,
                    FrameStats& stats) {
  bool touch = false;
  find_touching_triangles(frame, a, b, margin, cache, stats, &touch, [](void* out, std::uint32_t, std::uint32_t) {
    *static_cast<bool*>(out) = true;
    return false;
  });
  return touch;
}

NearBox near_box(const StoredPose& at, const ConvexShape& shape, const double (&shift)[3], float size, float margin) {
  const kernel::RigidLanes<double> pose = pose_in_double(at);
  const Double3 by = {shift[0], shift[1], shift[2]}, position = pose.scale * double3(shape.position);
  const Double3 center = (pose.translation + by) + kernel::rotate(pose.column, position);
  const double away =
      kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(by)) + kernel::sum(kernel::abs(position));
  const double within =
      static_cast<double>(margin) + static_cast<double>(kSurfaceError) * (static_cast<double>(size) + away);
  const float margin_of_pair = rounded_up(within);
  constexpr float kMost = std::numeric_limits<float>::max();
  // A half space reaches anywhere, but not where the empty boxes of unused lanes are.
  if (shape.kind == ConvexKind::kHalfSpace) return {{-kMost, -kMost, -kMost}, {kMost, kMost, kMost}, margin_of_pair};
  if (kernel::max_component(kernel::abs(by)) > kMostShift)
    return {{kMost, kMost, kMost}, {kMost, kMost, kMost}, margin_of_pair};
  const double reach = within + pose.scale * static_cast<double>(shape.reach);
  return {{float_below(center.x - reach), float_below(center.y - reach), float_below(center.z - reach)},
          {float_above(center.x + reach), float_above(center.y + reach), float_above(center.z + reach)},
          margin_of_pair};
}

}  // namespace cab
