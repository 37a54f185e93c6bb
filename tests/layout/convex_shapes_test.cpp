// Convex shapes as the exact kernels read them.
#include "layout/convex_shapes.h"

#include "perf/judge/oracle/convex_pairs.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

namespace {

using namespace cab;

// An articulation of one link, and the shapes of its leaves.
struct Shapes {
  Arena arena{default_allocator()};
  Articulation articulation;
  ConvexShapes all;

  explicit Shapes(const std::vector<Leaf>& leaves) {
    static constexpr std::int32_t kRoot = -1;
    ArticulationDesc desc;
    desc.link_parents = {&kRoot, 1};
    desc.leaves = leaves;
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
    all = make_convex_shapes(articulation, arena);
  }
  Shapes(const Shapes&) = delete;
  Shapes& operator=(const Shapes&) = delete;
};

Leaf leaf_with(Span<const ConvexPart> parts) {
  return {0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1e6f, 1e6f, 1e6f}}, parts};
}

// The vertices of a hull's shape, in the caller's unit about its centre.
std::vector<std::array<float, 3>> vertices_of(const ConvexShape& shape) {
  std::vector<std::array<float, 3>> out;
  for (std::uint32_t v = 0; v < (shape.vertex_count + 15) / 16 * 16; ++v) {
    const float* const at = shape.vertices + v / 16 * 48 + v % 16;
    out.push_back({at[0] * shape.unit, at[16] * shape.unit, at[32] * shape.unit});
  }
  return out;
}

}  // namespace

TEST_CASE("a leaf without parts is its box, and every part is a shape of its leaf, in order") {
  const ConvexPart parts[] = {{ShapeKind::kEllipsoid, {1, 2, 3}, {0, 0, 0, 1}, {3, 1, 2}, {}},
                              {ShapeKind::kCapsule, {0, 0, 0}, {0, 0, 0, 1}, {2, 5, 0}, {}}};
  Leaf plain = leaf_with({});
  plain.box.half[1] = 2;
  const Shapes shapes({plain, leaf_with({parts, 2})});
  REQUIRE(shapes.all.shapes.size == 3);
  CHECK(shapes.all.leaf_begin[0] == 0);
  CHECK(shapes.all.leaf_begin[1] == 1);
  CHECK(shapes.all.leaf_begin[2] == 3);
  CHECK(shapes.all.shapes[0].kind == ConvexKind::kBox);
  CHECK(shapes.all.shapes[0].size[1] == 2);
  CHECK(shapes.all.shapes[0].axis[2][2] == 1);
  CHECK(shapes.all.shapes[1].kind == ConvexKind::kEllipsoid);
  CHECK(shapes.all.shapes[1].position[2] == 3);
  CHECK(shapes.all.shapes[1].reach == 3);
  CHECK(shapes.all.shapes[1].part == &shapes.articulation.parts[0]);
  CHECK(shapes.all.shapes[2].kind == ConvexKind::kRound);
  CHECK(shapes.all.shapes[2].size[0] == 2);
  CHECK(shapes.all.shapes[2].size[2] == 5);
  CHECK(shapes.all.shapes[2].reach == 7);
}

TEST_CASE("a sphere is round without a length, a cylinder reaches its rims, a half space is a place and a rotation") {
  const ConvexPart parts[] = {{ShapeKind::kSphere, {1, 2, 3}, {0, 0, 0, 1}, {3, 1, 2}, {}},
                              {ShapeKind::kCylinder, {0, 0, 0}, {0, 0, 0, 1}, {3, 4, 7}, {}},
                              {ShapeKind::kHalfSpace, {4, 5, 6}, {1, 0, 0, 0}, {7, 7, 7}, {}}};
  const Shapes shapes({leaf_with({parts, 3})});
  REQUIRE(shapes.all.shapes.size == 3);
  const ConvexShape &sphere = shapes.all.shapes[0], &cylinder = shapes.all.shapes[1], &half = shapes.all.shapes[2];
  CHECK(sphere.kind == ConvexKind::kRound);
  CHECK(sphere.size[0] == 3);
  CHECK(sphere.size[2] == 0);
  CHECK(sphere.reach == 3);
  CHECK(sphere.position[2] == 3);
  CHECK(cylinder.kind == ConvexKind::kCylinder);
  CHECK(cylinder.size[0] == 3);
  CHECK(cylinder.size[2] == 4);
  CHECK(cylinder.reach == 5);
  CHECK(half.kind == ConvexKind::kHalfSpace);
  CHECK(half.size[0] == 0);
  CHECK(half.reach == 0);
  CHECK(half.position[1] == 5);
  CHECK(half.column[2][2] == -1);
}

TEST_CASE("a hull's vertices are sorted about its centre, padded by the last, and within its reach, in any unit") {
  for (const double unit : {1e-20, 1.0, 1e5}) {
    CAPTURE(unit);
    cab::oracle::Random random(static_cast<std::uint64_t>(7));
    for (const std::uint32_t count : {4u, 16u, 17u, 50u}) {
      CAPTURE(count);
      std::vector<float> vertices;
      for (std::uint32_t v = 0; v < 3 * count; ++v)
        vertices.push_back(static_cast<float>(unit * (random.uniform(-1, 1) + 3)));
      const ConvexPart part = {ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {}, vertices};
      const Shapes shapes({leaf_with({&part, 1})});
      const ConvexShape& hull = shapes.all.shapes[0];
      REQUIRE(hull.vertex_count == count);
      const auto sorted = vertices_of(hull);
      float largest = 0;
      for (std::size_t v = 0; v < sorted.size(); ++v) {
        if (v > 0) CHECK(!(sorted[v] < sorted[v - 1]));
        if (v >= count) CHECK(sorted[v] == sorted[count - 1]);
        double square = 0;
        for (const float c : sorted[v]) {
          largest = std::max(largest, std::fabs(c) / hull.unit);
          square += static_cast<double>(c) * static_cast<double>(c);
        }
        CHECK(std::sqrt(square) <= static_cast<double>(hull.reach) * (1 + 1e-6));
      }
      CHECK(largest <= 1);
      CHECK(largest >= 0.5f);
      // Each vertex is one of the caller's, to rounding.
      for (std::uint32_t v = 0; v < count; ++v) {
        double nearest = 1e30;
        for (std::uint32_t w = 0; w < count; ++w) {
          double distance = 0;
          for (std::size_t c = 0; c < 3; ++c)
            distance += std::fabs(static_cast<double>(sorted[v][c]) + static_cast<double>(hull.position[c]) -
                                  static_cast<double>(vertices[3 * w + c]));
          nearest = std::min(nearest, distance);
        }
        CHECK(nearest < 1e-6 * unit);
      }
    }
  }
}
