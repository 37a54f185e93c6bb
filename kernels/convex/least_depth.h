// The least depth of two polytopes, or of a polytope and a segment. Their difference is a polytope too; the depth is
// least along the outward normal of one of its faces. These come from a face of one shape, or from an edge of each
// whose arcs on the sphere of normals cross (Gregorius 2013, The separating axis test between convex polyhedra). All
// are tried in float, with faces and edges as lanes, and the best again in double.
#pragma once

#include "kernels/convex/contact_lanes.h"
#include "layout/polytope.h"

#include <limits>

namespace cab::kernel {

using Double3 = Vec3<double>;

// One shape without the ball about it. polytope: null for a segment along z.
struct DepthSide {
  const Polytope* polytope;
  Double3 lengths;  // by which vertices are multiplied; of a segment its half length as z
};

// A pair of shapes in the frame of a, scaled to size 1. column, t: the axes and the centre of b.
struct DepthPair {
  DepthSide a, b;
  Double3 column[3], t;
};

// A direction of length 1 along which b can leave a, how far it must go (below 0: a proof that they are apart), and
// points of both shapes that are then the same.
struct LeastDepth {
  double depth;
  Double3 normal, on_a, on_b;
};

// Up to so many vertices, looking at all of them is as fast as choosing faces and edges.
inline constexpr std::uint32_t kFewVertices = 64;

// A shape in the frame of a, in float. Arrays are padded to a multiple of sixteen.
struct PosedPolytope {
  std::uint32_t vertex_count, face_count;
  alignas(64) float vertex[3][kMostVertices];
  float normal[3][kMostFaces], offset[kMostFaces];  // the plane of a face: dot(normal, x) = offset
  // Only of shapes of more than kFewVertices:
  float point[3][kMostFaces];                  // a vertex of the face
  float cosine[kMostFaces], sine[kMostFaces];  // of half the longest arc of the face's edges
  // How far the other shape reaches below the plane, by its vertex that is deepest there; below 0: a separation. Of
  // faces that cannot be the best: at least so far, by one of its spread vertices.
  float depth[kMostFaces], deepest[3][kMostFaces];
};

// Edges with the normals of the faces that they join, towards the outside of the difference.
struct EdgeList {
  std::uint32_t count;
  alignas(64) float start[3][kMostEdges], direction[3][kMostEdges], normal[2][3][kMostEdges];
  std::uint32_t edge[kMostEdges];
};

template <class V>
CAB_INLINE Vec3<V> splat(const Double3& v) {
  return {V(static_cast<float>(v.x)), V(static_cast<float>(v.y)), V(static_cast<float>(v.z))};
}

template <class V, std::size_t kSize>
CAB_INLINE Vec3<V> load3_of(const float (&from)[3][kSize], std::uint32_t at) {
  return {Lanes<V>::load(from[0] + at), Lanes<V>::load(from[1] + at), Lanes<V>::load(from[2] + at)};
}
template <class V, std::size_t kSize>
CAB_INLINE void store3_of(float (&to)[3][kSize], std::uint32_t at, const Vec3<V>& v) {
  Lanes<V>::store(to[0] + at, v.x);
  Lanes<V>::store(to[1] + at, v.y);
  Lanes<V>::store(to[2] + at, v.z);
}

template <class V>
CAB_NOINLINE void pose_polytope(const DepthSide& side, const Double3 (&column)[3], const Double3& t,
                                PosedPolytope& out) {
  const Vec3<V> axes[3] = {splat<V>(column[0]), splat<V>(column[1]), splat<V>(column[2])}, at = splat<V>(t),
                lengths = splat<V>(side.lengths);
  if (!side.polytope) {
    const Double3 end = side.lengths.z * column[2], ends[2] = {t - end, t + end};
    out.vertex_count = side.lengths.z > 0 ? 2 : 1;
    out.face_count = 0;
    for (std::uint32_t i = 0; i < 2; ++i) {
      out.vertex[0][i] = static_cast<float>(ends[i].x);
      out.vertex[1][i] = static_cast<float>(ends[i].y);
      out.vertex[2][i] = static_cast<float>(ends[i].z);
    }
    return;
  }
  const Polytope& polytope = *side.polytope;
  out.vertex_count = polytope.vertex_count;
  out.face_count = polytope.face_count;
  const auto load = [](const float* from, std::uint32_t stride, std::uint32_t i) {
    return Vec3<V>{Lanes<V>::load(from + i), Lanes<V>::load(from + stride + i), Lanes<V>::load(from + 2 * stride + i)};
  };
  const auto scaled = [&](const Vec3<V>& v) { return Vec3<V>{lengths.x * v.x, lengths.y * v.y, lengths.z * v.z}; };
  const std::uint32_t vertices = padded_for_lanes(polytope.vertex_count), faces = padded_for_lanes(polytope.face_count);
  for (std::uint32_t i = 0; i < vertices; i += kWidth<V>)
    store3_of(out.vertex, i, at + rotate(axes, scaled(load(polytope.vertices, vertices, i))));
  for (std::uint32_t i = 0; i < faces; i += kWidth<V>) {
    const Vec3<V> local = load(polytope.faces, faces, i), normal = rotate(axes, local);
    store3_of(out.normal, i, normal);
    const Vec3<V> point = scaled(load(polytope.faces + 3 * faces, faces, i));
    Lanes<V>::store(out.offset + i, dot(local, point) + dot(normal, at));
    if (polytope.vertex_count <= kFewVertices) continue;
    store3_of(out.point, i, at + rotate(axes, point));
    Lanes<V>::store(out.cosine + i, Lanes<V>::load(polytope.faces + 6 * faces + i));
    Lanes<V>::store(out.sine + i, Lanes<V>::load(polytope.faces + 7 * faces + i));
  }
}

// The lowest of the first vertices of a shape along normals.
template <class V>
CAB_INLINE V find_lowest(const PosedPolytope& shape, std::uint32_t count, const Vec3<V>& normal, Vec3<V>& lowest) {
  V least(std::numeric_limits<float>::infinity());
  lowest = {V(0.0f), V(0.0f), V(0.0f)};
  for (std::uint32_t v = 0; v < count; ++v) {
    const Vec3<V> vertex = {V(shape.vertex[0][v]), V(shape.vertex[1][v]), V(shape.vertex[2][v])};
    const V height = dot(normal, vertex);
    take<V>(height < least, vertex, lowest);
    least = min(height, least);
  }
  return least;
}

// Faces that are measured by all vertices of the other shape, sixteen at a time.
struct ChosenFaces {
  alignas(64) float normal[3][kLanes], offset[kLanes], depth[kLanes], deepest[3][kLanes];
  std::uint32_t face[kLanes], count = 0;

  CAB_INLINE void add(const PosedPolytope& own, std::uint32_t f) {
    for (int c = 0; c < 3; ++c) normal[c][count] = own.normal[c][f];
    offset[count] = own.offset[f];
    face[count++] = f;
  }

  template <class V>
  CAB_NOINLINE void measure(const PosedPolytope& other, PosedPolytope& own) {
    for (std::uint32_t i = count; i < kLanes; ++i) {
      for (int c = 0; c < 3; ++c) normal[c][i] = normal[c][0];
      offset[i] = offset[0];
    }
    for (std::uint32_t i = 0; i < kLanes; i += kWidth<V>) {
      Vec3<V> lowest;
      const V height = find_lowest(other, other.vertex_count, load3<V>(normal, i), lowest);
      Lanes<V>::store(depth + i, Lanes<V>::load(offset + i) - height);
      store3(deepest, i, lowest);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      own.depth[face[i]] = depth[i];
      for (int c = 0; c < 3; ++c) own.deepest[c][face[i]] = deepest[c][i];
    }
    count = 0;
  }
};

// Writes how far another shape reaches below the planes of the faces: by its spread vertices, and by all below those
// planes that may have the least depth.
template <class V>
CAB_NOINLINE void measure_faces(const PosedPolytope& other, PosedPolytope& own) {
  const std::uint32_t few = other.vertex_count <= kFewVertices ? other.vertex_count : kSpreadVertices;
  for (std::uint32_t i = 0; i < padded_for_lanes(own.face_count); i += kWidth<V>) {
    Vec3<V> deepest;
    const V lowest = find_lowest(other, few, load3_of<V>(own.normal, i), deepest);
    Lanes<V>::store(own.depth + i, Lanes<V>::load(own.offset + i) - lowest);
    store3_of(own.deepest, i, deepest);
  }
  if (few == other.vertex_count || own.face_count == 0) return;
  // The depth at the face that may be the best is a bound for all others.
  std::uint32_t first = 0;
  for (std::uint32_t f = 1; f < own.face_count; ++f)
    if (own.depth[f] < own.depth[first]) first = f;
  ChosenFaces chosen;
  chosen.add(own, first);
  chosen.measure<V>(other, own);
  const float most = own.depth[first];
  for (std::uint32_t f = 0; f < own.face_count; ++f) {
    if (own.depth[f] > most || f == first) continue;
    chosen.add(own, f);
    if (chosen.count == kLanes) chosen.measure<V>(other, own);
  }
  if (chosen.count > 0) chosen.measure<V>(other, own);
}

// The least depth along the normal of a face.
CAB_INLINE float least_of_faces(const PosedPolytope& own) {
  float least = std::numeric_limits<float>::infinity();
  for (std::uint32_t f = 0; f < own.face_count; ++f) least = min(least, own.depth[f]);
  return least;
}

// Writes for each face whether no direction within half an arc of its normal has a depth of `depth` or less. Along any
// direction the depth is at least the height of a point of the difference, such as that of the face and its deepest
// vertex; at an angle to the normal it falls at most like the point's distance from the normal times the sine.
template <class V>
CAB_NOINLINE void find_deep_faces(const PosedPolytope& own, float depth, std::uint8_t (&is_deep)[kMostFaces]) {
  for (std::uint32_t i = 0; i < padded_for_lanes(own.face_count); i += kWidth<V>) {
    const Vec3<V> point = load3_of<V>(own.point, i) - load3_of<V>(own.deepest, i);
    const V height = dot(load3_of<V>(own.normal, i), point);
    const V across = sqrt(max(dot(point, point) - height * height, V(0.0f)));
    const std::uint32_t deep =
        bits(height * Lanes<V>::load(own.cosine + i) - across * Lanes<V>::load(own.sine + i) > V(depth));
    for (std::uint32_t lane = 0; lane < kWidth<V>; ++lane) is_deep[i + lane] = deep >> lane & 1;
  }
}

// Whether no direction between the two normals of an edge has a depth of `depth` or less. The depth along any direction
// is at least the height of any point of the difference, such as the two that are farthest along the normals: depth_0
// and depth_1 are their heights along those, over_0 that of the second along the first normal, and over_1 that of the
// first along the second. A mean of both points is as high along the arc as the lower of its heights at the ends.
CAB_INLINE bool is_arc_deeper(float depth_0, float depth_1, float over_0, float over_1, float depth) {
  if ((depth_0 + over_0 > 2 * depth) & (depth_1 + over_1 > 2 * depth)) return true;
  const float falls = (depth_0 - over_0) + (depth_1 - over_1);
  const float weight = falls > 0 ? min(max((depth_1 - over_0) / falls, 0.0f), 1.0f) : 0.0f;
  return min(weight * depth_0 + (1.0f - weight) * over_0, weight * over_1 + (1.0f - weight) * depth_1) > depth;
}

// The edges of a shape along which a direction may be better than the faces. towards: 1 for those of a, -1 for those of
// b, whose normals are those of the difference turned over.
template <class V>
CAB_NOINLINE void list_edges(const Polytope& polytope, const Double3 (&column)[3], const PosedPolytope& own,
                             float towards, float depth, EdgeList& out) {
  const Vec3<float> axes[3] = {splat<float>(column[0]), splat<float>(column[1]), splat<float>(column[2])};
  const auto at = [](const auto& from, std::uint32_t i) { return Vec3<float>{from[0][i], from[1][i], from[2][i]}; };
  std::uint8_t is_deep[kMostFaces];
  const bool chooses = own.vertex_count > kFewVertices;
  if (chooses) find_deep_faces<V>(own, depth, is_deep);
  std::uint32_t count = 0;
  for (std::uint32_t e = 0; e < polytope.edge_count; ++e) {
    const PolytopeEdge& edge = polytope.edges[e];
    const std::uint32_t f = edge.face[0], g = edge.face[1];
    if (chooses && (is_deep[f] & is_deep[g])) continue;
    const Vec3<float> normal[2] = {at(own.normal, f), at(own.normal, g)};
    if (is_arc_deeper(own.depth[f], own.depth[g], own.offset[f] - dot(normal[0], at(own.deepest, g)),
                      own.offset[g] - dot(normal[1], at(own.deepest, f)), depth))
      continue;
    const Vec3<float> start = at(own.vertex, edge.vertex[0]);
    const Vec3<float> direction = rotate(axes, {edge.direction[0], edge.direction[1], edge.direction[2]});
    const float from[3] = {start.x, start.y, start.z}, along[3] = {direction.x, direction.y, direction.z};
    for (int c = 0; c < 3; ++c) {
      out.start[c][count] = from[c];
      out.direction[c][count] = along[c];
    }
    for (int n = 0; n < 2; ++n) {
      out.normal[n][0][count] = towards * normal[n].x;
      out.normal[n][1][count] = towards * normal[n].y;
      out.normal[n][2][count] = towards * normal[n].z;
    }
    out.edge[count++] = e;
  }
  out.count = count;
  for (std::uint32_t i = count; i < padded_for_lanes(count); ++i)  // no arc crosses that of an edge without normals
    for (int c = 0; c < 3; ++c) {
      out.start[c][i] = 0;
      out.direction[c][i] = 1;
      out.normal[0][c][i] = out.normal[1][c][i] = 0;
    }
}

// The edge of a segment, whose normals are all those square to it.
CAB_INLINE void list_segment(const DepthSide& side, const Double3 (&column)[3], const PosedPolytope& own,
                             EdgeList& out) {
  out.count = side.lengths.z > 0;
  const float along[3] = {static_cast<float>(column[2].x), static_cast<float>(column[2].y),
                          static_cast<float>(column[2].z)};
  for (int c = 0; c < 3; ++c) {
    out.start[c][0] = own.vertex[c][0];
    out.direction[c][0] = along[c];
  }
  out.edge[0] = 0;
}

// How far a shape reaches along a direction in its own axes.
CAB_INLINE double reach_along(const DepthSide& side, const Double3& d) {
  if (!side.polytope) return side.lengths.z * abs(d.z);
  const Double3 along = {side.lengths.x * d.x, side.lengths.y * d.y, side.lengths.z * d.z};
  double highest = -std::numeric_limits<double>::infinity();
  for (std::uint32_t v = 0; v < side.polytope->vertex_count; ++v) {
    const double* const p = side.polytope->exact_vertices + 3 * v;
    highest = max(highest, (p[0] * along.x + p[1] * along.y) + p[2] * along.z);
  }
  return highest;
}

CAB_INLINE Double3 vertex_of(const DepthSide& side, std::uint32_t v) {
  if (!side.polytope) return {0, 0, v ? side.lengths.z : -side.lengths.z};
  const double* const p = side.polytope->exact_vertices + 3 * v;
  return {side.lengths.x * p[0], side.lengths.y * p[1], side.lengths.z * p[2]};
}

// A point of an edge, and the way along it.
CAB_INLINE Double3 start_of(const DepthSide& side, std::uint32_t e) {
  return vertex_of(side, side.polytope ? side.polytope->edges[e].vertex[0] : 0u);
}
CAB_INLINE Double3 edge_of(const DepthSide& side, std::uint32_t e) {
  if (!side.polytope) return {0, 0, 1};
  const PolytopeEdge& edge = side.polytope->edges[e];
  return vertex_of(side, edge.vertex[1]) - vertex_of(side, edge.vertex[0]);
}

// A vector of the frame of a in the axes of b, and back.
CAB_INLINE Double3 in_b(const DepthPair& pair, const Double3& v) {
  return {dot(pair.column[0], v), dot(pair.column[1], v), dot(pair.column[2], v)};
}

// The vertices of a shape that are farthest along a direction in its own axes, to rounding.
struct FarthestVertices {
  std::uint32_t count = 0;
  Double3 at[kMostVertices];

  CAB_INLINE void find(const DepthSide& side, const Double3& d, double within) {
    const double height = reach_along(side, d) - within;
    const std::uint32_t vertices = side.polytope ? side.polytope->vertex_count : side.lengths.z > 0 ? 2 : 1;
    for (std::uint32_t v = 0; v < vertices; ++v)
      if (const Double3 p = vertex_of(side, v); dot(p, d) >= height) at[count++] = p;
  }
};

// Points of two faces, edges or vertices that are nearest to each other, which both lie square to a normal: GJK in two
// dimensions, by heights along two axes.
template <class D>
CAB_NOINLINE void nearest_in_plane(const FarthestVertices& a, const FarthestVertices& b, const Double3& normal,
                                   Double3& on_a, Double3& on_b) {
  struct Corner {
    double x, y;
    std::uint32_t a, b;
  };
  const Double3 any = abs(normal.x) < 0.5 ? Double3{1, 0, 0} : Double3{0, 1, 0};
  const Double3 x = normalized(cross(normal, any)), y = cross(normal, x);
  double ax[kMostVertices], ay[kMostVertices], bx[kMostVertices], by[kMostVertices];
  for (std::uint32_t i = 0; i < a.count; ++i) {
    ax[i] = dot(x, a.at[i]);
    ay[i] = dot(y, a.at[i]);
  }
  for (std::uint32_t i = 0; i < b.count; ++i) {
    bx[i] = dot(x, b.at[i]);
    by[i] = dot(y, b.at[i]);
  }
  const auto farthest = [&](double dx, double dy) {
    std::uint32_t i = 0, j = 0;
    for (std::uint32_t k = 1; k < a.count; ++k)
      if (dx * ax[k] + dy * ay[k] > dx * ax[i] + dy * ay[i]) i = k;
    for (std::uint32_t k = 1; k < b.count; ++k)
      if (dx * bx[k] + dy * by[k] < dx * bx[j] + dy * by[j]) j = k;
    return Corner{ax[i] - bx[j], ay[i] - by[j], i, j};
  };
  Corner corner[3] = {farthest(1, 0)};
  double weight[3] = {1, 0, 0};
  std::uint32_t count = 1;
  for (int step = 0; step < 32; ++step) {
    double px = 0, py = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      px += weight[i] * corner[i].x;
      py += weight[i] * corner[i].y;
    }
    const double sq = px * px + py * py;
    const Corner next = farthest(-px, -py);
    if (!(sq - (px * next.x + py * next.y) > kSameInPlane)) break;
    // The nearest point of the sides from the new corner to the others, or the inside of the triangle.
    const auto side = [&](const Corner& from, double& to_next) {
      const double ex = next.x - from.x, ey = next.y - from.y, length_sq = ex * ex + ey * ey;
      to_next = length_sq > 0 ? min(max(-(from.x * ex + from.y * ey) / length_sq, 0.0), 1.0) : 1.0;
      const double qx = from.x + to_next * ex, qy = from.y + to_next * ey;
      return qx * qx + qy * qy;
    };
    if (count == 2) {
      const auto area = [](const Corner& p, const Corner& q) { return p.x * q.y - p.y * q.x; };
      const double w0 = area(corner[1], next), w1 = area(next, corner[0]), w2 = area(corner[0], corner[1]);
      const double all = (w0 + w1) + w2;
      if (all != 0 && w0 / all >= 0 && w1 / all >= 0 && w2 / all >= 0) {
        corner[2] = next;
        weight[0] = w0 / all;
        weight[1] = w1 / all;
        weight[2] = w2 / all;
        count = 3;
        break;
      }
    }
    double to_next, by_other = 0;
    double nearest_sq = side(corner[0], to_next);
    if (count == 2 && side(corner[1], by_other) < nearest_sq) {
      corner[0] = corner[1];
      to_next = by_other;
    }
    corner[1] = next;
    weight[0] = 1 - to_next;
    weight[1] = to_next;
    count = 2;
  }
  on_a = on_b = {0, 0, 0};
  for (std::uint32_t i = 0; i < count; ++i) {
    on_a = on_a + weight[i] * a.at[corner[i].a];
    on_b = on_b + weight[i] * b.at[corner[i].b];
  }
}

// The outward normal of a face of a polytope.
CAB_INLINE Double3 normal_of_face(const Polytope& polytope, std::uint32_t face) {
  const double* const n = polytope.exact_normals + 3 * face;
  return {n[0], n[1], n[2]};
}

// How far b must move along a direction to be free, by all vertices of both shapes.
CAB_INLINE double depth_along(const DepthPair& pair, const Double3& d) {
  return (reach_along(pair.a, d) + reach_along(pair.b, -1.0 * in_b(pair, d))) - dot(d, pair.t);
}

// What was found so far. V: names the instruction set, since an object of one must not define what others do.
template <class V>
struct BestDepth {
  const DepthPair& pair;
  double depth = std::numeric_limits<double>::infinity();
  Double3 normal = {0, 0, 0};
  float separation = -std::numeric_limits<float>::infinity();  // less the depth, or what float is sure of; rounded down

  CAB_INLINE void take(double found, const Double3& along) {
    if (!(found < depth)) return;
    depth = found;
    normal = along;
    separation = max(separation, static_cast<float>(-depth) - kDepthRounding);
  }

  // Tries the normal of a face.
  CAB_INLINE void try_along(const Double3& along) { take(depth_along(pair, along), along); }

  // Tries an edge of each, if their arcs cross: the normal is that of a face of the difference then, and the depth is
  // the height of the two edges along it.
  CAB_NOINLINE void try_edges(std::uint32_t of_a, std::uint32_t of_b) {
    const Double3 e = edge_of(pair.a, of_a), f = rotate(pair.column, edge_of(pair.b, of_b));
    Double3 outward = {0, 0, 0}, normals_a[2] = {e, e}, normals_b[2] = {f, f};  // of segments: the axis of all of them
    if (pair.a.polytope)
      for (int n = 0; n < 2; ++n) {
        normals_a[n] = normal_of_face(*pair.a.polytope, pair.a.polytope->edges[of_a].face[n]);
        outward = outward + normals_a[n];
      }
    if (pair.b.polytope)
      for (int n = 0; n < 2; ++n) {
        normals_b[n] =
            -1.0 * rotate(pair.column, normal_of_face(*pair.b.polytope, pair.b.polytope->edges[of_b].face[n]));
        if (!pair.a.polytope) outward = outward + normals_b[n];
      }
    const Double3 plane_a = pair.a.polytope ? cross(normals_a[1], normals_a[0]) : e,
                  plane_b = pair.b.polytope ? cross(normals_b[1], normals_b[0]) : f;
    const double c = dot(normals_b[0], plane_a), d = dot(normals_b[1], plane_a), a = dot(normals_a[0], plane_b),
                 b = dot(normals_a[1], plane_b);
    if (pair.b.polytope && !(c * d <= 0)) return;
    if (pair.a.polytope && !(a * b <= 0)) return;
    if (pair.a.polytope && pair.b.polytope && !(c * b >= 0)) return;
    Double3 along = cross(e, f);
    const double sine_sq = dot(along, along) / (dot(e, e) * dot(f, f));
    if (!(sine_sq > kParallelInDouble)) return;
    along = normalized(along);
    if (dot(along, outward) < 0) along = -1.0 * along;
    const Double3 on_a = start_of(pair.a, of_a), on_b = pair.t + rotate(pair.column, start_of(pair.b, of_b));
    take(dot(along, on_a - on_b), along);
  }
};

// Tries one edge with all edges of the other shape. is_segment: the one is a segment. towards: 1 if the one is of a.
template <class V>
CAB_INLINE void cross_edges(const EdgeList& ones, std::uint32_t one, bool is_segment, float towards,
                            const EdgeList& others, BestDepth<V>& found) {
  const auto of_one = [one](const float(&from)[3][kMostEdges]) {
    return Vec3<float>{from[0][one], from[1][one], from[2][one]};
  };
  const auto splatted = [](const Vec3<float>& v) { return Vec3<V>{V(v.x), V(v.y), V(v.z)}; };
  const Vec3<float> along_one = of_one(ones.direction);
  // The plane of the arc of `one`.
  Vec3<float> normal_a = along_one, normal_b = along_one, plane_of_one = along_one;
  if (!is_segment) {
    normal_a = of_one(ones.normal[0]);
    normal_b = of_one(ones.normal[1]);
    plane_of_one = cross(normal_b, normal_a);
  }
  const Vec3<V> along = splatted(along_one), start = splatted(of_one(ones.start)), plane = splatted(plane_of_one),
                a = splatted(normal_a), b = splatted(normal_b);
  const V zero(0.0f);
  for (std::uint32_t i = 0; i < padded_for_lanes(others.count); i += kLanes) {
    alignas(64) float most[kLanes];  // what the separation is at most
    std::uint32_t crossing = 0;
    for (std::uint32_t j = i; j < i + kLanes; j += kWidth<V>) {
      const Vec3<V> c = load3_of<V>(others.normal[0], j), d = load3_of<V>(others.normal[1], j);
      const V side_c = dot(c, plane), side_d = dot(d, plane);
      Mask<V> cross_here = side_c * side_d < zero;
      if (!bits(cross_here)) continue;
      if (!is_segment) {
        const Vec3<V> plane_of_other = cross(d, c);
        const V side_a = dot(a, plane_of_other), side_b = dot(b, plane_of_other);
        cross_here = both(cross_here, both(side_a * side_b<zero, side_c * side_b> zero));
        if (!bits(cross_here)) continue;
      }
      const Vec3<V> normal = cross(along, load3_of<V>(others.direction, j));
      const V sine = sqrt(dot(normal, normal));
      const V gap = V(towards) * dot(normal, load3_of<V>(others.start, j) - start);
      const V outward = dot(normal, c + d);
      const V one_over = divide(V(1.0f), sine);
      const V separation = one_over * select(outward < zero, zero - gap, gap);
      Lanes<V>::store(most + (j - i), separation + V(kDepthRounding) * one_over);
      crossing |= bits(cross_here) << (j - i);
    }
    for (; crossing; crossing &= crossing - 1) {
      const std::uint32_t lane = lowest_bit(crossing);
      if (most[lane] < found.separation) continue;  // not a number where edges are parallel
      const std::uint32_t e = ones.edge[one], f = others.edge[i + lane];
      found.try_edges(towards > 0 ? e : f, towards > 0 ? f : e);
    }
  }
}

// Finds the least depth of two shapes, at least one of which is a polytope.
template <class V>
CAB_NOINLINE void least_depth(const DepthPair& pair, LeastDepth& out) {
  PosedPolytope a, b;
  const Double3 own[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  pose_polytope<V>(pair.a, own, {0, 0, 0}, a);
  pose_polytope<V>(pair.b, pair.column, pair.t, b);
  measure_faces<V>(b, a);
  measure_faces<V>(a, b);
  const float depth = min(least_of_faces(a), least_of_faces(b)) + kDepthRounding;
  BestDepth<V> found = {pair};
  found.separation = -depth;
  EdgeList of_a, of_b;
  if (pair.a.polytope)
    list_edges<V>(*pair.a.polytope, own, a, 1, depth, of_a);
  else
    list_segment(pair.a, own, a, of_a);
  if (pair.b.polytope)
    list_edges<V>(*pair.b.polytope, pair.column, b, -1, depth, of_b);
  else
    list_segment(pair.b, pair.column, b, of_b);
  if (pair.b.polytope) {
    for (std::uint32_t i = 0; i < of_a.count; ++i) cross_edges<V>(of_a, i, !pair.a.polytope, 1, of_b, found);
  } else {
    for (std::uint32_t i = 0; i < of_b.count; ++i) cross_edges<V>(of_b, i, true, -1, of_a, found);
  }
  for (std::uint32_t f = 0; f < a.face_count; ++f)
    if (kDepthRounding - a.depth[f] >= found.separation) found.try_along(normal_of_face(*pair.a.polytope, f));
  for (std::uint32_t f = 0; f < b.face_count; ++f)
    if (kDepthRounding - b.depth[f] >= found.separation)
      found.try_along(-1.0 * rotate(pair.column, normal_of_face(*pair.b.polytope, f)));
  out.normal = found.normal;
  out.depth = depth_along(pair, found.normal);
  FarthestVertices top_of_a, top_of_b;
  top_of_a.find(pair.a, out.normal, kSameHeight);
  top_of_b.find(pair.b, -1.0 * in_b(pair, out.normal), kSameHeight);
  for (std::uint32_t i = 0; i < top_of_b.count; ++i) top_of_b.at[i] = pair.t + rotate(pair.column, top_of_b.at[i]);
  if (top_of_b.count == 1) {
    out.on_b = top_of_b.at[0];
    out.on_a = out.on_b + out.depth * out.normal;
  } else if (top_of_a.count == 1) {
    out.on_a = top_of_a.at[0];
    out.on_b = out.on_a - out.depth * out.normal;
  } else {
    nearest_in_plane<V>(top_of_a, top_of_b, out.normal, out.on_a, out.on_b);
  }
}

}  // namespace cab::kernel
