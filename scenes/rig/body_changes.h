// Changes that a person makes to guessed bodies.
#pragma once

#include "scenes/rig/skeleton_bodies.h"

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// What BodyChange::to says for a cap or a ball.
inline constexpr const char* kNoEnd = "-";

// A change of all bodies between two joints of these names.
struct BodyChange {
  std::string link;                           // the name of the joint that the body moves with
  std::string to;                             // the name of the joint at the other end, or kNoEnd
  bool is_solid = true;                       // false: no body
  ShapeKind kind = ShapeKind::kEllipsoid;     // not a hull, not a half space
  std::optional<std::array<double, 3>> half;  // metres, along the bone and across it; empty: as guessed
  std::optional<double> radius;               // metres, across the bone; empty: as guessed
};

// Changes bodies. A segment that was no bone becomes solid only if its half extents are given. Returns the index of the
// first change that no body fits, or that asks for a body without a size. Empty: every change was made.
std::optional<std::size_t> change_bodies(const std::vector<std::string>& names, const std::vector<BodyChange>& changes,
                                         SkeletonBodies& bodies);

}  // namespace cab::scenes
