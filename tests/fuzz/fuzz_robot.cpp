// Bytes as a file of a robot, of the kind that the first byte chooses: URDF, SRDF and joint states here, URDF and MJCF
// in a child process. Each gives a robot that is whole, or one line. What assimp gets of a Collada mesh is XML again.
// A package.xml has a name, or is none.
#include "scenes/import/collada_file.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/packages.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/state_file.h"
#include "tests/fuzz/bytes.h"
#include "tests/scenes/temporary_file.h"

namespace {

using namespace cab;
using namespace cab::scenes;

enum Kind : std::uint32_t { kUrdf, kSrdf, kStates, kUrdfInChild, kMjcfInChild, kCollada, kPackage, kKindCount };

// Two links and a joint.
Robot known_robot() {
  Robot robot;
  robot.body.link_names = {"a", "b"};
  robot.body.link_parents = {-1, 0};
  robot.links.resize(2);
  robot.links[1].joint_count = 1;
  robot.joints.resize(1);
  robot.joints[0].name = std::string("j");  // g++ 12 warns of a plain literal
  robot.variables = {{"j", -1, 1, 0}};
  return robot;
}

// What the payload's reader requires holds of every robot that is read, and its rest pose has no number that is none.
void check_robot(const Robot& robot) {
  FUZZ_CHECK(robot_payload(read_robot_payload(robot_payload(robot))) == robot_payload(robot));
  FUZZ_CHECK(robot.links.size() <= kMaxLinks && robot.body.leaves.size() <= kMaxLeaves);
  const Kinematics kinematics(robot);
  std::vector<float> poses(kinematics.pose_floats());
  std::vector<double> state = rest_state(robot);
  kinematics.write_poses(state, poses);
  for (const float value : poses) FUZZ_CHECK(!std::isnan(value));
  for (double& value : state) value = 1e9 * value + 1e300;
  kinematics.write_poses(state, poses);
}

void check_collada(const std::string& text) {
  std::vector<std::string> notes;
  const std::optional<std::string> for_assimp = collada_for_assimp(text, notes);
  // tinyxml2 passes over text behind the first element, but not at the end of a file.
  FUZZ_CHECK(!for_assimp || collada_for_assimp(*for_assimp + "<!---->", notes));
  for (const std::string& note : notes) FUZZ_CHECK(printable(note) == note);
}

void check_package(const std::string& path) {
  const PackageFolders packages = read_packages({path});
  FUZZ_CHECK(packages.size() <= 1 && packages.count("") == 0);
}

void read(Kind kind, const std::string& text, const std::string& path) {
  RobotOptions options;
  if (kind == kUrdfInChild || kind == kMjcfInChild)
    options.sandbox = SandboxLimits{std::size_t{1} << 30, 2, 60, std::size_t{64} << 20};
  const Robot known = known_robot();
  if (kind == kSrdf) {
    for (const auto& [a, b] : read_disabled_pairs(path, known, {}).pairs) FUZZ_CHECK(a < b && b < 2);
  } else if (kind == kStates) {
    const JointStates states = read_joint_states(path, known, {});
    FUZZ_CHECK(states.count > 0 && states.values.size() == states.count);
    for (const double value : states.values) FUZZ_CHECK(std::fabs(value) <= kMaxImportValue);
  } else if (kind == kCollada) {
    check_collada(text);
  } else if (kind == kPackage) {
    check_package(path);
  } else {
    check_robot(import_robot(path, options));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const auto kind = static_cast<Kind>(bytes.below(kKindCount));
  static const tests::TemporaryFile file("robot.xml", "");
  const std::string text = bytes.rest();
  // libmujoco in this process would read any text that begins with its element.
  if (kind == kUrdf && text.find("<mujoco") != std::string::npos) return 0;
  std::ofstream(file.path(), std::ios::binary) << text;
  try {
    read(kind, text, file.path());
  } catch (const ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind(file.path() + ": ", 0) == 0 && printable(line) == line);
  }
  return 0;
}
