// From a block of pairs to lanes: the pose of b's shape in the frame of a's shape, scaled to size 1, with the slack
// that covers all rounding up to there.
#pragma once

#include "kernels/convex/convex_block.h"

namespace cab::kernel {

// Pairs as lanes, in the frame of a's shape. All lengths are scaled.
template <class V>
struct PairLanes {
  Vec3<V> column[3];       // the axes of b's shape
  Vec3<V> t;               // its centre
  Vec3<V> size_a, size_b;  // ConvexShape::size
  V scale_a, scale_b;      // by which the lengths of each shape are multiplied
  V reach;                 // the sum of both reaches
  V slack;                 // more than how far rounding may move a point of b against a
};

// The 16 floats that a shape's record begins with, in lanes.
template <class V>
struct ShapeLanes {
  Vec3<V> position, column[3], size;
  V reach;
};

template <class V>
CAB_INLINE ShapeLanes<V> load_shapes(const ConvexShape* const* shapes) {
  const float* rows[kWidth<V>];
  for (std::uint32_t i = 0; i < kWidth<V>; ++i) rows[i] = reinterpret_cast<const float*>(shapes[i]);
  V f[16];
  Transpose<V>::load(rows, f);
  return {
      {f[0], f[1], f[2]}, {{f[3], f[4], f[5]}, {f[6], f[7], f[8]}, {f[9], f[10], f[11]}}, {f[12], f[13], f[14]}, f[15]};
}

// The raw poses of one side.
struct RawSide {
  RawPoses poses, orientations;
};

template <class V>
CAB_INLINE void read_side(const ConvexSide& side, RawSide& raw) {
  read_raw<V>(side.pose, 0, pose_floats(side.coding.format), raw.poses);
  if (side.orientation[0]) read_raw<V>(side.orientation, 0, 4, raw.orientations);
}

// A shape relative to the origin of its instance, in world axes. scale: that of its link. away: |translation|_1 of its
// link + |position|_1. V: a vector of floats or of doubles.
template <class V>
struct PosedShape {
  Vec3<V> column[3], center, size;
  V scale, reach, away;
};

// local: the shapes in the frames of their links, of the lanes that V covers from `lane` on.
template <class V>
CAB_INLINE PosedShape<V> pose_shape(const ConvexSide& side, const RawSide& raw, std::uint32_t lane,
                                    const ShapeLanes<V>& local) {
  const Mask<V> yes = V(0) <= V(0);
  LaneChecks<V> checks = {yes, yes, yes};  // not read: pose_leaves checked the pose when the instance was bounded
  const Placing placing = {side.coding, side.orientation[0] ? &raw.orientations : nullptr, side.scales};
  const RigidLanes<V> pose = placed_pose<V>(raw.poses, placing, lane, checks);
  const Vec3<V> position = pose.scale * local.position;
  PosedShape<V> out;
  for (int k = 0; k < 3; ++k) out.column[k] = rotate(pose.column, local.column[k]);
  out.center = pose.translation + rotate(pose.column, position);
  out.scale = pose.scale;
  out.size = pose.scale * local.size;
  out.reach = pose.scale * local.reach;
  out.away = sum(abs(pose.translation)) + sum(abs(position));
  return out;
}

// The lanes that V covers, from `lane` on.
template <class V>
CAB_INLINE PairLanes<V> pair_lanes(const ConvexBlock& block, const RawSide& raw_a, const RawSide& raw_b,
                                   std::uint32_t lane) {
  const PosedShape<V> a = pose_shape<V>(block.a, raw_a, lane, load_shapes<V>(block.a.shape + lane)),
                      b = pose_shape<V>(block.b, raw_b, lane, load_shapes<V>(block.b.shape + lane));
  const V scale = Lanes<V>::load(block.scale + lane);
  const Vec3<V> between = {difference(b.center.x, a.center.x, block.shift.by[0] + lane),
                           difference(b.center.y, a.center.y, block.shift.by[1] + lane),
                           difference(b.center.z, a.center.z, block.shift.by[2] + lane)};
  PairLanes<V> out;
  for (int k = 0; k < 3; ++k)
    out.column[k] = {dot(a.column[0], b.column[k]), dot(a.column[1], b.column[k]), dot(a.column[2], b.column[k])};
  out.t = scale * Vec3<V>{dot(a.column[0], between), dot(a.column[1], between), dot(a.column[2], between)};
  out.size_a = scale * a.size;
  out.size_b = scale * b.size;
  out.scale_a = scale * a.scale;
  out.scale_b = scale * b.scale;
  out.reach = scale * (a.reach + b.reach);
  out.slack = V(kConvexSlack) * (sum(abs(out.t)) + out.reach) + V(kConvexPoseSlack) * (scale * (a.away + b.away));
  return out;
}

}  // namespace cab::kernel
