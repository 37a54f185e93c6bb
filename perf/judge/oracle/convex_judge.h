// The judge of two convex shapes: bounds of their separation, each with its own proof, by minimising the support
// function of their difference over directions.
#pragma once

#include "perf/judge/oracle/convex_faces.h"

#include <cstdint>
#include <span>

namespace cab::oracle {

// The kinds of shapes, each in a frame of its own, and what their sizes mean.
enum class JudgeKind : std::uint8_t {
  kBox,        // half extents along x, y, z
  kSphere,     // radius
  kEllipsoid,  // radii along x, y, z
  kCapsule,    // radius, half the length of the cylinder along z
  kCylinder,   // radius, half the length along z
  kHull,       // none: the hull of `vertices`, which may all lie in a plane, in a line or in one point
  kHalfSpace,  // none: z <= 0
};

// A shape and its pose. The numbers are taken as exact, so a rotation that is orthonormal only to rounding deforms the
// shape. Radii of spheres and capsules are not deformed.
struct JudgeShape {
  JudgeKind kind = JudgeKind::kBox;
  Real size[3] = {};
  std::span<const Point> vertices;   // of a hull, at least one; owned by the caller
  const HullFaces* faces = nullptr;  // find_faces of the vertices, owned by the caller; if null, found at need
  ExactPose pose{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
};

// What is known about two shapes. Their gap is the distance of shapes that are apart, and less the depth of shapes that
// overlap: the least translation that parts them.
struct Verdict {
  // The shapes are apart by this much along the normal. Proof: the supports of both along the normal.
  Real gap_at_least;
  // If above 0, the distance of on_a and on_b, plus a bound of their rounding where they come from double. If below 0,
  // less the depth: by kDecide that of a ball that fits into the overlap's proof, by kMeasure the least depth found.
  Real gap_at_most;
  Point normal;      // of length 1, from a to b: the direction of the largest gap found
  Point on_a, on_b;  // apart: the closest points found. Overlapping: each shape's point furthest along the normal
  Point common;      // overlapping: a point of both shapes, to 1e-13 of their size
  // Whether the least depth is a search's result without a proof. The search is complete for polytopes, spheres and
  // capsules, since it tries every direction that can have the least depth. With an ellipsoid or a cylinder it may end
  // in a depth that is least only among directions near the normal. gap_at_least is a proof even so.
  bool is_refined;
};

inline bool are_apart(const Verdict& verdict) { return verdict.gap_at_least > 0; }
inline bool overlap(const Verdict& verdict) { return verdict.gap_at_most <= 0; }

enum class Effort : std::uint8_t {
  kDecide,   // apart or overlapping; the bounds may be loose
  kMeasure,  // distance or depth as tight as the judge can tell
};

// The separation of two shapes, relative to the sum of their sizes plus their distance. Up to the judge's rounding of
// 2^-55 of that, a positive gap_at_least and a negative gap_at_most are proofs. Shapes closer than the rounding have
// neither. Distances are good to 1e-12 for polytopes and 1e-9 else. Two half spaces are not judged: the bounds are
// infinite.
Verdict judge(const JudgeShape& a, const JudgeShape& b, Effort effort);

}  // namespace cab::oracle
