// Triangles of a mesh's polygons, by cutting ears (Meisters 1975, "Polygons have ears").
#include "scenes/import/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace cab::scenes {
namespace {

using Point = std::array<double, 2>;

// The work of cutting grows with the square of the corners, and more for crafted ones. A polygon of more is a fan.
constexpr std::size_t kMostCutCorners = 4096;

// The corners seen along the axis that is nearest to the polygon's normal (Newell), so that they turn left.
std::vector<Point> projected(const std::vector<Vec3>& polygon) {
  Vec3 normal = {0, 0, 0};
  for (std::size_t k = 2; k < polygon.size(); ++k)
    normal = normal + cross(polygon[k - 1] - polygon[0], polygon[k] - polygon[0]);
  std::size_t axis = 0;
  for (const std::size_t k : {1u, 2u})
    if (std::fabs(normal[k]) > std::fabs(normal[axis])) axis = k;
  std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Point> points;
  for (const Vec3& corner : polygon) points.push_back({corner[u], corner[v]});
  return points;
}

// Above 0 if the way from a over b to c turns left.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// What is left of a polygon.
class Ring {
 public:
  explicit Ring(const std::vector<Vec3>& polygon) : points_(projected(polygon)), corners_(polygon.size()) {
    std::iota(corners_.begin(), corners_.end(), 0u);
  }

  bool is_convex() const {
    for (std::size_t k = 0; k < corners_.size(); ++k)
      if (!(turn(before(k), at(k), after(k)) >= 0)) return false;
    return true;
  }

  // Moves ears to `triangles` until three corners are left, or no ear.
  void cut_ears(std::vector<std::uint32_t>& triangles) {
    for (std::size_t k = 0, passed = 0; corners_.size() > 3 && passed < corners_.size();) {
      if (is_ear(k)) {
        triangles.insert(triangles.end(), {corners_[left_of(k)], corners_[k], corners_[right_of(k)]});
        corners_.erase(corners_.begin() + static_cast<std::ptrdiff_t>(k));
        passed = 0;
      } else {
        ++k, ++passed;
      }
      if (k == corners_.size()) k = 0;
    }
  }

  const std::vector<std::uint32_t>& corners() const { return corners_; }

 private:
  std::size_t left_of(std::size_t k) const { return (k == 0 ? corners_.size() : k) - 1; }
  std::size_t right_of(std::size_t k) const { return k + 1 == corners_.size() ? 0 : k + 1; }
  const Point& at(std::size_t k) const { return points_[corners_[k]]; }
  const Point& before(std::size_t k) const { return at(left_of(k)); }
  const Point& after(std::size_t k) const { return at(right_of(k)); }

  // Whether the triangle of a corner and its neighbours turns left and has no other corner in it or on its edges. A
  // corner at the place of one of these three, where a hole is joined to the outline, is none.
  bool is_ear(std::size_t k) const {
    const Point &a = before(k), &b = at(k), &c = after(k);
    if (!(turn(a, b, c) > 0)) return false;
    return std::none_of(corners_.begin(), corners_.end(), [&](std::uint32_t corner) {
      const Point& p = points_[corner];
      return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
  }

  std::vector<Point> points_;
  std::vector<std::uint32_t> corners_;
};

void add_fan(const std::vector<std::uint32_t>& corners, std::vector<std::uint32_t>& triangles) {
  for (std::size_t k = 2; k < corners.size(); ++k)
    triangles.insert(triangles.end(), {corners[0], corners[k - 1], corners[k]});
}

}  // namespace

// Whichever ears are cut, the areas of the triangles, with their signs, add up to that of the polygon at each point: no
// point that the outline goes around is left out.
void cut_polygon(const std::vector<Vec3>& polygon, std::vector<std::uint32_t>& triangles) {
  if (polygon.size() < 3) return;
  if (polygon.size() == 3) {
    triangles.insert(triangles.end(), {0u, 1u, 2u});
    return;
  }
  Ring ring(polygon);
  if (polygon.size() <= kMostCutCorners && !ring.is_convex()) ring.cut_ears(triangles);
  add_fan(ring.corners(), triangles);
}

}  // namespace cab::scenes
