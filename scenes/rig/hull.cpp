// Convex hulls of points: one point at a time, the farthest one first.
#include "scenes/rig/hull.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::scenes {
namespace {

// Shares of the points' extent. Points that are closer to a face than the first are inside. Points are in one plane if
// the tetrahedron about them is thinner than the second.
constexpr double kOnFace = 1e-9;
constexpr double kFlat = 1e-6;
// The enlargement that covers the rounding of vertices to float. Worst is 2^-24 of the coordinates.
constexpr double kRoundingMargin = 0x1p-20;

struct Face {
  std::array<std::uint32_t, 3> corners;
  Plane plane;
  std::vector<std::uint32_t> outside;  // points above the plane, each in the list of one face
  std::uint32_t farthest = 0;          // of the points outside
  double height = 0;                   // of the farthest point above the plane
};

double above(const Plane& plane, const Vec3& point) { return dot(plane.normal, point) - plane.offset; }

Face make_face(const std::vector<Vec3>& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Face face;
  face.corners = {a, b, c};
  const Vec3 normal = cross(points[b] - points[a], points[c] - points[a]);
  const double size = length(normal);
  if (size > 0) face.plane.normal = (1 / size) * normal;
  // The highest corner, so that no corner is above its own face.
  face.plane.offset = std::max(
      {dot(face.plane.normal, points[a]), dot(face.plane.normal, points[b]), dot(face.plane.normal, points[c])});
  return face;
}

// Puts each point into the list of the first face that it is above.
void share_out(const std::vector<Vec3>& points, const std::vector<std::uint32_t>& open, double least,
               Face* const first_face, Face* const end_face) {
  for (const std::uint32_t p : open) {
    for (Face* face = first_face; face != end_face; ++face) {
      const double height = above(face->plane, points[p]);
      if (height <= least) continue;
      face->outside.push_back(p);
      if (height > face->height) {
        face->height = height;
        face->farthest = p;
      }
      break;
    }
  }
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

// The border of a part of the faces that has no hole: from each corner on it to the next, counter-clockwise.
using Border = std::vector<std::array<std::uint32_t, 2>>;

Border::iterator edge_from(Border& border, std::uint32_t corner) {
  return std::find_if(border.begin(), border.end(), [corner](const auto& edge) { return edge[0] == corner; });
}

bool has_edge(const Border& border, std::uint32_t from, std::uint32_t to) {
  return std::find(border.begin(), border.end(), std::array{from, to}) != border.end();
}

// Adds a face to the part if it is beside it and leaves it without a hole. Returns whether it did.
bool add_face(const std::array<std::uint32_t, 3>& corners, Border& border) {
  std::array<bool, 3> shared;  // the edge from this corner on
  for (std::size_t k = 0; k < 3; ++k) shared[k] = has_edge(border, corners[(k + 1) % 3], corners[k]);
  const auto count = std::count(shared.begin(), shared.end(), true);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t a = corners[k], b = corners[(k + 1) % 3], c = corners[(k + 2) % 3];
    if (count == 1 && shared[k] && edge_from(border, c) == border.end()) {
      (*edge_from(border, b))[1] = c;
      border.push_back({c, a});
      return true;
    }
    if (count == 2 && shared[k] && shared[(k + 1) % 3]) {
      (*edge_from(border, c))[1] = a;
      border.erase(edge_from(border, b));
      return true;
    }
  }
  return false;
}

// Replaces the faces that a point is above by faces from their border to the point. The first of them is given. By
// rounding the point may be above others that are no part without a hole together with it. Those stay, or else an edge
// would get more than two faces, and the next points ever more.
void add_point(const std::vector<Vec3>& points, std::uint32_t point, std::size_t first, double least,
               std::vector<Face>& faces) {
  std::vector<std::size_t> waiting;
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (f != first && above(faces[f].plane, points[point]) > least) waiting.push_back(f);
  const auto [a, b, c] = faces[first].corners;
  Border border = {{a, b}, {b, c}, {c, a}};
  std::vector<bool> goes(faces.size(), false);
  goes[first] = true;
  for (std::size_t before = waiting.size() + 1; waiting.size() < before;) {
    before = waiting.size();
    for (const std::size_t f : waiting) goes[f] = add_face(faces[f].corners, border);
    waiting.erase(std::remove_if(waiting.begin(), waiting.end(), [&](std::size_t f) { return goes[f]; }),
                  waiting.end());
  }
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> open;
  std::vector<Face> kept;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Face& face = faces[f];
    if (!goes[f]) {
      kept.push_back(std::move(face));
      continue;
    }
    open.insert(open.end(), face.outside.begin(), face.outside.end());
    for (std::size_t k = 0; k < 3; ++k) edges.push_back({face.corners[k], face.corners[(k + 1) % 3]});
  }
  const std::size_t kept_count = kept.size();
  for (const auto& [from, to] : edges)
    if (has_edge(border, from, to)) kept.push_back(make_face(points, from, to, point));
  open.erase(std::remove(open.begin(), open.end(), point), open.end());
  share_out(points, open, least, kept.data() + kept_count, kept.data() + kept.size());
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
  const double least = kOnFace * length(points[b] - points[a]);
  std::vector<Face> faces = {make_face(points, a, b, c), make_face(points, a, d, b), make_face(points, b, d, c),
                             make_face(points, c, d, a)};
  std::vector<std::uint32_t> open(points.size());
  for (std::uint32_t p = 0; p < points.size(); ++p) open[p] = p;
  share_out(points, open, least, faces.data(), faces.data() + faces.size());
  for (std::size_t taken = 4; taken < max_vertices; ++taken) {
    const auto highest =
        std::max_element(faces.begin(), faces.end(), [](const Face& f, const Face& g) { return f.height < g.height; });
    if (highest->outside.empty()) break;
    add_point(points, highest->farthest, static_cast<std::size_t>(highest - faces.begin()), least, faces);
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
