// The braid of Table 4: motion, shapes, and the counts that follow from the leaf boxes.
#include "scenes/paper/braid.h"

#include "scenes/paper/superellipsoid.h"
#include "tests/scenes/paper/leaf_boxes.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace cab::tests;

TEST_CASE("the braid is two strands of eight links that meet end to end in every frame") {
  const Scene scene = make_braid(2000);
  REQUIRE(scene.characters.size() == 2);
  CHECK(scene.frame_count == 2000);
  CHECK(scene.frame_seconds == doctest::Approx(1.0 / 60));
  // Worst measured 3.8e-6, from floats of coordinates below 64.
  constexpr double kJointTolerance = 1e-5;
  for (const Character& strand : scene.characters) {
    REQUIRE(strand.leaves.size() == 8);
    for (std::uint32_t i = 0; i < 8; ++i) {
      CHECK(strand.link_parents[i] == static_cast<int>(i) - 1);
      CHECK(strand.link_joints[3 * i] == -3);
      REQUIRE(strand.leaves[i].parts.size() == 1);
      CHECK(strand.leaves[i].parts[0].vertices == superellipsoid(3, .5, .5, .6));
    }
    double worst = 0;
    for (std::uint32_t f = 0; f < scene.frame_count; ++f)
      for (std::uint32_t i = 1; i < 8; ++i)
        worst = std::max(
            worst, length(placed(strand, f, i - 1).to_world({3, 0, 0}) - placed(strand, f, i).to_world({-3, 0, 0})));
    CHECK(worst < kJointTolerance);
  }
}

TEST_CASE("the first links of both strands stand in frame 0 where the equations put them") {
  // t = 0: r = 1.169, turn 1.3, h = (36 - 4 1.169^2 sin^2 .65)^.5 = 5.8307791. Strand 0: Q = (0, .6, 0), link 0 from
  // (1.169, 0, 0) to (.3127061, 1.1263995, 5.8307791), both plus Q; its axis 1 lies along the middle, which is square
  // to axis 0 by symmetry.
  const Scene scene = make_braid(1);
  const PlacedBox first = placed(scene.characters[0], 0, 0);
  CHECK(length(first.center - tilted_by(.081, {.7408531, 1.1631998, 2.9153896})) < 1e-6);
  CHECK(length(first.axes[0] - tilted_by(.081, {-.1427156, .1877333, .9717965})) < 1e-6);
  const Vec3 radial = {.7408531, .5631998, 0};
  CHECK(length(first.axes[1] - tilted_by(.081, (1 / length(radial)) * radial)) < 1e-6);
  // Strand 1 is half a turn further and shifted by .33: from phi = .429 + pi to 1.729 + pi; Q = .6 (sin 2, cos 1.3, 0)
  // = (.5455785, .1604993, 0); the middle before Q is (-.4394491, -.8203303, 4.8395467).
  const PlacedBox other = placed(scene.characters[1], 0, 0);
  CHECK(length(other.center - tilted_by(.081, {.1061294, -.6598310, 4.8395467})) < 1e-6);
}

TEST_CASE("the leaf boxes of the braid have the known counts of overlaps") {
  const Scene scene = make_braid(10000);
  CHECK(count_box_overlaps(scene) == 24822);
  CHECK(count_box_bounds_overlaps(scene) == 95718);
  CHECK(count_vertex_bounds_overlaps(scene) == 61337);
}
