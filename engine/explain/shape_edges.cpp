#include "engine/explain/shape_edges.h"

namespace cab {
namespace {

// A circle is drawn by so many lines.
constexpr int kCircleLines = 16;

// The cosine of k sixteenths of a turn.
double cosine(int k) {
  constexpr double kQuarter[] = {1, 0.92387953251128674, 0.70710678118654752, 0.38268343236508977, 0};
  k = (k % kCircleLines + kCircleLines) % kCircleLines;
  if (k > kCircleLines / 2) k = kCircleLines - k;
  return k > kCircleLines / 4 ? -kQuarter[kCircleLines / 2 - k] : kQuarter[k];
}

// Appends lines of one shape. Points are in the shape's axes, relative to its centre.
class ShapeLines {
 public:
  ShapeLines(const ConvexShape& shape, std::vector<Segment>& out) : shape_(shape), out_(out) {}

  void line(const Double3& from, const Double3& to) { out_.push_back({in_link(from), in_link(to)}); }

  // The part of an ellipse from its first to its last sixteenth.
  void arc(const Double3& center, const Double3& u, const Double3& v, int first = 0, int last = kCircleLines) {
    const auto at = [&](int k) { return center + (cosine(k) * u + cosine(k - kCircleLines / 4) * v); };
    for (int k = first; k < last; ++k) line(at(k), at(k + 1));
  }

  void polytope(const Double3& scale) {
    const Polytope& from = *shape_.polytope;
    const auto vertex = [&](std::uint32_t v) {
      const double* const at = from.exact_vertices + std::size_t{3} * v;
      return Double3{at[0] * scale.x, at[1] * scale.y, at[2] * scale.z};
    };
    for (std::uint32_t e = 0; e < from.edge_count; ++e)
      line(vertex(from.edges[e].vertex[0]), vertex(from.edges[e].vertex[1]));
  }

  // Circles about z at both ends, and four lines between them.
  void tube(double radius, double half) {
    for (const double z : {-half, half}) arc({0, 0, z}, {radius, 0, 0}, {0, radius, 0});
    for (int k = 0; k < kCircleLines; k += kCircleLines / 4) {
      const double x = radius * cosine(k), y = radius * cosine(k - kCircleLines / 4);
      line({x, y, -half}, {x, y, half});
    }
  }

 private:
  Double3 in_link(const Double3& point) const {
    const Double3 axes[3] = {axis_of(shape_, 0), axis_of(shape_, 1), axis_of(shape_, 2)};
    return double3(shape_.position) + kernel::rotate(axes, point);
  }

  const ConvexShape& shape_;
  std::vector<Segment>& out_;
};

}  // namespace

bool append_edges(const ConvexShape& shape, std::vector<Segment>& out) {
  ShapeLines lines(shape, out);
  const Double3 size = double3(shape.size);
  const Double3 x = {size.x, 0, 0}, y = {0, size.y, 0}, z = {0, 0, size.z};
  switch (shape.kind) {
    case ConvexKind::kBox: lines.polytope(size); return true;
    case ConvexKind::kHull: {
      if (!shape.polytope) return false;
      const double unit = static_cast<double>(shape.unit);
      lines.polytope({unit, unit, unit});
      return true;
    }
    case ConvexKind::kEllipsoid:
      lines.arc({}, x, y);
      lines.arc({}, y, z);
      lines.arc({}, z, x);
      return true;
    case ConvexKind::kCylinder: lines.tube(size.x, size.z); return true;
    case ConvexKind::kRound: {
      const double radius = size.x;
      const Double3 side[2] = {{radius, 0, 0}, {0, radius, 0}}, up = {0, 0, radius};
      if (size.z > 0) {
        lines.tube(radius, size.z);
      } else {
        lines.arc({}, side[0], side[1]);
      }
      for (const Double3& across : side) {
        lines.arc(z, across, up, 0, kCircleLines / 2);
        lines.arc({0, 0, -size.z}, across, up, kCircleLines / 2, kCircleLines);
      }
      return true;
    }
    case ConvexKind::kHalfSpace: break;
  }
  return false;
}

}  // namespace cab
