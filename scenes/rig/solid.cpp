// Bodies about points, by kind.
#include "scenes/rig/solid.h"

#include <cab/cab.h>
#include <cab/skin.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;
// A sphere's or circle's centre moves towards the farthest point so often. The radius is then within about 1 percent
// of the least (Badoiu and Clarkson, "Smaller core-sets for balls", 2003: the error falls as 1 / steps).
constexpr int kCentreSteps = 200;
// Khachiyan's algorithm ends when no point is farther outside than this share.
constexpr double kEllipsoidTolerance = .01;
constexpr int kEllipsoidSteps = 2000;
// A capsule's straight part is at least this share of its radius: the engine's sizes are above 0.
constexpr double kLeastStraight = 1e-3;

float grown(double size) {
  return std::nextafter(static_cast<float>(size * (1 + kMargin)), std::numeric_limits<float>::infinity());
}

Vec3 widen(const float* v) { return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])}; }

Quat rotation_of(const ConvexPart& part) {
  return normalized({part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]});
}

// How far rounding to float moves a point of the link's frame, at most, among points: half a step of a float in each
// coordinate, and so less than a step of the largest.
double rounding_of(const std::vector<Vec3>& points) {
  double largest = 0;
  for (const Vec3& point : points)
    for (const double x : point) largest = std::max(largest, std::fabs(x));
  return 0x1p-23 * largest;
}

// The largest distance from a centre to points.
double reach(const std::vector<Vec3>& points, const Vec3& centre) {
  double radius = 0;
  for (const Vec3& point : points) radius = std::max(radius, length(point - centre));
  return radius;
}

// The centre of a small ball about points, which may all be in one plane.
Vec3 ball_centre(const std::vector<Vec3>& points) {
  Vec3 centre = points[0];
  for (int step = 1; step <= kCentreSteps; ++step) {
    const Vec3* farthest = &points[0];
    for (const Vec3& point : points)
      if (length(point - centre) > length(*farthest - centre)) farthest = &point;
    centre = centre + (1.0 / (step + 1)) * (*farthest - centre);
  }
  return centre;
}

void set_frame(ConvexPart& part, const Vec3& position, const Quat& rotation) {
  for (std::size_t k = 0; k < 3; ++k) part.position[k] = static_cast<float>(position[k]);
  for (std::size_t k = 0; k < 4; ++k) part.rotation[k] = static_cast<float>(rotation[k]);
}

// The rotation whose columns are three orthonormal axes.
Quat rotation_to(const Vec3& x, const Vec3& y, const Vec3& z) {
  Eigen::Matrix3d matrix;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    matrix.row(k) << x[i], y[i], z[i];
  }
  const Eigen::Quaterniond q(matrix);
  return normalized({q.x(), q.y(), q.z(), q.w()});
}

// A box along a part's axes, a little larger than the part.
Box box_about(const ConvexPart& part, const Vec3& half) {
  Box box = {};
  const Quat rotation = rotation_of(part);
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3 axis = {0, 0, 0};
    axis[k] = 1;
    axis = rotate(rotation, axis);
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[c]);
    box.center[k] = part.position[k];
    box.half[k] = grown(half[k]);
  }
  return box;
}

Solid sphere_about(const std::vector<Vec3>& points) {
  Solid solid;
  solid.part.kind = ShapeKind::kSphere;
  set_frame(solid.part, ball_centre(points), {0, 0, 0, 1});
  solid.part.size[0] = grown(reach(points, widen(solid.part.position)));
  const double radius = solid.part.size[0];
  solid.box = box_about(solid.part, {radius, radius, radius});
  solid.volume = 4 * kPi / 3 * radius * radius * radius;
  return solid;
}

// The capsule about points with its axis along z of a rotation.
Solid capsule_along(const std::vector<Vec3>& points, const Quat& rotation) {
  std::vector<Vec3> flat;
  std::vector<double> heights;
  for (const Vec3& point : points) {
    const Vec3 local = rotate(conjugate(rotation), point);
    flat.push_back({local[0], local[1], 0});
    heights.push_back(local[2]);
  }
  const Vec3 centre = ball_centre(flat);
  const double radius = reach(flat, centre) * (1 + kMargin);
  // A point is inside if the end of the axis is so near that the cap reaches it.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double across = length(flat[p] - centre);
    const double cap = std::sqrt(std::max(0.0, radius * radius - across * across));
    low = std::min(low, heights[p] + cap);
    high = std::max(high, heights[p] - cap);
  }
  const double half = std::max(.5 * (high - low), kLeastStraight * radius);
  Solid solid;
  solid.part.kind = ShapeKind::kCapsule;
  set_frame(solid.part, rotate(rotation, {centre[0], centre[1], .5 * (high + low)}), rotation);
  // What grows by kMargin anyway covers the rounding of the position, unless the link's origin is far away.
  solid.part.size[0] = grown(radius + std::max(kMargin * half, rounding_of(points) - kMargin * radius));
  solid.part.size[1] = grown(half);
  const double r = solid.part.size[0], h = solid.part.size[1];
  solid.box = box_about(solid.part, {r, r, h + r});
  solid.volume = kPi * r * r * (2 * h + 4.0 / 3 * r);
  return solid;
}

// The capsule of least volume along one of a box's axes.
Solid capsule_about(const std::vector<Vec3>& points, const Box& box) {
  std::optional<Solid> best;
  for (std::size_t k = 0; k < 3; ++k) {
    const Quat rotation = rotation_to(widen(box.axis[(k + 1) % 3]), widen(box.axis[(k + 2) % 3]), widen(box.axis[k]));
    Solid solid = capsule_along(points, rotation);
    if (!best || solid.volume < best->volume) best = std::move(solid);
  }
  return *best;
}

// The ellipsoid of least volume about points that are not all in one plane (L. Khachiyan, "Rounding of polytopes in the
// real number model of computation", 1996), enlarged until all points are inside.
Solid ellipsoid_about(const std::vector<Vec3>& points) {
  const auto count = static_cast<Eigen::Index>(points.size());
  const Vec3 shift = points[0];
  const double scale = std::max(reach(points, shift), std::numeric_limits<double>::min());
  Eigen::Matrix4Xd lifted(4, count);
  for (Eigen::Index p = 0; p < count; ++p) {
    const Vec3 at = (1 / scale) * (points[static_cast<std::size_t>(p)] - shift);
    lifted.col(p) << at[0], at[1], at[2], 1;
  }
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count));
  for (int step = 0; step < kEllipsoidSteps; ++step) {
    const Eigen::Matrix4d moments = lifted * weights.asDiagonal() * lifted.transpose();
    const Eigen::RowVectorXd far = lifted.cwiseProduct(moments.inverse() * lifted).colwise().sum();
    Eigen::Index farthest = 0;
    const double most = far.maxCoeff(&farthest);
    if (most <= 4 * (1 + kEllipsoidTolerance)) break;
    const double move = (most - 4) / (4 * (most - 1));
    weights *= 1 - move;
    weights(farthest) += move;
  }
  const Eigen::Vector3d centre = lifted.topRows<3>() * weights;
  const Eigen::Matrix3d moments =
      lifted.topRows<3>() * weights.asDiagonal() * lifted.topRows<3>().transpose() - centre * centre.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(3 * moments);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;

  Solid solid;
  solid.part.kind = ShapeKind::kEllipsoid;
  const auto column = [&](int k) { return Vec3{axes(0, k), axes(1, k), axes(2, k)}; };
  set_frame(solid.part, shift + scale * Vec3{centre[0], centre[1], centre[2]},
            rotation_to(column(0), column(1), column(2)));
  Vec3 radii;
  for (int k = 0; k < 3; ++k)
    radii[static_cast<std::size_t>(k)] = scale * std::sqrt(std::max(solver.eigenvalues()[k], 1e-12));
  double growth_sq = 0;
  for (const Vec3& point : points) {
    const Vec3 local = rotate(conjugate(rotation_of(solid.part)), point - widen(solid.part.position));
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += local[k] * local[k] / (radii[k] * radii[k]);
    growth_sq = std::max(growth_sq, sum);
  }
  for (std::size_t k = 0; k < 3; ++k) solid.part.size[k] = grown(radii[k] * std::sqrt(growth_sq));
  const Vec3 size = widen(solid.part.size);
  solid.box = box_about(solid.part, size);
  solid.volume = 4 * kPi / 3 * size[0] * size[1] * size[2];
  return solid;
}

double box_volume(const Box& box) {
  return 8.0 * static_cast<double>(box.half[0]) * static_cast<double>(box.half[1]) * static_cast<double>(box.half[2]);
}

// The box about vertices in range, for which only memory may be lacking.
Box fitted_box(const std::vector<float>& vertices) {
  Box box;
  if (fit_box(vertices, &box) != Status::kOk) throw std::bad_alloc();
  return box;
}

std::vector<float> flattened(const std::vector<Vec3>& points) {
  std::vector<float> floats;
  for (const Vec3& point : points)
    for (const double component : point) floats.push_back(static_cast<float>(component));
  return floats;
}

// The box about points, grown by their rounding to float.
Solid box_solid(const std::vector<Vec3>& points) {
  Solid solid;
  solid.box = fitted_box(flattened(points));
  const double longest = std::max({solid.box.half[0], solid.box.half[1], solid.box.half[2]});
  const double margin = std::max(kMargin * longest, rounding_of(points));
  for (float& half : solid.box.half)
    if (half > 0) half = grown(half + margin);
  solid.volume = box_volume(solid.box);
  return solid;
}

Solid hull_solid(Hull hull) {
  Solid solid;
  solid.part.kind = ShapeKind::kConvexHull;
  solid.vertices = flattened(hull.vertices);
  solid.box = fitted_box(solid.vertices);
  solid.volume = hull.volume;
  solid.hull = std::move(hull);
  return solid;
}

double distance_to_box(const Box& box, const Vec3& point) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double along = dot(point - widen(box.center), widen(box.axis[k]));
    const double out = std::max(0.0, std::fabs(along) - static_cast<double>(box.half[k]));
    sum += out * out;
  }
  return std::sqrt(sum);
}

// The distance to a hull of a point outside of it. The nearest face is one that the point is above.
double distance_to_hull(const Hull& hull, const Vec3& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    if (dot(hull.planes[f].normal, point) < hull.planes[f].offset) continue;
    const auto& [a, b, c] = hull.faces[f];
    nearest = std::min(nearest, distance_to_triangle(point, {hull.vertices[a], hull.vertices[b], hull.vertices[c]}));
  }
  return nearest;
}

// The distance to the point of the ellipsoid on the line to its centre.
double limit_to_ellipsoid(const Vec3& size, const Vec3& local) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += local[k] * local[k] / (size[k] * size[k]);
  return sum <= 1 ? 0 : length(local) * (1 - 1 / std::sqrt(sum));
}

// The distance from a point to a body that is not a hull, 0 or less inside.
double gap(const Solid& solid, const Vec3& point) {
  if (!solid.has_part) return distance_to_box(solid.box, point);
  const Vec3 size = widen(solid.part.size);
  Vec3 local = rotate(conjugate(rotation_of(solid.part)), point - widen(solid.part.position));
  if (solid.part.kind == ShapeKind::kEllipsoid) return limit_to_ellipsoid(size, local);
  if (solid.part.kind == ShapeKind::kCapsule) local[2] -= std::clamp(local[2], -size[1], size[1]);
  return length(local) - size[0];
}

}  // namespace

bool are_in_range(const std::vector<Vec3>& points) {
  return std::all_of(points.begin(), points.end(), [](const Vec3& point) {
    return std::all_of(point.begin(), point.end(),
                       [](double x) { return std::fabs(x) <= static_cast<double>(kMaxCoordinate); });
  });
}

Solid fit_solid(const std::vector<Vec3>& points, std::uint32_t kinds, std::size_t max_hull_vertices) {
  const Hull full = convex_hull(points, points.size());
  const std::vector<Vec3>& outer = full.faces.empty() ? points : full.vertices;
  const Solid boxed = box_solid(outer);
  std::vector<Solid> choice;
  if (full.faces.empty() || (kinds & rig::kBoxBody) != 0) choice.push_back(boxed);
  if (!full.faces.empty()) {
    if ((kinds & rig::kCapsuleBody) != 0) choice.push_back(capsule_about(outer, boxed.box));
    if ((kinds & rig::kSphereBody) != 0) choice.push_back(sphere_about(outer));
    if ((kinds & rig::kEllipsoidBody) != 0) choice.push_back(ellipsoid_about(outer));
    if ((kinds & rig::kHullBody) != 0) {
      Hull hull = enclosing_hull(outer, max_hull_vertices);
      // Rounding to float may flatten a very thin hull, and a hull that grew may be out of range.
      const bool is_hull = !hull.faces.empty() && are_in_range(hull.vertices);
      choice.push_back(is_hull ? hull_solid(std::move(hull)) : boxed);
    }
  }
  Solid solid = *std::min_element(choice.begin(), choice.end(),
                                  [](const Solid& a, const Solid& b) { return a.volume < b.volume; });
  solid.has_part = solid.part.size[0] > 0 || !solid.vertices.empty();
  solid.box_volume = box_volume(solid.box);
  solid.centre = widen(solid.box.center);
  solid.radius = length(widen(solid.box.half));
  return solid;
}

bool is_inside(const Solid& solid, const Vec3& point) {
  const double margin = kMargin * solid.radius;
  if (solid.hull.planes.empty()) return gap(solid, point) <= margin;
  return std::all_of(solid.hull.planes.begin(), solid.hull.planes.end(),
                     [&](const Plane& plane) { return dot(plane.normal, point) <= plane.offset + margin; });
}

double distance(const Solid& solid, const Vec3& point) {
  if (is_inside(solid, point)) return 0;
  return solid.hull.planes.empty() ? gap(solid, point) : distance_to_hull(solid.hull, point);
}

}  // namespace cab::scenes
