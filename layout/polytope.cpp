#include "layout/polytope.h"

#include "layout/arena.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cab {
namespace {

using Double3 = std::array<double, 3>;

// Rounding of what is computed from vertices of size 1: points are in a plane within kInPlane, and faces whose normals
// differ by less than kSamePlane are one.
constexpr double kInPlane = 1e-12, kSamePlane = 1e-6;

// A cosine below which two normals of an edge get a face between them.
constexpr double kFarNormals = -0.5;

Double3 operator-(const Double3& a, const Double3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Double3 operator*(double s, const Double3& v) { return {s * v[0], s * v[1], s * v[2]}; }
double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Double3 cross(const Double3& a, const Double3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double length(const Double3& v) { return std::sqrt(dot(v, v)); }
Double3 unit(const Double3& v) { return (1 / length(v)) * v; }

// A face of the hull while it grows: counterclockwise seen from outside.
struct Triangle {
  std::array<std::uint32_t, 3> vertex;
  Double3 normal;
  double area;
  bool is_gone = false;
};

// The faces and edges of points, before they are counted and written.
class Builder {
 public:
  explicit Builder(Span<const double> vertices) {
    for (std::size_t v = 0; v + 2 < vertices.size; v += 3)
      points_.push_back({vertices[v], vertices[v + 1], vertices[v + 2]});
    spread();
  }

  // Returns whether there is a polytope.
  bool build() {
    std::uint32_t first[4];
    const int dimensions = find_first(first);
    if (dimensions == 2) {
      build_flat(first);
      return faces_.size() <= kMostFaces;
    }
    return dimensions == 3 && grow(first) && join_faces() && faces_.size() <= kMostFaces && edges_.size() <= kMostEdges;
  }

  const Polytope* write(Arena& arena) const {
    const auto count = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
    const std::uint32_t vertex_count = count(points_), face_count = count(faces_);
    const std::uint32_t vertices = padded_for_lanes(vertex_count), faces = padded_for_lanes(face_count);
    // One block: a level has many triangles, and each block costs as much as what is written here for one.
    constexpr std::size_t kHead = 64;  // as the arena aligns; what is padded for lanes keeps that
    static_assert(sizeof(Polytope) <= kHead);
    std::byte* next = arena
                          .allocate<std::byte>(kHead + (3 * vertices + 8 * faces) * sizeof(float) +
                                               3 * (vertex_count + face_count) * sizeof(double) +
                                               edges_.size() * sizeof(PolytopeEdge))
                          .data;
    const auto take = [&next](auto* none, std::size_t length) {
      auto* const taken = reinterpret_cast<decltype(none)>(next);
      next += length * sizeof *none;
      return taken;
    };
    Polytope& out = *reinterpret_cast<Polytope*>(take(static_cast<std::byte*>(nullptr), kHead));
    out.vertex_count = vertex_count;
    out.face_count = face_count;
    out.edge_count = count(edges_);
    float* const vertex = take(static_cast<float*>(nullptr), 3 * vertices);
    float* const face = take(static_cast<float*>(nullptr), 8 * faces);
    double* const exact_vertex = take(static_cast<double*>(nullptr), 3 * vertex_count);
    double* const exact_normal = take(static_cast<double*>(nullptr), 3 * face_count);
    PolytopeEdge* const edge = take(static_cast<PolytopeEdge*>(nullptr), edges_.size());
    std::copy(edges_.begin(), edges_.end(), edge);
    const std::vector<Arc> arcs = half_arcs();
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::uint32_t i = 0; i < vertices; ++i)
        vertex[c * vertices + i] = static_cast<float>(points_[std::min(i, out.vertex_count - 1)][c]);
      for (std::uint32_t i = 0; i < faces; ++i) {
        const std::uint32_t f = std::min(i, out.face_count - 1);
        face[c * faces + i] = static_cast<float>(faces_[f].normal[c]);
        face[(3 + c) * faces + i] = static_cast<float>(points_[faces_[f].vertex][c]);
        if (c < 2) face[(6 + c) * faces + i] = c == 0 ? arcs[f].cosine : arcs[f].sine;
      }
      for (std::uint32_t i = 0; i < out.vertex_count; ++i) exact_vertex[3 * i + c] = points_[i][c];
      for (std::uint32_t i = 0; i < out.face_count; ++i) exact_normal[3 * i + c] = faces_[i].normal[c];
    }
    out.vertices = vertex;
    out.faces = face;
    out.edges = edge;
    out.exact_vertices = exact_vertex;
    out.exact_normals = exact_normal;
    return &out;
  }

 private:
  struct Arc {
    float cosine, sine;
  };

  // For each face half of the longest arc of its edges, a little more.
  std::vector<Arc> half_arcs() const {
    std::vector<double> longest(faces_.size(), 0);
    for (const PolytopeEdge& edge : edges_) {
      const double cosine = dot(faces_[edge.face[0]].normal, faces_[edge.face[1]].normal);
      const double half = std::acos(std::clamp(cosine, -1.0, 1.0)) / 2 + kSamePlane;
      for (const std::uint16_t face : edge.face) longest[face] = std::max(longest[face], half);
    }
    std::vector<Arc> out;
    for (const double half : longest)
      out.push_back({static_cast<float>(std::cos(half)), static_cast<float>(std::sin(half))});
    return out;
  }

  struct Face {
    Double3 normal;
    std::uint32_t vertex;
  };

  // Puts points to the front that are far from each other: each is the farthest from those before it.
  void spread() {
    std::vector<double> away(points_.size(), std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < std::min<std::size_t>(kSpreadVertices, points_.size()); ++i) {
      const auto next = std::max_element(away.begin() + static_cast<std::ptrdiff_t>(i), away.end()) - away.begin();
      std::swap(points_[i], points_[static_cast<std::size_t>(next)]);
      std::swap(away[i], away[static_cast<std::size_t>(next)]);
      for (std::size_t k = i + 1; k < points_.size(); ++k) away[k] = std::min(away[k], length(points_[k] - points_[i]));
    }
  }

  // The point with the greatest of a measure.
  template <class Measure>
  std::uint32_t farthest(Measure measure) const {
    std::uint32_t out = 0;
    for (std::uint32_t i = 1; i < points_.size(); ++i)
      if (measure(points_[i]) > measure(points_[out])) out = i;
    return out;
  }

  // Writes the first vertices, as far apart as they can be found. Returns of how many dimensions the points are.
  int find_first(std::uint32_t (&out)[4]) const {
    if (points_.size() < 3) return 0;
    out[0] = 0;
    const Double3& origin = points_[0];
    out[1] = farthest([&](const Double3& p) { return length(p - origin); });
    const Double3 x = points_[out[1]] - origin;
    if (!(length(x) > kInPlane)) return 0;
    const Double3 along = unit(x);
    out[2] = farthest([&](const Double3& p) { return length(cross(along, p - origin)); });
    const Double3 normal = cross(along, points_[out[2]] - origin);
    if (!(length(normal) > kInPlane)) return 1;
    const Double3 up = unit(normal);
    out[3] = farthest([&](const Double3& p) { return std::fabs(dot(up, p - origin)); });
    return std::fabs(dot(up, points_[out[3]] - origin)) > kInPlane ? 3 : 2;
  }

  void add_edge(std::uint32_t a, std::uint32_t b, std::size_t face_a, std::size_t face_b) {
    const Double3 along = unit(points_[b] - points_[a]);
    PolytopeEdge edge = {{static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b)},
                         {static_cast<std::uint16_t>(face_a), static_cast<std::uint16_t>(face_b)},
                         {}};
    for (std::size_t c = 0; c < 3; ++c) edge.direction[c] = static_cast<float>(along[c]);
    edges_.push_back(edge);
  }

  // The same with a face between the two, along `between`.
  void add_two_edges(std::uint32_t a, std::uint32_t b, std::size_t face_a, std::size_t face_b, const Double3& between) {
    faces_.push_back({between, a});
    add_edge(a, b, face_a, faces_.size() - 1);
    add_edge(a, b, faces_.size() - 1, face_b);
  }

  // The vertices of a polygon by the method of Andrew 1979: sorted along one axis, then two chains.
  void build_flat(const std::uint32_t (&first)[4]) {
    const Double3 x = unit(points_[first[1]] - points_[first[0]]);
    const Double3 normal = unit(cross(x, points_[first[2]] - points_[first[0]])), y = cross(normal, x);
    std::vector<std::uint32_t> order(points_.size()), chain;
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto place = [&](std::uint32_t i) {
      return std::array<double, 2>{dot(x, points_[i] - points_[first[0]]), dot(y, points_[i] - points_[first[0]])};
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
    const auto is_left = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      const auto p = place(a), q = place(b), r = place(c);
      return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) > kInPlane;
    };
    for (int half = 0; half < 2; ++half) {
      const std::size_t begin = chain.size();
      for (const std::uint32_t i : order) {
        while (chain.size() > begin + 1 && !is_left(chain[chain.size() - 2], chain.back(), i)) chain.pop_back();
        chain.push_back(i);
      }
      chain.pop_back();
      std::reverse(order.begin(), order.end());
    }
    faces_ = {{normal, first[0]}, {-1.0 * normal, first[0]}};
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const std::uint32_t a = chain[i], b = chain[(i + 1) % chain.size()];
      add_two_edges(a, b, 0, 1, unit(cross(points_[b] - points_[a], normal)));
    }
  }

  bool add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Double3 normal = cross(points_[b] - points_[a], points_[c] - points_[a]);
    const double area = length(normal);
    if (!(area > 0)) return false;
    const auto index = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back({{a, b, c}, (1 / area) * normal, area});
    for (std::uint32_t k = 0; k < 3; ++k) {
      std::uint32_t& of = beside(triangles_.back().vertex[k], triangles_.back().vertex[(k + 1) % 3]);
      if (of != kNone) return false;
      of = index;
    }
    return true;
  }

  // The triangle to the left of the way from one vertex to another.
  std::uint32_t& beside(std::uint32_t from, std::uint32_t to) { return beside_[from * points_.size() + to]; }

  // The hull of all points, one after the other (Clarkson and Shor 1989, without their sets of conflicts). Returns
  // false if rounding leaves open which faces a point sees.
  bool grow(const std::uint32_t (&first)[4]) {
    beside_.assign(points_.size() * points_.size(), kNone);
    std::uint32_t a = first[0], b = first[1];
    const std::uint32_t c = first[2], d = first[3];
    if (dot(cross(points_[b] - points_[a], points_[c] - points_[a]), points_[d] - points_[a]) > 0) std::swap(a, b);
    if (!add_triangle(a, b, c) || !add_triangle(a, d, b) || !add_triangle(b, d, c) || !add_triangle(c, d, a))
      return false;
    for (std::uint32_t p = 0; p < points_.size(); ++p)
      if (!add_point(p)) return false;
    // No point may be beyond any face.
    for (const Triangle& triangle : triangles_)
      for (const Double3& point : points_)
        if (!triangle.is_gone && dot(triangle.normal, point - points_[triangle.vertex[0]]) > kSamePlane) return false;
    return true;
  }

  bool add_point(std::uint32_t p) {
    std::vector<std::uint32_t> seen;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (!triangles_[t].is_gone && dot(triangles_[t].normal, points_[p] - points_[triangles_[t].vertex[0]]) > kInPlane)
        seen.push_back(t);
    if (seen.empty()) return true;
    for (const std::uint32_t t : seen) triangles_[t].is_gone = true;
    std::vector<std::array<std::uint32_t, 2>> rim;
    for (const std::uint32_t t : seen)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t from = triangles_[t].vertex[k], to = triangles_[t].vertex[(k + 1) % 3];
        if (!triangles_[beside(to, from)].is_gone) rim.push_back({from, to});
      }
    for (const std::uint32_t t : seen)
      for (std::uint32_t k = 0; k < 3; ++k) beside(triangles_[t].vertex[k], triangles_[t].vertex[(k + 1) % 3]) = kNone;
    for (const auto& edge : rim)
      if (!add_triangle(edge[0], edge[1], p)) return false;
    // The rim is closed if every new triangle has its neighbours.
    for (const auto& edge : rim)
      if (beside(p, edge[1]) == kNone || beside(edge[0], p) == kNone) return false;
    return true;
  }

  // Makes one face of the triangles in the same plane, and edges of those between two faces. Returns false if the
  // triangles are no closed surface.
  bool join_faces() {
    std::vector<std::uint32_t> root(triangles_.size());
    for (std::uint32_t t = 0; t < root.size(); ++t) root[t] = t;
    const auto find = [&](std::uint32_t t) {
      while (root[t] != t) t = root[t];
      return t;
    };
    std::size_t triangle_count = 0;
    const auto for_each_edge = [&](auto visit) {
      for (std::uint32_t a = 0; a < points_.size(); ++a)
        for (std::uint32_t b = a + 1; b < points_.size(); ++b)
          if (beside(a, b) != kNone && beside(b, a) != kNone) visit(a, b, beside(a, b), beside(b, a));
    };
    std::size_t edge_count = 0;
    for_each_edge([&](std::uint32_t, std::uint32_t, std::uint32_t s, std::uint32_t t) {
      ++edge_count;
      s = find(s);
      t = find(t);
      if (length(triangles_[s].normal - triangles_[t].normal) > kSamePlane) return;
      if (triangles_[s].area < triangles_[t].area) std::swap(s, t);
      root[t] = s;  // the largest triangle says how the face lies
    });
    std::vector<std::uint32_t> face_of(triangles_.size(), kNone);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (triangles_[t].is_gone) continue;
      ++triangle_count;
      if (find(t) != t) continue;
      face_of[t] = static_cast<std::uint32_t>(faces_.size());
      faces_.push_back({triangles_[t].normal, triangles_[t].vertex[0]});
    }
    std::size_t used = 0;
    for (std::uint32_t a = 0; a < points_.size(); ++a) {
      bool is_used = false;
      for (std::uint32_t b = 0; b < points_.size(); ++b) is_used = is_used || beside(a, b) != kNone;
      used += is_used;
    }
    if (2 * edge_count != 3 * triangle_count || used + triangle_count != edge_count + 2) return false;  // Euler
    for_each_edge([&](std::uint32_t a, std::uint32_t b, std::uint32_t s, std::uint32_t t) {
      const std::uint32_t left = face_of[find(s)], right = face_of[find(t)];
      if (left == right) return;
      const Double3 &n = faces_[left].normal, &m = faces_[right].normal;
      const Double3 sum = n - -1.0 * m;
      if (dot(n, m) > kFarNormals)
        add_edge(a, b, left, right);
      else if (length(sum) > 1e-3)
        add_two_edges(a, b, left, right, unit(sum));
      else
        add_two_edges(a, b, left, right, unit(cross(points_[b] - points_[a], n)));
    });
    return true;
  }

  static constexpr std::uint32_t kNone = ~0u;
  std::vector<Double3> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> beside_;
  std::vector<Face> faces_;
  std::vector<PolytopeEdge> edges_;
};

// The arrays of the cube.
struct Cube {
  alignas(64) float vertices[3][16];
  alignas(64) float faces[8][16];
  PolytopeEdge edges[12];
  double exact_vertices[8][3];
  double exact_normals[6][3];
  Polytope polytope;

  Cube() : polytope{8, 6, 12, vertices[0], faces[0], edges, exact_vertices[0], exact_normals[0]} {
    for (std::uint32_t i = 0; i < 16; ++i)
      for (std::uint32_t c = 0; c < 3; ++c) {
        const double vertex = (std::min(i, 7u) >> c & 1) ? 1 : -1;
        vertices[c][i] = static_cast<float>(vertex);
        if (i < 8) exact_vertices[i][c] = vertex;
        // Faces 2k and 2k + 1 are those at -1 and 1 along axis k, and the last vertices are at 1 along all axes.
        const std::uint32_t face = std::min(i, 5u);
        const double normal = face / 2 == c ? (face % 2 ? 1 : -1) : 0;
        faces[c][i] = static_cast<float>(normal);
        faces[3 + c][i] = face % 2 ? 1.0f : -1.0f;
        if (c < 2) faces[6 + c][i] = c == 0 ? 0.7071f : 0.7072f;  // of an eighth of a turn, a little more
        if (i < 6) exact_normals[i][c] = normal;
      }
    std::uint32_t count = 0;
    for (std::uint32_t k = 0; k < 3; ++k)
      for (std::uint32_t at = 0; at < 4; ++at) {  // along axis k, at -1 or 1 along both others
        const std::uint32_t p = (k + 1) % 3, q = (k + 2) % 3, u = at & 1, v = at >> 1;
        const std::uint32_t vertex = u << p | v << q;
        edges[count++] = {{static_cast<std::uint16_t>(vertex), static_cast<std::uint16_t>(vertex | 1u << k)},
                          {static_cast<std::uint16_t>(2 * p + u), static_cast<std::uint16_t>(2 * q + v)},
                          {k == 0 ? 1.0f : 0.0f, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f}};
      }
  }
};

}  // namespace

const Polytope* make_polytope(Span<const double> vertices, Arena& arena) {
  if (vertices.size > 3 * kMostVertices) return nullptr;
  Builder builder(vertices);
  return builder.build() ? builder.write(arena) : nullptr;
}

const Polytope& unit_cube() {
  static const Cube cube;
  return cube.polytope;
}

}  // namespace cab
