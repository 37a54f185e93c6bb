// How far leaf boxes, and the vertices of skins, leave the straight line between two moments.
#pragma once

#include "kernels/pose_leaves.h"

namespace cab::kernel {

// Sixteen instances at two moments. Poses are quaternions and translations. Unused lanes repeat a used one.
struct BulgeTile {
  const Articulation* articulation;
  const float* reach;         // by link: how far what it moves is from its origin, at most; below 0 if it moves nothing
  const float* from[kLanes];  // the pose of each instance's first link
  const float* to[kLanes];
  const float* from_orientation[kLanes];  // 4 floats per instance
  const float* to_orientation[kLanes];
  alignas(64) float from_scale[kLanes], to_scale[kLanes];

  // Receives how far any point of the leaf boxes, or of the triangles of leaves that have some, can be, between the
  // two, from the straight line between where it is at both; without the origins of the instances, which are on a line
  // (docs/proof.md, steps 13.3, 13.5 and 13.7).
  alignas(64) float bulge[kLanes];
};

// How far two rotations are from each other: one less the cosine of half the angle, and the sine; at least that.
template <class V>
struct HalfTurn {
  V versine, sine;

  CAB_INLINE HalfTurn(const RawPoses& from, const RawPoses& to, std::uint32_t lane) {
    V product(0.0f), from_sq(0.0f), to_sq(0.0f);
    for (std::uint32_t c = 0; c < 4; ++c) {
      const V a = Lanes<V>::load(from.raw[c] + lane), b = Lanes<V>::load(to.raw[c] + lane);
      product = product + a * b;
      from_sq = from_sq + a * a;
      to_sq = to_sq + b * b;
    }
    const V one(1.0f), cosine = min(one, divide(abs(product), sqrt(from_sq * to_sq)));
    versine = (one - cosine) + V(kHistoryCosine);
    sine = sqrt(versine * (one + cosine));
  }
};

template <class V>
void bound_bulge(BulgeTile& tile) {
  RawPoses from, to;
  read_quad<V>(tile.from_orientation, 0, 0, from);
  read_quad<V>(tile.to_orientation, 0, 0, to);
  alignas(64) float versine[kLanes], sine[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const HalfTurn<V> turn(from, to, lane);
    Lanes<V>::store(versine + lane, turn.versine);
    Lanes<V>::store(sine + lane, turn.sine);
    Lanes<V>::store(tile.bulge + lane, V(0.0f));
  }
  constexpr std::uint32_t kFloats = pose_floats(PoseFormat::kQuaternionTranslation);
  for (const PosedLink& posed : tile.articulation->posed_links) {
    if (tile.reach[posed.link] < 0) continue;
    const V reach(tile.reach[posed.link]);
    read_raw<V>(tile.from, posed.link * kFloats, kFloats, from);
    read_raw<V>(tile.to, posed.link * kFloats, kFloats, to);
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      const HalfTurn<V> turn(from, to, lane);
      V away_from(0.0f), away_to(0.0f), way(0.0f);
      for (std::uint32_t c = 4; c < kFloats; ++c) {
        const V a = Lanes<V>::load(from.raw[c] + lane), b = Lanes<V>::load(to.raw[c] + lane);
        away_from = away_from + abs(a);
        away_to = away_to + abs(b);
        way = way + abs(b - a);
      }
      const V scale_from = Lanes<V>::load(tile.from_scale + lane), scale_to = Lanes<V>::load(tile.to_scale + lane);
      const V scale = max(scale_from, scale_to), rescaled = abs(scale_to - scale_from);
      const V most = max(away_from, away_to) + reach, moved = way + V(2.0f) * turn.sine * reach;
      const V in_instance = scale * turn.versine * reach + V(0.25f) * rescaled * moved;
      const V by_orientation = Lanes<V>::load(versine + lane) * scale * most +
                               V(0.5f) * Lanes<V>::load(sine + lane) * (scale * moved + rescaled * most);
      const V bulge = (in_instance + by_orientation) + V(static_cast<float>(kHistoryPad)) * scale * (most + reach);
      Lanes<V>::store(tile.bulge + lane, max(Lanes<V>::load(tile.bulge + lane), V(kHistoryRounding) * bulge));
    }
  }
}

}  // namespace cab::kernel
