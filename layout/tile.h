// Tiles: one quantity of 16 instances as a structure of arrays. A lane is an instance, never a coordinate.
#pragma once

#include <cab/types.h>

#include <cstdint>

namespace cab {

// The number of instances in a tile, on every instruction set.
inline constexpr std::uint32_t kLanes = 16;

// The box of one node of 16 instances. axis[k][c] is component c of axis k. Axes are orthonormal to rounding
// (docs/proof.md, part 1), half >= 0, and no lane holds a NaN. Lanes past the last instance repeat it.
struct alignas(64) BoxTile {
  float center[3][kLanes];
  float axis[3][3][kLanes];
  float half[3][kLanes];
};
static_assert(sizeof(BoxTile) == 960);

// The axis-aligned box of one node of 16 instances.
struct alignas(64) AabbTile {
  float lo[3][kLanes];
  float hi[3][kLanes];
};
static_assert(sizeof(AabbTile) == 384);

// One point per instance, such as a joint.
struct alignas(64) PointTile {
  float at[3][kLanes];
};

// One motion per instance: the columns of the rotation, the translation, and the scale.
struct alignas(64) MotionTile {
  float column[3][3][kLanes];
  float translation[3][kLanes];
  float scale[kLanes];
};

// The difference of origins of 16 pairs of instances, in double: that of the second less that of the first.
struct alignas(64) ShiftTile {
  double by[3][kLanes];
};

// Writes a box to one lane of a tile.
inline void set_lane(const Box& box, std::uint32_t lane, BoxTile& tile) {
  for (int c = 0; c < 3; ++c) {
    tile.center[c][lane] = box.center[c];
    tile.half[c][lane] = box.half[c];
    for (int k = 0; k < 3; ++k) tile.axis[k][c][lane] = box.axis[k][c];
  }
}

inline constexpr std::uint32_t tile_count(std::uint32_t instances) { return (instances + kLanes - 1) / kLanes; }

// So few instances of a skin are posed with leaves as lanes; more of them are faster by lanes of instances (measured).
// Leaf n of instance i is in lane n % kLanes of tile i * tile_count(leaves) + n / kLanes. The lanes after an instance's
// last leaf repeat it.
inline constexpr std::uint32_t kFewInstances = 5;

}  // namespace cab
