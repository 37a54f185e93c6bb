// Length units: which are guessed, what is said of the others, and what FBX and Collada state.
#include "scenes/import/unit.h"

#include "scenes/import/limits.h"
#include "tests/scenes/import/made_person.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdlib>

namespace {

using namespace cab::scenes;
using namespace cab::tests;

// The person of 18 nodes, whose lengths are so many times as large.
MadePerson person_of(double scale, bool skin = true) {
  MadePerson person(names_of_person(), skin ? std::vector<std::string>{"Head", "Neck"} : std::vector<std::string>{});
  for (Json& node : person.json()["nodes"])
    if (node.contains("translation"))
      for (Json& component : node["translation"]) component = scale * component.get<double>();
  return person;
}

Skeleton read(const std::string& name, const std::string& bytes, const ImportOptions& options = {}) {
  const TemporaryFile file(name, bytes);
  return import_skeleton(file.path(), options);
}

ImportOptions automatic() {
  ImportOptions options;
  options.guesses_unit = true;
  return options;
}

// Three joints in a text of FBX, of which one moves along z from 0 to 100 in a second.
std::string fbx(const std::string& settings) {
  std::string text =
      "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n}\n"
      "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n" +
      settings +
      "\t}\n}\nDefinitions:  {\n\tVersion: 100\n\tCount: 6\n}\nObjects:  {\n"
      "\tModel: 1, \"Model::Hips\", \"LimbNode\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
      "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",0,90,0\n\t\t}\n\t}\n"
      "\tModel: 2, \"Model::Spine\", \"LimbNode\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
      "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",0,60,0\n\t\t}\n\t}\n"
      "\tModel: 3, \"Model::LeftUpLeg\", \"LimbNode\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
      "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",10,-90,0\n\t\t}\n\t}\n"
      "\tAnimationStack: 10, \"AnimStack::walk\", \"\" {\n\t\tProperties70:  {\n"
      "\t\t\tP: \"LocalStop\", \"KTime\", \"Time\", \"\",46186158000\n\t\t}\n\t}\n"
      "\tAnimationLayer: 11, \"AnimLayer::base\", \"\" {\n\t}\n"
      "\tAnimationCurveNode: 12, \"AnimCurveNode::T\", \"\" {\n\t\tProperties70:  {\n"
      "\t\t\tP: \"d|X\", \"Number\", \"\", \"A\",0\n\t\t\tP: \"d|Y\", \"Number\", \"\", \"A\",90\n"
      "\t\t\tP: \"d|Z\", \"Number\", \"\", \"A\",0\n\t\t}\n\t}\n"
      "\tAnimationCurve: 13, \"AnimCurve::\", \"\" {\n\t\tDefault: 0\n\t\tKeyVer: 4008\n"
      "\t\tKeyTime: *2 {\n\t\t\ta: 0,46186158000\n\t\t}\n\t\tKeyValueFloat: *2 {\n\t\t\ta: 0,100\n\t\t}\n"
      "\t\tKeyAttrFlags: *1 {\n\t\t\ta: 24840\n\t\t}\n\t\tKeyAttrDataFloat: *4 {\n\t\t\ta: 0,0,0,0\n\t\t}\n"
      "\t\tKeyAttrRefCount: *1 {\n\t\t\ta: 2\n\t\t}\n\t}\n}\nConnections:  {\n"
      "\tC: \"OO\",1,0\n\tC: \"OO\",2,1\n\tC: \"OO\",3,1\n\tC: \"OO\",11,10\n\tC: \"OO\",12,11\n"
      "\tC: \"OP\",12,1, \"Lcl Translation\"\n\tC: \"OP\",13,12, \"d|Z\"\n}\n";
  return text;
}

std::string unit_setting(const std::string& centimetres) {
  return "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," + centimetres + "\n";
}

// A joint that moves, 90 units above the ground, and another 60 units above it.
std::string collada(const std::string& unit) {
  return "<?xml version='1.0'?>\n<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\n"
         "<asset>" +
         unit +
         "<up_axis>Y_UP</up_axis></asset>\n<library_animations><animation id='a'>\n"
         "<source id='t'><float_array id='ta' count='2'>0 1</float_array><technique_common><accessor source='#ta' "
         "count='2' stride='1'><param name='TIME' type='float'/></accessor></technique_common></source>\n"
         "<source id='v'><float_array id='va' count='6'>0 90 0 0 90 100</float_array><technique_common><accessor "
         "source='#va' count='2' stride='3'><param name='X' type='float'/><param name='Y' type='float'/><param "
         "name='Z' type='float'/></accessor></technique_common></source>\n"
         "<source id='i'><Name_array id='ia' count='2'>LINEAR LINEAR</Name_array><technique_common><accessor "
         "source='#ia' count='2' stride='1'><param name='INTERPOLATION' type='name'/></accessor></technique_common>"
         "</source>\n<sampler id='s'><input semantic='INPUT' source='#t'/><input semantic='OUTPUT' source='#v'/>"
         "<input semantic='INTERPOLATION' source='#i'/></sampler><channel source='#s' target='Hips/translate'/>\n"
         "</animation></library_animations>\n<library_visual_scenes><visual_scene id='scene' name='scene'>\n"
         "<node id='Hips' name='Hips' sid='Hips' type='JOINT'><translate sid='translate'>0 90 0</translate>\n"
         "<node id='Spine' name='Spine' sid='Spine' type='JOINT'><translate sid='translate'>0 60 0</translate></node>"
         "</node>\n</visual_scene></library_visual_scenes>\n<scene><instance_visual_scene url='#scene'/></scene>\n"
         "</COLLADA>\n";
}

double place(const Skeleton& skeleton, std::size_t frame, std::size_t joint, std::size_t axis) {
  return skeleton.positions[3 * (frame * skeleton.joint_names.size() + joint) + axis];
}

}  // namespace

TEST_CASE("the usual unit that makes a standing person is guessed, or else one of 1.7 m") {
  struct Figure {
    double units_tall, metres_per_unit;
  };
  for (const Figure& figure : {Figure{1.7, 1},
                               {26.1, .0564},
                               {66, .0254},
                               {170, .01},
                               {1700, .001},
                               {5.5, .3048},
                               {17, .1},
                               {45, .038},
                               {.017, 100},
                               {1e6, 1.7e-6}}) {
    CAPTURE(figure.units_tall);
    const UnitGuess guess = guess_unit(figure.units_tall);
    CHECK(guess.metres_per_unit == doctest::Approx(figure.metres_per_unit).epsilon(1e-12));
    CHECK(guess.height == doctest::Approx(figure.units_tall * figure.metres_per_unit));
    CHECK(guess.height >= 1.3);
    CHECK(guess.height <= 2.1);
  }
  for (const double none : {0.0, -1.0, std::nan(""), HUGE_VAL}) CHECK(guess_unit(none).metres_per_unit == 0);
}

TEST_CASE("a doubt says how tall the figure is, and which unit would make a person of it") {
  CHECK(doubt_of_height(1.7, 1, true).empty());
  CHECK(doubt_of_height(.5, 1, true).empty());
  CHECK(doubt_of_height(26.1, 1, true) ==
        "the figure is 26.1 m tall, a person is 0.5 to 3 m; --units 0.0564 (inches / "
        "0.45, as CMU's) makes 1.47 m");
  // The unit is that of the file, whatever was given.
  CHECK(doubt_of_height(.017, .0001, true).find("--units 0.01 (centimetres) makes 1.7 m") != std::string::npos);
  CHECK(doubt_of_height(45, 1, true).find("--units 0.038 makes 1.71 m") != std::string::npos);
  CHECK(doubt_of_height(45, 1, false).find("if it is a person: its joints' names do not say") != std::string::npos);
  CHECK(doubt_of_height(0, 1, false) == "the figure is 0 m tall, a person is 0.5 to 3 m");
}

TEST_CASE("a guessed unit scales all that is a length, and says so") {
  for (const bool sandbox : {false, true}) {
    ImportOptions options = automatic(), given;
    options.skin.emplace();
    if (sandbox) options.sandbox = kImportSandbox;
    given.skin.emplace();
    given.metres_per_unit = .01;
    const std::string bytes = glb(person_of(100).gltf());
    const Skeleton guessed = read("person.glb", bytes, options), right = read("person.glb", bytes, given);
    CHECK(guessed.unit.metres == .01);
    CHECK(guessed.unit.source == UnitSource::kGuessed);
    CHECK(right.unit.source == UnitSource::kGiven);
    REQUIRE(guessed.positions.size() == right.positions.size());
    for (std::size_t i = 0; i < right.positions.size(); ++i)
      CHECK(guessed.positions[i] == doctest::Approx(right.positions[i]).epsilon(1e-12));
    for (std::size_t i = 0; i < right.rest_offsets.size(); ++i)
      CHECK(guessed.rest_offsets[i] == doctest::Approx(right.rest_offsets[i]).epsilon(1e-12));
    REQUIRE(guessed.skin.inverse_bind.size() == right.skin.inverse_bind.size());
    for (std::size_t i = 0; i < right.skin.inverse_bind.size(); ++i)
      CHECK(guessed.skin.inverse_bind[i] == doctest::Approx(right.skin.inverse_bind[i]).epsilon(1e-6));
    CHECK(guessed.notes.back().find("unit guessed: 0.01 m (centimetres)") == 0);
    CHECK(guessed.alterations.back().kind == AlterationKind::kGuessed);
  }
}

TEST_CASE("a guess leaves alone what can be a person, and what has no height") {
  for (const double scale : {1.0, .5, 1.5}) {
    const Skeleton plain = read("person.glb", glb(person_of(scale).gltf()));
    const Skeleton guessed = read("person.glb", glb(person_of(scale).gltf()), automatic());
    CHECK(guessed.positions == plain.positions);
    CHECK(guessed.unit.source == UnitSource::kDefault);
  }
  const std::string point =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 0 0\n}\n}\n"
      "MOTION\nFrames: 1\nFrame Time: .01\n0 0 0\n";
  CHECK(read("point.bvh", point, automatic()).unit.source == UnitSource::kDefault);
  ImportOptions both = automatic();
  both.metres_per_unit = 1;
  CHECK_THROWS_WITH_AS(read("point.bvh", point, both), doctest::Contains("given or guessed"), ImportError);
}

TEST_CASE("FBX is read in the unit that it states, centimetres by default, and a given unit comes before it") {
  struct Stated {
    std::string settings;
    double metres;
  };
  for (const Stated& stated : {Stated{unit_setting("1"), .01},
                               {"", .01},
                               {unit_setting("100"), 1},
                               {unit_setting("2.54"), .0254},
                               {unit_setting("0.1"), .001}}) {
    CAPTURE(stated.settings);
    const Skeleton skeleton = read("walk.fbx", fbx(stated.settings));
    CHECK(skeleton.unit.source == UnitSource::kFile);
    CHECK(skeleton.unit.metres == doctest::Approx(stated.metres).epsilon(1e-6));
    REQUIRE(skeleton.joint_names == std::vector<std::string>{"Hips", "Spine", "LeftUpLeg"});
    CHECK(place(skeleton, 0, 0, 1) == doctest::Approx(90 * stated.metres).epsilon(1e-6));
    CHECK(place(skeleton, 0, 1, 1) == doctest::Approx(150 * stated.metres).epsilon(1e-6));
    ImportOptions given;
    given.metres_per_unit = .5;
    const Skeleton as_given = read("walk.fbx", fbx(stated.settings), given);
    CHECK(as_given.unit.source == UnitSource::kGiven);
    CHECK(place(as_given, 0, 1, 1) == doctest::Approx(75));
  }
}

TEST_CASE("FBX with few keys is sampled at the rate that it states") {
  const Skeleton skeleton = read("walk.fbx", fbx(unit_setting("1") + "\t\tP: \"TimeMode\", \"enum\", \"\", \"\",6\n"));
  CHECK(skeleton.frame_seconds == doctest::Approx(1.0 / 30));
  REQUIRE(skeleton.frame_count == 31);
  CHECK(place(skeleton, 15, 0, 2) == doctest::Approx(.5).epsilon(1e-6));
}

TEST_CASE("Collada is read in the unit that it states, once, and a given unit comes before it") {
  struct Stated {
    std::string unit;
    double metres;
  };
  for (const Stated& stated : {Stated{"<unit name='centimeter' meter='0.01'/>", .01},
                               {"", 1},
                               {"<unit name='inch' meter='0.0254'/>", .0254}}) {
    CAPTURE(stated.unit);
    const Skeleton skeleton = read("walk.dae", collada(stated.unit));
    CHECK(skeleton.unit.source == UnitSource::kFile);
    CHECK(skeleton.unit.metres == doctest::Approx(stated.metres).epsilon(1e-6));
    CHECK(place(skeleton, 0, 0, 1) == doctest::Approx(90 * stated.metres).epsilon(1e-6));
    CHECK(place(skeleton, 0, 1, 1) == doctest::Approx(150 * stated.metres).epsilon(1e-6));
    ImportOptions given;
    given.metres_per_unit = .5;
    CHECK(place(read("walk.dae", collada(stated.unit), given), 0, 1, 1) == doctest::Approx(75));
  }
}

TEST_CASE("the public clips get the unit that their makers used, or one that makes a person") {
  const char* const data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr) {
    MESSAGE("skipped: CAB_DATA_DIR is not set");
    return;
  }
  struct Clip {
    const char* file;
    double metres;
  };
  for (const Clip& clip : {Clip{"bvh/cmu1_jumping_jacks.bvh", .0564},
                           {"bvh/cmu_12_01_walk.bvh", .0564},
                           {"bvh/fair1_dab.bvh", .038},
                           {"bvh/fair1_jumping.bvh", .038},
                           {"bvh/fair1_zombie.bvh", .039},
                           {"bvh/pybvh_test3_fingers.bvh", .0254},
                           {"bvh/pymo_AV_8Walk_Meredith.bvh", .0254},
                           {"bvh/rokoko_jesse_dance_fingers.bvh", .01},
                           {"asfamc/11_01.amc", .0564},
                           {"gltf/cesium_man.gltf", 1},
                           {"gltf/robot.glb", 1},
                           {"gltf/generic-hand-left.glb", 1}}) {
    CAPTURE(std::string(clip.file));
    const Skeleton skeleton = import_skeleton(std::string(data) + "/" + clip.file, automatic());
    CHECK(skeleton.unit.metres == doctest::Approx(clip.metres));
    CHECK(make_clip(skeleton, "figure", {}).size_doubt.empty());
  }
}
