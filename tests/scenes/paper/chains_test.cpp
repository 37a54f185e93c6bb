// The chains of Tables 1 to 3: motion, shapes, and the counts that follow from the leaf boxes.
#include "scenes/paper/chains.h"

#include "scenes/paper/superellipsoid.h"
#include "tests/scenes/paper/leaf_boxes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

using namespace cab::tests;

TEST_CASE("a superellipsoid has 58 vertices that fill its half extents") {
  const std::vector<float> v = superellipsoid(3, .5, .25, .75);
  REQUIRE(v.size() == 58 * 3);
  const float half[3] = {3, .5f, .25f};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = 0, high = 0;
    for (std::size_t i = axis; i < v.size(); i += 3) {
      low = std::min(low, v[i]);
      high = std::max(high, v[i]);
    }
    CHECK(low == -half[axis]);
    CHECK(high == half[axis]);
  }
}

TEST_CASE("with exponent 1 the vertices lie on the ellipsoid, with a small one near the box's corners") {
  const std::vector<float> ball = superellipsoid(2, 3, 4, 1);
  for (std::size_t i = 0; i < ball.size(); i += 3) {
    const double x = ball[i] / 2, y = ball[i + 1] / 3, z = ball[i + 2] / 4;
    CHECK(x * x + y * y + z * z == doctest::Approx(1).epsilon(1e-6));
  }
  // Ring 1, phi = 45 degrees, by hand: x = -cos(pi/8)^.75, y = z = sin(pi/8)^.75 cos(pi/4)^.75.
  const std::vector<float> link = superellipsoid(1, 1, 1, .75);
  CHECK(link[3 * 3 + 0] == doctest::Approx(-0.942334).epsilon(1e-5));
  CHECK(link[3 * 3 + 1] == doctest::Approx(0.375183).epsilon(1e-5));
  CHECK(link[3 * 3 + 2] == doctest::Approx(0.375183).epsilon(1e-5));
}

TEST_CASE("the chain's links are rigid, of the paper's size, and meet at their joints in every frame") {
  for (const std::uint32_t table : {1u, 2u, 3u}) {
    const Scene scene = make_chains(table, 300);
    const double half_length = table == 1 ? 1.5 : 3;
    const float half_height = table == 3 ? .2f : .5f;
    REQUIRE(scene.characters.size() == 2);
    CHECK(scene.frame_count == 300);
    CHECK(scene.frame_seconds == doctest::Approx(1.0 / 60));
    for (const Character& chain : scene.characters) {
      REQUIRE(chain.leaves.size() == 8);
      REQUIRE(chain.link_parents.size() == 8);
      REQUIRE(chain.poses.size() == 300 * 8 * 12);
      CHECK(chain.ignored_pairs.empty());
      for (std::uint32_t i = 0; i < 8; ++i) {
        CHECK(chain.link_parents[i] == static_cast<int>(i) - 1);
        CHECK(chain.leaves[i].link == i);
        CHECK(chain.leaves[i].box.half[0] == static_cast<float>(half_length));
        CHECK(chain.leaves[i].box.half[1] == .5f);
        CHECK(chain.leaves[i].box.half[2] == half_height);
        REQUIRE(chain.leaves[i].parts.size() == (table == 3 ? 12 : 1));
        CHECK(chain.leaves[i].parts.back().shape.kind == cab::ShapeKind::kConvexHull);
        CHECK(chain.link_joints[3 * i] == static_cast<float>(-half_length));
      }
      // Worst measured 3.2e-6, from floats of coordinates below 48.
      constexpr double kJointTolerance = 1e-5;
      for (std::uint32_t f = 0; f < scene.frame_count; ++f) {
        for (std::uint32_t i = 0; i < 8; ++i) {
          const PlacedBox link = placed(chain, f, i);
          REQUIRE(length(cross(link.axes[0], link.axes[1]) - link.axes[2]) < 1e-6);
          REQUIRE(std::fabs(dot(link.axes[0], link.axes[0]) - 1) < 1e-6);
          if (i == 0) continue;
          const PlacedBox before = placed(chain, f, i - 1);
          const Vec3 end = before.center + half_length * before.axes[0];
          const Vec3 start = link.center - half_length * link.axes[0];
          REQUIRE(length(end - start) < kJointTolerance);
        }
      }
    }
  }
}

TEST_CASE("the first link of frame 0 stands where the equations put it") {
  // t = 0, s = +1, i = 0 of Table 1 by hand: D = 2.223; P = (1.1115, 0, .009); a = .146 sin .6 = .0824378;
  // b = .8 .022 sin 1.1 = .0156853; F0 = Rx(b) Ry(a) (0,0,-1) = (-sin a, cos a sin b, -cos a cos b)
  //    = (-.0823445, .0156314, -.9964813); centre P + 1.5 F0 = (.9879833, .0234471, -1.4857220).
  const PlacedBox link = placed(make_chains(1, 1).characters[1], 0, 0);
  CHECK(length(link.center - tilted_by(.868, {.9879833, .0234471, -1.4857220})) < 1e-6);
}

TEST_CASE("the leaf boxes of the three tables have the known counts of overlaps") {
  // Two independent versions in double agree on these counts. Rounding poses to float changes no count.
  struct Counts {
    std::uint32_t table;
    int boxes, box_bounds, vertex_bounds;
  };
  for (const Counts& expected : {Counts{1, 5667, 95752, 67418}, {2, 7335, 135539, 114882}, {3, 3526, 122313, 102521}}) {
    CAPTURE(expected.table);
    const Scene scene = make_chains(expected.table, 10000);
    CHECK(count_box_overlaps(scene) == expected.boxes);
    CHECK(count_box_bounds_overlaps(scene) == expected.box_bounds);
    CHECK(count_vertex_bounds_overlaps(scene) == expected.vertex_bounds);
  }
}

TEST_CASE("dented links move as other links of their length do, bit for bit") {
  CHECK(pose_hash(make_chains(3, 100)) == pose_hash(make_chains(2, 100)));
}

TEST_CASE("chains have the same bits every time, and frames do not depend on the number of frames") {
  const Scene whole = make_chains(2, 50);
  const Scene part = make_chains(2, 20);
  CHECK(pose_hash(whole) == pose_hash(make_chains(2, 50)));
  CHECK(pose_hash(whole) != pose_hash(part));
  for (std::size_t c = 0; c < 2; ++c) {
    CHECK(std::equal(part.characters[c].poses.begin(), part.characters[c].poses.end(),
                     whole.characters[c].poses.begin()));
  }
}

TEST_CASE("the hash of poses is FNV-1a over their bits") {
  Scene scene;
  CHECK(pose_hash(scene) == 0xcbf29ce484222325u);
  scene.characters.emplace_back();
  scene.characters[0].poses = {1.0f};  // bytes 00 00 80 3f
  std::uint64_t by_hand = 0xcbf29ce484222325u;
  for (const std::uint64_t byte : {0x00u, 0x00u, 0x80u, 0x3fu}) by_hand = (by_hand ^ byte) * 0x100000001b3u;
  CHECK(pose_hash(scene) == by_hand);
}

TEST_CASE("the description of an articulation borrows what the character owns") {
  const Scene scene = make_chains(1, 1);
  const ArticulationStorage storage(scene.characters[0]);
  const cab::ArticulationDesc& desc = storage.desc();
  REQUIRE(desc.leaves.size == 8);
  CHECK(desc.link_parents.data == scene.characters[0].link_parents.data());
  CHECK(desc.link_joints.size == 24);
  REQUIRE(desc.leaves[7].parts.size == 1);
  CHECK(desc.leaves[7].parts[0].vertices.data == scene.characters[0].leaves[7].parts[0].vertices.data());
  CHECK(desc.leaves[7].parts[0].vertices.size == 58 * 3);
}

TEST_CASE("a pose has as many floats as its format says") {
  CHECK(pose_floats(cab::PoseFormat::kQuaternionTranslation) == 7);
  CHECK(pose_floats(cab::PoseFormat::kMatrix3x4Rows) == 12);
  CHECK(pose_floats(cab::PoseFormat::kMatrix4x4Columns) == 16);
}

TEST_CASE("tables without chains are refused") {
  CHECK_THROWS_AS(make_chains(0, 1), std::invalid_argument);
  CHECK_THROWS_AS(make_chains(4, 1), std::invalid_argument);
}
