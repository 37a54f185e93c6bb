// MuJoCo: which states of a robot collide, by its kinematics and its collision phase alone.
#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "perf/base/report.h"
#include "perf/measure/peers/robot_setup.h"

namespace cab::perf {
namespace {

// MuJoCo would write warnings to a file, and end the process at errors.
void pass_over(const char*) {}
[[noreturn]] void refuse(const char* text) { throw std::runtime_error(text); }

// ` name="1 2 3"`.
template <class Numbers>
std::string numbers(const std::string& name, const Numbers& values) {
  std::string text;
  for (const auto value : values) text += (text.empty() ? "" : " ") + shortest(value);
  return ' ' + name + "=\"" + text + '"';
}

template <class Position, class Rotation>
std::string place(const Position& position, const Rotation& q) {
  return numbers("pos", position) + numbers("quat", std::array{q[3], q[0], q[1], q[2]});
}

std::string named(const std::string& attribute, const std::string& prefix, std::size_t number) {
  return ' ' + attribute + "=\"" + prefix + std::to_string(number) + '"';
}

// In the orders of ShapeKind and JointKind.
constexpr const char* kGeoms[] = {"box", "ellipsoid", "capsule", "mesh", "sphere", "cylinder"};
constexpr const char* kJoints[] = {"hinge", "slide", "ball"};

// The body of a link with all below it. Link l is the body "bL", leaf n the geom "gN", joint j the joint "jJ". bits:
// attributes of all geoms.
std::string body_text(const scenes::Robot& robot, std::size_t l, const std::string& bits) {
  const scenes::RobotLink& link = robot.links[l];
  std::string text = "<body" + named("name", "b", l) + place(link.place.translation, link.place.rotation) +
                     "><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\n";
  for (std::size_t j = link.first_joint; j < link.first_joint + link.joint_count; ++j) {
    const scenes::RobotJoint& joint = robot.joints[j];
    text += "<joint" + named("name", "j", j) + " type='" + kJoints[static_cast<std::size_t>(joint.kind)] + "'" +
            numbers("axis", joint.axis) + numbers("pos", joint.anchor) + "/>\n";
  }
  for (std::size_t n = 0; n < robot.body.leaves.size(); ++n) {
    const ConvexPart& part = robot.body.leaves[n].parts[0].shape;
    if (robot.body.leaves[n].link != l) continue;
    text += "<geom" + named("name", "g", n) + bits + " type='" + kGeoms[static_cast<std::size_t>(part.kind)] + "'" +
            (part.kind == ShapeKind::kConvexHull ? named("mesh", "g", n)
                                                 : numbers("size", part.size) + place(part.position, part.rotation)) +
            "/>\n";
  }
  for (std::size_t child = l + 1; child < robot.links.size(); ++child)
    if (robot.body.link_parents[child] == static_cast<std::int32_t>(l)) text += body_text(robot, child, bits);
  return text + "</body>\n";
}

// The robot as MJCF. Its own file is not handed over, since MuJoCo reads neither package:// paths nor mimics of URDF.
// by_pairs: the pairs of geoms of tested links are listed; else the other pairs of bodies are excluded.
std::string robot_text(const scenes::Robot& robot, const RobotPairs& pairs, bool by_pairs) {
  const std::vector<scenes::BodyLeaf>& leaves = robot.body.leaves;
  std::string text =
      "<mujoco><compiler angle='radian' inertiafromgeom='false'/><size nconmax='1000' njmax='300'/>"
      "<option" +
      std::string(by_pairs && mjVERSION_HEADER < 300 ? " collision='predefined'" : "") +
      "><flag filterparent='disable'/></option><asset>\n";
  for (std::size_t n = 0; n < leaves.size(); ++n)
    if (leaves[n].parts[0].shape.kind == ShapeKind::kConvexHull)
      text += "<mesh" + named("name", "g", n) + numbers("vertex", leaves[n].parts[0].vertices) + "/>\n";
  text += "</asset><worldbody>\n" + body_text(robot, 0, by_pairs ? " contype='0' conaffinity='0'" : "") +
          "</worldbody><contact>\n";
  for (const LinkPair& pair : by_pairs ? pairs.tested : pairs.masked) {
    if (!by_pairs) text += "<exclude" + named("body1", "b", pair.a) + named("body2", "b", pair.b) + "/>\n";
    for (std::size_t g = 0; by_pairs && g < leaves.size(); ++g)
      for (std::size_t h = 0; h < leaves.size(); ++h)
        if (leaves[g].link == pair.a && leaves[h].link == pair.b)
          text += "<pair" + named("geom1", "g", g) + named("geom2", "g", h) + "/>\n";
  }
  return text + "</contact></mujoco>\n";
}

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;

Model load(const std::string& text) {
  constexpr const char* kName = "robot.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const int size = static_cast<int>(text.size());
#if mjVERSION_HEADER >= 313
  mj_addBufferVFS(files.get(), kName, text.data(), size);
#else
  if (mj_makeEmptyFileVFS(files.get(), kName, size) == 0)
    std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], text.data(), text.size());
#endif
  std::array<char, 1024> reason = {};
  Model model(mj_loadXML(kName, files.get(), reason.data(), static_cast<int>(reason.size())), mj_deleteModel);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(reason.data());
  return model;
}

// A model with its data, at any state.
class MujocoRobot {
 public:
  MujocoRobot(const scenes::Robot& robot, const RobotPairs& pairs, bool by_pairs)
      : robot_(robot),
        model_(load(robot_text(robot, pairs, by_pairs))),
        data_(mj_makeData(model_.get()), mj_deleteData) {
    for (std::size_t j = 0; j < robot.joints.size(); ++j)
      places_.push_back(model_->jnt_qposadr[mj_name2id(model_.get(), mjOBJ_JOINT, ("j" + std::to_string(j)).c_str())]);
  }

  // Whether all tested pairs are tested: MuJoCo passes over links that no joint moves against each other.
  bool tests_all(const RobotPairs& pairs) const {
    const auto rigid_body = [&](std::uint32_t link) {
      return model_->body_weldid[mj_name2id(model_.get(), mjOBJ_BODY, ("b" + std::to_string(link)).c_str())];
    };
    for (const LinkPair& pair : pairs.tested)
      if (rigid_body(pair.a) == rigid_body(pair.b)) return false;
    return true;
  }

  bool touches(const double* state) {
    for (std::size_t j = 0; j < places_.size(); ++j) {
      const scenes::RobotJoint& joint = robot_.joints[j];
      const bool is_ball = joint.kind == JointKind::kBall;
      double value[3];
      for (std::size_t k = 0; k < (is_ball ? 3 : 1); ++k)
        value[k] = joint.multiplier * state[joint.variable + k] + joint.offset;
      if (!is_ball) {
        data_->qpos[places_[j]] = value[0];
        continue;
      }
      const double angle = mju_normalize3(value);
      mju_axisAngle2Quat(data_->qpos + places_[j], value, angle);
    }
    mj_kinematics(model_.get(), data_.get());
    mj_collision(model_.get(), data_.get());
    return data_->ncon > 0;
  }

 private:
  const scenes::Robot& robot_;
  Model model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::vector<int> places_;  // of joints in qpos
};

// Leaves out all pairs after the first contact.
int has_contact(const mjModel*, mjData* data, int, int) { return data->ncon > 0; }

}  // namespace

std::vector<RobotSetup> mujoco_setups(const scenes::Robot& robot, const RobotPairs& pairs) {
  mju_user_warning = pass_over;
  mju_user_error = refuse;
  const auto by = [&](const std::shared_ptr<MujocoRobot>& model, mjfConFilt filter) {
    return [model, filter, variables = robot.variables.size()](Span<const double> states, Span<std::uint8_t> touching) {
      mjcb_contactfilter = filter;
      for (std::size_t s = 0; s < touching.size; ++s) touching[s] = model->touches(states.data + s * variables);
      mjcb_contactfilter = nullptr;
    };
  };
  std::vector<RobotSetup> setups = {{"mujoco pairs", "mj_kinematics and mj_collision; geoms are listed pair by pair",
                                     by(std::make_shared<MujocoRobot>(robot, pairs, true), nullptr)}};
  const auto bodies = std::make_shared<MujocoRobot>(robot, pairs, false);
  if (bodies->tests_all(pairs))
    setups.push_back({"mujoco bodies", "with its broad phase; a contact filter ends a state at its first contact",
                      by(bodies, has_contact)});
  return setups;
}

std::string mujoco_version() { return mj_versionString(); }

}  // namespace cab::perf
