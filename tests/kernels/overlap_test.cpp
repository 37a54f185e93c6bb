// The overlap test against an exact judge: no overlapping pair is lost, and each axis separates its boxes.
#include "kernels/descend_tiles.h"
#include "kernels/gather_pairs.h"
#include "perf/judge/oracle/overlap_exact.h"
#include "perf/judge/oracle/touching_pairs.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <limits>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 15;

constexpr std::size_t kAll15 = static_cast<std::size_t>(Sat::kAll15), kFaces6 = static_cast<std::size_t>(Sat::kFaces6);

// Sixteen pairs in both layouts that kernels read.
struct Pairs {
  oracle::BoxPair pair[kLanes];
  BoxAos aos_a[kLanes], aos_b[kLanes];
  BoxTile tile_a, tile_b;
  ShiftTile shift;
};

void fill(Pairs& pairs) {
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const oracle::BoxPair& pair = pairs.pair[lane];
    pairs.aos_a[lane] = to_aos(pair.a);
    pairs.aos_b[lane] = to_aos(pair.b);
    put(pairs.tile_a, lane, pair.a);
    put(pairs.tile_b, lane, pair.b);
    for (std::size_t c = 0; c < 3; ++c) pairs.shift.by[c][lane] = pair.origin_b[c] - pair.origin_a[c];
  }
}

std::uint32_t overlap_block(const kernel::KernelTable& kernels, const Pairs& pairs, std::uint32_t leaves,
                            std::size_t sat = kAll15) {
  kernel::BoxPairs<BoxAos> boxes;
  boxes.shift = &pairs.shift;
  boxes.leaves = leaves;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    boxes.a[lane] = &pairs.aos_a[lane];
    boxes.b[lane] = &pairs.aos_b[lane];
  }
  return kernels.overlap_boxes[sat](boxes);
}

// An articulation of one link and one leaf, for the tile kernels.
Articulation one_leaf() {
  static constexpr std::uint16_t kLink[] = {0}, kCount[] = {1};
  static constexpr std::uint64_t kIgnored[] = {1};
  Articulation articulation;
  articulation.link_count = articulation.leaf_count = articulation.node_count = 1;
  articulation.leaf_link = {kLink, 1};
  articulation.ignored_bits = {kIgnored, 1};
  articulation.program.node_leaf_count = {kCount, 1};
  return articulation;
}

std::uint32_t overlap_tiles(const kernel::KernelTable& kernels, const Pairs& pairs, const ShiftTile* shift,
                            std::size_t sat = kAll15) {
  const Articulation articulation = one_leaf();
  TilePair stack[4], found[4];
  kernel::TileDescent<BoxTile> job{&articulation, &articulation, &pairs.tile_a, &pairs.tile_b, shift,
                                   0xffff,        false,         {stack, 4, 0}, {found, 4, 0}, 0};
  kernels.descend_boxes[sat](job);
  CHECK(job.box_tests == kLanes);
  return job.found.size ? found[0].lanes : 0;
}

bool zero_shift(const Pairs& pairs) {
  for (const auto& component : pairs.shift.by)
    for (const double by : component)
      if (by != 0) return false;
  return true;
}

// A pose that only one axis separates, in all lanes.
Pairs separated_along(std::size_t axis) {
  Pairs pairs;
  for (auto& pair : pairs.pair) pair = oracle::separating_axis_pose(axis);
  fill(pairs);
  return pairs;
}

}  // namespace

TEST_CASE("no pair that touches is called apart, however narrowly it touches") {
  const std::uint64_t tiles_per_regime = rounds(800);
  const std::uint32_t kAllLeaves = 0xffff, kAllInner = 0;
  for (unsigned regime = 0; regime < oracle::kTouchRegimeCount; ++regime) {
    oracle::Random random(kSeed + regime);
    std::size_t touching = 0, lost = 0, false_positives = 0, differing = 0;
    for (std::uint64_t t = 0; t < tiles_per_regime; ++t) {
      Pairs pairs;
      std::uint32_t truth = 0;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        pairs.pair[lane] =
            oracle::near_touching_pair(random, static_cast<oracle::TouchRegime>(regime), random.uniform(-20, 2));
        if (oracle::judge_overlap(pairs.pair[lane].a, pairs.pair[lane].b, oracle::exact_offset(pairs.pair[lane]))
                .overlap)
          truth |= 1u << lane;
      }
      fill(pairs);
      touching += static_cast<std::size_t>(__builtin_popcount(truth));
      const std::uint32_t expected = overlap_block(*kernel::find_kernels(Isa::kScalar), pairs, kAllLeaves);
      lost += static_cast<std::size_t>(__builtin_popcount(truth & ~expected));
      false_positives += static_cast<std::size_t>(__builtin_popcount(expected & ~truth));
      lost += static_cast<std::size_t>(
          __builtin_popcount(truth & ~overlap_block(*kernel::find_kernels(Isa::kScalar), pairs, kAllInner)));
      for (const kernel::KernelTable* kernels : available_kernels()) {
        differing += overlap_block(*kernels, pairs, kAllLeaves) != expected;
        differing += overlap_tiles(*kernels, pairs, &pairs.shift) != expected;
        if (zero_shift(pairs)) differing += overlap_tiles(*kernels, pairs, nullptr) != expected;
      }
    }
    MESSAGE("regime " << regime << ": " << touching << " of " << tiles_per_regime * kLanes << " touch, "
                      << false_positives << " false positives");
    CAPTURE(regime);
    CAPTURE(kSeed);
    CHECK(touching > tiles_per_regime * kLanes / 4);
    CHECK(lost == 0);
    CHECK(differing == 0);
  }
}

TEST_CASE("each of the fifteen axes alone separates the pose made for it") {
  for (std::size_t axis = 0; axis < oracle::kSeparatingAxisCount; ++axis) {
    const Pairs pairs = separated_along(axis);
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(axis);
      CAPTURE(name_of(*kernels));
      CHECK(overlap_block(*kernels, pairs, 0) == 0);
      CHECK(overlap_tiles(*kernels, pairs, nullptr) == 0);
    }
  }
}

// In the order of oracle::separating_axis_pose the six faces come first.
TEST_CASE("the six faces alone separate their own poses, and no pose that only edges separate") {
  for (std::size_t axis = 0; axis < oracle::kSeparatingAxisCount; ++axis) {
    const Pairs pairs = separated_along(axis);
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(axis);
      CAPTURE(name_of(*kernels));
      const std::uint32_t expected = axis < 6 ? 0 : 0xffff;
      CHECK(overlap_block(*kernels, pairs, 0, kFaces6) == expected);
    }
  }
}

TEST_CASE("fewer axes let every pair pass that all fifteen do, and the same ones on every instruction set") {
  std::size_t more = 0;
  for (unsigned regime = 0; regime < oracle::kTouchRegimeCount; ++regime) {
    oracle::Random random(kSeed + 400 + regime);
    std::size_t lost = 0, differing = 0;
    for (std::uint32_t t = 0; t < 400; ++t) {
      Pairs pairs;
      for (auto& pair : pairs.pair)
        pair = oracle::near_touching_pair(random, static_cast<oracle::TouchRegime>(regime), random.uniform(-20, 1000));
      fill(pairs);
      const kernel::KernelTable& scalar = *kernel::find_kernels(Isa::kScalar);
      for (const std::uint32_t leaves : {0u, 0xffffu}) {
        const std::uint32_t all = overlap_block(scalar, pairs, leaves),
                            faces = overlap_block(scalar, pairs, leaves, kFaces6);
        lost += (all & ~faces) != 0;
        more += static_cast<std::size_t>(__builtin_popcount(faces & ~all));
        for (const kernel::KernelTable* kernels : available_kernels()) {
          differing += overlap_block(*kernels, pairs, leaves, kFaces6) != faces;
          if (leaves) differing += overlap_tiles(*kernels, pairs, &pairs.shift, kFaces6) != faces;
        }
      }
    }
    CAPTURE(regime);
    CHECK(lost == 0);
    CHECK(differing == 0);
  }
  CHECK(more > 1000);
}

TEST_CASE("a NaN never separates two boxes") {
  oracle::Random random(kSeed);
  Pairs pairs;
  for (auto& pair : pairs.pair) {
    pair = oracle::separating_axis_pose(0);
    pair.b.center[0] = pair.b.center[1] = pair.b.center[2] = std::numeric_limits<float>::quiet_NaN();
  }
  fill(pairs);
  for (const kernel::KernelTable* kernels : available_kernels())
    for (const std::size_t sat : {kAll15, kFaces6}) CHECK(overlap_block(*kernels, pairs, 0xffff, sat) == 0xffff);
}

TEST_CASE("bounds contain their box and overlap wherever the leaf predicate says so") {
  for (unsigned regime = 0; regime < oracle::kTouchRegimeCount; ++regime) {
    oracle::Random random(kSeed + 100 + regime);
    std::size_t outside = 0, lost = 0, differing = 0;
    for (std::uint32_t t = 0; t < 400; ++t) {
      Pairs pairs;
      for (auto& pair : pairs.pair)
        pair = oracle::near_touching_pair(random, static_cast<oracle::TouchRegime>(regime), random.uniform(-20, 100));
      fill(pairs);
      AabbTile a, b;
      const kernel::KernelTable& scalar = *kernel::find_kernels(Isa::kScalar);
      scalar.bound_boxes(&pairs.tile_a, 1, &a);
      scalar.bound_boxes(&pairs.tile_b, 1, &b);
      AabbAos aos_a[kLanes], aos_b[kLanes];
      scalar.aabbs_to_aos(&a, 1, kLanes, aos_a, 1);
      scalar.aabbs_to_aos(&b, 1, kLanes, aos_b, 1);
      kernel::BoxPairs<AabbAos> boxes;
      boxes.shift = &pairs.shift;
      boxes.leaves = 0xffff;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        boxes.a[lane] = &aos_a[lane];
        boxes.b[lane] = &aos_b[lane];
        const auto box = oracle::convert<oracle::Quad>(pairs.pair[lane].a);
        for (unsigned i = 0; i < 8; ++i) {
          const auto corner = oracle::corner(box, i);
          for (std::size_t c = 0; c < 3; ++c)
            outside += corner[c] < static_cast<oracle::Quad>(a.lo[c][lane]) ||
                       corner[c] > static_cast<oracle::Quad>(a.hi[c][lane]);
        }
      }
      const std::uint32_t expected = scalar.overlap_aabbs(boxes);
      lost += (overlap_block(scalar, pairs, 0xffff) & ~expected) != 0;
      for (const kernel::KernelTable* kernels : available_kernels()) {
        AabbTile again;
        kernels->bound_boxes(&pairs.tile_a, 1, &again);
        differing += !same_bits(again, a);
        differing += kernels->overlap_aabbs(boxes) != expected;
      }
    }
    CAPTURE(regime);
    CHECK(outside == 0);
    CHECK(lost == 0);
    CHECK(differing == 0);
  }
}

TEST_CASE("boxes as records are exactly the tile's boxes, for every number of live lanes") {
  oracle::Random random(kSeed + 300);
  for (std::uint32_t live = 1; live <= kLanes; ++live) {
    BoxTile nodes[3];
    for (auto& node : nodes)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        put(node, lane, oracle::near_touching_pair(random, oracle::TouchRegime::kOrdinary, 0).a);
    for (const kernel::KernelTable* kernels : available_kernels()) {
      std::vector<BoxAos> boxes(kLanes * 4);
      std::memset(static_cast<void*>(boxes.data()), 0x5a, boxes.size() * sizeof(BoxAos));
      const std::vector<BoxAos> untouched = boxes;
      kernels->boxes_to_aos(nodes, 3, live, boxes.data(), 4);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        for (std::uint32_t n = 0; n < 4; ++n) {
          const BoxAos expected = lane < live && n < 3 ? to_aos(get(nodes[n], lane)) : untouched[lane * 4 + n];
          REQUIRE(same_bits(boxes[lane * 4 + n], expected));
        }
    }
  }
}

}  // namespace cab::tests
