#include "engine/exact/surface.h"

#include "engine/exact/convex.h"
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

// Whether a leaf can be tested where it is given, without being skinned: one link moves it, by a pose whose rotation is
// exact to the rounding of doubles.
bool is_rigid(const ExactLeaf& leaf) {
  return leaf.batch->articulation->surface.leaves[leaf.leaf].bounds_count > 0 &&
         coding_of(*leaf.batch).format == PoseFormat::kQuaternionTranslation;
}

// One of two rigid leaves, and the pose of its link.
struct RigidSide {
  kernel::PlacedSurface surface;
  const SurfaceBone& bone;
  kernel::RigidLanes<double> pose;
};

RigidSide rigid_side(const ExactLeaf& leaf) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  const SurfaceLeaf& of = surface.leaves[leaf.leaf];
  const SurfaceBone& bone = surface.bones[of.bone_begin];
  return {{surface.places.data + std::size_t{4} * kLanes * of.block_begin, surface.bounds.data + of.bounds_begin},
          bone,
          pose_in_double(stored_pose(*leaf.batch, leaf.instance, bone.link))};
}

// Writes what places the vertices of a rigid leaf, and returns how large numbers are on the way.
float place_side(const ExactLeaf& leaf, const SurfaceBone& bone, float (&to)[kernel::kBoneFloats]) {
  const InstanceBatch& batch = *leaf.batch;
  return kernel::place_bone({nullptr, nullptr, coding_of(batch), nullptr, orientation_of(batch, leaf.instance),
                             scale_of(batch, leaf.instance), nullptr, nullptr},
                            bone, pose_of(batch, leaf.instance, bone.link), to);
}

// Writes the matrix that takes points of the frame of `from` to that of `to`, and returns by how much bounds there have
// to grow. shift: the origin of from's instance less that of to's.
float turn_side(const RigidSide& from, const RigidSide& to, const Double3& shift, double margin,
                float (&out)[kernel::kBoneFloats]) {
  const double by = 1 / to.pose.scale;
  const auto seen = [&](const Double3& v) {
    const Double3(&axis)[3] = to.pose.column;
    return by * Double3{kernel::dot(axis[0], v), kernel::dot(axis[1], v), kernel::dot(axis[2], v)};
  };
  const Double3 between = (from.pose.translation - to.pose.translation) + shift;
  for (std::size_t k = 0; k < 4; ++k) {
    const Double3 column = seen(k < 3 ? from.pose.scale * from.pose.column[k] : between);
    out[3 * k] = static_cast<float>(column.x);
    out[3 * k + 1] = static_cast<float>(column.y);
    out[3 * k + 2] = static_cast<float>(column.z);
  }
  const double size_from = from.pose.scale * static_cast<double>(from.bone.reach),
               size_to = to.pose.scale * static_cast<double>(to.bone.reach);
  const double numbers = (kernel::sum(kernel::abs(from.pose.translation)) + kernel::sum(kernel::abs(shift))) +
                         (kernel::sum(kernel::abs(to.pose.translation)) + (size_from + size_to));
  return rounded_up(by * (margin + static_cast<double>(kSurfaceError) * numbers) + static_cast<double>(kTriangleTiny));
}

// The corners of a triangle that is a hull of three vertices.
PlacedTriangle placed_corners(const PlacedShape& triangle, const double (&shift)[3]) {
  const kernel::RigidLanes<double> pose = pose_in_double(triangle.at);
  const ConvexShape& shape = *triangle.shape;
  const Double3 by = {shift[0], shift[1], shift[2]}, position = double3(shape.part->position);
  const Double3 axis[3] = {axis_of(shape, 0), axis_of(shape, 1), axis_of(shape, 2)};
  PlacedTriangle out = {{}, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    const Double3 vertex = double3(shape.part->vertices.data + 3 * i);
    const Double3 at = pose.scale * (position + kernel::rotate(axis, vertex));
    out.at.corner[i] = (pose.translation + kernel::rotate(pose.column, at)) + by;
    out.size = std::max(out.size, pose.scale * (kernel::sum(kernel::abs(position)) + kernel::sum(kernel::abs(vertex))));
  }
  out.size += kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(by));
  return out;
}

// A triangle that is no leaf's, and whether one of a leaf touches it.
struct LoneTriangle {
  const ExactLeaf& leaf;
  PlacedTriangle triangle;
  double margin;
  bool touches;

  // Returns whether to go on.
  bool take(const kernel::TrianglePairs& pairs) {
    touches = pairs.touching != 0;
    for (std::uint32_t lanes = pairs.undecided; lanes && !touches; lanes &= lanes - 1) {
      const PlacedTriangle at = triangle_in_double(leaf, pairs.a[lowest_bit(lanes)], {0, 0, 0});
      touches = kernel::touch_in_double(at.at, triangle.at, kSurfaceErrorDouble * (at.size + triangle.size), margin);
    }
    return !touches;
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
  const std::uint32_t patches_in_a = a.batch->articulation->surface.leaves[a.leaf].patch_count,
                      patches_in_b = b.batch->articulation->surface.leaves[b.leaf].patch_count;
  const auto run = [&](const kernel::PlacedSurface& at_a, const kernel::PlacedSurface& at_b, float size,
                       const kernel::RigidSurfaces* rigid) {
    kernel::SurfacePair pair = {at_a,   at_b, patches_of(a), patches_of(b), patches_in_a, patches_in_b, {}, 0,
                                margin, 0,    rigid};
    for (std::uint32_t c = 0; c < 3; ++c) {
      pair.shift[c] = static_cast<float>(test.shift[c]);
      size += std::fabs(pair.shift[c]);
    }
    pair.error = kSurfaceError * size;
    pair.reach = rounded_up(static_cast<double>(pair.error) + test.margin);
    frame.kernels.test_surfaces(pair, &test, [](void* test_of, const kernel::TrianglePairs& pairs) {
      return static_cast<const SurfaceTest*>(test_of)->take(pairs);
    });
  };
  if (is_rigid(a) && is_rigid(b)) {
    const RigidSide side_a = rigid_side(a), side_b = rigid_side(b);
    kernel::RigidSurfaces rigid;
    const float size = place_side(a, side_a.bone, rigid.place[0]) + place_side(b, side_b.bone, rigid.place[1]);
    const Double3 shift = {test.shift[0], test.shift[1], test.shift[2]};
    rigid.reach[0] = turn_side(side_b, side_a, shift, test.margin, rigid.turn[0]);
    rigid.reach[1] = turn_side(side_a, side_b, -1.0 * shift, test.margin, rigid.turn[1]);
    return run(side_a.surface, side_b.surface, size, &rigid);
  }
  const SkinCounts counts = {stats.leaves_skinned, stats.leaves_replaced};
  const kernel::SkinnedLeaf &skin_a = skinned(frame, a, nullptr, cache, counts),
                            &skin_b = skinned(frame, b, &skin_a, cache, counts);
  run(skin_a, skin_b, skin_a.size + skin_b.size, nullptr);
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

bool touch_triangle(const FrameContext& frame, const ExactLeaf& leaf, const kernel::SkinnedLeaf& skin,
                    const PlacedShape& triangle, const double (&shift)[3], float margin) {
  LoneTriangle test = {leaf, placed_corners(triangle, shift), static_cast<double>(margin), false};
  for (const double by : shift)
    if (std::fabs(by) > kMostShift) return false;
  static constexpr TrianglePatch kOne = {{{0}, {1}, {2}}, {}, 1};
  alignas(64) float vertices[4 * 3] = {};
  AabbTile bounds[2];
  for (std::size_t c = 0; c < 3; ++c) {
    const kernel::Vec3<double>(&at)[3] = test.triangle.at.corner;
    for (std::size_t i = 0; i < 3; ++i)
      vertices[4 * i + c] = static_cast<float>(c == 0 ? at[i].x : c == 1 ? at[i].y : at[i].z);
    bounds[0].lo[c][0] = std::min({vertices[c], vertices[4 + c], vertices[8 + c]});
    bounds[0].hi[c][0] = std::max({vertices[c], vertices[4 + c], vertices[8 + c]});
  }
  kernel::empty_lanes(bounds[0], 1);
  bounds[1] = bounds[0];
  kernel::SurfacePair pair = {skin,
                              {vertices, bounds},
                              patches_of(leaf),
                              &kOne,
                              leaf.batch->articulation->surface.leaves[leaf.leaf].patch_count,
                              1,
                              {0, 0, 0},
                              kSurfaceError * (skin.size + rounded_up(test.triangle.size)),
                              margin,
                              0};
  pair.reach = rounded_up(static_cast<double>(pair.error) + test.margin);
  frame.kernels.test_surfaces(pair, &test, [](void* of, const kernel::TrianglePairs& pairs) {
    return static_cast<LoneTriangle*>(of)->take(pairs);
  });
  return test.touches;
}

NearPart near_part(const PlacedShape& placed, const double (&shift)[3], const ExactLeaf& leaf,
                   const kernel::SkinnedLeaf& skin, float margin) {
  const ConvexShape& shape = *placed.shape;
  const kernel::RigidLanes<double> pose = pose_in_double(placed.at);
  const Double3 by = {shift[0], shift[1], shift[2]}, position = pose.scale * double3(shape.position);
  const Double3 center = (pose.translation + by) + kernel::rotate(pose.column, position);
  const double away =
      kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(by)) + kernel::sum(kernel::abs(position));
  const double size = static_cast<double>(skin.size) + away, reach = pose.scale * static_cast<double>(shape.reach);
  const double within = static_cast<double>(margin) + static_cast<double>(kSurfaceError) * size;
  NearPart out;
  const float scale = scale_of_reach(rounded_up(size + reach + within));
  const double by_scale = static_cast<double>(scale);
  out.part = {skin, patches_of(leaf), &shape, scale, {}, {}, {}, 0, 0, rounded_up(within)};
  out.part.stretch = static_cast<float>(pose.scale * by_scale);
  out.part.reach = rounded_up(reach * by_scale);
  const bool is_round = shape.kind == ConvexKind::kRound;
  const bool is_plane = shape.kind == ConvexKind::kHalfSpace;
  const bool is_far = !is_plane && kernel::max_component(kernel::abs(by)) > kMostShift;
  const double centers[3] = {center.x, center.y, center.z};
  double extent[3] = {};
  for (std::size_t k = 0; k < 3; ++k) {
    const Double3 axis = kernel::rotate(pose.column, axis_of(shape, k));
    const double axes[3] = {axis.x, axis.y, axis.z};
    const float length = shape.kind == ConvexKind::kCylinder && k == 1 ? shape.size[0] : shape.size[k];
    const double half = pose.scale * static_cast<double>(length);
    out.part.half[k] = static_cast<float>(half * by_scale);
    for (std::size_t c = 0; c < 3; ++c) {
      out.part.axis[k][c] = static_cast<float>(axes[c]);
      extent[c] += is_round && k == 0 ? half : std::fabs(axes[c]) * half;
    }
  }
  constexpr float kMost = std::numeric_limits<float>::max();
  for (std::size_t c = 0; c < 3; ++c) {
    out.part.center[c] = static_cast<float>(centers[c]);
    // A half space reaches anywhere, but not where the empty boxes of unused lanes are.
    const double from_center = std::min(extent[c], reach) + within;
    out.lo[c] = is_plane ? -kMost : float_below(centers[c] - from_center);
    out.hi[c] = is_plane ? kMost : float_above(centers[c] + from_center);
    if (is_far) out.lo[c] = out.hi[c] = kMost;
  }
  return out;
}

}  // namespace cab
