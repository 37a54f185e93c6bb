#include "engine/exact/convex.h"

#include "engine/exact/convex_in_double.h"
#include "engine/exact/convex_queues.h"
#include "engine/exact/leaf_pairs.h"
#include "engine/exact/surface.h"
#include "engine/exact/touching_links.h"
#include "engine/step/candidate.h"
#include "layout/compiler.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cab {
namespace {

// Counts tested leaf pairs, those of them that are apart, and all that were removed. A frame counts leaf pairs before
// the exact test, but what is reported counts only those that are left.
void count_tests(std::uint32_t tested, std::uint32_t apart, std::uint32_t removed, FrameStats& stats) {
  stats.exact_tests += tested;
  stats.false_positives += apart;
  stats.leaf_pairs += removed;
}

// Tests leaf pairs. Each is named by an id of the caller, who keeps which of them touch: is_touching(id) and
// set_touching(id).
template <class Touching>
class ConvexTester {
 public:
  ConvexTester(const FrameContext& frame, ExactScratch& scratch, Touching touching, FrameStats& stats)
      : frame_(frame), scratch_(scratch), touching_(touching), stats_(stats), queues_(scratch, Test{frame, touching}) {}

  // Tests two leaves of a candidate, or queues pairs of their shapes. Returns whether they are known to touch at once.
  bool add(const Candidate& candidate, std::uint32_t leaf_a, std::uint32_t leaf_b, std::uint32_t id) {
    if (is_within(candidate) && leaf_b < leaf_a) std::swap(leaf_a, leaf_b);
    const ExactLeaf at_a = exact_leaf(frame_, candidate.batch_a, candidate.instance_a, leaf_a),
                    at_b = exact_leaf(frame_, candidate.batch_b, candidate.instance_b, leaf_b);
    const float margin = margin_between(at_a, at_b, frame_.margin);
    queues_.asks = id;
    const bool by_triangles_a = has_triangles(at_a), by_triangles_b = has_triangles(at_b);
    if (by_triangles_a && by_triangles_b) {
      const bool touch = surfaces_touch(frame_, at_a, at_b, margin, scratch_.skins, stats_);
      if (touch) touching_.set_touching(id);
      return touch;
    }
    if (by_triangles_a || by_triangles_b)
      return add_triangles(by_triangles_a ? at_a : at_b, by_triangles_a ? at_b : at_a, margin, id);
    const LeafShapes a = shapes_of(at_a), b = shapes_of(at_b);
    double shift[3];
    origin_difference(at_a, at_b, shift);
    const PartBalls balls(a, b, shift, margin);
    for (const ConvexShape& shape_a : a.shapes)
      for (const ConvexShape& shape_b : b.shapes) {
        if (touching_.is_touching(id)) return false;
        if (!balls.are_apart(shape_a, shape_b)) queues_.add(a, shape_a, b, shape_b, shift, margin);
      }
    return false;
  }

  // Tests what is left in the queues.
  void finish() { queues_.finish(); }

 private:
  // Tests the triangles of one leaf against the shapes of the other, and queues those that are undecided. Returns
  // whether one is known to touch.
  bool add_triangles(const ExactLeaf& surface, const ExactLeaf& other, float margin, std::uint32_t id) {
    double shift[3];
    origin_difference(surface, other, shift);
    const kernel::SkinnedLeaf& skin =
        skinned(frame_, surface, nullptr, scratch_.skins, {stats_.leaves_skinned, stats_.leaves_replaced});
    const LeafShapes shapes = shapes_of(other);
    bool touch = false;
    for (std::size_t i = 0; i < shapes.shapes.size && !touch; ++i) {
      const PlacedShape placed = {&shapes.shapes[i], shapes.at};
      touch = is_triangle(*placed.shape) ? touch_triangle(frame_, surface, skin, placed, shift, margin)
                                         : touches_part(surface, skin, shapes, *placed.shape, shift, margin);
    }
    if (touch) touching_.set_touching(id);
    return touch;
  }

  // The same for one convex shape.
  bool touches_part(const ExactLeaf& surface, const kernel::SkinnedLeaf& skin, const LeafShapes& shapes,
                    const ConvexShape& shape, const double (&shift)[3], float margin) {
    const SurfaceLeaves& of = surface.batch->articulation->surface;
    const SurfaceLeaf& leaf = of.leaves[surface.leaf];
    const NearPart near = near_part({&shape, shapes.at}, shift, surface, skin, margin);
    std::uint32_t* const triangles = scratch_.skins.near.data;
    std::uint32_t count = frame_.kernels.near_triangles(skin, leaf.patch_count, near.lo, near.hi, triangles);
    if (frame_.kernels.test_part(near.part, triangles, &count)) return true;
    for (std::uint32_t i = 0; i < count && !touching_.is_touching(queues_.asks); ++i) {
      const ConvexShape& triangle = add_triangle(of, leaf, skin, triangles[i], shape.kind, scratch_.triangles);
      queues_.add({{&triangle, 1}, pose_of_instance(), 1}, triangle, shapes, shape, shift, near.part.margin);
    }
    return false;
  }

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
  ExactScratch& scratch_;
  Touching touching_;
  FrameStats& stats_;
  ConvexQueues<Test> queues_;
};

// The margin of the two instances of a hit.
float margin_of(const FrameContext& frame, const Hit& hit) {
  return margin_between(frame.batch(hit.batch_a.value - 1), hit.instance_a, frame.batch(hit.batch_b.value - 1),
                        hit.instance_b, frame.margin);
}

// The nearest number within float's range.
double saturated(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return std::min(std::max(value, -kMost), kMost);
}

// Makes a difference of origins shorter along its direction where its square is beyond double. A gap so wide saturates
// in float.
void limit_length(double (&shift)[3]) {
  constexpr double kMost = 1e100, kLargest = std::numeric_limits<double>::max();
  double largest = 0;
  for (double& by : shift) {
    by = std::min(std::max(by, -kLargest), kLargest);  // the difference itself may be beyond double
    largest = std::max(largest, std::fabs(by));
  }
  for (double& by : shift)
    if (largest > kMost) by *= kMost / largest;
}

// Leaf pairs, named by index. The highest bit of LeafPair::candidate says which of them touch.
struct FoundPairs {
  static constexpr std::uint32_t kTouching = 1u << 31;
  LeafPair* pairs;
  bool is_touching(std::uint32_t id) const { return pairs[id].candidate & kTouching; }
  void set_touching(std::uint32_t id) const { pairs[id].candidate |= kTouching; }
};

// The lanes of the leaf pairs of tiles, named by kLanes * index + lane. The upper half of TilePair::lanes says which of
// them touch, and that of `touched` in which lanes any does.
struct FoundLanes {
  TilePair* pairs;
  std::uint32_t* touched;
  static std::uint32_t bit(std::uint32_t id) { return 1u << (kLanes + id % kLanes); }
  bool is_touching(std::uint32_t id) const { return pairs[id / kLanes].lanes & bit(id); }
  void set_touching(std::uint32_t id) const {
    pairs[id / kLanes].lanes |= bit(id);
    *touched |= bit(id);
  }
};

// Sorts the leaf pairs of every candidate by links.
void sort_by_links(const FrameContext& frame, const Candidate* candidates, FixedList<LeafPair>& found) {
  for_each_candidate(candidates, found, [&](const Candidate& candidate, Span<LeafPair> pairs) {
    sort_by_links(*frame.batch(candidate.batch_a).articulation, *frame.batch(candidate.batch_b).articulation,
                  is_within(candidate), pairs);
  });
}

// Whether a leaf pair that touches answers for a later one: hits name the first leaf pair of two links, and
// Report::kInContact asks for any.
bool is_answered(const FrameContext& frame, const Candidate& candidate, const LeafPair& touching,
                 const LeafPair& pair) {
  if ((touching.candidate & ~FoundPairs::kTouching) != pair.candidate) return false;
  if (frame.report == Report::kInContact) return true;
  const Articulation &a = *frame.batch(candidate.batch_a).articulation,
                     &b = *frame.batch(candidate.batch_b).articulation;
  const LinkedPair first = linked(a, b, touching, is_within(candidate)),
                   second = linked(a, b, pair, is_within(candidate));
  return first.link_a == second.link_a && first.link_b == second.link_b;
}

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

void keep_touching(const FrameContext& frame, const Candidate* candidates, FixedList<LeafPair>& found,
                   ExactScratch& scratch, FrameStats& stats) {
  const FoundPairs pairs = {found.data};
  ConvexTester<FoundPairs> tester(frame, scratch, pairs, stats);
  const bool by_links = frame.policies.exact == Exact::kSurface;
  if (by_links) sort_by_links(frame, candidates, found);
  std::uint32_t tested = 0;
  const LeafPair* touching = nullptr;  // the last one that was known to touch at once
  for (std::uint32_t i = 0; i < found.size; ++i) {
    const LeafPair& pair = found.data[i];
    const Candidate& candidate = candidates[pair.candidate];
    if (touching && is_answered(frame, candidate, *touching, pair)) continue;
    if (tester.add(candidate, pair.a, pair.b, i)) touching = &pair;
    ++tested;
  }
  tester.finish();
  std::uint32_t kept = 0;
  for (const LeafPair& pair : found)
    if (pair.candidate & FoundPairs::kTouching)
      found.data[kept++] = {pair.candidate & ~FoundPairs::kTouching, pair.a, pair.b};
  count_tests(tested, tested - kept, found.size - kept, stats);
  found.size = kept;
}

void keep_touching_lanes(const FrameContext& frame, const Candidate (&candidates)[kLanes], FixedList<TilePair>& found,
                         ExactScratch& scratch, FrameStats& stats) {
  std::uint32_t touched = 0;
  ConvexTester<FoundLanes> tester(frame, scratch, {found.data, &touched}, stats);
  for (std::uint32_t i = 0; i < found.size; ++i) {
    TilePair& pair = found.data[i];
    if (frame.report == Report::kInContact) pair.lanes &= ~(touched >> kLanes);  // they are answered
    for (std::uint32_t untested = pair.lanes & ~(pair.lanes >> kLanes) & 0xffff; untested; untested &= untested - 1) {
      const std::uint32_t lane = lowest_bit(untested);
      tester.add(candidates[lane], pair.a, pair.b, kLanes * i + lane);
    }
  }
  tester.finish();
  for (TilePair& pair : found) {
    const std::uint32_t tested = pair.lanes & 0xffff;
    pair.lanes >>= kLanes;
    const std::uint32_t apart = count_bits(tested & ~pair.lanes);
    count_tests(count_bits(tested), apart, apart, stats);
  }
}

void convex_contacts(const FrameContext& frame, Span<const Hit> hits, Contact* contacts, ExactScratch& scratch) {
  std::uint64_t ranks[kContactsPerTask];
  for (std::size_t i = 0; i < hits.size; ++i) {
    contacts[i] = {};
    contacts[i].depth = -std::numeric_limits<float>::infinity();
    ranks[i] = ~std::uint64_t{0};
  }
  ConvexQueues queues(scratch, [&](ConvexQueue& queue) {
    kernel::ConvexContacts found;
    frame.kernels.contact_pairs(queue.block, found);
    for (std::uint32_t lane = 0; lane < queue.count; ++lane) {
      const std::uint32_t hit = queue.asks[lane];
      const float depth = rounded_up(saturated(found.depth[lane]));
      Contact& deepest = contacts[hit];
      if (!(depth > deepest.depth || (depth == deepest.depth && queue.rank[lane] < ranks[hit]))) continue;
      ranks[hit] = queue.rank[lane];
      deepest.depth = depth;
      for (std::size_t c = 0; c < 3; ++c) {
        deepest.normal[c] = static_cast<float>(found.normal[c][lane]);
        deepest.point_a[c] = static_cast<float>(saturated(found.point_a[c][lane]));
        deepest.point_b[c] = static_cast<float>(saturated(found.point_b[c][lane]));
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
      limit_length(shift);
      queues.rank = std::uint64_t{at_a.leaf} << 48 | std::uint64_t{at_b.leaf} << 32;
      // Of links that touch, parts whose balls are apart are not the deepest.
      const float margin = margin_between(at_a, at_b, frame.margin);
      const PartBalls balls(a, b, shift, margin);
      for (const ConvexShape& shape_a : a.shapes)
        for (const ConvexShape& shape_b : b.shapes) {
          if (!balls.are_apart(shape_a, shape_b)) queues.add(a, shape_a, b, shape_b, shift, margin);
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
