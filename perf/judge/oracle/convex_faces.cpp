// Faces and edges of a convex hull, by brute force.
#include "perf/judge/oracle/convex_faces.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace cab::oracle {
namespace {

// The size of a hull times this: how far a point may be beyond a face.
constexpr Real kFaceTolerance = 1e-12L;

// The size of a hull times this: how thin a hull may be to count as flat.
constexpr Real kFlatTolerance = 1e-15L;

// Three points whose triangle has a smaller sine than this name no plane.
constexpr Real kLeastSine = 1e-9L;

Real length(const Point& p) { return std::sqrt(dot(p, p)); }

Point unit(const Point& p) { return (1 / length(p)) * p; }

// A unit vector normal to a unit vector.
Point perpendicular(const Point& p) {
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k) least = magnitude(p[k]) < magnitude(p[least]) ? k : least;
  Point axis{};
  axis[least] = 1;
  return unit(cross(p, axis));
}

// The point for which a measure is largest.
template <class Measure>
const Point& furthest(std::span<const Point> points, const Measure& measure) {
  return *std::max_element(points.begin(), points.end(),
                           [&](const Point& p, const Point& q) { return measure(p) < measure(q); });
}

// The two ends of the edge along which points lie.
Point extent_of(std::span<const Point> points, const std::vector<std::uint32_t>& chosen) {
  Point longest{};
  for (const std::uint32_t i : chosen) {
    const Point from_first = points[i] - points[chosen.front()];
    if (dot(from_first, from_first) > dot(longest, longest)) longest = from_first;
  }
  return longest;
}

// All points lie in the line through `from` along the unit vector `along`.
HullFaces faces_of_line(const Point& along) {
  const Point side = perpendicular(along), other = cross(along, side);
  const Point around[4] = {side, other, -1.0L * side, -1.0L * other};
  HullFaces out;
  for (std::size_t k = 0; k < 4; ++k) {
    out.normals.push_back(around[k]);
    out.edges.push_back({along, {around[k], around[(k + 1) % 4]}});
  }
  return out;
}

// All points lie in the plane with the unit normal `up`.
HullFaces faces_of_plane(std::span<const Point> points, const Point& up, Real size) {
  const Point down = -1.0L * up;
  HullFaces out;
  out.normals = {up, down};
  for (const Point& p : points) {
    for (const Point& q : points) {
      const Point along = q - p;
      if (length(along) <= kFlatTolerance * size) continue;
      const Point outward = unit(cross(along, up));
      const Point& highest = furthest(points, [&](const Point& r) { return dot(outward, r); });
      if (dot(outward, highest - p) > kFaceTolerance * size) continue;
      out.edges.push_back({along, {up, outward}});
      out.edges.push_back({along, {outward, down}});
    }
  }
  return out;
}

// A face: its normal, and its points in ascending order.
struct Face {
  Point normal;
  std::vector<std::uint32_t> on;
};

// Whether all points lie below the plane through p with a normal; on: those in it.
bool bounds_all(std::span<const Point> points, const Point& p, const Point& normal, Real tolerance,
                std::vector<std::uint32_t>& on) {
  on.clear();
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Real height = dot(normal, points[i] - p);
    if (height > tolerance) return false;
    if (height >= -tolerance) on.push_back(i);
  }
  return true;
}

HullFaces faces_of_solid(std::span<const Point> points, Real size) {
  std::vector<Face> faces;
  std::vector<std::uint32_t> on;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        const Point u = points[j] - points[i], v = points[k] - points[i], normal = cross(u, v);
        if (length(normal) <= kLeastSine * length(u) * length(v)) continue;
        for (const Point& outward : {unit(normal), -1.0L * unit(normal)}) {
          if (!bounds_all(points, points[i], outward, kFaceTolerance * size, on)) continue;
          const bool known = std::any_of(faces.begin(), faces.end(), [&](const Face& f) { return f.on == on; });
          if (!known) faces.push_back({outward, on});
        }
      }
  HullFaces out;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    out.normals.push_back(faces[i].normal);
    for (std::size_t j = i + 1; j < faces.size(); ++j) {
      on.clear();
      std::set_intersection(faces[i].on.begin(), faces[i].on.end(), faces[j].on.begin(), faces[j].on.end(),
                            std::back_inserter(on));
      if (on.size() < 2) continue;
      const Point along = extent_of(points, on);
      if (length(along) > 0) out.edges.push_back({along, {faces[i].normal, faces[j].normal}});
    }
  }
  return out;
}

}  // namespace

HullFaces find_faces(std::span<const Point> points) {
  const Point& first = points.front();
  const Point along = furthest(points, [&](const Point& p) { return length(p - first); }) - first;
  const Real size = length(along);
  if (size == 0) return {{{{0, 0, 1}}}, {}};
  const Point line = unit(along);
  const Point beside = furthest(points, [&](const Point& p) { return length(cross(line, p - first)); }) - first;
  if (length(cross(line, beside)) <= kFlatTolerance * size) return faces_of_line(line);
  const Point up = unit(cross(line, beside));
  const Point above = furthest(points, [&](const Point& p) { return magnitude(dot(up, p - first)); }) - first;
  if (magnitude(dot(up, above)) <= kFlatTolerance * size) return faces_of_plane(points, up, size);
  return faces_of_solid(points, size);
}

}  // namespace cab::oracle
