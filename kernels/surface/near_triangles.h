// The triangles of a leaf that are near a box.
#pragma once

#include "kernels/surface/skin_leaf.h"

namespace cab::kernel {

// The lanes of a tile of bounds that overlap a box, which is finite.
template <class V>
CAB_INLINE std::uint32_t lanes_near(const AabbTile& tile, const float (&lo)[3], const float (&hi)[3]) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Mask<V> near = Lanes<V>::load(tile.lo[0] + lane) <= V(hi[0]);
    near = both(near, V(lo[0]) <= Lanes<V>::load(tile.hi[0] + lane));
    for (std::uint32_t c = 1; c < 3; ++c)
      near = both(near,
                  both(Lanes<V>::load(tile.lo[c] + lane) <= V(hi[c]), V(lo[c]) <= Lanes<V>::load(tile.hi[c] + lane)));
    out |= bits(near) << lane;
  }
  return out;
}

// Writes the triangles of a skinned leaf whose bounds overlap a box: kLanes times the patch, and the lane. Returns how
// many there are, at most kLanes times patch_count.
template <class V>
std::uint32_t near_triangles(const SkinnedLeaf& leaf, std::uint32_t patch_count, const float (&lo)[3],
                             const float (&hi)[3], std::uint32_t* out) {
  std::uint32_t count = 0;
  for (std::uint32_t first = 0; first < patch_count; first += kLanes)
    for (std::uint32_t near = lanes_near<V>(leaf.bounds[patch_count + first / kLanes], lo, hi); near;
         near &= near - 1) {
      const std::uint32_t patch = first + lowest_bit(near);
      for (std::uint32_t lanes = lanes_near<V>(leaf.bounds[patch], lo, hi); lanes; lanes &= lanes - 1)
        out[count++] = kLanes * patch + lowest_bit(lanes);
    }
  return count;
}

}  // namespace cab::kernel
