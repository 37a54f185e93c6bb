// Which nodes become joints, and what they become: persons whose tracks and bones are not those of all limbs.
#include "scenes/import/scene_joints.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_person.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>

namespace {

using namespace cab::scenes;
using namespace cab::tests;
using Names = std::vector<std::string>;

Skeleton skeleton_of(const MadePerson& person, bool skin = false) {
  const TemporaryFile file("person.glb", glb(person.gltf()));
  ImportOptions options;
  if (skin) options.skin.emplace();
  return import_skeleton(file.path(), options);
}

Names sorted(Names names) {
  std::sort(names.begin(), names.end());
  return names;
}

bool has(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string all_notes(const Names& notes) {
  std::string text;
  for (const std::string& note : notes) text += note + "\n";
  return text;
}

// The length along a link's bone between its joints, metres.
double bone_of(const Clip& clip, const Skeleton& skeleton, const std::string& name) {
  for (const SkeletonBody& body : clip.bodies.bodies)
    if (body.is_solid && body.end >= 0 && skeleton.joint_names[body.joint] == name)
      return length(clip.bodies.segments.offset[static_cast<std::size_t>(body.end)]);
  return 0;
}

// Every part of the person has a body.
void check_person(const Skeleton& skeleton) {
  CHECK(sorted(skeleton.joint_names) == sorted(names_of_person()));
  const Clip clip = make_clip(skeleton, "person", {});
  // Toes have no link: a foot's bone ends there. Hips, spine, neck and head have one.
  for (const char* link :
       {"Hips", "Spine", "Neck", "Head", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftArm", "LeftForeArm", "LeftHand",
        "RightUpLeg", "RightLeg", "RightFoot", "RightArm", "RightForeArm", "RightHand"}) {
    CAPTURE(std::string(link));
    CHECK(has(clip.character.link_names, link));
  }
  CHECK(bone_of(clip, skeleton, "LeftUpLeg") == doctest::Approx(.42).epsilon(1e-6));
  CHECK(bone_of(clip, skeleton, "RightForeArm") == doctest::Approx(.25).epsilon(1e-6));
  CHECK(clip.size_doubt.empty());
}

const Names kFewTracks = {"Hips", "LeftUpLeg", "RightUpLeg", "LeftArm", "RightArm"};

}  // namespace

TEST_CASE("limbs are joints though the skin is that of a head alone") {
  check_person(skeleton_of({names_of_person(), {"Head", "Neck"}}));
  check_person(skeleton_of({kFewTracks, {"Head", "Neck"}}));
  check_person(skeleton_of({kFewTracks, {"Head"}}));
  // The node above all limbs and bones need not move.
  check_person(skeleton_of({{"LeftUpLeg", "RightUpLeg", "LeftArm", "RightArm"}, {"Head", "Neck"}}));
  check_person(skeleton_of({{"LeftUpLeg", "RightUpLeg", "LeftArm", "RightArm"}, {"Head", "Neck"}}, true));
}

TEST_CASE("nodes without tracks below those that have some are joints") {
  check_person(skeleton_of({kFewTracks, {}}));
  check_person(skeleton_of({{"Hips"}, {}}));
  check_person(skeleton_of({names_of_person(), {}}));
}

TEST_CASE("the ends of bones that move no vertex are joints") {
  const Names bones = {"Hips",       "Spine",    "Neck",    "LeftUpLeg", "LeftLeg",
                       "RightUpLeg", "RightLeg", "LeftArm", "RightArm"};
  check_person(skeleton_of({{}, bones}));
  check_person(skeleton_of({kFewTracks, bones}));
}

TEST_CASE("meshes, cameras, lights, and what steers a figure are no joints of it") {
  for (const bool has_skin : {false, true}) {
    CAPTURE(has_skin);
    MadePerson person(names_of_person(), has_skin ? Names{"Head", "Neck"} : Names{});
    if (has_skin) person.add("Sword", "RightHand", {{"mesh", 1}, {"translation", {0, 0, .1}}});
    person.json()["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", .1}}}}};
    person.add("Eyes of the viewer", "Head", {{"camera", 0}, {"translation", {0, 0, .1}}});
    for (const char* name : {"ik_foot_l", "LeftHandTarget", "weapon_socket", "Hips_ctrl", "Knee Pole"})
      person.add(name, "LeftFoot", {{"translation", {1, 0, 0}}});
    check_person(skeleton_of(person));
  }
}

TEST_CASE("what moves beside a figure with a skin is no joint, and a note names it") {
  MadePerson person(names_of_person(), {"Head", "Neck"});
  person.hold("Armature", Json::object());
  person.add("Ball", "Armature", {{"mesh", 1}, {"translation", {3, 0, 0}}});
  person.add("Locator1", "Armature", {{"translation", {2, 0, 0}}});
  person.add("Still", "Armature", {{"translation", {2, 0, 0}}});
  person.add("Parked", "Armature", {{"mesh", 1}});
  for (const char* name : {"Ball", "Locator1"}) person.turn(name);
  const Skeleton skeleton = skeleton_of(person);
  check_person(skeleton);
  CHECK(all_notes(skeleton.notes).find("2 nodes move and are no joint of the figure: Ball, Locator1\n") !=
        std::string::npos);
  REQUIRE(skeleton.alterations.size() == 1);
  CHECK(skeleton.alterations[0].kind == AlterationKind::kDropped);
  CHECK(skeleton.alterations[0].count == 2);
}

TEST_CASE("an armature that moves carries the figure and is no part of it") {
  MadePerson person(names_of_person(), {"Head", "Neck"});
  person.hold("Armature", {{"translation", {0, 1, 0}}});
  person.turn("Armature");
  const Skeleton skeleton = skeleton_of(person);
  check_person(skeleton);
  // Hips turn with it.
  CHECK(skeleton.positions[1] == doctest::Approx(1.95));
  const std::size_t last = 3 * 2 * skeleton.joint_names.size();
  CHECK(skeleton.positions[last + 1] < 1.9);
  CHECK(all_notes(skeleton.notes).find("no joint of the figure") == std::string::npos);
}

TEST_CASE("a mesh that a track moves in a hand is a joint where bodies are made of meshes") {
  MadePerson person(names_of_person(), {"Head", "Neck", "RightHand"});
  person.add("Sword", "RightHand", {{"mesh", 1}, {"translation", {0, 0, .1}}});
  person.turn("Sword");
  CHECK(has(skeleton_of(person, true).joint_names, "Sword"));
  const Skeleton of_bones = skeleton_of(person);
  check_person(of_bones);
  CHECK(all_notes(of_bones.notes).find("1 node moves and is no joint of the figure: Sword\n") != std::string::npos);
}

TEST_CASE("the figures of assimp-testmodels keep their joints") {
  const std::string models = "/usr/share/assimp/models/";
  struct Known {
    const char* file;
    std::size_t joints, links;
  };
  for (const Known& known : {Known{"FBX/animation_with_skeleton.fbx", 17, 15}, {"X/Testwuson.X", 38, 38}}) {
    CAPTURE(std::string(known.file));
    if (!std::filesystem::exists(models + known.file)) {
      MESSAGE("skipped: " << models << known.file << " is not there (package assimp-testmodels)");
      continue;
    }
    const Skeleton skeleton = import_skeleton(models + known.file, {});
    CHECK(skeleton.joint_names.size() == known.joints);
    CHECK(make_clip(skeleton, "figure", {}).character.link_names.size() == known.links);
  }
}
