#include "engine/exact_convex.h"

#include "engine/convex_in_double.h"
#include "engine/worker.h"

#include <algorithm>
#include <cstring>

namespace cab {
namespace {

// The power of two that scales a length, which must be at least kLeastConvexReach, to between 1/2 and 1.
float scale_of(float length) {
  std::uint32_t bits;
  std::memcpy(&bits, &length, sizeof(bits));
  bits = (253 - (bits >> 23)) << 23;
  float out;
  std::memcpy(&out, &bits, sizeof(out));
  return out;
}

// One side of a leaf pair: the shapes of the leaf, and the poses that place them.
struct LeafShapes {
  Span<const ConvexShape> shapes;
  PoseFormat format;
  const float* pose;
  const float* orientation;  // null if instances have none
};

LeafShapes shapes_of(const ExactLeaf& leaf) {
  const InstanceBatch& batch = *leaf.batch;
  const std::uint32_t begin = leaf.convex_shapes->leaf_begin[leaf.leaf],
                      end = leaf.convex_shapes->leaf_begin[leaf.leaf + 1];
  const Span<const float> orientations = batch.input->orientations;
  return {
      {leaf.convex_shapes->shapes.data + begin, end - begin},
      batch.input->poses.format,
      pose_of(batch, leaf.instance) + batch.articulation->leaf_link[leaf.leaf] * (batch.link_stride / sizeof(float)),
      orientations.empty() ? nullptr : orientations.data + 4 * std::size_t{leaf.instance}};
}

// Whether the poses of a leaf are stored like those of a side that is in use.
bool poses_alike(const LeafShapes& leaf, const kernel::ConvexSide& side) {
  return leaf.format == side.format && !leaf.orientation == !side.orientation[0];
}

void set_side(const LeafShapes& leaf, const ConvexShape& shape, std::uint32_t lane, kernel::ConvexSide& side) {
  side.format = leaf.format;
  side.shape[lane] = &shape;
  side.pose[lane] = leaf.pose;
  side.orientation[lane] = leaf.orientation;
}

// Counts tested leaf pairs, and those of them that were removed. A frame counts leaf pairs before the exact test, but
// what is reported counts only those that are left.
void count_tests(std::uint32_t tested, std::uint32_t removed, FrameStats& stats) {
  stats.exact_tests += tested;
  stats.false_positives += removed;
  stats.leaf_pairs += removed;
}

// Tests leaf pairs. Each is named by an id of the caller, who keeps which of them touch: is_touching(id) and
// set_touching(id).
template <class Touching>
class ConvexTester {
 public:
  ConvexTester(const FrameContext& frame, Worker& worker, Touching touching)
      : frame_(frame), worker_(worker), touching_(touching) {}

  // Queues all pairs of shapes of two leaves of a candidate.
  void add(const Candidate& candidate, std::uint32_t leaf_a, std::uint32_t leaf_b, std::uint32_t id) {
    if (is_within(candidate) && leaf_b < leaf_a) std::swap(leaf_a, leaf_b);
    const ExactLeaf at_a = frame_.exact_leaf(candidate.batch_a, candidate.instance_a, leaf_a),
                    at_b = frame_.exact_leaf(candidate.batch_b, candidate.instance_b, leaf_b);
    const LeafShapes a = shapes_of(at_a), b = shapes_of(at_b);
    double shift[3];
    origin_difference(at_a, at_b, shift);
    for (const ConvexShape& shape_a : a.shapes)
      for (const ConvexShape& shape_b : b.shapes) {
        if (touching_.is_touching(id)) return;
        add_pair(a, shape_a, b, shape_b, shift, id);
      }
  }

  // Tests what is left in the queues.
  void finish() {
    for (ConvexQueue& queue : worker_.convex_queues) test(queue);
  }

 private:
  void add_pair(const LeafShapes& a, const ConvexShape& shape_a, const LeafShapes& b, const ConvexShape& shape_b,
                const double (&shift)[3], std::uint32_t id) {
    ConvexQueue& queue = worker_.convex_queues[static_cast<std::uint32_t>(shape_a.kind) * kConvexKindCount +
                                               static_cast<std::uint32_t>(shape_b.kind)];
    kernel::ConvexBlock& block = queue.block;
    if (queue.count > 0 && !(poses_alike(a, block.a) && poses_alike(b, block.b))) test(queue);
    const std::uint32_t lane = queue.count++;
    set_side(a, shape_a, lane, block.a);
    set_side(b, shape_b, lane, block.b);
    for (std::uint32_t c = 0; c < 3; ++c) block.shift.by[c][lane] = shift[c];
    block.scale[lane] = scale_of(std::max(shape_a.reach + shape_b.reach, kLeastConvexReach));
    queue.leaf_pair[lane] = id;
    if (queue.count == kLanes) test(queue);
  }

  void test(ConvexQueue& queue) {
    if (queue.count == 0) return;
    kernel::ConvexBlock& block = queue.block;
    for (std::uint32_t lane = queue.count; lane < kLanes; ++lane) {
      for (kernel::ConvexSide* side : {&block.a, &block.b}) {
        side->shape[lane] = side->shape[0];
        side->pose[lane] = side->pose[0];
        side->orientation[lane] = side->orientation[0];
      }
      for (auto& by : block.shift.by) by[lane] = by[0];
      block.scale[lane] = block.scale[0];
    }
    block.margin = frame_.margin;
    const kernel::ConvexAnswer answer = frame_.kernels.test_convex_pairs(block);
    for (std::uint32_t lane = 0; lane < queue.count; ++lane) {
      const std::uint32_t id = queue.leaf_pair[lane];
      const bool tiny = block.a.shape[lane]->reach + block.b.shape[lane]->reach < kLeastConvexReach;
      const bool apart = !tiny && (answer.apart >> lane & 1), touching = !tiny && (answer.touching >> lane & 1);
      if (!apart && !touching_.is_touching(id) && (touching || touch_in_double(block, lane)))
        touching_.set_touching(id);
    }
    queue.count = 0;
  }

  const FrameContext& frame_;
  Worker& worker_;
  Touching touching_;
};

// The leaf pairs of worker.found, named by index. The highest bit of LeafPair::candidate says which of them touch.
struct FoundPairs {
  static constexpr std::uint32_t kTouching = 1u << 31;
  LeafPair* pairs;
  bool is_touching(std::uint32_t id) const { return pairs[id].candidate & kTouching; }
  void set_touching(std::uint32_t id) const { pairs[id].candidate |= kTouching; }
};

// The lanes of worker.tile_found, named by kLanes * index + lane. The upper half of TilePair::lanes says which of them
// touch.
struct FoundLanes {
  TilePair* pairs;
  static std::uint32_t bit(std::uint32_t id) { return 1u << (kLanes + id % kLanes); }
  bool is_touching(std::uint32_t id) const { return pairs[id / kLanes].lanes & bit(id); }
  void set_touching(std::uint32_t id) const { pairs[id / kLanes].lanes |= bit(id); }
};

}  // namespace

void keep_touching(const FrameContext& frame, Worker& worker) {
  FixedList<LeafPair>& found = worker.found;
  ConvexTester<FoundPairs> tester(frame, worker, {found.data});
  for (std::uint32_t i = 0; i < found.size; ++i) {
    const LeafPair& pair = found.data[i];
    tester.add(worker.candidates.data[pair.candidate & ~FoundPairs::kTouching], pair.a, pair.b, i);
  }
  tester.finish();
  std::uint32_t kept = 0;
  for (const LeafPair& pair : found)
    if (pair.candidate & FoundPairs::kTouching)
      found.data[kept++] = {pair.candidate & ~FoundPairs::kTouching, pair.a, pair.b};
  count_tests(found.size, found.size - kept, worker.stats);
  found.size = kept;
}

void keep_touching_lanes(const FrameContext& frame, const Candidate (&candidates)[kLanes], Worker& worker) {
  FixedList<TilePair>& found = worker.tile_found;
  ConvexTester<FoundLanes> tester(frame, worker, {found.data});
  for (std::uint32_t i = 0; i < found.size; ++i) {
    const TilePair& pair = found.data[i];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      if (pair.lanes >> lane & 1) tester.add(candidates[lane], pair.a, pair.b, kLanes * i + lane);
  }
  tester.finish();
  for (TilePair& pair : found) {
    const std::uint32_t tested = pair.lanes & 0xffff;
    pair.lanes >>= kLanes;
    const auto count = [](std::uint32_t lanes) { return static_cast<std::uint32_t>(__builtin_popcount(lanes)); };
    count_tests(count(tested), count(tested & ~pair.lanes), worker.stats);
  }
}

Contact convex_leaf_contact(const ExactLeaf& a, const ExactLeaf& b, float margin) {
  const LeafShapes of_a = shapes_of(a), of_b = shapes_of(b);
  double shift[3];
  origin_difference(a, b, shift);
  Contact deepest = {};
  bool found = false;
  for (const ConvexShape& shape_a : of_a.shapes)
    for (const ConvexShape& shape_b : of_b.shapes) {
      const Contact contact = contact_in_double({&shape_a, of_a.format, of_a.pose, of_a.orientation},
                                                {&shape_b, of_b.format, of_b.pose, of_b.orientation}, shift);
      if (found && !(contact.depth > deepest.depth)) continue;
      deepest = contact;
      found = true;
    }
  // Shapes that could not be shown to be apart touch.
  if (margin == 0) deepest.depth = std::max(deepest.depth, 0.0f);
  return deepest;
}

}  // namespace cab
