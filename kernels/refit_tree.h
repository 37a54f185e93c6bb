// Refit: makes every inner box of one tile from its leaf boxes, children first, by one merge program.
#pragma once

#include "kernels/merge_aabb.h"
#include "kernels/merge_cab.h"
#include "kernels/merge_covariance.h"
#include "layout/articulation.h"

namespace cab::kernel {

// A tile to refit. nodes: the leaf boxes are read, the inner boxes are written. joints are indexed by link.
struct RefitTile {
  const MergeProgram* program;
  const PointTile* joints;
  BoxTile* nodes;
};

// One node to make: its children and the joint that they share.
struct MergeTile {
  const RefitTile* tile;
  std::uint32_t left, right, parent;
  const BoxTile* first;    // the box of node left
  const BoxTile* second;   // the box of node right
  const PointTile* joint;  // null: they share no joint, or the rule reads no joint
};

// ---- rules: each chooses the axes of a parent; an Extents type then makes its box

template <bool UseSum>
struct CabRule {
  static constexpr bool kUsesJoint = true;
  template <class V, class Extents, bool HasJoint>
  static CAB_INLINE void choose_axes(const MergeTile& merge, std::uint32_t lane, Vec3<V> (&axes)[3]) {
    const Vec3<V> joint = HasJoint ? load3<V>(merge.joint->at, lane) : Vec3<V>{};
    cab_axes<V, UseSum>(load_box<V>(*merge.first, lane), load_box<V>(*merge.second, lane), HasJoint ? &joint : nullptr,
                        axes);
  }
};

// Principal axes of the sixteen corners of the children. If the direction of a child does not matter (both_matter), the
// axes are copied from one child.
struct CovarianceRule {
  static constexpr bool kUsesJoint = false;
  template <class V, class Extents, bool HasJoint>
  static CAB_INLINE void choose_axes(const MergeTile& merge, std::uint32_t lane, Vec3<V> (&axes)[3]) {
    const BoxLanes<V> left = load_box<V>(*merge.first, lane);
    const BoxLanes<V> right = load_box<V>(*merge.second, lane);
    eigen_axes(corner_covariance(left, right), axes);
    const MajorAxis<V> major_1 = major_axis(left, left.center), major_2 = major_axis(right, right.center);
    const Mask<V> both_count = both_matter(major_1, major_2), copy_2 = copies_second(major_1, major_2);
    for (int k = 0; k < 3; ++k)
      axes[k] = choose<V>(both_count, axes[k], choose<V>(copy_2, right.axis[k], left.axis[k]));
  }
};

// An eighth of a box's surface.
template <class V>
CAB_INLINE V eighth_of_surface(Vec3<V> half) {
  return half.x * half.y + half.y * half.z + half.z * half.x;
}

// Of CAB's axes and each child's own axes, those along which the box has the least surface. If surfaces are equal or
// NaN, CAB's axes win, then the first child's. Surfaces are measured relative to CAB's box, so that no square under- or
// overflows. A child's axes are copied, so their errors do not grow.
struct Best3Rule {
  static constexpr bool kUsesJoint = true;
  template <class V, class Extents, bool HasJoint>
  static CAB_INLINE void choose_axes(const MergeTile& merge, std::uint32_t lane, Vec3<V> (&axes)[3]) {
    CabRule<false>::choose_axes<V, Extents, HasJoint>(merge, lane, axes);
    const Vec3<V> half = Extents::template contain<V>(merge, lane, axes).half;
    const V scale = divide(V(1.0f), max_component(half));
    V least = eighth_of_surface(scale * half);
    for (const BoxTile* child : {merge.first, merge.second}) {
      const BoxLanes<V> box = load_box<V>(*child, lane);
      const V surface = eighth_of_surface(scale * Extents::template contain<V>(merge, lane, box.axis).half);
      const Mask<V> smaller = surface < least;
      for (int k = 0; k < 3; ++k) axes[k] = choose<V>(smaller, box.axis[k], axes[k]);
      least = select(smaller, surface, least);
    }
  }
};

// ---- extents: what a parent contains

struct ChildrenExtents {
  template <class V>
  static CAB_INLINE BoxLanes<V> contain(const MergeTile& merge, std::uint32_t lane, const Vec3<V> (&axes)[3]) {
    return enclose(load_box<V>(*merge.first, lane), load_box<V>(*merge.second, lane), axes);
  }
};

struct LeavesExtents {
  template <class V>
  static CAB_INLINE BoxLanes<V> contain(const MergeTile& merge, std::uint32_t lane, const Vec3<V> (&axes)[3]) {
    const MergeProgram& program = *merge.tile->program;
    const std::uint16_t* leaves = program.leaf_sequence.data + program.node_first_leaf[merge.parent];
    Enclosure<V> out(load_box<V>(merge.tile->nodes[leaves[0]], lane), axes);
    for (std::uint32_t i = 1; i < program.node_leaf_count[merge.parent]; ++i)
      out.add(load_box<V>(merge.tile->nodes[leaves[i]], lane));
    return out.box();
  }
};

// Makes one parent in all lanes. The axes of all lanes are chosen first: each choice is a long chain of dependent
// operations, and the CPU overlaps the chains of several groups of lanes (measured with AVX2 and SSE2).
template <class V, class Rule, class Extents, bool HasJoint>
CAB_INLINE void merge_node(const MergeTile merge) {
  Vec3<V> axes[kLanes / kWidth<V>][3];
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    Rule::template choose_axes<V, Extents, HasJoint>(merge, lane, axes[lane / kWidth<V>]);
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    store_box(merge.tile->nodes[merge.parent], lane, Extents::template contain<V>(merge, lane, axes[lane / kWidth<V>]));
}

// Makes every inner box of a tile, children first.
template <class V, class Rule, class Extents>
void refit_boxes(const RefitTile& tile) {
  const MergeProgram& program = *tile.program;
  const std::uint32_t leaves = static_cast<std::uint32_t>(program.steps.size) + 1;
  std::uint32_t parent = leaves;
  for (const MergeStep& step : program.steps) {
    MergeTile merge = {&tile, step.left, step.right, parent, &tile.nodes[step.left], &tile.nodes[step.right], nullptr};
    if (Rule::kUsesJoint && step.joint_link != kNoJoint) {
      merge.joint = tile.joints + step.joint_link;
      merge_node<V, Rule, Extents, Rule::kUsesJoint>(merge);
    } else {
      merge_node<V, Rule, Extents, false>(merge);
    }
    ++parent;
  }
}

// Writes the bounds of each of `count` boxes.
template <class V>
void bound_boxes(const BoxTile* boxes, std::uint32_t count, AabbTile* bounds) {
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
      store_aabb(bounds[i], lane, bounds_of(load_box<V>(boxes[i], lane)));
}

// Writes the bounds that enclose all of `count` bounds.
template <class V>
void bound_together(const AabbTile* bounds, std::uint32_t count, AabbTile* all) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    AabbLanes<V> out = load_aabb<V>(bounds[0], lane);
    for (std::uint32_t i = 1; i < count; ++i) out = merge_aabb(out, load_aabb<V>(bounds[i], lane));
    store_aabb(*all, lane, out);
  }
}

// Makes all inner bounds of a tile from the bounds of their children. nodes: the leaf bounds are read, the inner bounds
// are written.
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

// Makes the same bounds, but each from the bounds of all leaves below its node: the paper's refit from the corners of
// the leaf hulls.
template <class V>
void refit_aabb_leaves(const MergeProgram& program, AabbTile* nodes) {
  const std::uint32_t leaves = static_cast<std::uint32_t>(program.steps.size) + 1;
  for (std::uint32_t node = leaves; node < 2 * leaves - 1; ++node) {
    const std::uint16_t* below = program.leaf_sequence.data + program.node_first_leaf[node];
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      AabbLanes<V> all = load_aabb<V>(nodes[below[0]], lane);
      for (std::uint32_t i = 1; i < program.node_leaf_count[node]; ++i)
        all = merge_aabb(all, load_aabb<V>(nodes[below[i]], lane));
      store_aabb(nodes[node], lane, all);
    }
  }
}

// A tile whose first node_count nodes, leaves first, are each fitted to all vertices below them (the paper's AABB+).
// motions are indexed by link. pad: the padding of posed leaf boxes.
struct VertexTile {
  const Articulation* articulation;
  std::uint32_t node_count;
  const MotionTile* motions;
  AabbTile* nodes;
  PosePad pad;
  const float* margins;  // by lane, as PoseTile::margins
};

// The bounds of one leaf's vertices, widened by what posing can round.
template <class V>
CAB_INLINE AabbLanes<V> bound_vertices(const VertexTile& tile, std::uint32_t leaf, std::uint32_t lane) {
  const Articulation& articulation = *tile.articulation;
  const MotionTile& motion = tile.motions[articulation.leaf_link[leaf]];
  const Vec3<V> column[3] = {load3<V>(motion.column[0], lane), load3<V>(motion.column[1], lane),
                             load3<V>(motion.column[2], lane)};
  const Vec3<V> translation = load3<V>(motion.translation, lane);
  const V scale = Lanes<V>::load(motion.scale + lane);
  const V largest(3.402823466e38f);
  AabbLanes<V> out = {{largest, largest, largest}, {-largest, -largest, -largest}};
  for (std::uint32_t v = articulation.leaf_vertex_begin[leaf]; v < articulation.leaf_vertex_begin[leaf + 1]; ++v) {
    const float* vertex = articulation.vertices.data + 3 * std::size_t{v};
    const Vec3<V> at = V(vertex[0]) * column[0] + V(vertex[1]) * column[1] + V(vertex[2]) * column[2];
    out = merge_aabb(out, AabbLanes<V>{at, at});
  }
  const V body = V(tile.pad.body) * (scale * V(articulation.leaf_vertex_reach[leaf])) + V(kMergePadTiny);
  const V pad =
      (body + Lanes<V>::load(tile.margins + lane)) + V(tile.pad.translation) * max_component(abs(translation));
  const Vec3<V> wide = {pad, pad, pad};
  return {scale * out.lo + translation - wide, scale * out.hi + translation + wide};
}

template <class V>
void fit_vertices(const VertexTile& tile) {
  const MergeProgram& program = tile.articulation->program;
  for (std::uint32_t node = 0; node < tile.node_count; ++node) {
    const std::uint16_t* below = program.leaf_sequence.data + program.node_first_leaf[node];
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      AabbLanes<V> all = bound_vertices<V>(tile, below[0], lane);
      for (std::uint32_t i = 1; i < program.node_leaf_count[node]; ++i)
        all = merge_aabb(all, bound_vertices<V>(tile, below[i], lane));
      store_aabb(tile.nodes[node], lane, all);
    }
  }
}

}  // namespace cab::kernel
