// The faces and edges of a convex polytope, of which the search for the least depth of two shapes is made.
#pragma once

#include <cab/span.h>

#include <cstdint>

namespace cab {

class Arena;

// The most vertices, faces and edges of a polytope.
inline constexpr std::uint32_t kMostVertices = 256, kMostFaces = 528, kMostEdges = 784;

// How many vertices, the first ones, say roughly where a polytope is: they are far from each other.
inline constexpr std::uint32_t kSpreadVertices = 16;

// An edge by the indices of its vertices and of the two faces that it joins. Its direction is from the first vertex to
// the second, of length 1: a difference of rounded vertices would have few digits where the edge is short.
struct PolytopeEdge {
  std::uint16_t vertex[2], face[2];
  float direction[3];
};

// Numbers as structures of arrays: of each component one array, padded to a multiple of sixteen by repeats of the last
// element. Coordinates are in the axes of the shape, relative to its centre, and are multiplied by the lengths that a
// caller gives: for boxes the half extents, for hulls the same length along all three axes.
//
// A face is a direction along which vertices of at least one edge are farthest: faces of the hull without those in the
// same plane, and in the middle between two faces whose normals are more than 120 degrees apart one more, so that the
// way on the sphere from one normal of an edge to the other is always the short one. A flat hull has two faces, and one
// for each edge.
struct Polytope {
  std::uint32_t vertex_count, face_count, edge_count;
  const float* vertices;  // x, y, z
  // x, y, z of the outward normal, of length 1; x, y, z of a vertex on it; the cosine and sine of half the longest arc
  // from the normal to that of the other face of an edge.
  const float* faces;
  const PolytopeEdge* edges;
  const double* exact_vertices;  // x, y, z of one vertex after the other
  const double* exact_normals;   // x, y, z of one face after the other
};

// Elements of an array that is padded for lanes.
inline std::uint32_t padded_for_lanes(std::uint32_t count) { return (count + 15) / 16 * 16; }

// The polytope of a hull's vertices: x, y, z of one after the other, in units in which the largest is about 1. Null if
// there are more than kMostVertices, if they lie in one line, or if rounding leaves open what the faces are. All its
// arrays are in the arena. Throws std::bad_alloc.
const Polytope* make_polytope(Span<const double> vertices, Arena& arena);

// The cube with vertices at -1 and 1. It lives as long as the program.
const Polytope& unit_cube();

}  // namespace cab
