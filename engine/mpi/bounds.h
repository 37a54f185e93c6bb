// Bounds of characters along the world's axes.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <vector>

namespace cab::mpi {

// Bounds of a character's leaf boxes, widened by its own margin, relative to a point. None, if a lower side is above
// the upper one: the character is masked.
struct RelativeBounds {
  float lo[3], hi[3];
  bool none() const { return lo[0] > hi[0]; }
};

inline constexpr RelativeBounds kNoBounds = {{1, 1, 1}, {-1, -1, -1}};

// How much farther bounds reach for each unit of a character's own margin.
inline constexpr double kOwnMarginReach = 1.76;

struct WorldBounds {
  double lo[3], hi[3];
};

bool meet(const WorldBounds& a, const WorldBounds& b);
void widen(WorldBounds& bounds, const WorldBounds& other);

// The bounds in the world, widened by a frame's margin, so that whatever run_frame tests against each other meets.
// about: x y z of the point that they are relative to.
WorldBounds in_world(const double* about, const RelativeBounds& bounds, float margin);

// The same bounds relative to another point, rounded outwards.
RelativeBounds relative_to(const double* point, const double* about, const RelativeBounds& bounds);

// find_candidates takes bounds to kMaxCoordinate, but boxes reach up to 2.8 times as far from a character's origin, and
// 1.8 times its own margin farther. So it gets lengths and places of this share, and bounds are rounded outwards.
inline constexpr float kSearchScale = 0.125f;
RelativeBounds scaled_for_search(const RelativeBounds& bounds);

// Bounds some characters of one articulation. batch: of the engine, with room for `slice` characters at a time. input:
// as in compute_boxes. chosen: whom, ascending. Writes to bounds[i] for each character i of them. Statuses: those of
// compute_boxes.
Status bound_characters(Engine& engine, BatchId batch, std::uint32_t slice, const BatchInput& input,
                        Span<const std::uint32_t> chosen, const Policies& policies, Span<RelativeBounds> bounds);

}  // namespace cab::mpi
