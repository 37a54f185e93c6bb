// Single convex bodies as queries meet them: their nearest points, supports, and where a moved ball first touches them.
#pragma once

#include "perf/judge/oracle/convex_judge.h"
#include "perf/judge/oracle/exact_pose.h"

#include <optional>
#include <vector>

namespace cab::oracle {

inline Real length_of(const Point& p) { return std::sqrt(dot(p, p)); }

// A leaf's box, or one convex part of a leaf, where it is posed: relative to the origin of its instance.
struct QueryBody {
  JudgeKind kind = JudgeKind::kBox;
  ExactBox box{};               // kBox: a parallelepiped, whose axes are those of the caller, rounding and all
  Real size[3] = {};            // all other kinds, as JudgeShape
  std::vector<Point> vertices;  // kHull, relative to at, in the world's axes
  Real column[3][3] = {};       // all kinds but boxes and hulls: their axes, orthonormal, mirrored or not
  Point at{};                   // all kinds but boxes: the origin of their frame
  Point middle{};               // every point of the body is within `reach` of it; infinite for a half space
  Real reach = 0;
  Real bluntness = 0;  // kEllipsoid: the least radius of curvature; else 0
};

// Fills in what is known by the other members.
void complete(QueryBody& body);

// The body as the judge of convex shapes takes it, moved by `shift`. It points to the body's vertices.
JudgeShape shape_of(const QueryBody& body, const Point& shift = {});

// A box with its half extents made larger. Other bodies do not change: a body that grows by a ball is one that is met
// at a larger distance.
QueryBody grown(QueryBody body, Real by);

// The body's point that is nearest to a point; the point itself, to rounding, if it is inside.
Point nearest_point(const QueryBody& body, const Point& to);

// The distance of the body from a point, 0 if it is inside.
Real distance_of_point(const QueryBody& body, const Point& to);

// The largest dot product of a point of the body and a direction. Infinite for a half space, but along its normal.
Real support_of(const QueryBody& body, const Point& direction);

// The first length t in 0 .. most at which the point at + t * direction is no farther than `radius` from the body, if
// there is one. direction: of length 1, or 0.
std::optional<Real> first_contact(const QueryBody& body, const Point& at, const Point& direction, Real most,
                                  Real radius);

// The distance of the body from the segment at - along to at + along; 0 if they meet.
Real distance_of_segment(const QueryBody& body, const Point& at, const Point& along);

// What of a box is within a half space, as a hull without vertices if nothing is.
QueryBody clipped(const ExactBox& box, const QueryBody& half_space);

}  // namespace cab::oracle
