// Convex hulls of points: one point at a time, the farthest one first.
#include "scenes/rig/hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::scenes {
namespace {

// Shares of the longest side of the points' bounding box. Points that are closer to the hull than the first are left
// out. Points are in one plane if the tetrahedron about them is thinner than the second.
constexpr double kOnFace = 1e-9;
constexpr double kFlat = 1e-6;
// The enlargement that covers the rounding of vertices to float. Worst is 2^-24 of the coordinates.
constexpr double kRoundingMargin = 0x1p-20;
// Whether a point is above a face is decided on a grid of at most 2^38 steps along a side, in integers. A coordinate is
// two digits of 19 bits: so no sum is above 2^62. A step is below 2^-37 of the longest side, and half the diagonal of a
// cell, by which a point moves, below 6.4e-12.
constexpr int kDigitBits = 19;
constexpr std::int64_t kDigitMask = (1 << kDigitBits) - 1;

constexpr double kNone = -std::numeric_limits<double>::infinity();

using Integer3 = std::array<std::int64_t, 3>;

struct GridPoint {
  Integer3 high, low;  // the coordinates are high 2^19 + low
};

Integer3 minus(const Integer3& a, const Integer3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
GridPoint minus(const GridPoint& a, const GridPoint& b) { return {minus(a.high, b.high), minus(a.low, b.low)}; }
std::int64_t product(const Integer3& a, const Integer3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Adds the cross product.
void add_cross(const Integer3& a, const Integer3& b, Integer3& sum) {
  for (std::size_t k = 0; k < 3; ++k) sum[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

struct Points {
  const std::vector<Vec3>& exact;
  std::vector<GridPoint> grid;
  double least;  // those that are closer to the hull are left out
};

struct Face {
  std::array<std::uint32_t, 3> corners;
  Plane plane;
  GridPoint origin;                     // the first corner
  std::array<Integer3, 3> normal = {};  // on the grid: normal[0] + normal[1] 2^19 + normal[2] 2^38
  std::vector<std::uint32_t> outside;   // points above the face, each in the list of one face
  std::uint32_t farthest = 0;           // of the points outside
  double height = kNone;                // of the farthest point above the plane
};

double above(const Plane& plane, const Vec3& point) { return dot(plane.normal, point) - plane.offset; }

// Whether a point is above a face on the grid. Without rounding, the faces that a point is above are one part of the
// hull, without a hole.
bool is_above(const Face& face, const GridPoint& point) {
  const auto& [low, middle, high] = face.normal;
  const GridPoint from = minus(point, face.origin);
  const std::int64_t digits[] = {product(low, from.low), product(low, from.high) + product(middle, from.low),
                                 product(middle, from.high) + product(high, from.low)};
  std::int64_t carry = 0, rest = 0;
  for (const std::int64_t digit : digits) {
    rest |= (digit + carry) & kDigitMask;
    carry = (digit + carry) >> kDigitBits;
  }
  const std::int64_t top = product(high, from.high) + carry;
  return top > 0 || (top == 0 && rest != 0);
}

Face make_face(const Points& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Face face;
  face.corners = {a, b, c};
  const Vec3 &pa = points.exact[a], &pb = points.exact[b], &pc = points.exact[c];
  const Vec3 normal = cross(pb - pa, pc - pa);
  const double size = length(normal);
  if (size > 0) face.plane.normal = (1 / size) * normal;
  // The highest corner, so that no corner is above its own face.
  face.plane.offset = std::max({dot(face.plane.normal, pa), dot(face.plane.normal, pb), dot(face.plane.normal, pc)});
  face.origin = points.grid[a];
  const GridPoint u = minus(points.grid[b], face.origin), v = minus(points.grid[c], face.origin);
  add_cross(u.low, v.low, face.normal[0]);
  add_cross(u.low, v.high, face.normal[1]);
  add_cross(u.high, v.low, face.normal[1]);
  add_cross(u.high, v.high, face.normal[2]);
  return face;
}

void put_outside(std::uint32_t point, double height, Face& face) {
  face.outside.push_back(point);
  if (height > face.height) {
    face.height = height;
    face.farthest = point;
  }
}

// Puts each point into the list of the first face that it is well above, or else among the doubtful ones if it is above
// any. The others are inside: a point that was above a face instead of these is above one of these, or inside.
void share_out(const Points& points, const std::vector<std::uint32_t>& open, Face* const first_face,
               Face* const end_face, std::vector<std::uint32_t>& doubtful) {
  for (const std::uint32_t p : open) {
    bool doubt = false;
    for (Face* face = first_face; face != end_face; ++face) {
      if (!is_above(*face, points.grid[p])) continue;
      const double height = above(face->plane, points.exact[p]);
      doubt = height <= points.least;
      if (doubt) continue;
      put_outside(p, height, *face);
      break;
    }
    if (doubt) doubtful.push_back(p);
  }
}

// Puts each doubtful point that is not at the hull into the list of the face that it is highest above. Hardly above one
// face, a point may still be a corner far beyond the next one.
void settle(const Points& points, std::vector<std::uint32_t>& doubtful, std::vector<Face>& faces) {
  for (const std::uint32_t p : doubtful) {
    const Vec3& point = points.exact[p];
    Face* highest = nullptr;
    double most = kNone;
    for (Face& face : faces) {
      const double height = above(face.plane, point);
      const auto& [a, b, c] = face.corners;
      if (std::fabs(height) <= points.least &&
          distance_to_triangle(point, {points.exact[a], points.exact[b], points.exact[c]}) <= points.least) {
        highest = nullptr;
        break;
      }
      if (height > most && is_above(face, points.grid[p])) most = height, highest = &face;
    }
    if (highest) put_outside(p, most, *highest);
  }
  doubtful.clear();
}

// The points with a grid that is as fine as their extent allows.
Points on_grid(const std::vector<Vec3>& points) {
  Vec3 lowest = points[0];
  for (const Vec3& point : points)
    for (std::size_t k = 0; k < 3; ++k) lowest[k] = std::min(lowest[k], point[k]);
  double extent = 0;
  for (const Vec3& point : points)
    for (std::size_t k = 0; k < 3; ++k) extent = std::max(extent, point[k] - lowest[k]);
  int exponent = 0;
  std::frexp(extent, &exponent);
  std::vector<GridPoint> grid(points.size());
  for (std::size_t p = 0; p < points.size(); ++p)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto step = std::llround(std::ldexp(points[p][k] - lowest[k], 2 * kDigitBits - exponent));
      grid[p].high[k] = step >> kDigitBits;
      grid[p].low[k] = step & kDigitMask;
    }
  return {points, std::move(grid), kOnFace * extent};
}

// Four points of a large tetrahedron: the two ends of the longest extent, the point farthest from their line, and the
// point farthest from the plane of the three. Empty if the points are in one plane.
std::vector<std::uint32_t> first_corners(const std::vector<Vec3>& points) {
  const auto argmax = [&](const auto& value) {
    std::uint32_t best = 0;
    for (std::uint32_t p = 1; p < points.size(); ++p)
      if (value(points[p]) > value(points[best])) best = p;
    return best;
  };
  std::uint32_t a = 0, b = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t low = argmax([&](const Vec3& p) { return -p[k]; });
    const std::uint32_t high = argmax([&](const Vec3& p) { return p[k]; });
    if (length(points[high] - points[low]) > length(points[b] - points[a])) a = low, b = high;
  }
  const Vec3 line = points[b] - points[a];
  const double extent = length(line);
  if (!(extent > 0)) return {};
  const std::uint32_t c = argmax([&](const Vec3& p) { return length(cross(line, p - points[a])); });
  const Vec3 normal = cross(line, points[c] - points[a]);
  if (!(length(normal) > kFlat * extent * extent)) return {};
  const std::uint32_t d = argmax([&](const Vec3& p) { return std::fabs(dot(normal, p - points[a])); });
  const double side = dot(normal, points[d] - points[a]);
  if (!(std::fabs(side) > kFlat * extent * length(normal))) return {};
  // The fourth corner is below the triangle of the first three.
  return side < 0 ? std::vector<std::uint32_t>{a, b, c, d} : std::vector<std::uint32_t>{a, c, b, d};
}

// Replaces the faces that a point is above by faces from their border to the point.
void add_point(const Points& points, std::uint32_t point, std::vector<Face>& faces,
               std::vector<std::uint32_t>& doubtful) {
  std::vector<std::array<std::uint32_t, 2>> edges, turned;
  std::vector<std::uint32_t> open;
  std::vector<Face> kept;
  for (Face& face : faces) {
    if (!is_above(face, points.grid[point])) {
      kept.push_back(std::move(face));
      continue;
    }
    open.insert(open.end(), face.outside.begin(), face.outside.end());
    for (std::size_t k = 0; k < 3; ++k) {
      edges.push_back({face.corners[k], face.corners[(k + 1) % 3]});
      turned.push_back({face.corners[(k + 1) % 3], face.corners[k]});
    }
  }
  const std::size_t kept_count = kept.size();
  std::sort(turned.begin(), turned.end());
  for (const auto& edge : edges)
    if (!std::binary_search(turned.begin(), turned.end(), edge))
      kept.push_back(make_face(points, edge[0], edge[1], point));
  open.erase(std::remove(open.begin(), open.end(), point), open.end());
  share_out(points, open, kept.data() + kept_count, kept.data() + kept.size(), doubtful);
  faces = std::move(kept);
}

Hull finished(const std::vector<Vec3>& points, const std::vector<Face>& faces) {
  Hull hull;
  std::vector<std::uint32_t> index(points.size(), std::numeric_limits<std::uint32_t>::max());
  for (const Face& face : faces) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = index[face.corners[k]];
      if (vertex == std::numeric_limits<std::uint32_t>::max()) {
        vertex = static_cast<std::uint32_t>(hull.vertices.size());
        hull.vertices.push_back(points[face.corners[k]]);
      }
      corners[k] = vertex;
    }
    hull.faces.push_back(corners);
    hull.planes.push_back(face.plane);
  }
  // The normal of a sliver is inexact. No plane may cut the hull for that.
  for (Plane& plane : hull.planes)
    for (const Vec3& vertex : hull.vertices) plane.offset = std::max(plane.offset, dot(plane.normal, vertex));
  for (const auto& [a, b, c] : hull.faces) {
    const Vec3& origin = hull.vertices[0];
    hull.volume += dot(hull.vertices[a] - origin, cross(hull.vertices[b] - origin, hull.vertices[c] - origin)) / 6;
  }
  return hull;
}

}  // namespace

Hull convex_hull(const std::vector<Vec3>& points, std::size_t max_vertices) {
  if (points.empty()) return {};
  const std::vector<std::uint32_t> corners = first_corners(points);
  if (corners.empty()) return {};
  const auto [a, b, c, d] = std::array{corners[0], corners[1], corners[2], corners[3]};
  const Points all = on_grid(points);
  std::vector<Face> faces = {make_face(all, a, b, c), make_face(all, a, d, b), make_face(all, b, d, c),
                             make_face(all, c, d, a)};
  std::vector<std::uint32_t> open(points.size()), doubtful;
  for (std::uint32_t p = 0; p < points.size(); ++p) open[p] = p;
  share_out(all, open, faces.data(), faces.data() + faces.size(), doubtful);
  const auto highest = [&faces] {
    return std::max_element(faces.begin(), faces.end(),
                            [](const Face& f, const Face& g) { return f.height < g.height; });
  };
  for (std::size_t taken = 4; taken < max_vertices; ++taken) {
    if (highest()->outside.empty()) settle(all, doubtful, faces);
    if (highest()->outside.empty()) break;
    add_point(all, highest()->farthest, faces, doubtful);
  }
  return finished(points, faces);
}

Hull enclosing_hull(const std::vector<Vec3>& points, std::size_t max_vertices) {
  Hull hull = convex_hull(points, max_vertices);
  if (hull.faces.empty()) return hull;
  Vec3 centre = {0, 0, 0};
  for (const Vec3& vertex : hull.vertices) centre = centre + (1.0 / static_cast<double>(hull.vertices.size())) * vertex;
  double scale = 1;
  for (const Plane& plane : hull.planes) {
    double highest = plane.offset;
    for (const Vec3& point : points) highest = std::max(highest, dot(plane.normal, point));
    const double from_centre = plane.offset - dot(plane.normal, centre);
    if (from_centre > 0) scale = std::max(scale, 1 + (highest - plane.offset) / from_centre);
  }
  scale *= 1 + kRoundingMargin;
  std::vector<Vec3> vertices;
  for (const Vec3& vertex : hull.vertices) {
    Vec3 moved = centre + scale * (vertex - centre);
    for (double& component : moved) component = static_cast<double>(static_cast<float>(component));
    vertices.push_back(moved);
  }
  return convex_hull(vertices, vertices.size());
}

double distance_to_triangle(const Vec3& point, const std::array<Vec3, 3>& corners) {
  const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  bool over_triangle = dot(normal, normal) > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 edge = corners[(k + 1) % 3] - corners[k];
    const Vec3 from = point - corners[k];
    over_triangle = over_triangle && dot(cross(normal, edge), from) >= 0;
    const double along = dot(edge, edge) > 0 ? std::clamp(dot(from, edge) / dot(edge, edge), 0.0, 1.0) : 0;
    nearest = std::min(nearest, length(from - along * edge));
  }
  return over_triangle ? std::fabs(dot(normal, point - corners[0])) / length(normal) : nearest;
}

}  // namespace cab::scenes
