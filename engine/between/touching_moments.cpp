// Which links touch between two frames, and when first: exact tests at moments in between, sixteen at a time.
#include "engine/between/link_path.h"
#include "engine/exact/convex.h"
#include "engine/exact/leaf_pairs.h"
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <exception>
#include <vector>

namespace cab {
namespace {

// How many pairs one task looks at.
constexpr std::size_t kPairsPerTask = 16;

// Links of one pair at sixteen moments, of which the lanes of a block are.
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
  }

  // Takes the moments (first + lane) / steps, none after the last.
  void set(std::uint32_t first, std::uint32_t steps) {
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double t = static_cast<double>(std::min(first + lane, steps)) / steps;
      a_.pose_at(t, poses_[0][lane]);
      b_.pose_at(t, poses_[1][lane]);
      for (std::uint32_t c = 0; c < 3; ++c) block_.shift.by[c][lane] = b_.origin_at(t, c) - a_.origin_at(t, c);
      scales_[lane] = static_cast<float>(std::max(a_.scale_at(t), b_.scale_at(t)));
    }
  }

  // The first lane in which two shapes touch, or kLanes. Lanes from `end` on are not asked.
  std::uint32_t first_touching(const kernel::KernelTable& kernels, const ConvexShape& a, const ConvexShape& b,
                               std::uint32_t end) {
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      block_.a.shape[lane] = &a;
      block_.b.shape[lane] = &b;
      block_.scale[lane] = scale_of_reach(scales_[lane] * (a.reach + b.reach));
    }
    const kernel::ConvexAnswer answer = kernels.test_convex_pairs(block_);
    for (std::uint32_t lane = 0; lane < end; ++lane)
      if (lane_touches(block_, answer, lane)) return lane;
    return kLanes;
  }

 private:
  const LinkPath &a_, &b_;
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

float first_moment(const FrameContext& frame, const LastBatches& last, const Hit& pair, std::uint32_t steps) {
  const std::uint32_t batch_a = pair.batch_a.value - 1, batch_b = pair.batch_b.value - 1;
  if (!is_valid_pose(frame.batch(batch_a), pair.instance_a, pair.link_a) ||
      !is_valid_pose(frame.batch(batch_b), pair.instance_b, pair.link_b))
    return kNeverTouch;
  const LinkPath a(last[batch_a], frame.batch(batch_a), pair.instance_a, pair.link_a),
      b(last[batch_b], frame.batch(batch_b), pair.instance_b, pair.link_b);
  Moments moments(a, b);
  for (std::uint32_t first = 0; first <= steps; first += kLanes) {
    std::uint32_t found = kLanes, end = std::min(kLanes, steps + 1 - first);
    moments.set(first, steps);
    for_each_leaf_pair(frame, pair, [&](const ExactLeaf& leaf_a, const ExactLeaf& leaf_b) {
      for (const ConvexShape& shape_a : shapes_of(leaf_a))
        for (const ConvexShape& shape_b : shapes_of(leaf_b)) {
          if (end == 0) return;
          found = std::min(found, moments.first_touching(frame.kernels, shape_a, shape_b, end));
          end = std::min(end, found);
        }
    });
    if (found < kLanes) return static_cast<float>(first + found) / static_cast<float>(steps);
  }
  return kNeverTouch;
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
                             std::uint32_t steps, Span<const Hit> pairs, Span<float> moments) noexcept try {
  Call call(engine, Access::kReads);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  LastBatches before;
  if (const Status status = bind_last(engine, call, last, before); status != Status::kOk) return status;
  if (const Status status = bind_inputs(engine, call, inputs); status != Status::kOk) return status;
  if (steps == 0 || steps > kMaxSteps) return Status::kBadSteps;
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
                   for (std::size_t i = begin; i < end; ++i) moments[i] = first_moment(frame, before, pairs[i], steps);
                 });
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
