// Forward kinematics against products of 4x4 matrices in long double, made from the numbers that a file holds.
#include "scenes/robot/kinematics.h"

#include "scenes/random.h"
#include "tests/rounds.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using Real = long double;
using Matrix = std::array<std::array<Real, 4>, 4>;

// Over 14 links of about a metre: floats are off by 2^-25 of 16 metres, and by 2^-24 of a turned metre.
constexpr double kTolerance = 1e-6;

Matrix identity() {
  Matrix m = {};
  for (std::size_t k = 0; k < 4; ++k) m[k][k] = 1;
  return m;
}

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix m = {};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t k = 0; k < 4; ++k) m[r][c] += a[r][k] * b[k][c];
  return m;
}

Matrix shift(Real x, Real y, Real z) {
  Matrix m = identity();
  m[0][3] = x, m[1][3] = y, m[2][3] = z;
  return m;
}

// The turn about an axis by the formula of Rodrigues. The axis need not have length 1.
Matrix turn(const scenes::Vec3& axis, Real angle) {
  const Real n = std::sqrt(Real{axis[0]} * axis[0] + Real{axis[1]} * axis[1] + Real{axis[2]} * axis[2]);
  const Real x = axis[0] / n, y = axis[1] / n, z = axis[2] / n, c = std::cos(angle), s = std::sin(angle);
  Matrix m = identity();
  m[0] = {c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s, 0};
  m[1] = {y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s, 0};
  m[2] = {z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c), 0};
  return m;
}

// Roll, pitch and yaw: turns about the fixed axes x, y and z in this order.
Matrix rpy(const scenes::Vec3& angles) {
  return product(turn({0, 0, 1}, angles[2]), product(turn({0, 1, 0}, angles[1]), turn({1, 0, 0}, angles[0])));
}

// The largest difference of a pose and a matrix, in any coordinate of the images of four points.
double difference(const float* pose, const Matrix& matrix) {
  double worst = 0;
  const scenes::RigidMotion motion = {{pose[0], pose[1], pose[2], pose[3]}, {pose[4], pose[5], pose[6]}};
  for (const scenes::Vec3& p : std::vector<scenes::Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
    const scenes::Vec3 turned = scenes::rotate(motion.rotation, p);
    for (std::size_t r = 0; r < 3; ++r) {
      const Real expected = matrix[r][0] * p[0] + matrix[r][1] * p[1] + matrix[r][2] * p[2] + matrix[r][3];
      worst = std::max(worst, static_cast<double>(std::fabs(expected - turned[r] - motion.translation[r])));
    }
  }
  return worst;
}

scenes::Vec3 random_vector(scenes::Random& random, double reach) {
  return {random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)};
}

std::string text_of(const scenes::Vec3& v) {
  std::ostringstream text;
  text.precision(17);
  text << v[0] << ' ' << v[1] << ' ' << v[2];
  return text.str();
}

// One joint of a file that the test writes, and the link l<number> below it.
struct Made {
  std::string type;
  int parent = 0;
  scenes::Vec3 xyz = {}, angles = {}, axis = {};
  int mimics = -1;
  double multiplier = 1, offset = 0;
};

double value_of(const std::vector<Made>& joints, std::size_t j, const std::map<std::string, double>& given) {
  if (joints[j].mimics < 0) return given.at("j" + std::to_string(j));
  return joints[j].multiplier * value_of(joints, static_cast<std::size_t>(joints[j].mimics), given) + joints[j].offset;
}

}  // namespace

TEST_CASE("every link of a random URDF tree stands where products of matrices put it, mimic joints included") {
  double worst = 0;
  for (std::uint64_t round = 0; round < rounds(60); ++round) {
    CAPTURE(round);
    scenes::Random random = scenes::Random::of(1301, round);
    std::vector<Made> joints(1);  // none for the first link
    std::string urdf =
        "<robot name='made'><link name='l0'><collision><geometry><sphere radius='1'/></geometry>"
        "</collision></link>\n";
    for (int j = 1; j < 15; ++j) {
      Made made;
      const char* const types[] = {"revolute", "continuous", "prismatic", "fixed"};
      made.type = types[random.index(4)];
      made.parent = static_cast<int>(random.index(static_cast<std::uint32_t>(j)));
      made.xyz = random_vector(random, 1);
      made.angles = random_vector(random, 3);
      made.axis = random_vector(random, 2);
      const int other = static_cast<int>(random.index(static_cast<std::uint32_t>(j)));
      if (made.type != "fixed" && other > 0 && joints[static_cast<std::size_t>(other)].type != "fixed" &&
          random.index(3) == 0) {
        made.mimics = other;
        made.multiplier = random.uniform(-2, 2);
        made.offset = random.uniform(-1, 1);
      }
      const std::string number = std::to_string(j);
      urdf += "<link name='l" + number + "'/><joint name='j" + number + "' type='" + made.type + "'><parent link='l" +
              std::to_string(made.parent) + "'/><child link='l" + number + "'/><origin xyz='" + text_of(made.xyz) +
              "' rpy='" + text_of(made.angles) + "'/><axis xyz='" + text_of(made.axis) +
              "'/><limit lower='-1' upper='2' effort='1' velocity='1'/>";
      if (made.mimics >= 0) {
        std::ostringstream mimic;
        mimic.precision(17);
        mimic << "<mimic joint='j" << made.mimics << "' multiplier='" << made.multiplier << "' offset='" << made.offset
              << "'/>";
        urdf += mimic.str();
      }
      urdf += "</joint>\n";
      joints.push_back(made);
    }
    const TemporaryFile file("made.urdf", urdf + "</robot>");
    const scenes::Robot robot = scenes::import_robot(file.path(), {});
    REQUIRE(robot.links.size() == joints.size());

    std::vector<double> state(robot.variables.size());
    scenes::random_state(robot, 7, round, state.data());
    std::map<std::string, double> given;
    for (std::size_t v = 0; v < state.size(); ++v) given[robot.variables[v].name] = state[v];
    std::vector<Matrix> expected = {identity()};
    for (std::size_t j = 1; j < joints.size(); ++j) {
      const Made& made = joints[j];
      Matrix m = product(shift(made.xyz[0], made.xyz[1], made.xyz[2]), rpy(made.angles));
      if (made.type != "fixed") {
        const Real value = value_of(joints, j, given);
        const Real n = std::sqrt(Real{made.axis[0]} * made.axis[0] + Real{made.axis[1]} * made.axis[1] +
                                 Real{made.axis[2]} * made.axis[2]);
        m = product(m, made.type == "prismatic"
                           ? shift(made.axis[0] / n * value, made.axis[1] / n * value, made.axis[2] / n * value)
                           : turn(made.axis, value));
      }
      expected.push_back(product(expected[static_cast<std::size_t>(made.parent)], m));
    }
    std::vector<float> poses(7 * robot.links.size());
    scenes::Kinematics(robot).write_poses(state, poses);
    for (std::size_t l = 0; l < robot.links.size(); ++l) {
      const auto number = static_cast<std::size_t>(std::stoi(robot.body.link_names[l].substr(1)));
      worst = std::max(worst, difference(poses.data() + 7 * l, expected[number]));
    }
  }
  CAPTURE(worst);
  CHECK(worst < kTolerance);
  CHECK(worst > 0);
}

TEST_CASE("MJCF: hinges off the body's origin, slides, balls and references stand where matrices put them") {
  if (!scenes::reads_mjcf()) {
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  const TemporaryFile file("made.xml", R"(<mujoco model="made"><compiler angle="radian"/><worldbody>
    <body name="a" pos=".1 .2 .3" quat=".8 .6 0 0">
      <joint name="h" type="hinge" axis="0 3 4" pos=".5 -.2 .1" limited="true" range="-2 2" ref=".25"/>
      <joint name="s" type="slide" axis="1 0 0" limited="true" range="-1 1" ref="-.5"/>
      <geom type="sphere" size=".1"/>
      <body name="b" pos="0 0 1"><joint name="b" type="ball" pos="0 .3 0" limited="true" range="0 1.5"/>
        <geom type="capsule" size=".1 .2"/></body>
    </body></worldbody></mujoco>)");
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  REQUIRE(robot.body.link_names == std::vector<std::string>{"world", "a", "b"});
  REQUIRE(robot.variables.size() == 5);
  CHECK(robot.variables[0].rest == .25);
  CHECK(robot.variables[1].rest == -.5);
  for (std::uint64_t index = 0; index < 50; ++index) {
    CAPTURE(index);
    std::vector<double> q(5);
    scenes::random_state(robot, 3, index, q.data());
    const auto turn_about = [](const scenes::Vec3& anchor, const Matrix& rotation) {
      return product(shift(anchor[0], anchor[1], anchor[2]),
                     product(rotation, shift(-anchor[0], -anchor[1], -anchor[2])));
    };
    Matrix a = product(shift(.1L, .2L, .3L), turn({1, 0, 0}, 2 * std::atan2(.6L, .8L)));
    a = product(a, turn_about({.5, -.2, .1}, turn({0, 3, 4}, Real{q[0]} - .25L)));
    a = product(a, shift(Real{q[1]} + .5L, 0, 0));
    const Real angle = std::sqrt(Real{q[2]} * q[2] + Real{q[3]} * q[3] + Real{q[4]} * q[4]);
    CHECK(static_cast<double>(angle) <= 1.5 * (1 + 1e-15));
    const Matrix b = product(product(a, shift(0, 0, 1)), turn_about({0, .3, 0}, turn({q[2], q[3], q[4]}, angle)));
    std::vector<float> poses(21);
    scenes::Kinematics(robot).write_poses(q, poses);
    CHECK(difference(poses.data(), identity()) == 0);
    CHECK(difference(poses.data() + 7, a) < kTolerance);
    CHECK(difference(poses.data() + 14, b) < kTolerance);
  }
}

TEST_CASE("random states are within the limits, follow the seed alone and differ from each other") {
  scenes::Robot robot;
  robot.variables = {{"a", -1, 3, 0}, {"b", .5, .5, .5}};
  std::set<double> seen;
  double least = 3, most = -1;
  for (std::uint64_t index = 0; index < 1000; ++index) {
    double state[2] = {}, again[2] = {}, other[2] = {};
    scenes::random_state(robot, 11, index, state);
    scenes::random_state(robot, 11, index, again);
    scenes::random_state(robot, 12, index, other);
    CHECK(state[0] == again[0]);
    CHECK(state[0] != other[0]);
    CHECK(state[1] == .5);
    seen.insert(state[0]);
    least = std::min(least, state[0]);
    most = std::max(most, state[0]);
  }
  CHECK(seen.size() == 1000);
  CHECK((least >= -1 && least < -.95));
  CHECK((most < 3 && most > 2.95));
}

}  // namespace cab::tests
