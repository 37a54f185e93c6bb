// Refit: leaf boxes of one tile -> every inner box, children first, by one merge program.
#pragma once

#include "kernels/merge_aabb.h"
#include "kernels/merge_cab.h"
#include "layout/merge_program.h"

namespace cab::kernel {

// nodes: leaf boxes in, inner boxes out (2 leaf_count - 1). joints are indexed by link.
template <class V>
void refit_cab(const MergeProgram& program, const PointTile* joints, BoxTile* nodes) {
  BoxTile* parent = nodes + program.steps.size + 1;
  for (const MergeStep& step : program.steps) {
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      const BoxLanes<V> left = load_box<V>(nodes[step.left], lane);
      const BoxLanes<V> right = load_box<V>(nodes[step.right], lane);
      if (step.joint_link == kNoJoint) {
        store_box(*parent, lane, merge_cab<V>(left, right, nullptr));
      } else {
        const Vec3<V> joint = load3<V>(joints[step.joint_link].at, lane);
        store_box(*parent, lane, merge_cab(left, right, &joint));
      }
    }
    ++parent;
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
