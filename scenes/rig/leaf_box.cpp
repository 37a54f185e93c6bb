// The leaf box about a link's convex parts.
#include "scenes/rig/leaf_box.h"

#include "layout/rounded_up.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::scenes {
namespace {

using Axes = std::array<Vec3, 3>;

// The orientations of this many parts are tried, chosen evenly. With all of them the work would be quadratic, and one
// link of a file may have 65 000 parts.
constexpr std::size_t kMaxOwnOrientations = 256;
// The planes of pairs are tried among this many parts. With more the work would be cubic without gain.
constexpr std::size_t kMaxPairedParts = 16;
// This is more than outward rounding needs. It also covers readers that do not normalise a part's float rotation.
constexpr double kMargin = 0x1p-22;

Axes rounded_to_float(Axes axes) {
  for (Vec3& axis : axes) {
    for (double& component : axis) component = static_cast<double>(static_cast<float>(component));
  }
  return axes;
}

Axes axes_of(const ConvexPart& part) {
  const float* const r = part.rotation;
  const Quat q = normalized({r[0], r[1], r[2], r[3]});
  return {rotate(q, {1, 0, 0}), rotate(q, {0, 1, 0}), rotate(q, {0, 0, 1})};
}

// Parts, and the axes of each.
struct PlacedParts {
  const std::vector<ConvexPart>& parts;
  std::vector<Axes> axes;
};

Vec3 position_of(const ConvexPart& part) { return {part.position[0], part.position[1], part.position[2]}; }

// Half the width of a part along a direction, whose components along the part's axes are c, times its length.
double half_width(const ConvexPart& part, const Vec3& c) {
  const double a = part.size[0], b = part.size[1];
  switch (part.kind) {
    case ShapeKind::kBox: return std::fabs(a * c[0]) + std::fabs(b * c[1]) + std::fabs(part.size[2] * c[2]);
    case ShapeKind::kSphere: return a * length(c);
    case ShapeKind::kCapsule: return a * length(c) + std::fabs(b * c[2]);
    case ShapeKind::kCylinder: return a * std::sqrt(c[0] * c[0] + c[1] * c[1]) + std::fabs(b * c[2]);
    case ShapeKind::kEllipsoid:
    case ShapeKind::kConvexHull:  // and a half space: no body of a rig is one
    case ShapeKind::kHalfSpace: break;
  }
  double width_sq = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double term = part.size[k] * c[k];
    width_sq += term * term;
  }
  return std::sqrt(width_sq);
}

// The least and the greatest dot(direction, x) over all points x of all parts.
std::array<double, 2> bounds(const PlacedParts& placed, const Vec3& direction) {
  std::array<double, 2> range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (std::size_t p = 0; p < placed.parts.size(); ++p) {
    const ConvexPart& part = placed.parts[p];
    const Axes& axes = placed.axes[p];
    const double reach = half_width(part, {dot(direction, axes[0]), dot(direction, axes[1]), dot(direction, axes[2])});
    const double middle = dot(direction, position_of(part));
    range[0] = std::min(range[0], middle - reach);
    range[1] = std::max(range[1], middle + reach);
  }
  return range;
}

double volume(const PlacedParts& placed, const Axes& axes) {
  double product = 1;
  for (const Vec3& axis : axes) {
    const auto [low, high] = bounds(placed, axis);
    product *= high - low;
  }
  return product;
}

}  // namespace

Box leaf_box(const std::vector<ConvexPart>& parts) {
  PlacedParts placed = {parts, {}};
  placed.axes.reserve(parts.size());
  for (const ConvexPart& part : parts) placed.axes.push_back(axes_of(part));
  const std::size_t own = std::min(parts.size(), kMaxOwnOrientations), paired = std::min(own, kMaxPairedParts);
  std::vector<Axes> candidates;
  candidates.reserve(own + kMaxPairedParts * kMaxPairedParts);
  for (std::size_t i = 0; i < own; ++i) candidates.push_back(placed.axes[i * parts.size() / own]);
  for (std::size_t i = 0; i < paired; ++i) {
    for (std::size_t j = 0; j < paired; ++j) {
      const Vec3 along = candidates[i][0];
      Vec3 normal = cross(along, candidates[j][0]);
      const double n = length(normal);
      if (n < 1e-3) continue;
      normal = (1 / n) * normal;
      candidates.push_back({along, cross(normal, along), normal});
    }
  }
  Axes axes = rounded_to_float(candidates[0]);
  double least = volume(placed, axes);
  for (const Axes& candidate : candidates) {
    const Axes rounded = rounded_to_float(candidate);
    const double size = volume(placed, rounded);
    // Only a clear gain counts, so that rounding does not choose between equal boxes.
    if (size < least * (1 - 1e-9)) {
      least = size;
      axes = rounded;
    }
  }

  Box box = {};
  Vec3 center = {0, 0, 0};
  for (const Vec3& axis : axes) {
    const auto [low, high] = bounds(placed, axis);
    center = center + (.5 * (low + high)) * axis;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    box.center[k] = static_cast<float>(center[k]);
    center[k] = static_cast<double>(box.center[k]);
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axes[k][c]);
  }
  // Axes in float are not quite orthonormal. A point of the box is center + sum x_k axis_k, so the dual axes give its
  // x_k. Readers that project on the axes themselves get nearly the same. The half extents hold for both.
  const double determinant = dot(axes[0], cross(axes[1], axes[2]));
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 dual = (1 / determinant) * cross(axes[(k + 1) % 3], axes[(k + 2) % 3]);
    double half = 0;
    for (const Vec3& direction : {axes[k], dual}) {
      const auto [low, high] = bounds(placed, direction);
      const double middle = dot(direction, center);
      half = std::max({half, high - middle, middle - low});
    }
    box.half[k] = rounded_up(half * (1 + kMargin));
  }
  return box;
}

}  // namespace cab::scenes
