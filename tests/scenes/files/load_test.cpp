// <cab/files.h>: characters and robots as descriptions, and bad files as errors in words.
#include <cab/cab.h>
#include <cab/files.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "perf/harness/engine_ptr.h"
#include "scenes/robot/robot.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

namespace {

using namespace cab;
using cab::tests::TemporaryFile;

constexpr const char* kBvh =
    "HIERARCHY\nROOT hips\n{\n  OFFSET 0 0 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "  JOINT leg\n  {\n    OFFSET 0 -50 0\n    CHANNELS 3 Zrotation Xrotation Yrotation\n"
    "    End Site\n    {\n      OFFSET 0 -40 0\n    }\n  }\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.05\n0 90 0 0 0 0 0 0 0\n0 95 0 0 0 0 90 0 0\n";

constexpr const char* kUrdf =
    "<robot name=\"arm\">\n"
    "  <link name=\"base\"><collision><geometry><box size=\"1 1 1\"/></geometry></collision></link>\n"
    "  <link name=\"arm\"><collision><geometry><sphere radius=\"0.5\"/></geometry></collision></link>\n"
    "  <joint name=\"slide\" type=\"prismatic\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"1 0 0\"/>\n"
    "    <limit lower=\"0\" upper=\"4\" effort=\"1\" velocity=\"1\"/></joint>\n"
    "</robot>\n";

// Whether an engine takes the description.
bool is_taken(const ArticulationDesc& desc) {
  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  const cab::oracle::EnginePtr owner(engine);
  ArticulationId id;
  return add_articulation(*engine, desc, &id) == Status::kOk;
}

}  // namespace

TEST_CASE("a file's meshes become hulls, or a surface of their triangles") {
  const TemporaryFile file("boxes.glb", cab::tests::glb(cab::tests::two_boxes()));
  files::MotionOptions options;
  files::Motion motion;
  options.body = files::MotionBody::kSkin;
  REQUIRE_MESSAGE(motion.load(file.path().c_str(), options), motion.error());
  CHECK(motion.desc().skin.vertices.empty());
  options.body = files::MotionBody::kSurface;
  REQUIRE_MESSAGE(motion.load(file.path().c_str(), options), motion.error());
  CHECK_FALSE(motion.desc().skin.vertices.empty());
  for (const Leaf& leaf : motion.desc().leaves) CHECK_FALSE(leaf.triangles.empty());
  CHECK(is_taken(motion.desc()));
}

TEST_CASE("a motion file becomes a description with poses and origins") {
  const TemporaryFile file("walk.bvh", kBvh);
  files::MotionOptions options;
  options.metres_per_unit = 0.01;
  files::Motion motion;
  CHECK_FALSE(is_taken(motion.desc()));  // nothing yet
  REQUIRE_MESSAGE(motion.load(file.path().c_str(), options), motion.error());
  CHECK(std::string(motion.error()).empty());
  CHECK(is_taken(motion.desc()));
  CHECK(motion.frame_count() == 2);
  CHECK(motion.frame_seconds() == doctest::Approx(0.05));
  CHECK(motion.link_names().size == motion.desc().link_parents.size);
  CHECK(std::string(motion.link_names()[0]) == "hips");
  CHECK(motion.poses().size == 2 * 7 * motion.link_names().size);
  REQUIRE(motion.origins().size == 6);
  CHECK(motion.origins()[4] - motion.origins()[1] == doctest::Approx(0.05));  // five centimetres higher
}

TEST_CASE("a motion file of one frame is one without motion, which has no frame time") {
  std::string text = kBvh;
  text.replace(text.find("Frames: 2"), 9, "Frames: 1");
  text.erase(text.rfind('\n', text.size() - 2) + 1);
  const TemporaryFile file("pose.bvh", text);
  files::Motion motion;
  REQUIRE_MESSAGE(motion.load(file.path().c_str(), {}), motion.error());
  CHECK(motion.frame_count() == 1);
  CHECK(motion.frame_seconds() == 0);
  bool is_told = false;
  for (const char* const note : motion.notes())
    is_told = is_told || std::string(note) == "no motion: the pose of the file holds for all frames";
  CHECK(is_told);
}

TEST_CASE("a robot becomes a description, and its joints pose it") {
  const TemporaryFile file("arm.urdf", kUrdf);
  files::Robot robot;
  REQUIRE_MESSAGE(robot.load(file.path().c_str(), {}), robot.error());
  CHECK(is_taken(robot.desc()));
  REQUIRE(robot.variables().size == 1);
  CHECK(std::string(robot.variables()[0].name) == "slide");
  CHECK(robot.variables()[0].upper == 4);
  const double states[] = {0, 2.5};
  std::vector<float> poses(2 * 2 * 7);
  REQUIRE(robot.write_poses(states, poses));
  CHECK(poses[7 + 4] == 0);
  CHECK(poses[14 + 7 + 4] == 2.5f);
  std::vector<float> same(poses.size());
  CHECK(compute_link_poses(robot.kinematics(), states, Isa::kScalar, same) == Status::kOk);
  CHECK(same == poses);
  CHECK_FALSE(robot.write_poses(states, {poses.data(), 14}));  // one pose of two states
  CHECK_FALSE(robot.write_poses(states, {poses.data(), 13}));
  double random[8];
  robot.write_random_states(5, 0, random);
  for (const double value : random) CHECK((value >= 0 && value <= 4));
  double later[3];
  robot.write_random_states(5, 4, later);
  for (std::size_t s = 0; s < 3; ++s) CHECK(later[s] == random[4 + s]);
  REQUIRE(robot.adjacent_pairs().size == 1);
  CHECK(robot.adjacent_pairs()[0].a == 0);
  CHECK(robot.adjacent_pairs()[0].b == 1);
  CHECK(robot.welded_pairs().empty());
}

TEST_CASE("bodies of MJCF that no joint moves against each other are welded, and adjacent as well") {
  if (!scenes::reads_mjcf()) {
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  const TemporaryFile file("arm.xml",
                           "<mujoco><worldbody><body><geom size='1'/><joint/><body><geom size='1'/><body>"
                           "<joint/><geom size='1'/></body></body></body></worldbody></mujoco>");
  files::Robot robot;
  REQUIRE_MESSAGE(robot.load(file.path().c_str(), {}), robot.error());
  const auto has = [](Span<const LinkPair> pairs, std::uint32_t a, std::uint32_t b) {
    return std::any_of(pairs.begin(), pairs.end(), [&](const LinkPair& pair) { return pair.a == a && pair.b == b; });
  };
  REQUIRE(robot.welded_pairs().size == 1);
  CHECK(has(robot.welded_pairs(), 1, 2));
  CHECK(robot.adjacent_pairs().size == 3);
  for (const std::uint32_t a : {1u, 2u}) CHECK(has(robot.adjacent_pairs(), a, 3));
  CHECK(has(robot.adjacent_pairs(), 1, 2));
}

TEST_CASE("a bad file is an error that names file, line and reason, and leaves nothing loaded") {
  const TemporaryFile good("walk.bvh", kBvh);
  const TemporaryFile bad("bad.bvh", std::string(kBvh).replace(std::string(kBvh).find("-50"), 3, "x"));
  files::Motion motion;
  REQUIRE(motion.load(good.path().c_str(), {}));
  REQUIRE_FALSE(motion.load(bad.path().c_str(), {}));
  CHECK(std::string(motion.error()).find("bad.bvh: line 8") != std::string::npos);
  CHECK(motion.frame_count() == 0);
  CHECK(motion.desc().link_parents.empty());
  CHECK_FALSE(motion.load("/no/such/file.bvh", {}));
  CHECK(std::string(motion.error()).find("/no/such/file.bvh") != std::string::npos);
  REQUIRE(motion.load(good.path().c_str(), {}));
  CHECK(motion.frame_count() == 2);

  const TemporaryFile no_robot("bad.urdf", std::string(kUrdf).replace(std::string(kUrdf).find("0.5"), 3, "-1"));
  files::Robot robot;
  REQUIRE_FALSE(robot.load(no_robot.path().c_str(), {}));
  CHECK(std::string(robot.error()).find("bad.urdf: line 3") != std::string::npos);
  CHECK(robot.variables().empty());
  std::vector<float> poses(14);
  CHECK_FALSE(robot.write_poses({}, poses));
  CHECK(robot.kinematics().links.empty());
}
