// Where a link is, in registers, one instance per lane.
#pragma once

#include "kernels/vec3.h"
#include "layout/tile.h"

namespace cab::kernel {

// Rotation, mirrored or not, translation and scale of a link, one instance per lane. A point p of the link is at
// translation + R (scale p).
template <class V>
struct RigidLanes {
  Vec3<V> column[3];
  Vec3<V> translation;
  V scale;
};

template <class V>
CAB_INLINE RigidLanes<V> load_motion(const MotionTile& tile, std::uint32_t lane) {
  return {{load3<V>(tile.column[0], lane), load3<V>(tile.column[1], lane), load3<V>(tile.column[2], lane)},
          load3<V>(tile.translation, lane),
          Lanes<V>::load(tile.scale + lane)};
}

template <class V>
CAB_INLINE void store_motion(MotionTile& tile, std::uint32_t lane, const RigidLanes<V>& motion) {
  for (int k = 0; k < 3; ++k) store3(tile.column[k], lane, motion.column[k]);
  store3(tile.translation, lane, motion.translation);
  Lanes<V>::store(tile.scale + lane, motion.scale);
}

}  // namespace cab::kernel
