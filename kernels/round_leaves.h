// Sequences of bodies whose leaves are all balls and capsules: poses them, and tests the links of each instance against
// each other, instances as lanes. In float, with a slack (docs/proof.md, part 16): what that decides nothing about is
// left to the exact test.
#pragma once

#include "kernels/pose_leaves.h"
#include "layout/pair_list.h"
#include "layout/round_leaf.h"

namespace cab::kernel {

// One tile to pose. Unused lanes repeat a used one. Writes one RoundTile per leaf, then one per link, for its ball.
struct RoundPoses {
  const Articulation* articulation;
  const RoundBody* body;
  const float* poses[kLanes];  // kQuaternionTranslation: the pose of each instance's first link
  std::size_t link_stride;     // floats from one link's pose to the next
  const RawPoses* links;       // the poses in lanes already, by link; else null
  RoundTile* tiles;
};

template <class V>
CAB_INLINE void pose_round_leaf(const RigidLanes<V>& pose, V away, const RoundLeaf& leaf, bool beside_capsules,
                                std::uint32_t lane, RoundTile& to) {
  const auto spread = [](const float* v) { return Vec3<V>{V(v[0]), V(v[1]), V(v[2])}; };
  store3(to.center, lane, pose.translation + rotate<V>(pose.column, spread(leaf.center)));
  if (beside_capsules) store3(to.axis, lane, rotate<V>(pose.column, spread(leaf.axis)));
  Lanes<V>::store(to.size + lane, away + V(leaf.size));
}

// Returns whether every pose that is read is finite, rigid and within kMostRoundLength. If not, boxes have to say which
// instances are masked, and what is written is not to be read.
template <class V>
bool pose_round(const RoundPoses& args) {
  const Mask<V> yes = V(0.0f) <= V(0.0f);
  LaneChecks<V> checks = {yes, yes, yes};
  RawPoses read;
  std::size_t next = 0;  // link with leaves
  for (const PosedLink& posed : args.articulation->posed_links) {
    if (!args.links) read_raw<V>(args.poses, posed.link * args.link_stride, 7, read);
    const RawPoses& raw = args.links ? args.links[posed.link] : read;
    const bool has_leaves = posed.leaf_begin < posed.leaf_end;
    const RoundLink* const link = has_leaves ? &args.body->links[next] : nullptr;
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      const RigidLanes<V> pose = link_pose<V>(raw, {PoseFormat::kQuaternionTranslation, Scaling::kNone}, lane, checks);
      checks.in_range = both(checks.in_range, in_range(pose.translation, V(kMostRoundLength)));
      if (!has_leaves) continue;
      const V away = sum(abs(pose.translation));
      for (std::uint32_t l = link->begin; l < link->end; ++l)
        pose_round_leaf(pose, away, args.body->leaves[l], args.body->has_capsules, lane, args.tiles[l]);
      if (link->end - link->begin > 1)
        pose_round_leaf(pose, away, link->ball, false, lane, args.tiles[args.body->leaves.size + next]);
    }
    next += has_leaves;
  }
  return bits(both(checks.finite, both(checks.rigid, checks.in_range))) == (1u << kWidth<V>)-1;
}

// One tile to test. In `found`, which must have room for every leaf pair, the lower half of TilePair::lanes names the
// lanes in which two leaves may touch, and the upper half those of them in which they do.
struct RoundTest {
  const Articulation* articulation;
  const RoundBody* body;
  const RoundTile* tiles;
  std::uint32_t lanes;  // to test
  float margin;
  bool first_only;  // a lane is done at its first touching pair; else each pair of links is
  FixedList<TilePair> found;
  std::uint64_t ball_tests;  // of links or leaves against balls about links, per lane
  std::uint64_t leaf_tests;  // per lane
};

// Which lanes touch, and which may.
struct RoundAnswer {
  std::uint32_t touching, possible;
};

// Two leaves, or balls, in the lanes that V covers. With kBalls neither has an axis.
template <class V, bool kBalls>
CAB_INLINE RoundAnswer test_round_lanes(const RoundTile& a, const RoundTile& b, float radii, std::uint32_t lane) {
  const Vec3<V> between = load3<V>(a.center, lane) - load3<V>(b.center, lane);
  const V size = (Lanes<V>::load(a.size + lane) + Lanes<V>::load(b.size + lane)) + V(radii);
  const V slack = V(kRoundSlack) * size + V(kRoundTiny);
  const V inner = V(radii) - slack, outer = V(radii) + slack;
  V square, gap;
  if constexpr (kBalls) {
    square = dot(between, between);
    gap = square;
  } else {
    // The closest points of the two segments. Any points tell that the leaves touch; where rounding makes these not the
    // closest, the gap along the line between them says less, and the pair stays possible.
    const V one(1.0f), tiny(1e-30f), parallel(1e-6f);
    const Vec3<V> axis_a = load3<V>(a.axis, lane), axis_b = load3<V>(b.axis, lane);
    const V aa = dot(axis_a, axis_a), bb = dot(axis_b, axis_b), ab = dot(axis_a, axis_b);
    const V on_a = dot(axis_a, between), on_b = dot(axis_b, between);
    const V cross_sq = aa * bb - ab * ab;
    const auto clamped = [&](V x) { return min(max(x, V(-1.0f)), one); };
    V s = clamped(divide(ab * on_b - bb * on_a, max(cross_sq, parallel * (aa * bb) + tiny)));
    const V t = clamped(divide(ab * s + on_b, max(bb, tiny)));
    s = clamped(divide(ab * t - on_a, max(aa, tiny)));
    const Vec3<V> closest = between + s * axis_a - t * axis_b;
    square = dot(closest, closest);
    gap = (dot(closest, between) - abs(dot(closest, axis_a))) - abs(dot(closest, axis_b));
  }
  const Mask<V> touching = both(V(0.0f) < inner, square < inner * inner);
  // Apart by gap / |closest|; for balls that is |between|.
  // A square that underflows is no less than the least normal number.
  const V at_least = max(square, V(1.17549435e-38f));
  const Mask<V> apart = kBalls ? outer * outer < square : both(V(0.0f) < gap, outer * outer * at_least < gap * gap);
  return {bits(touching), (bits(touching) | ~bits(apart)) & ((1u << kWidth<V>)-1)};
}

template <class V, bool kBalls>
CAB_INLINE RoundAnswer test_round(const RoundTile& a, const RoundTile& b, float radii, std::uint32_t lanes) {
  RoundAnswer out = {0, 0};
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    if ((lanes >> lane & ((1u << kWidth<V>)-1)) == 0) continue;
    const RoundAnswer part = test_round_lanes<V, kBalls>(a, b, radii, lane);
    out.touching |= part.touching << lane;
    out.possible |= part.possible << lane;
  }
  return {out.touching & lanes, out.possible & lanes};
}

// The ball of a link, and its tile.
struct PosedBall {
  const RoundTile& tile;
  float reach;
};

inline PosedBall ball_of(const RoundTest& job, std::size_t number) {
  const RoundLink& link = job.body->links[number];
  if (link.end - link.begin == 1) return {job.tiles[link.begin], job.body->leaves[link.begin].reach};
  return {job.tiles[job.body->leaves.size + number], link.ball.reach};
}

// Tests the leaves of two links whose balls overlap in the given lanes. Returns the lanes in which two touch.
template <class V>
std::uint32_t test_round_links(RoundTest& job, std::size_t number_a, std::size_t number_b, std::uint32_t lanes) {
  const RoundLink &link_a = job.body->links[number_a], &link_b = job.body->links[number_b];
  const PosedBall ball_b = ball_of(job, number_b);
  const bool is_group = link_a.end - link_a.begin > 1;
  std::uint32_t done = 0;
  for (std::uint32_t a = link_a.begin; a < link_a.end && (lanes & ~done); ++a) {
    const RoundLeaf& leaf_a = job.body->leaves[a];
    std::uint32_t near = lanes & ~done;
    if (is_group) {
      job.ball_tests += count_bits(near);
      near = test_round<V, true>(job.tiles[a], ball_b.tile, leaf_a.reach + ball_b.reach + job.margin, near).possible;
    }
    for (std::uint32_t b = link_b.begin; b < link_b.end && (near & ~done); ++b) {
      const RoundLeaf& leaf_b = job.body->leaves[b];
      const std::uint32_t tested = near & ~done;
      const float radii = leaf_a.radius + leaf_b.radius + job.margin;
      job.leaf_tests += count_bits(tested);
      const RoundAnswer answer = leaf_a.is_ball && leaf_b.is_ball
                                     ? test_round<V, true>(job.tiles[a], job.tiles[b], radii, tested)
                                     : test_round<V, false>(job.tiles[a], job.tiles[b], radii, tested);
      if (!answer.possible) continue;
      const std::uint32_t found = answer.touching << kLanes | answer.possible;
      job.found.push({std::min(leaf_a.leaf, leaf_b.leaf), std::max(leaf_a.leaf, leaf_b.leaf), found});
      done |= answer.touching;
    }
  }
  return done;
}

// Tests all pairs of links that are not ignored.
template <class V>
void test_round_body(RoundTest& job) {
  const Span<const RoundLink> links = job.body->links;
  std::uint32_t lanes = job.lanes;
  for (std::size_t a = 0; a < links.size; ++a) {
    const PosedBall ball_a = ball_of(job, a);
    for (std::size_t b = a + 1; b < links.size && lanes; ++b) {
      if (is_ignored(*job.articulation, links[a].link, links[b].link)) continue;
      const PosedBall ball_b = ball_of(job, b);
      job.ball_tests += count_bits(lanes);
      const std::uint32_t near =
          test_round<V, true>(ball_a.tile, ball_b.tile, ball_a.reach + ball_b.reach + job.margin, lanes).possible;
      if (!near) continue;
      const std::uint32_t touching = test_round_links<V>(job, a, b, near);
      if (job.first_only) lanes &= ~touching;
    }
  }
}

}  // namespace cab::kernel
