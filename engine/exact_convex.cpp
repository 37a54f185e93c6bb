#include "engine/exact_convex.h"

#include "engine/contacts.h"
#include "engine/convex_in_double.h"
#include "engine/worker.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cab {
namespace {

// One side of a leaf pair: the shapes of the leaf, the pose of its link, and the scale of that pose, rounded.
struct LeafShapes {
  Span<const ConvexShape> shapes;
  StoredPose at;
  float scale;
};

LeafShapes shapes_of(const ExactLeaf& leaf) {
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
bool poses_alike(const LeafShapes& leaf, const kernel::ConvexSide& side) {
  return leaf.at.coding == side.coding && !leaf.at.orientation == !side.orientation[0];
}

void set_side(const LeafShapes& leaf, const ConvexShape& shape, std::uint32_t lane, kernel::ConvexSide& side) {
  side.coding = leaf.at.coding;
  side.shape[lane] = &shape;
  side.pose[lane] = leaf.at.pose;
  side.orientation[lane] = leaf.at.orientation;
  side.scales[lane] = leaf.at.scale;
}

// Counts tested leaf pairs, and those of them that were removed. A frame counts leaf pairs before the exact test, but
// what is reported counts only those that are left.
void count_tests(std::uint32_t tested, std::uint32_t removed, FrameStats& stats) {
  stats.exact_tests += tested;
  stats.false_positives += removed;
  stats.leaf_pairs += removed;
}

// The queues of a worker. Run is a function that empties a block: run(queue).
template <class Run>
class ConvexQueues {
 public:
  ConvexQueues(Worker& worker, Run run) : worker_(worker), run_(run) {}

  // Queues a pair of shapes, and runs its block once that is full. shift: the origin of b less that of a.
  void add(const LeafShapes& a, const ConvexShape& shape_a, const LeafShapes& b, const ConvexShape& shape_b,
           const double (&shift)[3], float margin) {
    ConvexQueue& queue = worker_.convex_queues[static_cast<std::uint32_t>(shape_a.kind) * kConvexKindCount +
                                               static_cast<std::uint32_t>(shape_b.kind)];
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
    for (ConvexQueue& queue : worker_.convex_queues)
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
    run_(queue);
    queue.count = 0;
  }

  Worker& worker_;
  Run run_;
};

// Tests leaf pairs. Each is named by an id of the caller, who keeps which of them touch: is_touching(id) and
// set_touching(id).
template <class Touching>
class ConvexTester {
 public:
  ConvexTester(const FrameContext& frame, Worker& worker, Touching touching)
      : frame_(frame), touching_(touching), queues_(worker, Test{frame, touching}) {}

  // Queues all pairs of shapes of two leaves of a candidate.
  void add(const Candidate& candidate, std::uint32_t leaf_a, std::uint32_t leaf_b, std::uint32_t id) {
    if (is_within(candidate) && leaf_b < leaf_a) std::swap(leaf_a, leaf_b);
    const ExactLeaf at_a = frame_.exact_leaf(candidate.batch_a, candidate.instance_a, leaf_a),
                    at_b = frame_.exact_leaf(candidate.batch_b, candidate.instance_b, leaf_b);
    const LeafShapes a = shapes_of(at_a), b = shapes_of(at_b);
    double shift[3];
    origin_difference(at_a, at_b, shift);
    queues_.asks = id;
    const float margin = margin_between(at_a, at_b, frame_.margin);
    const PartBalls balls(a, b, shift, margin);
    for (const ConvexShape& shape_a : a.shapes)
      for (const ConvexShape& shape_b : b.shapes) {
        if (touching_.is_touching(id)) return;
        if (!balls.are_apart(shape_a, shape_b)) queues_.add(a, shape_a, b, shape_b, shift, margin);
      }
  }

  // Tests what is left in the queues.
  void finish() { queues_.finish(); }

 private:
  struct Test {
    const FrameContext& frame;
    Touching touching_pairs;

    void operator()(ConvexQueue& queue) const {
      kernel::ConvexBlock& block = queue.block;
      const kernel::ConvexAnswer answer = frame.kernels.test_convex_pairs(block);
      for (std::uint32_t lane = 0; lane < queue.count; ++lane) {
        const std::uint32_t id = queue.asks[lane];
        if (!touching_pairs.is_touching(id) && lane_touches(block, answer, lane)) touching_pairs.set_touching(id);
      }
    }
  };

  const FrameContext& frame_;
  Touching touching_;
  ConvexQueues<Test> queues_;
};

// The margin of the two instances of a hit.
float margin_of(const FrameContext& frame, const Hit& hit) {
  return margin_between(frame.batch(hit.batch_a.value - 1), hit.instance_a, frame.batch(hit.batch_b.value - 1),
                        hit.instance_b, frame.margin);
}

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

float scale_of_reach(float reach) {
  const float length = std::max(reach, kLeastConvexReach);
  std::uint32_t bits;
  std::memcpy(&bits, &length, sizeof(bits));
  bits = (253 - (bits >> 23)) << 23;
  float out;
  std::memcpy(&out, &bits, sizeof(out));
  return out;
}

bool lane_touches(const kernel::ConvexBlock& block, const kernel::ConvexAnswer& answer, std::uint32_t lane) {
  const bool tiny = block.a.shape[lane]->reach + block.b.shape[lane]->reach < kLeastConvexReach;
  if (!tiny && (answer.apart >> lane & 1)) return false;
  if (!tiny && (answer.touching >> lane & 1)) return true;
  return touch_in_double(block, lane);
}

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

void convex_contacts(const FrameContext& frame, Span<const Hit> hits, Contact* contacts, Worker& worker) {
  std::uint64_t ranks[kContactsPerTask];
  for (std::size_t i = 0; i < hits.size; ++i) {
    contacts[i].depth = -std::numeric_limits<float>::infinity();
    ranks[i] = ~std::uint64_t{0};
  }
  const std::uint32_t starts = frame.policies.depth == Depth::kOneStart ? 1 : kernel::kMostStarts;
  ConvexQueues queues(worker, [&](ConvexQueue& queue) {
    kernel::ConvexContacts found;
    frame.kernels.contact_pairs(queue.block, starts, found);
    for (std::uint32_t lane = 0; lane < queue.count; ++lane) {
      const std::uint32_t hit = queue.asks[lane];
      const float depth = rounded_up(found.depth[lane]);
      Contact& deepest = contacts[hit];
      if (!(depth > deepest.depth || (depth == deepest.depth && queue.rank[lane] < ranks[hit]))) continue;
      ranks[hit] = queue.rank[lane];
      deepest.depth = depth;
      for (std::size_t c = 0; c < 3; ++c) {
        deepest.normal[c] = static_cast<float>(found.normal[c][lane]);
        deepest.point_a[c] = static_cast<float>(found.point_a[c][lane]);
        deepest.point_b[c] = static_cast<float>(found.point_b[c][lane]);
      }
      deepest.leaf_a = static_cast<std::uint16_t>(queue.rank[lane] >> 48);
      deepest.leaf_b = static_cast<std::uint16_t>(queue.rank[lane] >> 32);
    }
  });
  for (std::uint32_t i = 0; i < hits.size; ++i) {
    queues.asks = i;
    for_each_leaf_pair(frame, hits[i], [&](const ExactLeaf& at_a, const ExactLeaf& at_b) {
      const LeafShapes a = shapes_of(at_a), b = shapes_of(at_b);
      double shift[3];
      origin_difference(at_a, at_b, shift);
      queues.rank = std::uint64_t{at_a.leaf} << 48 | std::uint64_t{at_b.leaf} << 32;
      // Of links that touch, parts whose balls are apart are not the deepest.
      const PartBalls balls(a, b, shift, margin_between(at_a, at_b, frame.margin));
      for (const ConvexShape& shape_a : a.shapes)
        for (const ConvexShape& shape_b : b.shapes) {
          if (!balls.are_apart(shape_a, shape_b)) queues.add(a, shape_a, b, shape_b, shift, 0);
          ++queues.rank;
        }
    });
  }
  queues.finish();
  // Shapes that could not be shown to be apart touch.
  for (std::size_t i = 0; i < hits.size; ++i)
    if (margin_of(frame, hits[i]) == 0) contacts[i].depth = std::max(contacts[i].depth, 0.0f);
}

}  // namespace cab
