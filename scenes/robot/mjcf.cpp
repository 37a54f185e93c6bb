// Robots from MJCF, through libmujoco.
#include "scenes/robot/mjcf.h"

#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/shapes.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;

// libmujoco calls plain functions for warnings, which it would otherwise write to a file, and for errors, after which
// it would otherwise end the process.
std::vector<std::string>* warnings = nullptr;
void take_warning(const char* text) {
  if (warnings != nullptr) warnings->push_back(printable(text));
}
[[noreturn]] void take_error(const char* text) { throw ImportError(text); }

// Sets the library's handlers, and puts back those that were there.
class Handlers {
 public:
  explicit Handlers(std::vector<std::string>& notes) : warning_(mju_user_warning), error_(mju_user_error) {
    warnings = &notes;
    mju_user_warning = take_warning;
    mju_user_error = take_error;
  }
  ~Handlers() {
    mju_user_warning = warning_;
    mju_user_error = error_;
    warnings = nullptr;
  }
  Handlers(const Handlers&) = delete;
  Handlers& operator=(const Handlers&) = delete;

 private:
  void (*warning_)(const char*);
  void (*error_)(const char*);
};

// A message of the library, whose lines become one.
std::string one_line(std::string text) {
  for (std::size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n', end))
    text.replace(end, 1, "; ");
  return printable(text);
}

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;

Model load(const XmlText& text, std::vector<std::string>& notes) {
  const Handlers handlers(notes);
  std::array<char, 1024> reason = {};
  mjModel* model = nullptr;
  try {
    model = mj_loadXML(text.path().c_str(), nullptr, reason.data(), static_cast<int>(reason.size()));
  } catch (const ImportError& error) {
    throw ImportError(printable(text.path()) + ": libmujoco cannot read it: " + one_line(error.what()));
  }
  if (model == nullptr)
    throw ImportError(printable(text.path()) + ": libmujoco cannot read it: " + one_line(reason.data()));
  return {model, mj_deleteModel};
}

Vec3 vector_at(const mjtNum* v) { return {v[0], v[1], v[2]}; }

RigidMotion motion_at(const mjtNum* position, const mjtNum* wxyz) {
  return {normalized({wxyz[1], wxyz[2], wxyz[3], wxyz[0]}), vector_at(position)};
}

class MjcfReader {
 public:
  explicit MjcfReader(const XmlText& text)
      : path_(printable(text.path())), model_(load(text, robot_.notes)), m_(*model_) {}

  Robot read() {
    if (m_.nbody > static_cast<int>(kMaxLinks))
      throw ImportError(path_ + ": more than " + std::to_string(kMaxLinks) + " bodies");
    robot_.body.name = printable(m_.names);  // the model's own name is the first of all names
    for (int b = 0; b < m_.nbody; ++b) add_body(b);
    for (int g = 0; g < m_.ngeom; ++g) add_geom(g);
    for (const char* note : {planes_ > 0 ? "planes and height fields are left out" : nullptr,
                             m_.neq > 0 ? "equality constraints are not applied" : nullptr})
      if (note != nullptr) robot_.notes.emplace_back(note);
    exclude_pairs();
    return std::move(robot_);
  }

 private:
  void add_body(int b) {
    robot_.body.link_names.push_back(b == 0 ? "world" : name_or_number("body ", mjOBJ_BODY, b));
    robot_.body.link_parents.push_back(b == 0 ? -1 : m_.body_parentid[b]);
    RobotLink link;
    if (b > 0) link.place = motion_at(m_.body_pos + 3 * b, m_.body_quat + 4 * b);
    if (!in_range(link.place))
      throw ImportError(path_ + ": body " + robot_.body.link_names.back() +
                        ": its place is not a number or out of range");
    link.first_joint = static_cast<std::uint32_t>(robot_.joints.size());
    for (int j = m_.body_jntadr[b]; j >= 0 && j < m_.body_jntadr[b] + m_.body_jntnum[b]; ++j) {
      if (m_.jnt_type[j] == mjJNT_FREE) link.floats = true;
      add_joint(j);
    }
    link.joint_count = static_cast<std::uint32_t>(robot_.joints.size()) - link.first_joint;
    robot_.links.push_back(link);
  }

  // The name of an object, or its kind and number.
  std::string name_or_number(const char* kind, mjtObj object, int id) const {
    const char* const name = mj_id2name(&m_, object, id);
    return name != nullptr && *name != '\0' ? printable(name) : kind + std::to_string(id);
  }

  // Angles and lengths of a joint count from qpos0, where the bodies stand as written.
  void add_joint(int j) {
    RobotJoint joint;
    joint.name = name_or_number("joint ", mjOBJ_JOINT, j);
    joint.axis = vector_at(m_.jnt_axis + 3 * j);
    joint.anchor = vector_at(m_.jnt_pos + 3 * j);
    joint.variable = static_cast<std::uint32_t>(robot_.variables.size());
    const double lower = m_.jnt_range[2 * j], upper = m_.jnt_range[2 * j + 1];
    const bool limited = m_.jnt_limited[j] != 0;
    const double rest = m_.qpos0[m_.jnt_qposadr[j]];
    const Vec3 numbers = {limited ? lower : 0, limited ? upper : 0, rest};
    if (!in_range(joint.axis) || !in_range(joint.anchor) || !in_range(numbers))
      throw ImportError(path_ + ": joint " + joint.name + ": it has a number that is none or out of range");
    switch (m_.jnt_type[j]) {
      case mjJNT_HINGE:
        joint.kind = JointKind::kRevolute;
        joint.offset = -rest;
        robot_.variables.push_back({joint.name, limited ? lower : rest - kPi, limited ? upper : rest + kPi, rest});
        break;
      case mjJNT_SLIDE:
        if (!limited) {
          ++robot_.left_out.joints;
          robot_.notes.push_back("joint " + joint.name + " slides without limits: held where it is");
          return;
        }
        joint.kind = JointKind::kPrismatic;
        joint.offset = -rest;
        robot_.variables.push_back({joint.name, lower, upper, rest});
        break;
      case mjJNT_BALL:
        joint.kind = JointKind::kBall;
        for (const char* component : {".x", ".y", ".z"}) {
          const double limit = limited ? upper : kPi;
          robot_.variables.push_back({joint.name + component, -limit, limit, 0});
        }
        break;
      default: return;  // free: held where it is
    }
    robot_.joints.push_back(joint);
  }

  void add_geom(int g) {
    if (m_.geom_contype[g] == 0 && m_.geom_conaffinity[g] == 0) return;  // only to look at
    const mjtNum* const size = m_.geom_size + 3 * g;
    RobotShape shape;
    shape.place = motion_at(m_.geom_pos + 3 * g, m_.geom_quat + 4 * g);
    shape.size = vector_at(size);
    switch (m_.geom_type[g]) {
      case mjGEOM_SPHERE: shape.kind = ShapeKind::kSphere; break;
      case mjGEOM_CAPSULE: shape.kind = ShapeKind::kCapsule; break;
      case mjGEOM_ELLIPSOID: shape.kind = ShapeKind::kEllipsoid; break;
      case mjGEOM_CYLINDER: shape.kind = ShapeKind::kCylinder; break;
      case mjGEOM_BOX: shape.kind = ShapeKind::kBox; break;
      case mjGEOM_MESH: {
        shape.kind = ShapeKind::kConvexHull;
        const int mesh = m_.geom_dataid[g];
        const float* const vertices = m_.mesh_vert + 3 * m_.mesh_vertadr[mesh];
        for (int v = 0; v < m_.mesh_vertnum[mesh]; ++v)
          shape.vertices.push_back({vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]});
        break;
      }
      default: ++planes_, ++robot_.left_out.shapes; return;
    }
    const auto link = static_cast<std::uint32_t>(m_.geom_bodyid[g]);
    add_shape(robot_, link, shape,
              path_ + ": body " + robot_.body.link_names[link] + ": geom " + name_or_number("", mjOBJ_GEOM, g));
    leaf_geoms_.push_back(g);
  }

  bool may_touch(int g, int h) const {
    return (m_.geom_contype[g] & m_.geom_conaffinity[h]) != 0 || (m_.geom_contype[h] & m_.geom_conaffinity[g]) != 0;
  }

  // Pairs of bodies that the file excludes, and those whose contact bits let no two geoms touch.
  void exclude_pairs() {
    std::vector<LinkPair>& pairs = robot_.body.ignored_pairs;
    for (int e = 0; e < m_.nexclude; ++e) {
      const auto signature = static_cast<std::uint32_t>(m_.exclude_signature[e]);
      pairs.push_back({(signature >> 16) - 1, (signature & 0xffffu) - 1});
    }
    const std::size_t links = robot_.body.link_parents.size();
    std::vector<char> some(links * links, 0), any(links * links, 0);  // a geom pair; one that may touch
    for (std::size_t k = 0; k < leaf_geoms_.size(); ++k)
      for (std::size_t n = 0; n < k; ++n) {
        const auto a = static_cast<std::size_t>(robot_.body.leaves[n].link);
        const auto b = static_cast<std::size_t>(robot_.body.leaves[k].link);
        const std::size_t at = std::min(a, b) * links + std::max(a, b);
        some[at] = 1;
        if (may_touch(leaf_geoms_[n], leaf_geoms_[k])) any[at] = 1;
      }
    for (std::uint32_t a = 0; a < links; ++a)
      for (std::uint32_t b = a + 1; b < links; ++b)
        if (some[a * links + b] && !any[a * links + b]) pairs.push_back({a, b});
  }

  std::string path_;
  Robot robot_;
  Model model_;
  const mjModel& m_;
  std::vector<int> leaf_geoms_;  // of each leaf
  int planes_ = 0;
};

}  // namespace

bool reads_mjcf() { return true; }

Robot read_mjcf(const XmlText& text) { return MjcfReader(text).read(); }

}  // namespace cab::scenes
