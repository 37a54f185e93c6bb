// Pairs of convex shapes that wait for a kernel: one block for each kind of a's shape and each kind of b's shape.
#pragma once

#include "engine/exact/convex.h"
#include "engine/exact/convex_pair.h"
#include "layout/convex_shapes.h"

namespace cab {

// One side of a leaf pair: the shapes of the leaf, the pose of its link, and the scale of that pose, rounded.
struct LeafShapes {
  Span<const ConvexShape> shapes;
  StoredPose at;
  float scale;
};

inline LeafShapes shapes_of(const ExactLeaf& leaf) {
  const InstanceBatch& batch = *leaf.batch;
  const std::uint32_t begin = leaf.convex_shapes->leaf_begin[leaf.shape],
                      end = leaf.convex_shapes->leaf_begin[leaf.shape + 1];
  const StoredPose at = stored_pose(batch, leaf.instance, batch.articulation->leaf_link[leaf.leaf]);
  const float scale = at.coding.scaling == Scaling::kNone ? 1.0f : static_cast<float>(pose_in_double(at).scale);
  return {{leaf.convex_shapes->shapes.data + begin, end - begin}, at, scale};
}

// Tells which parts of two leaves are far apart, by the balls about them. Where leaves have many parts, most pairs are.
class PartBalls {
 public:
  // shift: the origin of b less that of a.
  PartBalls(const LeafShapes& a, const LeafShapes& b, const double (&shift)[3], float margin)
      : several_(a.shapes.size * b.shapes.size > kFewPairs), margin_(static_cast<double>(margin)) {
    if (!several_) return;
    pose_a_ = pose_in_double(a.at);
    pose_b_ = pose_in_double(b.at);
    lengths_ = kernel::sum(kernel::abs(pose_a_.translation)) + kernel::sum(kernel::abs(pose_b_.translation));
    pose_b_.translation = pose_b_.translation + Double3{shift[0], shift[1], shift[2]};
  }

  // Whether two parts are apart by more than the margin, and by more than any rounding. False for half spaces.
  bool are_apart(const ConvexShape& a, const ConvexShape& b) const {
    if (!several_ || a.kind == ConvexKind::kHalfSpace || b.kind == ConvexKind::kHalfSpace) return false;
    const Double3 at_a = pose_a_.scale * position(a), at_b = pose_b_.scale * position(b);
    const Double3 between = (pose_b_.translation + kernel::rotate(pose_b_.column, at_b)) -
                            (pose_a_.translation + kernel::rotate(pose_a_.column, at_a));
    const double reach =
        pose_a_.scale * static_cast<double>(a.reach) + pose_b_.scale * static_cast<double>(b.reach) + margin_;
    const double lengths = lengths_ + kernel::sum(kernel::abs(at_a)) + kernel::sum(kernel::abs(at_b));
    const double least = reach + kRounding * (reach + lengths + kernel::sum(kernel::abs(between)));
    return kernel::dot(between, between) > least * least;
  }

 private:
  static constexpr std::size_t kFewPairs = 3;  // not worth two poses
  static constexpr double kRounding = 1e-6;    // of all lengths; far above that of doubles and of the kernels
  static Double3 position(const ConvexShape& shape) {
    return {static_cast<double>(shape.position[0]), static_cast<double>(shape.position[1]),
            static_cast<double>(shape.position[2])};
  }

  bool several_;
  double margin_, lengths_ = 0;  // lengths_: of which positions are sums
  kernel::RigidLanes<double> pose_a_ = {}, pose_b_ = {};
};

// Whether the poses of a leaf are stored like those of a side that is in use.
inline bool poses_alike(const LeafShapes& leaf, const kernel::ConvexSide& side) {
  return leaf.at.coding == side.coding && !leaf.at.orientation == !side.orientation[0];
}

inline void set_side(const LeafShapes& leaf, const ConvexShape& shape, std::uint32_t lane, kernel::ConvexSide& side) {
  side.coding = leaf.at.coding;
  side.shape[lane] = &shape;
  side.pose[lane] = leaf.at.pose;
  side.orientation[lane] = leaf.at.orientation;
  side.scales[lane] = leaf.at.scale;
}

// The queues of a worker, by their kinds. Run is a function that empties a block: run(queue).
template <class Run>
class ConvexQueues {
 public:
  ConvexQueues(ExactScratch& scratch, Run run) : queues_(scratch.queues), run_(run) {}

  // Queues a pair of shapes, and runs its block once that is full. shift: the origin of b less that of a.
  void add(const LeafShapes& a, const ConvexShape& shape_a, const LeafShapes& b, const ConvexShape& shape_b,
           const double (&shift)[3], float margin) {
    ConvexQueue& queue =
        queues_[static_cast<std::uint32_t>(shape_a.kind) * kConvexKindCount + static_cast<std::uint32_t>(shape_b.kind)];
    kernel::ConvexBlock& block = queue.block;
    if (queue.count > 0 &&
        !(poses_alike(a, block.a) && poses_alike(b, block.b) && (margin == 0) == (block.margin[0] == 0)))
      run(queue);
    const std::uint32_t lane = queue.count++;
    set_side(a, shape_a, lane, block.a);
    set_side(b, shape_b, lane, block.b);
    for (std::uint32_t c = 0; c < 3; ++c) block.shift.by[c][lane] = shift[c];
    block.margin[lane] = margin;
    block.scale[lane] = scale_of_reach(a.scale * shape_a.reach + b.scale * shape_b.reach);
    queue.asks[lane] = asks;
    queue.rank[lane] = rank;
    if (queue.count == kLanes) run(queue);
  }

  // Runs what is left in the queues.
  void finish() {
    for (ConvexQueue& queue : queues_)
      if (queue.count > 0) run(queue);
  }

  // Of the pairs that are added next.
  std::uint32_t asks = 0;
  std::uint64_t rank = 0;

 private:
  void run(ConvexQueue& queue) {
    kernel::ConvexBlock& block = queue.block;
    for (std::uint32_t lane = queue.count; lane < kLanes; ++lane) {
      for (kernel::ConvexSide* side : {&block.a, &block.b}) {
        side->shape[lane] = side->shape[0];
        side->pose[lane] = side->pose[0];
        side->orientation[lane] = side->orientation[0];
        side->scales[lane] = side->scales[0];
      }
      for (auto& by : block.shift.by) by[lane] = by[0];
      block.scale[lane] = block.scale[0];
      block.margin[lane] = block.margin[0];
    }
    block.count = queue.count;
    run_(queue);
    queue.count = 0;
  }

  Span<ConvexQueue> queues_;
  Run run_;
};

}  // namespace cab
