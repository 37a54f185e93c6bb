// Meshes, weights and inverse bind matrices of a file that the test writes as glTF.
#include "scenes/import/skin_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace {

using namespace cab;
using namespace cab::scenes;
using cab::tests::gltf_text;
using cab::tests::TemporaryFile;
using cab::tests::two_boxes;

Clip clip_of(const ImportOptions& options) {
  const TemporaryFile file("boxes.gltf", gltf_text(two_boxes()));
  return import_clip(file.path(), options);
}

}  // namespace

TEST_CASE("a file's skin has all meshes that joints move, with scale in the bodies and rigid poses") {
  ImportOptions options;
  options.skin.emplace();
  options.skin->kinds = rig::kBoxBody;
  options.metres_per_unit = .5;
  const Clip clip = clip_of(options);
  const Character& character = clip.character;
  REQUIRE(character.link_names == std::vector<std::string>{"root", "arm"});
  REQUIRE(character.leaves.size() == 2);
  // Half of 6 units, at half a metre each. The tetrahedron reaches to x = 6 units.
  const float* const half = character.leaves[1].box.half;
  CHECK(std::max({half[0], half[1], half[2]}) == doctest::Approx(1.5).epsilon(1e-5));
  CHECK(std::min({half[0], half[1], half[2]}) == doctest::Approx(.5).epsilon(1e-5));
  const float* const with_prop = character.leaves[0].box.half;
  CHECK(std::max({with_prop[0], with_prop[1], with_prop[2]}) > 1.6);
  CHECK(clip.coverage->share_inside == 1);
  CHECK(clip.coverage->worst_protrusion == 0);
  // The arm's pose is at z = 3 m, with a quaternion of length 1.
  const float* const pose = character.poses.data() + 7;
  CHECK(pose[6] == doctest::Approx(3));
  CHECK(pose[0] * pose[0] + pose[1] * pose[1] + pose[2] * pose[2] + pose[3] * pose[3] == doctest::Approx(1));
  bool is_told = false;
  for (const std::string& note : clip.notes) is_told = is_told || note.find("1 mesh left out") != std::string::npos;
  CHECK(is_told);
}

TEST_CASE("an animation is chosen by name or by number, and a wrong one is refused with the names that there are") {
  ImportOptions options;
  options.skin.emplace();
  for (const char* text : {"out", "1"}) {
    options.animation = text;
    const Clip clip = clip_of(options);
    REQUIRE(clip.frame_count == 2);
    CHECK(clip.character.poses[7 * 3 + 6] == doctest::Approx(9));
  }
  for (const char* text : {"", "still", "0"}) {
    options.animation = text;
    const Clip clip = clip_of(options);
    REQUIRE(clip.frame_count == 2);
    CHECK(clip.character.poses[7 * 3 + 6] == doctest::Approx(6));
  }
  options.animation = "walk";
  CHECK_THROWS_WITH_AS(clip_of(options), doctest::Contains("no animation walk among \"still\", \"out\""), ImportError);
}

TEST_CASE("bodies of a skin are refused where there is no mesh or no joint of a name") {
  ImportOptions options;
  options.skin.emplace();
  options.skin->kept_joints = {"root", "leg"};
  CHECK_THROWS_WITH_AS(clip_of(options), doctest::Contains("no joint is named leg"), ImportError);
  options.skin->kept_joints = {"root"};
  CHECK(clip_of(options).character.link_names == std::vector<std::string>{"root"});
  options.skin->kept_joints.clear();
  const TemporaryFile bvh("clip.bvh",
                          "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\n"
                          "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: .01\n0 0 0\n");
  CHECK_THROWS_WITH_AS(import_clip(bvh.path(), options), doctest::Contains("no skin"), ImportError);
}
