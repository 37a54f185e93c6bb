// Characters: writes boxes as records of one cache line, and tests pairs of boxes as lanes.
#pragma once

#include "kernels/few_lanes.h"
#include "kernels/overlap_sat.h"
#include "kernels/transpose.h"
#include "layout/box_aos.h"

namespace cab::kernel {

// The box of one lane of a tile.
CAB_INLINE BoxAos box_in_lane(const BoxTile& tile, std::uint32_t lane) {
  BoxAos out;
  for (int c = 0; c < 3; ++c) {
    out.center[c] = tile.center[c][lane];
    out.half[c] = tile.half[c][lane];
    for (int k = 0; k < 3; ++k) out.axis[3 * k + c] = tile.axis[k][c][lane];
  }
  out.unused = 0;
  return out;
}

// Writes `count` nodes of the first `live` instances of a tile as records: node n of instance i goes to
// boxes[i * instance_stride + n].
template <class V>
void boxes_to_aos(const BoxTile* nodes, std::uint32_t count, std::uint32_t live, BoxAos* boxes,
                  std::size_t instance_stride) {
  if (live <= kFewLanes) {
    for (std::uint32_t lane = 0; lane < live; ++lane)
      for (std::uint32_t n = 0; n < count; ++n) boxes[lane * instance_stride + n] = box_in_lane(nodes[n], lane);
    return;
  }
  BoxAos unused;
  for (std::uint32_t n = 0; n < count; ++n) {
    for (std::uint32_t lane = 0; lane < live; lane += kWidth<V>) {
      const BoxLanes<V> box = load_box<V>(nodes[n], lane);
      const V fields[16] = {box.center.x,  box.center.y,  box.center.z,  box.axis[0].x, box.axis[0].y, box.axis[0].z,
                            box.axis[1].x, box.axis[1].y, box.axis[1].z, box.axis[2].x, box.axis[2].y, box.axis[2].z,
                            box.half.x,    box.half.y,    box.half.z,    V(0.0f)};
      float* to[kWidth<V>];
      for (std::uint32_t i = 0; i < kWidth<V>; ++i)
        to[i] = reinterpret_cast<float*>(lane + i < live ? &boxes[(lane + i) * instance_stride + n] : &unused);
      Transpose<V>::store(fields, to);
    }
  }
}

// The same for bounds.
template <class V>
void aabbs_to_aos(const AabbTile* nodes, std::uint32_t count, std::uint32_t live, AabbAos* boxes,
                  std::size_t instance_stride) {
  for (std::uint32_t lane = 0; lane < live; ++lane)
    for (std::uint32_t n = 0; n < count; ++n)
      for (int c = 0; c < 3; ++c) {
        boxes[lane * instance_stride + n].lo[c] = nodes[n].lo[c][lane];
        boxes[lane * instance_stride + n].hi[c] = nodes[n].hi[c][lane];
      }
}

// Sixteen pairs of boxes. Unused lanes repeat a used one. shift: the origins of b less the origins of a, or null if
// they are equal. leaves: bits of the lanes that hold a pair of leaves, which must pass the leaf predicate.
template <class AosBox>
struct BoxPairs {
  const AosBox* a[kLanes];
  const AosBox* b[kLanes];
  const ShiftTile* shift;
  std::uint32_t leaves;
};

// extra: BoxAos::unused of each box.
template <class V>
CAB_INLINE BoxLanes<V> gather_boxes(const BoxAos* const* boxes, V& extra) {
  const float* from[kWidth<V>];
  for (std::uint32_t i = 0; i < kWidth<V>; ++i) from[i] = reinterpret_cast<const float*>(boxes[i]);
  V f[16];
  Transpose<V>::load(from, f);
  extra = f[15];
  return {{f[0], f[1], f[2]}, {{f[3], f[4], f[5]}, {f[6], f[7], f[8]}, {f[9], f[10], f[11]}}, {f[12], f[13], f[14]}};
}

template <class V>
CAB_INLINE BoxLanes<V> gather_boxes(const BoxAos* const* boxes) {
  V unused;
  return gather_boxes<V>(boxes, unused);
}

// Returns the bits of the pairs that overlap.
template <class V, Sat kSat>
std::uint32_t overlap_boxes(const BoxPairs<BoxAos>& pairs) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const BoxLanes<V> a = gather_boxes<V>(pairs.a + lane), b = gather_boxes<V>(pairs.b + lane);
    const Vec3<V> between = between_centers(a, b, pairs.shift, lane);
    std::uint32_t apart = bits(separated<kSat>(a, b, between));
    const std::uint32_t leaves = pairs.leaves >> lane & ((1u << kWidth<V>)-1);
    if (leaves & ~apart) apart |= bits(separated_in_world(a, b, between)) & leaves;
    out |= (~apart & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

template <class V>
std::uint32_t overlap_aabbs(const BoxPairs<AabbAos>& pairs) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    alignas(64) float pair[kWidth<V>][16];
    const float* from[kWidth<V>];
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
      std::memcpy(pair[i], pairs.a[lane + i], sizeof(AabbAos));
      std::memcpy(pair[i] + 8, pairs.b[lane + i], sizeof(AabbAos));
      from[i] = pair[i];
    }
    V f[16];
    Transpose<V>::load(from, f);
    const AabbLanes<V> a = {{f[0], f[1], f[2]}, {f[3], f[4], f[5]}}, b = {{f[8], f[9], f[10]}, {f[11], f[12], f[13]}};
    const double* x = pairs.shift ? pairs.shift->by[0] + lane : nullptr;
    const double* y = pairs.shift ? pairs.shift->by[1] + lane : nullptr;
    const double* z = pairs.shift ? pairs.shift->by[2] + lane : nullptr;
    out |= (~bits(bounds_apart(a, b, x, y, z)) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

}  // namespace cab::kernel
