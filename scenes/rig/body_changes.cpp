// Changes that a person makes to guessed bodies.
#include "scenes/rig/body_changes.h"

namespace cab::scenes {
namespace {

// Gives a body a shape and sizes. False if it then has no size.
bool change(const BodyChange& change, const Segments& segments, SkeletonBody& body) {
  body.is_solid = change.is_solid;
  if (!change.is_solid) return true;
  body.kind = change.kind;
  if (change.half) body.half = *change.half;
  if (change.radius) body.half[1] = body.half[2] = *change.radius;
  if (change.radius && change.kind == ShapeKind::kSphere) body.half[0] = *change.radius;
  if (body.reason == BodyReason::kTravels || body.reason == BodyReason::kOutside) {
    const Vec3& offset = segments.offset[static_cast<std::size_t>(body.end)];
    body.center = .5 * offset;
    if (length(offset) > 0) body.direction = (1 / length(offset)) * offset;
  }
  return body.half[0] > 0 && body.half[1] > 0 && body.half[2] > 0;
}

}  // namespace

std::optional<std::size_t> change_bodies(const std::vector<std::string>& names, const std::vector<BodyChange>& changes,
                                         SkeletonBodies& bodies) {
  for (std::size_t c = 0; c < changes.size(); ++c) {
    bool fits = false;
    for (SkeletonBody& body : bodies.bodies) {
      const std::string& to = body.end < 0 ? kNoEnd : names[static_cast<std::size_t>(body.end)];
      if (names[body.joint] != changes[c].link || to != changes[c].to) continue;
      if (!change(changes[c], bodies.segments, body)) return c;
      fits = true;
    }
    if (!fits) return c;
  }
  return std::nullopt;
}

}  // namespace cab::scenes
