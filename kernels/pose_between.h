// Poses between two moments: rotations by the straight line between two quaternions of length 1, translations along a
// straight line.
#pragma once

#include "kernels/simd.h"

#include <cstdint>

namespace cab::kernel {

// The floats of one pose of 16 instances: raw[f] holds float f of each.
struct RawPoses {
  alignas(64) float raw[16][kLanes];
};

// The later of two moments of sixteen instances, and where between the two each of them is.
struct LaterPoses {
  const float* poses[kLanes];         // the pose of each instance's first link
  const float* orientations[kLanes];  // 4 floats per instance, if the earlier moment has them
  alignas(64) float part[kLanes];     // of the way to the later moment, 0 to 1
};

// Replaces the earlier poses in the lanes that V covers by those between them and the later ones. A lane whose part is
// 0 keeps its bits. The first four floats are a quaternion of any length, and what follows up to `floats` a
// translation. The quaternion's length is between sqrt(1/2) and 1, but for rounding.
template <class V>
CAB_INLINE void blend_lanes(const RawPoses& later, const float* parts, std::uint32_t floats, std::uint32_t lane,
                            RawPoses& raw) {
  const auto load = [lane](const RawPoses& from, std::uint32_t f) { return Lanes<V>::load(from.raw[f] + lane); };
  const V zero(0.0f), one(1.0f);
  const V part = Lanes<V>::load(parts + lane), rest = one - part;
  const Mask<V> keeps = part <= zero;
  V q[4], r[4];
  for (std::uint32_t f = 0; f < 4; ++f) q[f] = load(raw, f), r[f] = load(later, f);
  const V length_q = sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  const V length_r = sqrt((r[0] * r[0] + r[1] * r[1]) + (r[2] * r[2] + r[3] * r[3]));
  const V cosine = (q[0] * r[0] + q[1] * r[1]) + (q[2] * r[2] + q[3] * r[3]);
  const V of_q = divide(rest, length_q), toward = divide(part, length_r);
  const V of_r = select(cosine < zero, zero - toward, toward);  // the shorter way round
  for (std::uint32_t f = 0; f < 4; ++f)
    Lanes<V>::store(raw.raw[f] + lane, select(keeps, q[f], of_q * q[f] + of_r * r[f]));
  for (std::uint32_t f = 4; f < floats; ++f) {
    const V from = load(raw, f);
    Lanes<V>::store(raw.raw[f] + lane, select(keeps, from, rest * from + part * load(later, f)));
  }
}

template <class V>
CAB_NOINLINE void blend_poses(const RawPoses& later, const float* parts, std::uint32_t floats, RawPoses& raw) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) blend_lanes<V>(later, parts, floats, lane, raw);
}

}  // namespace cab::kernel
