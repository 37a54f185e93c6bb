// The leaf boxes of the paper's scenes in double, and a separating axis test for them.
#pragma once

#include "scenes/scene.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace cab::tests {

// Vec3 is a std::array, so argument-dependent lookup does not find its operators.
using namespace scenes;

// A box in the world. In the paper's scenes a link has one leaf, whose box is centred in the link's frame.
struct PlacedBox {
  Vec3 center;
  std::array<Vec3, 3> axes;
  Vec3 half;

  Vec3 to_world(const Vec3& local) const {
    return center + local[0] * axes[0] + local[1] * axes[1] + local[2] * axes[2];
  }
  Vec3 to_local(const Vec3& world) const {
    const Vec3 d = world - center;
    return {dot(d, axes[0]), dot(d, axes[1]), dot(d, axes[2])};
  }
};

// The box of a link, for a character with poses of 12 floats and one leaf per link. A static character has the same box
// in every frame.
inline PlacedBox placed(const Character& character, std::uint32_t frame, std::size_t link) {
  const std::size_t row_of_frame = character.is_static ? 0 : frame;
  const float* const m = character.poses.data() + 12 * (row_of_frame * character.link_parents.size() + link);
  PlacedBox box;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) box.axes[column][row] = m[4 * row + column];
    box.center[row] = m[4 * row + 3];
    box.half[row] = character.leaves[link].box.half[row];
  }
  return box;
}

// The separating axis test of two boxes, independent of the kernels: 15 axes in double. Boxes that touch overlap.
inline bool boxes_overlap(const PlacedBox& a, const PlacedBox& b) {
  const Vec3 apart = b.center - a.center;
  if (std::sqrt(dot(apart, apart)) > length(a.half) + length(b.half)) return false;
  std::array<Vec3, 15> directions;
  auto next = std::copy(b.axes.begin(), b.axes.end(), std::copy(a.axes.begin(), a.axes.end(), directions.begin()));
  for (const Vec3& u : a.axes)
    for (const Vec3& v : b.axes) *next++ = cross(u, v);
  return std::none_of(directions.begin(), directions.end(), [&](const Vec3& d) {
    double reach = 0;
    for (std::size_t k = 0; k < 3; ++k)
      reach += a.half[k] * std::fabs(dot(d, a.axes[k])) + b.half[k] * std::fabs(dot(d, b.axes[k]));
    return std::fabs(dot(d, apart)) > reach;
  });
}

// An axis-aligned box.
struct Bounds {
  Vec3 low, high;
};

// The bounds of a leaf box's corners.
inline Bounds bounds_of_box(const PlacedBox& box, const BodyLeaf&) {
  Bounds bounds = {box.center, box.center};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double reach = box.half[k] * std::fabs(box.axes[k][axis]);
      bounds.low[axis] -= reach;
      bounds.high[axis] += reach;
    }
  }
  return bounds;
}

// The bounds of the vertices of a leaf's parts, or of the corners of its box where it has no parts.
inline Bounds bounds_of_vertices(const PlacedBox& box, const BodyLeaf& leaf) {
  if (leaf.parts.empty()) return bounds_of_box(box, leaf);
  constexpr double kFar = 1e9;
  Bounds bounds = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const ShapePart& part : leaf.parts) {
    for (std::size_t v = 0; v < part.vertices.size(); v += 3) {
      const Vec3 at = box.to_world({part.vertices[v], part.vertices[v + 1], part.vertices[v + 2]});
      for (std::size_t axis = 0; axis < 3; ++axis) {
        bounds.low[axis] = std::min(bounds.low[axis], at[axis]);
        bounds.high[axis] = std::max(bounds.high[axis], at[axis]);
      }
    }
  }
  return bounds;
}

inline bool bounds_overlap(const Bounds& a, const Bounds& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis]) return false;
  return true;
}

// The number of overlapping leaf pairs of the scene's pairs of characters, summed over all frames. This is the paper's
// #coll, without the padding that the engine adds to its boxes. shape_of makes the shape that overlap takes from a
// placed box and its leaf.
template <class ShapeOf, class Overlap>
int count_pairs(const Scene& scene, const ShapeOf& shape_of, const Overlap& overlap) {
  const auto shapes_of = [&shape_of](const Character& character, std::uint32_t frame) {
    std::vector<decltype(shape_of(PlacedBox(), BodyLeaf()))> shapes;
    for (std::size_t link = 0; link < character.leaves.size(); ++link)
      shapes.push_back(shape_of(placed(character, frame, link), character.leaves[link]));
    return shapes;
  };
  int count = 0;
  for (std::uint32_t f = 0; f < scene.frame_count; ++f) {
    for (const CharacterPair& pair : scene.pairs) {
      const auto left = shapes_of(scene.characters[pair.a], f);
      const auto right = shapes_of(scene.characters[pair.b], f);
      for (const auto& a : left)
        for (const auto& b : right) count += overlap(a, b) ? 1 : 0;
    }
  }
  return count;
}

inline int count_box_overlaps(const Scene& scene) {
  return count_pairs(
      scene, [](const PlacedBox& box, const BodyLeaf&) { return box; }, boxes_overlap);
}

// The leaf bounds of the paper's AABB* and AABB+.
inline int count_box_bounds_overlaps(const Scene& scene) { return count_pairs(scene, bounds_of_box, bounds_overlap); }
inline int count_vertex_bounds_overlaps(const Scene& scene) {
  return count_pairs(scene, bounds_of_vertices, bounds_overlap);
}

// v rotated about (1, 2, .5)/sqrt(5.25), the axis about which every scene is tilted.
inline Vec3 tilted_by(double angle, const Vec3& v) {
  const Vec3 k = {.43643578, .87287156, .21821789};
  return std::cos(angle) * v + std::sin(angle) * cross(k, v) + ((1 - std::cos(angle)) * dot(k, v)) * k;
}

}  // namespace cab::tests
