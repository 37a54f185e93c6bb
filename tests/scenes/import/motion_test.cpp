// Motion in another file than the mesh: one file split in two, other names, other formats, and wrong files.
#include "scenes/import/motion.h"

#include "scenes/import/import_payload.h"
#include "scenes/import/limits.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

namespace {

using namespace cab::scenes;
using namespace cab::tests;
using Names = std::vector<std::string>;

// Everything of a skeleton but its notes and their counts.
std::string without_notes(Skeleton skeleton) {
  skeleton.notes.clear();
  skeleton.alterations.clear();
  return skeleton_payload(skeleton);
}

MadeGltf mesh_of(MadeGltf made) {
  made.json.erase("animations");
  return made;
}

// Nodes and animations alone.
MadeGltf motion_of(MadeGltf made) {
  for (const char* key : {"meshes", "skins", "materials", "textures", "images"}) made.json.erase(key);
  for (Json& node : made.json["nodes"]) {
    node.erase("mesh");
    node.erase("skin");
  }
  return made;
}

ImportOptions options_with(const std::string& motion, double metres_per_unit = 0) {
  ImportOptions options;
  options.skin.emplace();
  options.motion = MotionFile{motion, metres_per_unit};
  return options;
}

// The two boxes, moved by a file that has `out`, whose nodes `change` renames or moves.
Skeleton moved_by(const std::function<void(Json& nodes)>& change, const ImportOptions& options = options_with("")) {
  const TemporaryFile mesh("mesh.gltf", gltf_text(mesh_of(two_boxes())));
  MadeGltf made = motion_of(two_boxes());
  change(made.json["nodes"]);
  const TemporaryFile motion("walk.glb", glb(made));
  ImportOptions with_file = options;
  with_file.motion->path = motion.path();
  with_file.animation = "out";
  return import_skeleton(mesh.path(), with_file);
}

// What a note says after "motion of walk.glb: ".
std::string told(const Skeleton& skeleton) {
  for (const std::string& note : skeleton.notes) {
    const std::size_t at = note.find("walk.glb: ");
    if (note.rfind("motion of ", 0) == 0 && at != std::string::npos) return note.substr(at + 10);
  }
  return {};
}

std::string complaint(const std::string& mesh, const ImportOptions& options) {
  try {
    import_skeleton(mesh, options);
  } catch (const ImportError& error) { return error.what(); }
  return {};
}

// The height of joint 1 above its parent in the last frame.
double reach(const Skeleton& skeleton) {
  return skeleton.positions[skeleton.positions.size() - 3 + 2] - skeleton.positions[skeleton.positions.size() - 6 + 2];
}

// A file as JSON and the bytes beside it.
MadeGltf read_gltf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.rfind("glTF", 0) != 0) return {Json::parse(bytes), {}};
  const auto word = [&bytes](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t k = 4; k-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    return value;
  };
  const std::size_t json = word(12);
  return {Json::parse(bytes.substr(20, json)), bytes.substr(28 + json, word(20 + json))};
}

std::string bvh(const std::string& root, const std::string& joint, const std::string& scale) {
  return "HIERARCHY\nROOT " + root + "\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation " +
         "Xrotation Yrotation\nJOINT " + joint + "\n{\nOFFSET 0 0 6" + scale +
         "\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 0 6" + scale +
         "\n}\n}\n}\nMOTION\nFrames: 2\nFrame Time: .04\n0 0 0 0 0 0 0 0 0\n1" + scale + " 0 0 90 0 0 0 90 0\n";
}

}  // namespace

TEST_CASE("names match as they are, then by what follows the last colon, unless several end so") {
  const auto match = [](const Names& names, const Names& others) { return match_names(names, others); };
  using Indices = std::vector<std::int32_t>;
  CHECK(match({"a", "b", "c"}, {"c", "a"}) == Indices{1, -1, 0});
  CHECK(match({"mixamorig:Hips", "mixamorig:Head"}, {"Head", "Hips"}) == Indices{1, 0});
  CHECK(match({"Hips"}, {"other", "x:mixamorig:Hips"}) == Indices{1});
  CHECK(match({"rig:Hips"}, {"mixamorig1:Hips"}) == Indices{0});
  CHECK(match({"Hips"}, {"x:Hips", "Hips"}) == Indices{1});
  // Which of two is meant is not known.
  CHECK(match({"Hips"}, {"x:Hips", "y:Hips"}) == Indices{-1});
  CHECK(match({"x:Hips", "y:Hips"}, {"Hips"}) == Indices{-1, -1});
  CHECK(match({"x:Hips", "y:Hips"}, {"y:Hips", "Hips"}) == Indices{-1, 0});
  CHECK(match({"", "a:"}, {"", "b:"}) == Indices{-1, 1});
  CHECK(match({}, {"a"}).empty());
}

TEST_CASE("a mesh moved by another file is what the two are in one file, to the last bit") {
  const TemporaryFile whole("whole.glb", glb(two_boxes())), mesh("mesh.gltf", gltf_text(mesh_of(two_boxes())));
  const TemporaryFile motion("walk.glb", glb(motion_of(two_boxes())));
  for (const char* animation : {"out", "1", "still", ""}) {
    CAPTURE(std::string(animation));
    ImportOptions in_one = options_with("");
    in_one.motion.reset();
    in_one.animation = animation;
    ImportOptions in_two = options_with(motion.path());
    in_two.animation = animation;
    const Skeleton one = import_skeleton(whole.path(), in_one), two = import_skeleton(mesh.path(), in_two);
    CHECK(one.frame_count == 2);
    CHECK((without_notes(one) == without_notes(two)));
    CHECK(told(two) == "it has 2 of 2 joints by name");
    // The motion's folder is another one, which the child process may read too.
    in_two.sandbox = kImportSandbox;
    CHECK((skeleton_payload(two) == skeleton_payload(import_skeleton(mesh.path(), in_two))));
  }
}

TEST_CASE("a file's own animation has no say where another file moves it") {
  const TemporaryFile whole("whole.glb", glb(two_boxes()));
  MadeGltf out = motion_of(two_boxes());
  out.json["animations"].erase(0);
  const TemporaryFile motion("walk.glb", glb(out));
  CHECK(reach(import_skeleton(whole.path(), {})) == doctest::Approx(6));
  CHECK(reach(import_skeleton(whole.path(), options_with(motion.path()))) == doctest::Approx(9));
}

TEST_CASE("joints that the motion lacks keep their rest pose and are named") {
  CHECK(reach(moved_by([](Json&) {})) == doctest::Approx(9));
  const Skeleton still = moved_by([](Json& nodes) { nodes[1]["name"] = "hand"; });
  CHECK(told(still) == "it has 1 of 2 joints by name; in rest pose: arm");
  CHECK(reach(still) == doctest::Approx(6));
  CHECK(still.frame_count == 2);
  // A namespace does not matter.
  const Skeleton spaced = moved_by([](Json& nodes) {
    nodes[0]["name"] = "mixamorig:root";
    nodes[1]["name"] = "mixamorig:arm";
  });
  CHECK(told(spaced) == "it has 2 of 2 joints by name");
  CHECK(reach(spaced) == doctest::Approx(9));
}

TEST_CASE("a node that stands still in the motion stands there as it does in that file") {
  const Skeleton turned = moved_by([](Json& nodes) { nodes[0]["translation"] = {0, 5, 0}; });
  CHECK(turned.positions[1] == doctest::Approx(5));
  CHECK(reach(turned) == doctest::Approx(9));
}

TEST_CASE("a motion without any of the joints is refused with both files and with names of both") {
  const auto rename = [](Json& nodes) {
    for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n]["name"] = "bone" + std::to_string(n);
  };
  try {
    moved_by(rename);
    FAIL("it is taken");
  } catch (const ImportError& error) {
    const std::string line = error.what();
    CAPTURE(line);
    CHECK(line.find("mesh.gltf: none of its joints (root, arm) has the name of a node of ") != std::string::npos);
    CHECK(line.find("walk.glb (ROOT, bone0, bone1, ") != std::string::npos);
    CHECK(line.find('\n') == std::string::npos);
  }
}

TEST_CASE("a file without bones takes as joints the nodes that the other file moves") {
  MadeGltf made = made_gltf({0, 1, 2});
  const TemporaryFile whole("whole.glb", glb(made)), motion("walk.glb", glb(made));
  const TemporaryFile still("still.glb", glb(mesh_of(made)));
  ImportOptions options = options_with(motion.path());
  options.skin.reset();
  CHECK((without_notes(import_skeleton(still.path(), options)) == without_notes(import_skeleton(whole.path(), {}))));
  for (Json& node : made.json["nodes"]) node["name"] = "x" + node["name"].get<std::string>();
  const TemporaryFile other("other.glb", glb(mesh_of(made)));
  CHECK(complaint(other.path(), options) ==
        other.path() + ": no skeleton: it has no bones and no nodes that " + motion.path() + " moves, by name");
}

TEST_CASE("a BVH file moves a mesh, in a length unit of its own") {
  const TemporaryFile mesh("mesh.gltf", gltf_text(mesh_of(two_boxes())));
  const TemporaryFile same("walk.bvh", bvh("rig:root", "rig:arm", "")), cm("cm.bvh", bvh("root", "arm", "00"));
  const auto has_doubt = [](const Skeleton& skeleton) {
    bool is_told = false;
    for (const std::string& note : skeleton.notes)
      is_told = is_told || note.find("are 100 times as long as those that they move: --motion-units") < note.size();
    return is_told;
  };
  ImportOptions half_metres = options_with(cm.path(), .005);
  half_metres.metres_per_unit = .5;
  for (const auto& [options, unit] : {std::pair{options_with(same.path()), 1.0}, {half_metres, .5}}) {
    const Skeleton skeleton = import_skeleton(mesh.path(), options);
    REQUIRE(skeleton.frame_count == 2);
    CHECK(skeleton.frame_seconds == doctest::Approx(.04));
    CHECK(!has_doubt(skeleton));
    // In frame 1 root is at x = 1 and turned by 90 degrees about z, arm 6 above it and turned about its own x.
    const double* const p = skeleton.positions.data() + 6;
    const double expected[6] = {unit, 0, 0, unit, 0, 6 * unit};
    for (std::size_t k = 0; k < 6; ++k) CHECK(p[k] == doctest::Approx(expected[k]));
    const double* const q = skeleton.rotations.data() + 8;
    for (std::size_t k = 0; k < 4; ++k) CHECK(q[k] == doctest::Approx(k < 2 ? 0 : std::sqrt(.5)));
    for (std::size_t k = 0; k < 4; ++k) CHECK(std::fabs(q[4 + k]) == doctest::Approx(.5));
  }
  CHECK(has_doubt(import_skeleton(mesh.path(), options_with(cm.path()))));
}

TEST_CASE("a motion of one frame poses a mesh, and a note names its file once") {
  const TemporaryFile mesh("mesh.gltf", gltf_text(mesh_of(two_boxes())));
  std::string text = bvh("root", "arm", "");
  text.replace(text.find("Frames: 2"), 9, "Frames: 1");
  text.erase(text.find("0 0 0 0 0 0 0 0 0\n"), 18);  // what is left is the second pose
  const TemporaryFile pose("pose.bvh", text);
  const Skeleton skeleton = import_skeleton(mesh.path(), options_with(pose.path()));
  CHECK(skeleton.is_static);
  REQUIRE(skeleton.frame_count == 1);
  CHECK(skeleton.positions[0] == doctest::Approx(1));
  Names told;
  for (const std::string& note : skeleton.notes)
    if (note.rfind("no motion: ", 0) == 0) told.push_back(note);
  CHECK(told == Names{"no motion: the pose of " + pose.path() + " holds for all frames"});
}

TEST_CASE("the scale of an armature in the motion does not reach the file that it moves") {
  struct Armatures {
    double own, other;     // scales of the armatures of the file and of the motion
    double other_lengths;  // of the motion's joints, over those of the file's
    double metres;         // per unit of the motion; 0: not given
  };
  const auto hold = [](MadeGltf made, double scale, double lengths) {
    Json& nodes = made.json["nodes"];
    nodes.push_back({{"name", "Armature"}, {"scale", {scale, scale, scale}}, {"children", {0}}});
    made.json["scenes"][0]["nodes"][0] = nodes.size() - 1;
    for (std::size_t n = 0; n < 2; ++n)
      if (nodes[n].contains("translation"))
        for (Json& component : nodes[n]["translation"]) component = lengths * component.get<double>();
    return made;
  };
  const TemporaryFile plain("mesh.glb", glb(mesh_of(two_boxes())));
  // As a file whose armature is scaled by 100 is made of one in metres, with or without lengths to match.
  for (const Armatures& a : {Armatures{1, 100, 1, 0}, {1, .01, 100, 0}, {100, 100, 1, 0}, {1, 100, 1, .01}}) {
    CAPTURE(a.other);
    CAPTURE(a.metres);
    const TemporaryFile mesh("mesh.glb", glb(hold(mesh_of(two_boxes()), a.own, 1)));
    const TemporaryFile motion("walk.glb", glb(hold(motion_of(two_boxes()), a.other, a.other_lengths)));
    ImportOptions options = options_with(motion.path(), a.metres);
    options.animation = "still";
    const Skeleton skeleton = import_skeleton(mesh.path(), options);
    // The track has its own lengths, which are 6; the armature of 100 makes 600 of them in both files.
    if (a.other_lengths == 1) CHECK(reach(skeleton) == doctest::Approx(6 * a.own));
    // The stretch of root is the scale of its armature, that of arm twice as much.
    REQUIRE(skeleton.skin.stretches.size() >= 12);
    CHECK(skeleton.skin.stretches[0] == doctest::Approx(a.own));
    CHECK(skeleton.skin.stretches[6] == doctest::Approx(2 * a.own));
    bool is_told = false;
    for (const std::string& note : skeleton.notes) is_told = is_told || note.find("evened out") != std::string::npos;
    CHECK(is_told == (a.own != a.other));
  }
}

TEST_CASE("files that cannot be moved, and files that move nothing, are refused") {
  const TemporaryFile mesh("mesh.gltf", gltf_text(mesh_of(two_boxes())));
  const TemporaryFile clip("clip.bvh", bvh("root", "arm", ""));
  const TemporaryFile pose(
      "pose.asf",
      ":root\n order TX TY TZ RX RY RZ\n axis XYZ\n position 0 0 0\n orientation 0 0 0\n:bonedata\n"
      "begin\n id 1\n name arm\n direction 0 0 1\n length 6\n axis 0 0 0 XYZ\nend\n:hierarchy\n"
      "begin\n root arm\nend\n");
  const TemporaryFile rubbish("walk.fbx", "rubbish");
  CHECK(complaint(mesh.path(), options_with(mesh.path())) == mesh.path() + ": it has no animation");
  CHECK(complaint(mesh.path(), options_with(pose.path())) == pose.path() + ": it has no animation");
  CHECK(complaint(mesh.path(), options_with("/nonexistent.bvh")) == "/nonexistent.bvh: no such file");
  CHECK(complaint(mesh.path(), options_with(rubbish.path())).rfind(rubbish.path() + ": assimp cannot read it", 0) == 0);
  CHECK(complaint(clip.path(), options_with(clip.path())) ==
        clip.path() + ": a motion in another file is for files of nodes, such as glTF, FBX and Collada");
  CHECK(complaint(mesh.path(), options_with(clip.path(), -1)) ==
        clip.path() + ": metres per unit must be between 1e-9 and 1e9");
  ImportOptions unknown = options_with(clip.path());
  unknown.animation = "run";
  CHECK(complaint(mesh.path(), unknown) == clip.path() + ": a BVH file has one motion, without a name");
  // A reader that does not end says of which files.
  ImportOptions limited = options_with(clip.path());
  limited.sandbox = kImportSandbox;
  limited.sandbox->payload_bytes = 1;
  CHECK(complaint(mesh.path(), limited).rfind(mesh.path() + " with " + clip.path() + ": reading it ", 0) == 0);
}

TEST_CASE("real skins are moved by a file of their nodes and animations as by their own") {
  const char* const data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr || !std::filesystem::exists(std::string(data) + "/gltf")) {
    MESSAGE("skipped: CAB_DATA_DIR is not set or has no folder gltf");
    return;
  }
  for (const auto& [name, animation] : {std::pair{"cesium_man.gltf", ""}, {"greenman.glb", ""}, {"robot.glb", "0"}}) {
    const std::string path = std::string(data) + "/gltf/" + name;
    CAPTURE(path);
    const MadeGltf made = read_gltf(path);
    const auto written = [&made](const MadeGltf& part) { return made.bin.empty() ? part.json.dump() : glb(part); };
    const TemporaryFile mesh("mesh.gltf", written(mesh_of(made))), motion("walk.gltf", written(motion_of(made)));
    ImportOptions in_one = options_with(""), in_two = options_with(motion.path());
    in_one.motion.reset();
    in_one.animation = in_two.animation = animation;
    const Skeleton one = import_skeleton(path, in_one);
    CHECK(one.frame_count > 1);
    CHECK((without_notes(one) == without_notes(import_skeleton(mesh.path(), in_two))));
  }
}
