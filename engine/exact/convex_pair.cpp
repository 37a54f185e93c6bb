#include "engine/exact/convex_pair.h"

#include "kernels/convex/support.h"
#include "kernels/pose_leaves.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace cab {
namespace {

// The vertex of a hull farthest along d.
Double3 farthest_vertex(Span<const float> vertices, const Double3& d) {
  Double3 best = double3(vertices.data);
  double height = kernel::dot(best, d);
  for (std::size_t v = 3; v < vertices.size; v += 3) {
    const Double3 at = double3(vertices.data + v);
    const double h = kernel::dot(at, d);
    if (h < height || (h == height && std::tie(best.x, best.y, best.z) <= std::tie(at.x, at.y, at.z))) continue;
    best = at;
    height = h;
  }
  return best;
}

// How far the vertices of a hull are from its part's origin.
double reach_of(Span<const float> vertices) {
  double most = 0;
  for (std::size_t v = 0; v < vertices.size; v += 3) {
    const Double3 at = double3(vertices.data + v);
    most = std::max(most, kernel::dot(at, at));
  }
  return std::sqrt(most);
}

}  // namespace

kernel::RigidLanes<double> pose_in_double(const StoredPose& from) {
  kernel::LaneChecks<double> checks = {true, true, true};  // not read
  return placed_pose(from, checks);
}

// The shape in the link's frame.
ConvexPair::Shape ConvexPair::local_shape(const ConvexShape& from) {
  Shape out = {};
  out.kind = from.kind;
  out.reach = static_cast<double>(from.reach);
  for (std::size_t k = 0; k < 3; ++k) out.column[k] = axis_of(from, k);
  out.center = double3(from.kind == ConvexKind::kHull ? from.part->position : from.position);
  if (from.kind == ConvexKind::kHull) {
    out.vertices = from.part->vertices;
    out.reach = reach_of(out.vertices);
    return out;
  }
  out.size = double3(from.size);
  if (from.kind == ConvexKind::kRound) out.radius = out.size.x;
  return out;
}

ConvexPair::Shape ConvexPair::posed_shape(const PlacedShape& from) {
  const kernel::RigidLanes<double> pose = pose_in_double(from.at);
  Shape out = local_shape(*from.shape);
  out.scale = pose.scale;
  out.size = pose.scale * out.size;
  out.center = pose.scale * out.center;
  out.radius *= pose.scale;
  out.reach *= pose.scale;
  out.away = kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(out.center));
  out.center = pose.translation + kernel::rotate(pose.column, out.center);
  for (Double3& column : out.column) column = kernel::rotate(pose.column, column);
  return out;
}

ConvexPair::ConvexPair(const PlacedShape& a, const PlacedShape& b, const double (&shift)[3])
    : a_(posed_shape(a)), b_(posed_shape(b)) {
  const Double3 between = (b_.center - a_.center) + Double3{shift[0], shift[1], shift[2]};
  const auto in_a = [this](const Double3& v) {
    return Double3{kernel::dot(a_.column[0], v), kernel::dot(a_.column[1], v), kernel::dot(a_.column[2], v)};
  };
  t_ = in_a(between);
  for (std::size_t k = 0; k < 3; ++k) axis_[k] = in_a(b_.column[k]);
  int exponent = 0;
  std::frexp((a_.reach + b_.reach) + kernel::sum(kernel::abs(t_)), &exponent);
  scale_ = std::ldexp(1.0, -exponent);
  t_ = scale_ * t_;
  for (Shape* shape : {&a_, &b_}) {
    if (shape->kind != ConvexKind::kHull) shape->size = scale_ * shape->size;
    shape->radius *= scale_;
  }
  const double reach = scale_ * (a_.reach + b_.reach);
  const double size = kernel::sum(kernel::abs(t_)) + reach;
  slack_ = kConvexSlackDouble * size + kConvexPoseSlackDouble * (scale_ * (a_.away + b_.away));
  rounding_ = kTetrahedronRoundingDouble * (size * (reach * reach));
}

Double3 ConvexPair::farthest_of(const Shape& shape, const Double3& d) const {
  return shape.kind == ConvexKind::kHull ? (scale_ * shape.scale) * farthest_vertex(shape.vertices, d)
                                         : kernel::support_by_size(shape.kind, shape.size, d);
}

Double3 ConvexPair::farthest_of_b(const Double3& d) const {
  return t_ + kernel::rotate(axis_, farthest_of(b_, {kernel::dot(axis_[0], d), kernel::dot(axis_[1], d),
                                                     kernel::dot(axis_[2], d)}));
}

int ConvexPair::half_spaces() const {
  return int{a_.kind == ConvexKind::kHalfSpace} + int{b_.kind == ConvexKind::kHalfSpace};
}

double ConvexPair::height_above_plane() const {
  if (a_.kind == ConvexKind::kHalfSpace) return farthest_of_b({0, 0, -1}).z;
  const Double3& up = axis_[2];
  return kernel::dot(up, farthest_of(a_, {-up.x, -up.y, -up.z}) - t_);
}

}  // namespace cab
