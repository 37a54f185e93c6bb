// Which links touch between two frames, and when first: exact tests in the middle of sixteen intervals at a time, with
// a margin of what the links move against each other within one.
#include "engine/between/link_path.h"
#include "engine/exact/convex.h"
#include "engine/exact/leaf_pairs.h"
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <exception>
#include <vector>

namespace cab {
namespace {

// How many pairs one task looks at.
constexpr std::size_t kPairsPerTask = 16;

// The shortest interval, of the time between two frames. Moments are its multiples, which are exact in float.
constexpr double kShortest = 1.0 / (1 << 20);

// Links of one pair in the middle of sixteen intervals, which are the lanes of a block.
class Moments {
 public:
  Moments(const LinkPath& a, const LinkPath& b) : a_(a), b_(b) {
    for (kernel::ConvexSide* side : {&block_.a, &block_.b}) {
      side->coding = {PoseFormat::kMatrix3x4Rows, Scaling::kInMatrices};
      std::fill_n(side->orientation, kLanes, nullptr);
      std::fill_n(side->scales, kLanes, 1.0f);
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      block_.a.pose[lane] = poses_[0][lane];
      block_.b.pose[lane] = poses_[1][lane];
    }
    const Double3 drift = b.drift() - a.drift(), first = b.place_at(0) - a.place_at(0);
    drift_ = std::sqrt(kernel::dot(drift, drift));
    apart_ = std::sqrt(kernel::dot(first, first)) + drift_;
    scale_ = std::max({a.scale_at(0), a.scale_at(1), b.scale_at(0), b.scale_at(1)});
    rounding_ = kPathRounding * (a.translations() + b.translations());
  }

  // Takes sixteen intervals of a width, the first of which begins at `begin`.
  void set(double begin, double width) {
    half_ = width / 2;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double t = begin + (lane + 0.5) * width;
      a_.pose_at(t, poses_[0][lane]);
      b_.pose_at(t, poses_[1][lane]);
      for (std::uint32_t c = 0; c < 3; ++c) block_.shift.by[c][lane] = b_.origin_at(t, c) - a_.origin_at(t, c);
      scales_[lane] = static_cast<float>(std::max(a_.scale_at(t), b_.scale_at(t)));
    }
  }

  // How fast points of two shapes move against each other at most, per unit of time.
  double speed(const ConvexShape& a, const ConvexShape& b) const {
    return drift_ + speed_about_link(a_, a, b) + speed_about_link(b_, b, a);
  }

  // The lanes, as bits, in which two shapes with a speed may touch at some moment of the interval.
  std::uint32_t find_open(const kernel::KernelTable& kernels, const ConvexShape& a, const ConvexShape& b,
                          double speed) {
    const double margin =
        (speed * half_ + rounding_ + kPathRounding * scale_ * (reach_of(a) + reach_of(b))) * (1 + kPathRounding);
    // A margin that is too large for the kernels decides nothing.
    if (!(margin < static_cast<double>(kMaxCoordinate))) return (1u << kLanes) - 1;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      block_.a.shape[lane] = &a;
      block_.b.shape[lane] = &b;
      block_.scale[lane] = scale_of_reach(scales_[lane] * (a.reach + b.reach));
      block_.margin[lane] = static_cast<float>(margin);
    }
    const kernel::ConvexAnswer answer = kernels.test_convex_pairs(block_);
    std::uint32_t open = 0;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      if (lane_touches(block_, answer, lane)) open |= 1u << lane;
    return open;
  }

 private:
  // How far the points of a shape are from its link's origin, before it is scaled.
  static double reach_of(const ConvexShape& shape) {
    const auto square = [](float v) { return static_cast<double>(v) * static_cast<double>(v); };
    return std::sqrt(square(shape.position[0]) + square(shape.position[1]) + square(shape.position[2])) +
           static_cast<double>(shape.reach);
  }

  // How fast points of a shape move against its link's origin. Those of a half space are as far from there as the other
  // shape, and scaling moves its plane.
  double speed_about_link(const LinkPath& path, const ConvexShape& own, const ConvexShape& other) const {
    const double grows = std::fabs(path.scale_at(1) - path.scale_at(0)) * reach_of(own);
    if (own.kind == ConvexKind::kHalfSpace) return path.most_turn() * (apart_ + scale_ * reach_of(other)) + grows;
    return path.most_turn() * std::max(path.scale_at(0), path.scale_at(1)) * reach_of(own) + grows;
  }

  const LinkPath &a_, &b_;
  double drift_, apart_, scale_, rounding_;
  double half_ = 0;  // of the width
  float poses_[2][kLanes][12];
  float scales_[kLanes];
  kernel::ConvexBlock block_;
};

// The shapes of a leaf.
Span<const ConvexShape> shapes_of(const ExactLeaf& leaf) {
  const std::uint32_t begin = leaf.convex_shapes->leaf_begin[leaf.shape],
                      end = leaf.convex_shapes->leaf_begin[leaf.shape + 1];
  return {leaf.convex_shapes->shapes.data + begin, end - begin};
}

// The batches of the earlier frame, by index; without input where it does not have them.
using LastBatches = std::vector<InstanceBatch>;

// The pair of links of a hit on its way between two frames.
class MovingPair {
 public:
  MovingPair(const FrameContext& frame, const Hit& pair, const LinkPath& a, const LinkPath& b, double resolution)
      : frame_(frame), pair_(pair), resolution_(resolution), moments_(a, b) {}

  // The begin of the first interval between two moments, `width` in all, in which the links come within the resolution;
  // before it they are apart. kNeverTouch if there is none.
  float first_moment(double begin, double width) {
    const double part = width / kLanes;
    double speed[kLanes] = {};  // of the fastest shapes that are not apart, by interval
    std::uint32_t open = 0;
    moments_.set(begin, part);
    for_each_leaf_pair(frame_, pair_, [&](const ExactLeaf& leaf_a, const ExactLeaf& leaf_b) {
      for (const ConvexShape& a : shapes_of(leaf_a))
        for (const ConvexShape& b : shapes_of(leaf_b)) {
          const double own = moments_.speed(a, b);
          const std::uint32_t open_here = moments_.find_open(frame_.kernels, a, b, own);
          for (std::uint32_t lanes = open_here; lanes; lanes &= lanes - 1)
            speed[lowest_bit(lanes)] = std::max(speed[lowest_bit(lanes)], own);
          open |= open_here;
        }
    });
    for (; open; open &= open - 1) {
      const std::uint32_t lane = lowest_bit(open);
      const double at = begin + lane * part;
      if (speed[lane] * part <= resolution_ || part <= kShortest) return static_cast<float>(at);
      if (const float found = first_moment(at, part); found != kNeverTouch) return found;
    }
    return kNeverTouch;
  }

 private:
  const FrameContext& frame_;
  const Hit& pair_;
  const double resolution_;
  Moments moments_;
};

float first_moment(const FrameContext& frame, const LastBatches& last, const Hit& pair, float resolution) {
  const std::uint32_t batch_a = pair.batch_a.value - 1, batch_b = pair.batch_b.value - 1;
  if (!is_valid_pose(frame.batch(batch_a), pair.instance_a, pair.link_a) ||
      !is_valid_pose(frame.batch(batch_b), pair.instance_b, pair.link_b))
    return kNeverTouch;
  const LinkPath a(last[batch_a], frame.batch(batch_a), pair.instance_a, pair.link_a),
      b(last[batch_b], frame.batch(batch_b), pair.instance_b, pair.link_b);
  return MovingPair(frame, pair, a, b, static_cast<double>(resolution)).first_moment(0, 1);
}

// Binds the inputs of the earlier frame, copies the batches and lets go of them.
Status bind_last(Engine& engine, Call& call, Span<const BatchInput> inputs, LastBatches& out) {
  const Status status = bind_inputs(engine, call, inputs);
  for (const auto& slot : call.batches()) out.push_back(slot->batch);
  call.unbind();
  return status;
}

}  // namespace

Status find_touching_moments(Engine& engine, Span<const BatchInput> last, Span<const BatchInput> inputs,
                             float resolution, Span<const Hit> pairs, Span<float> moments) noexcept try {
  Call call(engine, Access::kReads);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  LastBatches before;
  if (const Status status = bind_last(engine, call, last, before); status != Status::kOk) return status;
  if (const Status status = bind_inputs(engine, call, inputs); status != Status::kOk) return status;
  for (const BatchInput& input : inputs)
    if (has_skin(*call.batch(input.batch).articulation)) return Status::kSkinNotTaken;
  if (!(resolution > 0 && resolution <= kMaxCoordinate)) return Status::kBadResolution;
  if (const Status status = validate_pairs(engine, call, pairs); status != Status::kOk) return status;
  const auto is_known = [&before](BatchSlot slot) { return before[slot.value - 1].input != nullptr; };
  for (const Hit& pair : pairs)
    if (!is_known(pair.batch_a) || !is_known(pair.batch_b)) return Status::kBadPairs;
  if (moments.size < pairs.size || (pairs.size && !moments.data)) return Status::kBadOutput;
  const FrameContext frame = call.context({}, 0);
  TaskRunner& tasks = *call.reader().pool->tasks;
  tasks.alone = pairs.size <= kPairsPerTask;
  tasks.for_each(static_cast<std::uint32_t>((pairs.size + kPairsPerTask - 1) / kPairsPerTask),
                 [&](std::uint32_t task, std::uint32_t) {
                   const std::size_t begin = task * kPairsPerTask, end = std::min(begin + kPairsPerTask, pairs.size);
                   for (std::size_t i = begin; i < end; ++i)
                     moments[i] = first_moment(frame, before, pairs[i], resolution);
                 });
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
