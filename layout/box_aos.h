// Boxes as an array of structures: one box of one instance in one cache line, for tests that read boxes by index.
#pragma once

#include "layout/tile.h"

namespace cab {

// An oriented box: center, axes, half extents. Component c of axis k is axis[3 k + c].
struct alignas(64) BoxAos {
  float center[3];
  float axis[9];
  float half[3];
  float unused;
};
static_assert(sizeof(BoxAos) == 64);

// An axis-aligned box.
struct alignas(32) AabbAos {
  float lo[3];
  float hi[3];
  float unused[2];
};
static_assert(sizeof(AabbAos) == 32);

}  // namespace cab
