// The distance of two segments in long double. As a function of the place on one of them it is convex, and its square
// is quadratic in three pieces: the nearest place on the other is one end, inside, or the other end.
#pragma once

#include "perf/judge/oracle/real.h"

#include <algorithm>

namespace cab::oracle {

// All points from at - half to at + half.
struct Segment {
  Point at, half;
};

// The shortest vector from a point of a to a point of b.
inline Point shortest_between(const Segment& a, const Segment& b) {
  const auto clamped = [](Real x) { return std::clamp(x, Real{-1}, Real{1}); };
  const Real aa = dot(a.half, a.half), bb = dot(b.half, b.half);
  const Point between = b.at - a.at;
  // From the place s on a, |s| <= 1, to the nearest place on b.
  const auto from = [&](Real s) {
    const Point to_centre = between - s * a.half;
    return bb > 0 ? to_centre - clamped(dot(to_centre, b.half) / bb) * b.half : to_centre;
  };
  // Where each piece is least, if it were all there is. The middle one goes across b.
  const auto across = [&](const Point& p) { return bb > 0 ? p - (dot(p, b.half) / bb) * b.half : p; };
  const Point beside = across(between), along = across(a.half);
  const Real along_sq = dot(along, along);
  const Real places[] = {aa > 0 ? dot(between - b.half, a.half) / aa : 0,
                         aa > 0 ? dot(between + b.half, a.half) / aa : 0,
                         along_sq > 0 ? dot(beside, along) / along_sq : 0, 1};
  Point best = from(-1);
  for (const Real place : places)
    if (const Point other = from(clamped(place)); dot(other, other) < dot(best, best)) best = other;
  return best;
}

}  // namespace cab::oracle
