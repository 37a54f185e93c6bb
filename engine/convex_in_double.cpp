#include "engine/convex_in_double.h"

#include "kernels/convex/gjk.h"
#include "kernels/convex/pair_lanes.h"

#include <cmath>
#include <tuple>

namespace cab {
namespace {

using kernel::Vec3;
using Double3 = Vec3<double>;

Double3 double3(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// A shape in double, in the caller's unit: its axes and centre relative to the origin of its instance, in world axes.
// away: how far the centre is from the origins of its link and its instance.
struct Shape {
  ConvexKind kind;
  Double3 column[3], center, size;
  Span<const float> vertices;  // of a hull, relative to `center`
  double away;
};

// The shape in the link's frame.
Shape local_shape(const ConvexShape& from) {
  Shape out = {};
  out.kind = from.kind;
  if (from.box) {
    for (int k = 0; k < 3; ++k) out.column[k] = double3(from.box->axis[k]);
    for (int i = 0; i < 4; ++i) kernel::polish(out.column);
    out.center = double3(from.box->center);
    out.size = double3(from.box->half);
    return out;
  }
  const float* const q = from.part->rotation;
  const double x = static_cast<double>(q[0]), y = static_cast<double>(q[1]), z = static_cast<double>(q[2]),
               w = static_cast<double>(q[3]);
  kernel::quaternion_columns(x, y, z, w, (x * x + y * y) + (z * z + w * w), out.column);
  out.center = double3(from.part->position);
  out.size = from.kind == ConvexKind::kHull ? Double3{} : double3(from.size);
  out.vertices = from.part->vertices;
  return out;
}

// The same in an instance, posed.
Shape posed_shape(const kernel::ConvexSide& side, std::uint32_t lane) {
  kernel::RawPoses poses, orientations;
  for (std::uint32_t f = 0; f < kernel::pose_float_count(side.format); ++f) poses.raw[f][0] = side.pose[lane][f];
  const float* const orientation = side.orientation[lane];
  for (std::uint32_t f = 0; f < 4 && orientation; ++f) orientations.raw[f][0] = orientation[f];
  kernel::LaneChecks<double> checks = {true, true, true};  // not read: the instance was checked when it was bounded
  const auto pose = kernel::rotated_pose<double>(poses, orientation ? &orientations : nullptr, side.format, 0, checks);
  Shape out = local_shape(*side.shape[lane]);
  out.away = kernel::sum(kernel::abs(pose.translation)) + kernel::sum(kernel::abs(out.center));
  out.center = pose.translation + kernel::rotate(pose.column, out.center);
  for (Double3& column : out.column) column = kernel::rotate(pose.column, column);
  return out;
}

// The vertex of a hull farthest along d. Of several the one that comes first by x, then y, then z.
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

// The point of a shape farthest along d, both in its own frame. Round shapes are their segments alone.
Double3 farthest(const Shape& shape, const Double3& d) {
  if (shape.kind == ConvexKind::kHull) return farthest_vertex(shape.vertices, d);
  return kernel::support_by_size(shape.kind, shape.size, d);
}

// The distance from a shape's centre within which all of it is.
double reach_of(const Shape& shape, const ConvexShape& from) {
  if (shape.kind != ConvexKind::kHull) return static_cast<double>(from.reach);
  double most = 0;
  for (std::size_t v = 0; v < shape.vertices.size; v += 3) {
    const Double3 at = double3(shape.vertices.data + v);
    most = std::max(most, kernel::dot(at, at));
  }
  return std::sqrt(most);
}

double radius_of(const Shape& shape) { return shape.kind == ConvexKind::kRound ? shape.size.x : 0; }

}  // namespace

bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  Shape a = posed_shape(block.a, lane), b = posed_shape(block.b, lane);
  const double reach = reach_of(a, *block.a.shape[lane]) + reach_of(b, *block.b.shape[lane]);
  const Double3 between =
      (b.center - a.center) + Double3{block.shift.by[0][lane], block.shift.by[1][lane], block.shift.by[2][lane]};
  const Double3 t = {kernel::dot(a.column[0], between), kernel::dot(a.column[1], between),
                     kernel::dot(a.column[2], between)};
  Double3 column[3];
  for (int k = 0; k < 3; ++k)
    column[k] = {kernel::dot(a.column[0], b.column[k]), kernel::dot(a.column[1], b.column[k]),
                 kernel::dot(a.column[2], b.column[k])};
  // Scaled by a power of two, so that products of six lengths stay in range.
  int exponent = 0;
  std::frexp(reach + kernel::sum(kernel::abs(t)), &exponent);
  const double scale = std::ldexp(1.0, -exponent);
  const double size = scale * reach, away = scale * (a.away + b.away), from = scale * kernel::sum(kernel::abs(t));
  const kernel::GjkPair<double> pair = {scale * t,
                                        scale * ((radius_of(a) + radius_of(b)) + static_cast<double>(block.margin)),
                                        kConvexSlackDouble * (from + size) + kConvexPoseSlackDouble * away,
                                        kTetrahedronRoundingDouble * ((from + size) * (size * size))};
  const auto support = [&](const Double3& d, std::uint32_t) {
    const Double3 minus = {-d.x, -d.y, -d.z};
    const Double3 on_b =
        farthest(b, {kernel::dot(column[0], minus), kernel::dot(column[1], minus), kernel::dot(column[2], minus)});
    return scale * (farthest(a, d) - (t + kernel::rotate(column, on_b)));
  };
  return kernel::gjk(pair, kernel::kGjkInDouble, 1, support).apart == 0;
}

}  // namespace cab
