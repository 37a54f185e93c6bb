#include "layout/convex_shapes.h"

#include "layout/rounded_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cab {
namespace {

using Double3 = std::array<double, 3>;

Double3 double3(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

void store(const Double3& from, float* to) {
  for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(from[c]);
}

double length(const Double3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// Moves a hull's vertices to the centre of their bounds, scales and sorts them, and appends them to `shape`.
void set_hull(const ConvexPart& part, const double (&columns)[3][3], Arena& arena, ConvexShape& shape) {
  const std::size_t count = part.vertices.size / 3;
  Double3 lo, hi, center;
  lo.fill(std::numeric_limits<double>::infinity());
  hi.fill(-lo[0]);
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], static_cast<double>(part.vertices[3 * v + c]));
      hi[c] = std::max(hi[c], static_cast<double>(part.vertices[3 * v + c]));
    }
  double largest = 0, reach = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    center[c] = 0.5 * (lo[c] + hi[c]);
    largest = std::max(largest, hi[c] - center[c]);
    shape.size[c] = rounded_up(hi[c] - center[c]);
  }
  int exponent = 0;
  std::frexp(largest, &exponent);
  shape.unit = std::ldexp(1.0f, exponent);
  std::vector<std::array<float, 3>> sorted(count);
  for (std::size_t v = 0; v < count; ++v) {
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double from_center = static_cast<double>(part.vertices[3 * v + c]) - center[c];
      square += from_center * from_center;
      sorted[v][c] = static_cast<float>(std::ldexp(from_center, -exponent)) + 0.0f;  // no -0, which sorts before 0
    }
    reach = std::max(reach, std::sqrt(square));
  }
  std::sort(sorted.begin(), sorted.end());
  constexpr std::size_t kChunk = 16;
  const std::size_t padded = (count + kChunk - 1) / kChunk * kChunk;
  shape.vertex_count = static_cast<std::uint32_t>(count);
  const Span<float> vertices = arena.allocate<float>(3 * padded);
  for (std::size_t v = 0; v < padded; ++v)
    for (std::size_t c = 0; c < 3; ++c)
      vertices[v / kChunk * 3 * kChunk + c * kChunk + v % kChunk] = sorted[std::min(v, count - 1)][c];
  shape.vertices = vertices.data;
  shape.reach = rounded_up(reach);
  std::vector<double> exact;
  if (count <= kMostVertices)
    for (std::size_t v = 0; v < count; ++v)
      for (std::size_t c = 0; c < 3; ++c)
        exact.push_back(std::ldexp(static_cast<double>(part.vertices[3 * v + c]) - center[c], -exponent));
  shape.polytope = make_polytope(exact, arena);
  Double3 position = double3(part.position);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) position[c] += center[k] * columns[k][c];
  store(position, shape.position);
}

void set_axes(const double (&columns)[3][3], ConvexShape& shape) {
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      shape.axis[k][c] = columns[k][c];
      shape.column[k][c] = static_cast<float>(columns[k][c]);
    }
}

// The axes of a box, orthonormal to rounding in double: Gram-Schmidt, where the first axis keeps its direction.
void set_axes(const Box& box, ConvexShape& shape) {
  Double3 x = double3(box.axis[0]), y = double3(box.axis[1]);
  const auto unit = [](Double3& v) {
    const double norm = length(v);
    for (double& c : v) c /= norm;
  };
  unit(x);
  const double along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  for (std::size_t c = 0; c < 3; ++c) y[c] -= along * x[c];
  unit(y);
  set_axes({{x[0], x[1], x[2]},
            {y[0], y[1], y[2]},
            {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]}},
           shape);
}

ConvexShape shape_of(const ConvexPart& part, Arena& arena) {
  ConvexShape shape = {};
  shape.part = &part;
  shape.unit = 1;
  double columns[3][3];
  rotation_columns(part.rotation, columns);
  set_axes(columns, shape);
  store(double3(part.position), shape.position);
  Double3 size = double3(part.size);
  switch (part.kind) {
    case ShapeKind::kBox:
      shape.kind = ConvexKind::kBox;
      shape.reach = rounded_up(length(size));
      shape.polytope = &unit_cube();
      break;
    case ShapeKind::kEllipsoid:
      shape.kind = ConvexKind::kEllipsoid;
      shape.reach = *std::max_element(part.size, part.size + 3);
      break;
    case ShapeKind::kCapsule:
      shape.kind = ConvexKind::kRound;
      shape.reach = rounded_up(size[0] + size[1]);
      size = {size[0], 0, size[1]};
      break;
    case ShapeKind::kConvexHull:
      shape.kind = ConvexKind::kHull;
      set_hull(part, columns, arena, shape);
      size = double3(shape.size);
      break;
    case ShapeKind::kSphere:
      shape.kind = ConvexKind::kRound;
      shape.reach = part.size[0];
      size = {size[0], 0, 0};
      break;
    case ShapeKind::kCylinder:
      shape.kind = ConvexKind::kCylinder;
      size = {size[0], 0, size[1]};
      shape.reach = rounded_up(length(size));
      break;
    case ShapeKind::kHalfSpace:
      shape.kind = ConvexKind::kHalfSpace;
      size = {};
      break;
  }
  store(size, shape.size);
  return shape;
}

}  // namespace

ConvexShape shape_of_box(const Box& box) {
  ConvexShape shape = {};
  shape.unit = 1;
  shape.kind = ConvexKind::kBox;
  shape.polytope = &unit_cube();
  set_axes(box, shape);
  store(double3(box.half), shape.size);
  store(double3(box.center), shape.position);
  const Double3 half = double3(box.half);
  shape.reach = rounded_up(length(half));
  return shape;
}

ConvexShapes make_convex_shapes(const Articulation& articulation, Arena& arena) {
  const Span<const std::uint32_t> part_begin = articulation.leaf_part_begin;
  std::vector<ConvexShape> shapes;
  shapes.reserve(std::max<std::size_t>(articulation.leaf_count, articulation.parts.size));
  auto begin = arena.allocate<std::uint32_t>(articulation.leaf_count + 1);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    begin[leaf] = static_cast<std::uint32_t>(shapes.size());
    for (std::uint32_t p = part_begin[leaf]; p < part_begin[leaf + 1]; ++p)
      shapes.push_back(shape_of(articulation.parts[p], arena));
    if (part_begin[leaf] == part_begin[leaf + 1]) shapes.push_back(shape_of_box(articulation.leaf_box[leaf]));
  }
  begin[articulation.leaf_count] = static_cast<std::uint32_t>(shapes.size());
  return {constant(arena.copy(Span<const ConvexShape>(shapes))), constant(begin), {}};
}

}  // namespace cab
