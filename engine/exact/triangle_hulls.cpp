#include "engine/exact/triangle_hulls.h"

#include "layout/arena.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cab {
namespace {

// Sets the vertices of a hull of three: about the middle of their bounds, in a unit that makes them about 1, sorted.
void set_vertices(TriangleHull& out) {
  ConvexShape& shape = out.shape;
  float largest = 0;
  double square = 0;
  std::array<std::array<float, 3>, 3> at;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto [lo, hi] = std::minmax({out.corners[c], out.corners[3 + c], out.corners[6 + c]});
    shape.position[c] = 0.5f * lo + 0.5f * hi;
    shape.size[c] = std::max(hi - shape.position[c], shape.position[c] - lo);
    largest = std::max(largest, shape.size[c]);
  }
  int exponent = 0;
  std::frexp(largest, &exponent);
  shape.unit = std::ldexp(1.0f, exponent);
  for (std::size_t v = 0; v < 3; ++v) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float away = out.corners[3 * v + c] - shape.position[c];
      sum += static_cast<double>(away) * static_cast<double>(away);
      at[v][c] = std::ldexp(away, -exponent) + 0.0f;  // no -0, which sorts before 0
    }
    square = std::max(square, sum);
  }
  std::sort(at.begin(), at.end());
  shape.reach = rounded_up(std::sqrt(square));
  for (std::size_t v = 0; v < kLanes; ++v)
    for (std::size_t c = 0; c < 3; ++c) out.vertices[c * kLanes + v] = at[std::min<std::size_t>(v, 2)][c];
}

}  // namespace

void size_triangle_hulls(Arena& arena, TriangleHulls& out) {
  out.shapes = arena.allocate<TriangleHull>(std::size_t{kConvexKindCount} * kLanes);
  for (TriangleHull& triangle : out.shapes) {
    ConvexShape& shape = triangle.shape;
    shape.kind = ConvexKind::kHull;
    shape.vertex_count = 3;
    shape.vertices = triangle.vertices;
    shape.part = &triangle.part;
    for (std::size_t k = 0; k < 3; ++k) {
      shape.column[k][k] = 1;
      shape.axis[k][k] = 1;
    }
    triangle.part.rotation[3] = 1;
    triangle.part.kind = ShapeKind::kConvexHull;
    triangle.part.vertices = {triangle.corners, 9};
  }
}

const ConvexShape& add_triangle(const SurfaceLeaves& surface, const SurfaceLeaf& leaf, const kernel::SkinnedLeaf& skin,
                                std::uint32_t triangle, ConvexKind other, TriangleHulls& out) {
  const auto kind = static_cast<std::uint32_t>(other);
  TriangleHull& to = out.shapes[kind * kLanes + out.next[kind]];
  out.next[kind] = (out.next[kind] + 1) % kLanes;
  const TrianglePatch& patch = surface.patches[leaf.patch_begin + triangle / kLanes];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      to.corners[3 * i + c] = skin.vertices[std::size_t{4} * patch.corner[i][triangle % kLanes] + c];
  set_vertices(to);
  return to.shape;
}

StoredPose pose_of_instance() {
  static constexpr float kIdentity[7] = {0, 0, 0, 1, 0, 0, 0};
  return {{PoseFormat::kQuaternionTranslation, Scaling::kNone}, kIdentity, nullptr, 1};
}

}  // namespace cab
