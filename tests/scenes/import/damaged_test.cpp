// Small files of every format that a command reads, cut off at twenty places and with random bytes changed fifty times:
// each gives something to compute hits of, or one line that names a file, and costs no more than the limits.
#include "perf/base/engine_session.h"
#include "perf/tools/run/bodies_file.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/session.h"
#include "scenes/robot/state_file.h"
#include "scenes/scene_list.h"
#include "tests/rounds.h"
#include "tests/scenes/import/made_gltf.h"
#include "tests/scenes/rig/stick_figure.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>

namespace cab::tests {
namespace {

namespace fs = std::filesystem;
using scenes::SandboxLimits;

// A good file here takes less than 0.1 s and 50 MiB.
constexpr SandboxLimits kLimits = {std::size_t{1} << 30, 2, 300, std::size_t{256} << 20};

using Reader = std::function<void(const std::string& path)>;

// A good file, a reader for it, and the files that stand in its folder, by name and text.
struct Sample {
  std::string file_name, bytes;
  Reader read;
  std::vector<std::pair<std::string, std::string>> beside;
};

std::string text_at(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What `cab run` makes of a file.
void run_clip(const std::string& path) {
  scenes::ImportOptions options;
  options.sandbox = kLimits;
  const scenes::Scene scene = scenes::make_world({scenes::import_clip(path, options)});
  perf::SessionOptions session;
  session.frames = {0, std::min(scene.frame_count, 4u)};
  session.within = true;
  perf::EngineSession(scene, session).run({}, false, [](const perf::BlockResult&) {});
}

// The same with bodies of the file's meshes.
void run_skin(const std::string& path) {
  scenes::ImportOptions options;
  options.sandbox = kLimits;
  options.skin.emplace();
  scenes::make_world({scenes::import_clip(path, options)});
}

scenes::Robot robot_at(const std::string& path) {
  scenes::RobotOptions options;
  options.sandbox = kLimits;
  return scenes::import_robot(path, options);
}

// What `cab robot` makes of a file.
void run_robot(const std::string& path) {
  const scenes::Robot robot = robot_at(path);
  scenes::RobotSessionOptions options;
  options.policies.exact = Exact::kConvex;
  const scenes::StateSource states = {
      4, [&](std::uint64_t index, double* state) { scenes::random_state(robot, 1, index, state); }};
  scenes::RobotSession(robot, {}, options).run(states, {}, [](const scenes::StateChunk&) {});
}

// Reads the robot of a folder, and by it the file.
Reader beside_robot(const std::function<void(const std::string& path, const scenes::Robot& robot)>& read) {
  return [read](const std::string& path) { read(path, robot_at((fs::path(path).parent_path() / "r.urdf").string())); };
}

const std::string kBvh =
    "HIERARCHY\nROOT hips\n{\n  OFFSET 0 0 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
    "Xrotation\n"
    "  JOINT leg\n  {\n    OFFSET 0 -1 0\n    CHANNELS 3 Zrotation Yrotation Xrotation\n    End Site\n    {\n"
    "      OFFSET 0 -1 0\n    }\n  }\n}\nMOTION\nFrames: 3\nFrame Time: .01\n"
    "1 2 3 10 20 30 40 50 60\n1 2 3 10 20 30 40 50 60\n1 2 3 10 20 30 40 50 60\n";
const std::string kAsf =
    ":version 1.10\n:name arm\n:units\n  mass 1.0\n  length 1.0\n  angle deg\n:root\n  order TX TY TZ RX RY RZ\n"
    "  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n:bonedata\n  begin\n    id 1\n    name upper\n"
    "    direction 0 1 0\n    length 2\n    axis 0 0 90 XYZ\n    dof rx rz\n    limits (-160.0 20.0)\n"
    "           (-60.0 70.0)\n  end\n  begin\n    id 2\n    name lower\n    direction 1 0 0\n    length 3\n"
    "    axis 0 0 0 XYZ\n    dof ry\n  end\n:hierarchy\n  begin\n    root upper\n    upper lower\n  end\n";
const std::string kAmc =
    "#!OML:ASF a comment\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 0 0 90\nupper 90 0\nlower 9.0e+01\n"
    "2\nroot 1 2 3 0 0 0\nupper 90 90\nlower 0\n";
const std::string kUrdf =
    "<?xml version='1.0'?>\n<robot name='r'>\n"
    "<link name='a'><collision><geometry><box size='1 2 3'/></geometry></collision></link>\n"
    "<link name='b'><collision><origin xyz='1 2 3' rpy='.1 .2 .3'/><geometry><cylinder radius='1' length='2'/>"
    "</geometry></collision></link>\n"
    "<link name='c'><collision><geometry><sphere radius='1'/></geometry></collision></link>\n"
    "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><origin xyz='1 2 3' rpy='.1 .2 .3'/>"
    "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>\n"
    "<joint name='k' type='continuous'><parent link='b'/><child link='c'/><mimic joint='j' multiplier='2' offset='.5'/>"
    "</joint>\n</robot>\n";
const std::string kSrdf =
    "<?xml version='1.0'?>\n<robot name='r'>\n<disable_collisions link1='b' link2='a' reason='Adjacent'/>\n"
    "<disable_collisions link1='a' link2='c' reason='Never'/>\n</robot>\n";
const std::string kMjcf =
    "<mujoco model='made'>\n<compiler angle='degree'/>\n<asset><mesh name='m' file='tetra.obj'/></asset>\n<worldbody>\n"
    "<geom type='plane' size='1 1 1'/>\n<body name='a'><freejoint/><geom type='box' size='1 2 3'/>\n"
    "<body name='b' pos='1 2 3' quat='1 0 0 .5'><joint name='h' type='hinge' axis='0 0 1' limited='true' range='-90 "
    "90'/>"
    "<geom type='capsule' fromto='0 0 0 0 0 4' size='.5'/></body>\n"
    "<body name='c'><joint type='ball'/><geom type='mesh' mesh='m'/></body>\n"
    "</body></worldbody>\n<contact><exclude body1='a' body2='b'/></contact>\n</mujoco>\n";
const std::string kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const std::string kObsmat =
    "  7.8000000e+01   1.0000000e+00   1.0000000e+00   9.0000000e+00   2.0000000e+00   1.0e+00   0.0e+00   0.0e+00\n"
    "  7.8000000e+01   2.0000000e+00   5.0000000e+00   9.0000000e+00   5.0000000e+00   0.0e+00   0.0e+00   0.0e+00\n"
    "  8.4000000e+01   1.0000000e+00   1.5000000e+00   9.0000000e+00   2.0000000e+00   1.0e+00   0.0e+00   0.0e+00\n"
    "  8.4000000e+01   2.0000000e+00   5.0000000e+00   9.0000000e+00   5.0000000e+00   0.0e+00   0.0e+00   0.0e+00\n";

// A whole binary STL file of two triangles.
std::string made_stl() {
  std::string bytes(80, ' ');
  bytes += std::string("\x02\0\0\0", 4);
  for (int triangle = 0; triangle < 2; ++triangle) {
    const float z = triangle == 0 ? 0.f : 1.f;
    bytes += bytes_of({0, 0, 1, 0, 0, z, 1, 0, z, 0, 1, z}) + std::string(2, '\0');
  }
  return bytes;
}

std::string made_ply() {
  return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
         "3 0 1 2\n3 0 1 3\n";
}

std::string bodies_text() {
  return R"({"bodies": [{"link": "hips", "to": "leg", "shape": "capsule", "half_metres": [0.2, 0.05, 0.05]},
 {"link": "leg", "to": "leg/End", "shape": "sphere", "radius_metres": 0.1, "reason": "mine"},
 {"link": "hips", "to": "leg", "shape": "box", "radius_metres": 0.1}]})";
}

// What `cab crowd --scene bottleneck` makes of recorded pedestrians.
void run_crowd(const std::string& path) {
  scenes::CrowdSources sources;
  sources.trajectories = scenes::import_trajectories(path, 25, kLimits);
  sources.clips.push_back(scenes::make_clip(stick_figure(), "person", {}));
  std::vector<scenes::PosedGroup> posed;
  scenes::pose_crowd(scenes::make_crowd("bottleneck", 4, sources), .5, posed);
}

void run_bodies(const std::string& path) {
  scenes::ImportOptions options;
  options.body_changes = perf::read_bodies(path, kLimits);
  const std::string clip = (fs::path(path).parent_path() / "clip.bvh").string();
  scenes::import_clip(clip, options);
}

// A file that is the mesh of a robot.
Sample mesh_of(const std::string& name, const std::string& bytes) {
  const Reader read = [](const std::string& path) { run_robot((fs::path(path).parent_path() / "mesh.urdf").string()); };
  return {name,
          bytes,
          read,
          {{"mesh.urdf", "<robot name='r'><link name='a'><collision><geometry><mesh filename='" + name +
                             "'/></geometry></collision></link></robot>"}}};
}

std::vector<Sample> made_samples() {
  const Reader by_srdf = beside_robot(
      [](const std::string& path, const scenes::Robot& robot) { scenes::read_disabled_pairs(path, robot, kLimits); });
  const Reader by_states = beside_robot(
      [](const std::string& path, const scenes::Robot& robot) { scenes::read_joint_states(path, robot, kLimits); });
  MadeGltf gltf = made_gltf({0, 1, 2});
  gltf.bin = bytes_of({0, 1, 2, 0, 1, 0, 0, 1, 0, 0, 1, 0});  // three equal keys
  std::vector<Sample> all = {
      {"made.bvh", kBvh, run_clip, {}},
      {"made.gltf", gltf_text(gltf), run_clip, {}},
      {"made.glb", glb(gltf), run_clip, {}},
      {"made.vrm", glb(gltf), run_clip, {}},
      {"arm.asf", kAsf, run_clip, {}},
      {"arm.amc", kAmc, run_clip, {{"arm.asf", kAsf}}},
      {"made.urdf", kUrdf, run_robot, {}},
      {"made.srdf", kSrdf, by_srdf, {{"r.urdf", kUrdf}}},
      {"made.csv", "# recorded\nj\n.5\n-.25\n1e-1\n", by_states, {{"r.urdf", kUrdf}}},
      mesh_of("made.stl", made_stl()),
      mesh_of("made.ply", made_ply()),
      mesh_of("made.obj", kTetrahedron),
      {"bodies.json", bodies_text(), run_bodies, {{"clip.bvh", kBvh}}},
      {"obsmat.txt", kObsmat, run_crowd, {}},
      {"jupedsim.txt",
       "# framerate: 25 fps\n# id frame x/m y/m\n1 0 1 2\n1 1 1.5 2\n2 0 5 5\n2 1 5.5 5\n",
       run_crowd,
       {}},
      {"columns.csv", "frame,ped_id,y,x\r\n78,1,2,1\r\n78,2,5,5\r\n84, 1, 2, 1.5\r\n84,2,5,5\r\n", run_crowd, {}},
  };
  if (scenes::reads_mjcf()) {
    all.push_back({"made.xml", kMjcf, run_robot, {{"tetra.obj", kTetrahedron}}});
  } else {
    MESSAGE("skipped: MJCF, since libmujoco is not built in");
  }
  return all;
}

// Files of assimp-testmodels and of the shared data that are there, as clips or as meshes of a robot. Not all hold a
// skeleton.
std::vector<Sample> found_samples() {
  const std::string models = "/usr/share/assimp/models/";
  const char* const data = std::getenv("CAB_DATA_DIR");
  const std::string shared = data == nullptr ? "CAB_DATA_DIR, which is not set" : data;
  std::vector<Sample> all;
  const auto is_there = [](const std::string& path) {
    if (fs::exists(path)) return true;
    MESSAGE("skipped: " << path << " is not there (package assimp-testmodels, or CAB_DATA_DIR)");
    return false;
  };
  const auto add = [&](const std::string& path, const Reader& read) {
    if (is_there(path)) all.push_back({fs::path(path).filename().string(), text_at(path), read, {}});
  };
  for (const std::string& path :
       {models + "FBX/animation_with_skeleton.fbx", models + "FBX/huesitos.fbx",
        models + "Collada/box_nested_animation.dae", models + "Collada/library_animation_clips.dae",
        models + "X/test.x", models + "ASE/anim.ASE", models + "B3D/WusonBlitz.b3d", models + "MD5/SimpleCube.md5mesh",
        models + "MS3D/twospheres.ms3d", models + "SMD/triangle.smd", models + "glTF2/simple_skin/simple_skin.gltf",
        shared + "/gltf/generic-hand-left.glb", shared + "/gltf/greenman.glb", shared + "/gltf/cesium_man.gltf"})
    add(path, run_clip);
  add(shared + "/gltf/generic-hand-left.glb", run_skin);
  const std::string hand = shared + "/robots/allegro_hand/";
  add(hand + "allegro_hand_right.urdf", run_robot);
  const std::string tip = "meshes/collision/link_tip.obj";
  if (fs::exists(hand + tip)) all.back().beside = {{tip, text_at(hand + tip)}};
  if (scenes::reads_mjcf()) add(shared + "/robots/mujoco_humanoid.xml", run_robot);
  for (const std::string& path :
       {models + "STL/triangle_with_two_solids.stl", models + "PLY/cube_binary.ply", models + "OBJ/box.obj",
        models + "Collada/cube_tristrips.dae", models + "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb",
        models + "glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf"})
    if (is_there(path)) all.push_back(mesh_of("mesh" + fs::path(path).extension().string(), text_at(path)));
  return all;
}

// The line with which a file of these bytes is refused, without its folder; empty if it is read.
std::string refusal(const Sample& sample, const std::string& bytes) {
  const TemporaryFile file(sample.file_name, bytes);
  for (const auto& [name, text] : sample.beside) {
    fs::create_directories((file.directory() / name).parent_path());
    std::ofstream((file.directory() / name).string(), std::ios::binary) << text;
  }
  const std::string folder = file.directory().string() + "/";
  try {
    sample.read(file.path());
  } catch (const std::runtime_error& error) {
    const std::string line = error.what();
    CAPTURE(line);
    CHECK(line.rfind(folder, 0) == 0);
    CHECK(scenes::printable(line) == line);
    return line.size() > folder.size() ? line.substr(folder.size()) : "nothing";
  }
  return {};
}

void damage(const Sample& sample, std::mt19937_64& random) {
  CAPTURE(sample.file_name);
  const std::size_t size = sample.bytes.size();
  const std::uint64_t cuts = rounds(6), changes = rounds(16);
  for (std::uint64_t cut = 0; cut < cuts; ++cut) {
    CAPTURE(cut);
    refusal(sample, sample.bytes.substr(0, static_cast<std::size_t>(cut * size / cuts)));
  }
  for (std::uint64_t change = 0; change < changes; ++change) {
    CAPTURE(change);
    std::string bytes = sample.bytes;
    // One byte leaves most of the file to later parts of a parser, fifty are found by the first.
    const int changed_bytes = change % 2 == 0 ? 50 : 1;
    for (int b = 0; b < changed_bytes; ++b) bytes[random() % size] = static_cast<char>(random());
    refusal(sample, bytes);
  }
}

}  // namespace

TEST_CASE("a made file of any format, cut off or changed anywhere, is read or refused in one line") {
  std::mt19937_64 random(20261122);
  for (const Sample& sample : made_samples()) {
    CHECK(refusal(sample, sample.bytes) == "");
    damage(sample, random);
  }
}

TEST_CASE("a found file of any format, cut off or changed anywhere, is read or refused in one line") {
  std::mt19937_64 random(20261122);
  for (const Sample& sample : found_samples()) damage(sample, random);
}

}  // namespace cab::tests
