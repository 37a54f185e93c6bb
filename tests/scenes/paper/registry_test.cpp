// The paper's five scenes by number, and the properties that all of them have.
#include "scenes/paper/registry.h"

#include "tests/scenes/paper/leaf_boxes.h"

#include <cab/cab.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

using namespace cab::tests;

TEST_CASE("the names, frames and pairs of the registry are those of its scenes") {
  for (const PaperScene& entry : kPaperScenes) {
    CAPTURE(entry.table);
    const Scene scene = make_paper_scene(entry.table);
    CHECK(scene.name == entry.name);
    CHECK(scene.frame_count == entry.frame_count);
    CHECK(scene.frame_seconds == 1.0 / 60);
    std::size_t leaves = 0, leaf_pairs = 0;
    for (const Character& character : scene.characters) leaves += character.leaves.size();
    for (const CharacterPair& pair : scene.pairs) {
      REQUIRE(pair.a < pair.b);
      REQUIRE(pair.b < scene.characters.size());
      CHECK(pair.a == 0);
      leaf_pairs += scene.characters[pair.a].leaves.size() * scene.characters[pair.b].leaves.size();
    }
    if (entry.table == 5) {
      CHECK(leaf_pairs * scene.frame_count == 288072);
    } else {
      CHECK(leaf_pairs == 64);
      CHECK(leaves * (leaves - 1) / 2 * scene.frame_count == 1200000);
    }
  }
}

TEST_CASE("tables that the paper does not have are refused") {
  CHECK_THROWS_AS(make_paper_scene(0), std::invalid_argument);
  CHECK_THROWS_AS(make_paper_scene(6), std::invalid_argument);
}

TEST_CASE("a short scene is the beginning of a long one, bit for bit") {
  for (const PaperScene& entry : kPaperScenes) {
    CAPTURE(entry.table);
    const Scene whole = make_paper_scene(entry.table, 50), part = make_paper_scene(entry.table, 20);
    CHECK(part.frame_count == 20);
    CHECK(pose_hash(whole) == pose_hash(make_paper_scene(entry.table, 50)));
    CHECK(pose_hash(whole) != pose_hash(part));
    for (std::size_t c = 0; c < part.characters.size(); ++c) {
      const std::vector<float>& poses = part.characters[c].poses;
      CHECK(std::equal(poses.begin(), poses.end(), whole.characters[c].poses.begin()));
    }
  }
}

TEST_CASE("links are rigid and right-handed in every frame") {
  // Worst measured 1.1e-7, from unit axes rounded to float.
  constexpr double kAxesTolerance = 3e-7;
  for (const PaperScene& entry : kPaperScenes) {
    CAPTURE(entry.table);
    const Scene scene = make_paper_scene(entry.table);
    double worst = 0;
    for (const Character& character : scene.characters) {
      const std::uint32_t frames = character.is_static ? 1 : scene.frame_count;
      REQUIRE(character.pose_format == cab::PoseFormat::kMatrix3x4Rows);
      REQUIRE(character.poses.size() == std::size_t{frames} * character.link_parents.size() * 12);
      REQUIRE(character.origins.empty());
      for (std::uint32_t f = 0; f < frames; ++f) {
        for (std::size_t link = 0; link < character.link_parents.size(); ++link) {
          const std::array<Vec3, 3> r = placed(character, f, link).axes;
          for (std::size_t k = 0; k < 3; ++k) {
            worst = std::max(worst, std::fabs(length(r[k]) - 1));
            worst = std::max(worst, length(cross(r[k], r[(k + 1) % 3]) - r[(k + 2) % 3]));
          }
        }
      }
    }
    CHECK(worst < kAxesTolerance);
  }
}

TEST_CASE("a joint keeps its place in the frames of both its links") {
  // Worst measured 6.5e-6, in the braid, from floats of coordinates below 64 here and in frame 0.
  constexpr double kJointTolerance = 1e-5;
  for (const PaperScene& entry : kPaperScenes) {
    CAPTURE(entry.table);
    const Scene scene = make_paper_scene(entry.table);
    double worst = 0;
    for (const Character& character : scene.characters) {
      for (std::size_t link = 1; link < character.link_parents.size(); ++link) {
        const float* const joint = character.link_joints.data() + 3 * link;
        const auto parent = static_cast<std::size_t>(character.link_parents[link]);
        const auto in_parent = [&](std::uint32_t frame) {
          const Vec3 at = placed(character, frame, link).to_world({joint[0], joint[1], joint[2]});
          return placed(character, frame, parent).to_local(at);
        };
        const Vec3 first = in_parent(0);
        for (std::uint32_t f = 1; f < scene.frame_count; ++f) worst = std::max(worst, length(in_parent(f) - first));
      }
    }
    CHECK(worst < kJointTolerance);
  }
}

TEST_CASE("every vertex lies in the box of its leaf, which is centred in the link's frame") {
  for (const PaperScene& entry : kPaperScenes) {
    CAPTURE(entry.table);
    for (const Character& character : make_paper_scene(entry.table, 1).characters) {
      for (const BodyLeaf& leaf : character.leaves) {
        for (int k = 0; k < 3; ++k) {
          CHECK(leaf.box.center[k] == 0);
          for (int c = 0; c < 3; ++c) CHECK(leaf.box.axis[k][c] == (k == c ? 1 : 0));
        }
        float excess = -1;
        for (const ShapePart& part : leaf.parts)
          for (std::size_t i = 0; i < part.vertices.size(); ++i)
            excess = std::max(excess, std::fabs(part.vertices[i]) - leaf.box.half[i % 3]);
        CHECK(excess <= 0);
      }
    }
  }
}

TEST_CASE("an engine takes every character of the paper's scenes") {
  cab::Engine* made = nullptr;
  REQUIRE(cab::create_engine({}, &made) == cab::Status::kOk);
  const std::unique_ptr<cab::Engine, void (*)(cab::Engine*)> engine(made, cab::destroy_engine);
  for (const PaperScene& entry : kPaperScenes) {
    for (const Character& character : make_paper_scene(entry.table, 1).characters) {
      CAPTURE(character.name);
      const ArticulationStorage storage(character);
      cab::ArticulationId id;
      CHECK(cab::add_articulation(*engine, storage.desc(), &id) == cab::Status::kOk);
    }
  }
}
