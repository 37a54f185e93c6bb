#include "layout/fit_box.h"

#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cab {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;
using Axes = Eigen::Matrix3d;  // column k is axis k

// Eigenvalues and areas that differ by less than this fraction do not decide which axes are better.
constexpr double kAgree = 0.01;

// Cells along an edge of the grid of directions in which fit_box looks for extreme vertices.
constexpr int kGrid = 12;

constexpr int kMaxTurns = 24;  // of one descent; 2000 rotated cubes took at most 11

bool before(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

Vector3d vertex_at(Span<const float> vertices, std::size_t v) {
  return Eigen::Map<const Eigen::Vector3f>(vertices.data + v).cast<double>();
}

// Each point once, in order.
Points sorted_once(Points points) {
  std::sort(points.begin(), points.end(), before);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

void add_extremes(Span<const float> vertices, const Vector3d& direction, Points& points) {
  Vector3d low = vertex_at(vertices, 0), high = low;
  double least = low.dot(direction), greatest = least;
  for (std::size_t v = 3; v < vertices.size; v += 3) {
    const Vector3d vertex = vertex_at(vertices, v);
    const double along = vertex.dot(direction);
    if (along < least || (along == least && before(vertex, low))) {
      least = along;
      low = vertex;
    }
    if (along > greatest || (along == greatest && before(vertex, high))) {
      greatest = along;
      high = vertex;
    }
  }
  points.push_back(low);
  points.push_back(high);
}

// The extreme vertices along 360 directions and their opposites, each vertex once and in order. The result does not
// depend on the order of the vertices, on repeated ones or on those inside, and a finely meshed face weighs no more
// than a coarse one. The directions go through the cells of a grid on a cube: their symmetry keeps the axes of shapes
// that are symmetric in the link's frame. Cells on the diagonals are left out. So no direction is normal to a face of
// an aligned box or octahedron, where many vertices may be equally far.
Points extremes_of(Span<const float> vertices) {
  Points points;
  if (vertices.size <= 9) {  // all of them
    for (std::size_t v = 0; v < vertices.size; v += 3) points.push_back(vertex_at(vertices, v));
    return sorted_once(std::move(points));
  }
  for (int i = 1 - kGrid; i < kGrid; i += 2) {
    for (int j = 1 - kGrid; j < kGrid; j += 2) {
      if (std::abs(i) == std::abs(j)) continue;
      add_extremes(vertices, Vector3d(kGrid, i, j), points);
      add_extremes(vertices, Vector3d(j, kGrid, i), points);
      add_extremes(vertices, Vector3d(i, j, kGrid), points);
    }
  }
  return sorted_once(std::move(points));
}

double width(const Points& points, const Vector3d& direction) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const Vector3d& point : points) {
    least = std::min(least, point.dot(direction));
    greatest = std::max(greatest, point.dot(direction));
  }
  return greatest - least;
}

// Half the surface of the box about the points.
double area(const Points& points, const Axes& axes) {
  const double a = width(points, axes.col(0)), b = width(points, axes.col(1)), c = width(points, axes.col(2));
  return a * b + b * c + c * a;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// The convex hull in counter-clockwise order (Andrew's monotone chain). It has one or two points if all points are on a
// line.
std::vector<Vector2d> hull_of(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  std::vector<Vector2d> hull;
  const auto add = [&hull](const Vector2d& point, std::size_t fixed) {
    while (hull.size() > fixed && cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0) hull.pop_back();
    hull.push_back(point);
  };
  for (const Vector2d& point : points) add(point, 1);
  const std::size_t fixed = hull.size();
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], fixed);
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

// A rotation about one axis: the new direction of the next axis, in the plane of the other two, and the area there.
struct Turn {
  Vector2d along;
  double area;
};

// Rotates the axes about axis `kept` to the least area. They are unchanged if no rotation has less area. With widths a
// and b across the kept axis and c along it, the area is (a + c)(b + c) - c^2. Between rotations at which an edge of
// the projected hull lies on the box, a and b are concave, so the least area is at one of these rotations.
Axes rotated(const Points& points, const Axes& axes, int kept) {
  const int next = (kept + 1) % 3, last = (kept + 2) % 3;
  std::vector<Vector2d> projected;
  for (const Vector3d& point : points) projected.emplace_back(point.dot(axes.col(next)), point.dot(axes.col(last)));
  const std::vector<Vector2d> hull = hull_of(std::move(projected));
  const double c = width(points, axes.col(kept));
  const auto turn = [&](const Vector2d& along) {
    double low[2] = {0, 0}, high[2] = {0, 0};
    for (const Vector2d& point : hull) {
      const Vector2d step = point - hull[0];
      const double at[2] = {step.dot(along), cross(along, step)};
      for (int i = 0; i < 2; ++i) {
        low[i] = std::min(low[i], at[i]);
        high[i] = std::max(high[i], at[i]);
      }
    }
    const double a = high[0] - low[0], b = high[1] - low[1];
    return Turn{along, a * b + c * (a + b)};
  };

  const Turn none = turn({1, 0});
  std::vector<Turn> turns;
  double least = none.area;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    Vector2d edge = hull[(i + 1) % hull.size()] - hull[i];
    if (!(edge.norm() > 0)) continue;
    // A quarter turn gives the same box. Of the four, take the smallest rotation.
    if (std::fabs(edge.x()) < std::fabs(edge.y())) edge = Vector2d(edge.y(), -edge.x());
    if (edge.x() < 0) edge = -edge;
    turns.push_back(turn(edge.normalized()));
    least = std::min(least, turns.back().area);
  }
  const double longest = std::max({c, width(points, axes.col(next)), width(points, axes.col(last))});
  const double tie = kSameWidth * longest * longest;
  if (!(least < none.area - tie)) return axes;
  // Of rotations that are equally good, take the smallest.
  Vector2d best(0, 1);
  for (const Turn& one : turns)
    if (one.area <= least + tie && std::fabs(one.along.y()) < std::fabs(best.y())) best = one.along;
  Axes out = axes;
  out.col(next) = best.x() * axes.col(next) + best.y() * axes.col(last);
  out.col(last) = best.x() * axes.col(last) - best.y() * axes.col(next);
  return out;
}

// Right-handed axes. The last axis is the given one, and the first is as near as possible to one of the link's axes.
Axes link_axes_about(const Vector3d& last) {
  Eigen::Index side;
  last.cwiseAbs().minCoeff(&side);
  const Vector3d first = (Vector3d::Unit(side) - last[side] * last).normalized();
  Axes axes;
  axes << first, last.cross(first), last;
  return axes;
}

// The axes by covariance. If nearly equal eigenvalues leave axes open, those of least area or the link's axes are
// taken.
Axes covariance_axes(const Points& points) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& point : points) mean += point;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Vector3d& point : points) covariance += (point - mean) * (point - mean).transpose();
  covariance /= static_cast<double>(points.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Vector3d values = solver.eigenvalues();  // ascending
  const auto agree = [&](double less, double more) {
    return more - less <= kAgree * more + kSameWidth * kSameWidth * values[2];
  };
  const bool low_agree = agree(values[0], values[1]), high_agree = agree(values[1], values[2]);
  if (low_agree && high_agree) return Axes::Identity();
  if (low_agree) return rotated(points, link_axes_about(solver.eigenvectors().col(2)), 2);
  if (high_agree) return rotated(points, link_axes_about(solver.eigenvectors().col(0)), 2);
  return solver.eigenvectors();
}

// Rotates the axes about each of them in turn while that reduces the area. They stay as they were if the gain is below
// kAgree. This corrects the covariance, which does not show how a cube is rotated, and which is biased if a shape has
// more corners on one side.
Axes rotated_about_each(const Points& points, const Axes& axes) {
  Axes best = axes;
  int idle = 0;
  for (int i = 0; i < kMaxTurns && idle < 3; ++i) {
    const Axes next = rotated(points, best, i % 3);
    idle = next == best ? idle + 1 : 0;
    best = next;
  }
  return area(points, best) < (1 - kAgree) * area(points, axes) ? best : axes;
}

// The axes of the least box about at most three points: the longest side, and the normal of the plane. In the plane the
// least rectangle about a triangle lies on a side, and has twice its area on each side that is not beside an obtuse
// angle; the longest never is.
Axes triangle_axes(const Points& points) {
  Vector3d side = Vector3d::Zero(), other = Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d next = points[(i + 1) % points.size()] - points[i];
    if (!(next.squaredNorm() > side.squaredNorm())) continue;
    side = next;
    other = points[(i + 2) % points.size()] - points[i];
  }
  const double longest = side.norm();
  if (!(longest > 0)) return Axes::Identity();
  const Vector3d along = side / longest;
  Vector3d normal = along.cross(other);
  if (!(normal.norm() > kSameWidth * longest)) return link_axes_about(along);  // on a line, as widths are compared
  normal -= normal.dot(along) * along;
  normal.normalize();
  Axes axes;
  axes << along, normal.cross(along), normal;
  return axes;
}

// The axes of the box, which is never larger than the one along the link's axes.
Axes axes_for(const Points& points) {
  const Axes axes = points.size() <= 3 ? triangle_axes(points) : rotated_about_each(points, covariance_axes(points));
  return area(points, axes) < area(points, Axes::Identity()) ? axes : Axes::Identity();
}

// The same axes in the order and with the signs that come nearest to the link's axes. The result is right-handed,
// because its diagonal sums to more than 1 and that of a reflection does not. The sum exceeds 1, because the best order
// reaches at least the mean of all orders: a third of the sum of all magnitudes, which is at least 1.
Axes in_link_order(const Axes& axes) {
  std::array<int, 3> order = {0, 1, 2}, best = order;
  double nearest = -1;
  do {
    const double near = std::fabs(axes(0, order[0])) + std::fabs(axes(1, order[1])) + std::fabs(axes(2, order[2]));
    if (near > nearest) {
      nearest = near;
      best = order;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  Axes out;
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = axes.col(best[static_cast<std::size_t>(k)]);
    out.col(k) = axis[k] < 0 ? Vector3d(-axis) : axis;
  }
  return out;
}

// The box along the given axes about all vertices. Its numbers are floats, and it contains the vertices exactly.
Box box_about(Span<const float> vertices, const Axes& axes) {
  Box box = {};
  Axes rounded;
  for (int k = 0; k < 3; ++k) {
    for (int c = 0; c < 3; ++c) {
      box.axis[k][c] = std::fabs(axes(c, k)) < kZeroComponent ? 0.0f : static_cast<float>(axes(c, k));
      rounded(c, k) = static_cast<double>(box.axis[k][c]);
    }
  }
  // A vertex is center + sum x_k axis_k, and x_k is its product with row k. Products of floats are exact in double. So
  // entries of the cross products are exact to one rounding, zeros included, and the determinant (about 1) to 12.
  Eigen::Matrix3d dual;
  for (int k = 0; k < 3; ++k) dual.row(k) = rounded.col((k + 1) % 3).cross(rounded.col((k + 2) % 3));
  dual /= rounded.col(0).dot(dual.row(0));

  Vector3d low = dual * vertex_at(vertices, 0), high = low;
  for (std::size_t v = 3; v < vertices.size; v += 3) {
    const Vector3d at = dual * vertex_at(vertices, v);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Vector3d middle = rounded * (0.5 * low + 0.5 * high);
  Vector3d center;
  for (int c = 0; c < 3; ++c) {
    box.center[c] = static_cast<float>(middle[c]);
    center[c] = static_cast<double>(box.center[c]);
  }
  Vector3d half = Vector3d::Zero();
  for (std::size_t v = 0; v < vertices.size; v += 3) {
    const Vector3d offset = vertex_at(vertices, v) - center;
    half = half.cwiseMax((dual * offset).cwiseAbs() + kFitPad * (dual.cwiseAbs() * offset.cwiseAbs()));
  }
  for (int k = 0; k < 3; ++k) box.half[k] = rounded_up(half[k]);
  return box;
}

bool in_range(const Box& box) {
  const auto small = [](float value) { return std::fabs(value) <= kMaxCoordinate; };
  return std::all_of(box.center, box.center + 3, small) && std::all_of(box.half, box.half + 3, small);
}

}  // namespace

Status fit_box_to_vertices(Span<const float> vertices, Box* out) {
  if (!out) return Status::kBadOutput;
  if (!vertices.data || vertices.size == 0 || vertices.size % 3 != 0) return Status::kBadVertices;
  for (std::size_t i = 0; i < vertices.size; ++i)
    if (!(std::fabs(vertices[i]) <= kMaxCoordinate)) return Status::kBadVertices;

  Box box = box_about(vertices, in_link_order(axes_for(extremes_of(vertices))));
  if (!in_range(box)) {
    // Along the link's axes no vertex is further than kMaxCoordinate from the centre; only the padding goes beyond.
    box = box_about(vertices, Axes::Identity());
    for (float& half : box.half) half = std::min(half, kMaxCoordinate);
  }
  *out = box;
  return Status::kOk;
}

}  // namespace cab
