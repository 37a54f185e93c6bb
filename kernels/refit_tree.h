// Refit: leaf boxes of one tile -> every inner box, children first, by one merge program.
#pragma once

#include "kernels/merge_aabb.h"
#include "kernels/merge_cab.h"
#include "layout/merge_program.h"

namespace cab::kernel {

// Merges two nodes of a tile into their parent. All lanes' axes come first: choosing axes is one long chain of
// dependent operations, and the chains of several groups of lanes overlap (measured: AVX2 and SSE2).
template <class V>
CAB_INLINE void merge_tile(const BoxTile& left, const BoxTile& right, const PointTile* joint, BoxTile& parent) {
  Vec3<V> axes[kLanes / kWidth<V>][3];
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Vec3<V> at;
    if (joint) at = load3<V>(joint->at, lane);
    cab_axes(load_box<V>(left, lane), load_box<V>(right, lane), joint ? &at : nullptr, axes[lane / kWidth<V>]);
  }
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    store_box(parent, lane, enclose(load_box<V>(left, lane), load_box<V>(right, lane), axes[lane / kWidth<V>]));
}

// nodes: leaf boxes in, inner boxes out (2 leaf_count - 1). joints are indexed by link.
template <class V>
void refit_cab(const MergeProgram& program, const PointTile* joints, BoxTile* nodes) {
  BoxTile* parent = nodes + program.steps.size + 1;
  for (const MergeStep& step : program.steps) {
    const PointTile* joint = step.joint_link == kNoJoint ? nullptr : joints + step.joint_link;
    merge_tile<V>(nodes[step.left], nodes[step.right], joint, *parent++);
  }
}

// Bounds of each of `count` boxes.
template <class V>
void bound_boxes(const BoxTile* boxes, std::uint32_t count, AabbTile* bounds) {
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
      store_aabb(bounds[i], lane, bounds_of(load_box<V>(boxes[i], lane)));
}

// The bounds of all `count` boxes together.
template <class V>
void bound_together(const BoxTile* boxes, std::uint32_t count, AabbTile* bounds) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    AabbLanes<V> all = bounds_of(load_box<V>(boxes[0], lane));
    for (std::uint32_t i = 1; i < count; ++i) all = merge_aabb(all, bounds_of(load_box<V>(boxes[i], lane)));
    store_aabb(*bounds, lane, all);
  }
}

// nodes: leaf bounds in, inner bounds out.
template <class V>
void refit_aabb(const MergeProgram& program, AabbTile* nodes) {
  AabbTile* parent = nodes + program.steps.size + 1;
  for (const MergeStep& step : program.steps) {
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
      store_aabb(*parent, lane,
                 merge_aabb(load_aabb<V>(nodes[step.left], lane), load_aabb<V>(nodes[step.right], lane)));
    ++parent;
  }
}

}  // namespace cab::kernel
