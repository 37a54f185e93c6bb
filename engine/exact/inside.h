// Exact::kSurface: bodies that are wholly inside a closed part of a skin, so that no triangles of both touch.
#pragma once

#include "engine/exact/surface_ray.h"
#include "layout/pair_list.h"

namespace cab {

struct Candidate;
struct ExactScratch;

// The directions of rays, of any length. A ray that passes an edge too near to tell on which side is cast again along
// the next one. They have nothing to do with the axes and diagonals along which people model.
inline constexpr std::uint32_t kInsideRayCount = 4;
inline constexpr double kInsideRays[kInsideRayCount][3] = {{27, 67, 71}, {-59, 35, 73}, {82, -47, 33}, {13, 89, -43}};

// What the search for closed parts about a point has found of one part.
struct PartCrossings {
  std::int32_t turns;  // crossings of the ray on its way out, less those on its way in
  bool is_crossed;     // a triangle of it is crossed, or may be
  bool is_undecided;   // not even doubles tell whether a triangle of it is crossed
  bool is_asked;       // an earlier ray from the point left it undecided
  std::uint16_t leaf;  // of the first triangle that is crossed
  double first;        // where that is, along the ray
};

// Bounds of a leaf's triangles of closed parts, seen along a ray: across it, and how far they reach along it.
struct RayBounds {
  double lo[2], hi[2], end;
};

// Where the closed parts of an instance are.
struct ClosedBounds {
  std::uint32_t batch = 0;  // its index and 1; 0: none
  std::uint32_t instance = 0;
  Double3 lo = {}, hi = {};                // bounds of all, about its origin
  Span<kernel::RigidLanes<double>> poses;  // by link, of those that move closed parts
  std::uint32_t bounded_along = 0;         // 1 and the ray's number whose RayBounds are there; 0: none
  Span<RayBounds> leaves;                  // by SurfaceParts::leaves
};

// What a worker needs for it.
struct InsideScratch {
  ClosedBounds a, b;                 // of the first and the second instances that it has looked at last
  Span<std::uint8_t> touching;       // by link of the inner instance: whether it touches what all closed parts have
  Span<PartCrossings> crossings;     // by part; all 0 between points
  FixedList<std::uint32_t> crossed;  // parts
  Span<kernel::MetTriangle> met;     // of one leaf
};

// What the articulations of an engine ask of it: most leaves with triangles of closed parts, parts, patches of a leaf,
// and links.
struct InsideNeeds {
  std::size_t leaves = 0, parts = 0, patches = 0, links = 0;
};

// Makes the lists. Throws std::bad_alloc.
void size_inside(const InsideNeeds& needs, Arena& arena, InsideScratch& out);

// Forgets the instances that were looked at last: poses are new.
inline void forget_inside(InsideScratch& scratch) { scratch.a.batch = scratch.b.batch = 0; }

// Whether something may be inside an articulation's skin.
inline bool has_closed_parts(const Articulation& articulation) { return !articulation.surface_parts.leaves.empty(); }

// Whether a candidate of this frame is searched for what is inside the other.
bool searches_inside(const FrameContext& frame, const Candidate& candidate);

// Adds leaf pairs for what is inside closed parts. `found` has the leaf pairs that touch of the candidates `begin` to
// `end` - 1, in the order of candidates, and keeps this order. It has room for all leaf pairs of these candidates.
//
// A connected part of a skin, or a convex shape but a half space, is inside a closed part of another instance if one
// point of it is: the vertex nearest to its middle, or its centre. A pair is added for each two of which no link of the
// one touches a link of the other already: the leaf of that point, and the leaf that a ray from there leaves the closed
// part by. What not even doubles decide by any of kInsideRays is inside. With Report::kInContact nothing is added where
// it changes no report.
void add_inside(const FrameContext& frame, const Candidate* candidates, std::uint32_t begin, std::uint32_t end,
                FixedList<LeafPair>& found, ExactScratch& scratch, FrameStats& stats);

}  // namespace cab
