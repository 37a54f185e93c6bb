// Robots from MJCF, through libmujoco.
#include "scenes/robot/mjcf.h"

#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/mjcf_text.h"
#include "scenes/robot/shapes.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <utility>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;

// The number of the first body in a signature.
constexpr std::uint32_t kFirstBody = mjVERSION_HEADER >= 300 ? 0 : 1;

// libmujoco calls plain functions for warnings, which it would otherwise write to a file, and for errors, after which
// it would otherwise end the process.
std::vector<std::string>* warnings = nullptr;
void take_warning(const char* text) {
  constexpr std::size_t kMostNotes = 100;
  if (warnings != nullptr && warnings->size() < kMostNotes) warnings->push_back(printable(text));
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

// A message of the library as one line, which names the line of the file instead of that of the text.
std::string refusal(const std::string& name, std::string message, const MjcfText& text) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::string place = name;
  for (const std::string before : {"line = ", "line "}) {
    const std::size_t at = message.rfind(before);
    if (at == std::string::npos) continue;
    const unsigned long line = std::strtoul(message.c_str() + at + before.size(), nullptr, 10);
    if (line == 0 || line > text.lines.size()) continue;
    place = text.place_of(line - 1);
    message.resize(at);  // a column may follow, which is that of the text
    break;
  }
  message.resize(std::min(message.find(" Object name ="), message.size()));  // it is in the message, or there is none
  message.resize(message.find_last_not_of(", ") + 1);
  return place + ": libmujoco cannot read it: " + printable(message);
}

// What libmujoco finds as the file.
constexpr const char* kFileName = "robot.xml";

// Files in memory, for the library.
class Files {
 public:
  explicit Files(const std::string& xml) : files_(std::make_unique<mjVFS>()) {
    mj_defaultVFS(files_.get());
    const int size = static_cast<int>(xml.size());
#if mjVERSION_HEADER >= 313
    const bool is_there = mj_addBufferVFS(files_.get(), kFileName, xml.data(), size) == 0;
#else
    const bool is_there = mj_makeEmptyFileVFS(files_.get(), kFileName, size) == 0;
    if (is_there) std::memcpy(files_->filedata[mj_findFileVFS(files_.get(), kFileName)], xml.data(), xml.size());
#endif
    if (!is_there) throw ImportError("libmujoco has no room for the text");
  }
  ~Files() { mj_deleteVFS(files_.get()); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;
  const mjVFS* get() const { return files_.get(); }

 private:
  std::unique_ptr<mjVFS> files_;
};

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;

Model load(const std::string& name, const MjcfText& text, std::vector<std::string>& notes) {
  const Handlers handlers(notes);
  std::array<char, 1024> reason = {};
  mjModel* model = nullptr;
  std::string message;
  try {
    const Files files(text.xml);
    model = mj_loadXML(kFileName, files.get(), reason.data(), static_cast<int>(reason.size()));
    message = reason.data();
  } catch (const ImportError& error) { message = error.what(); }
  if (model == nullptr) throw ImportError(refusal(name, message, text));
  return {model, mj_deleteModel};
}

Vec3 vector_at(const mjtNum* v) { return {v[0], v[1], v[2]}; }

RigidMotion motion_at(const mjtNum* position, const mjtNum* wxyz) {
  return {normalized({wxyz[1], wxyz[2], wxyz[3], wxyz[0]}), vector_at(position)};
}

class MjcfReader {
 public:
  MjcfReader(const XmlText& text, const RobotOptions& options, LeafTriangles* triangles)
      : path_(printable(text.path())),
        triangles_(triangles),
        text_(mjcf_text(text, options)),
        model_(load(path_, text_, text_.notes)),
        m_(*model_),
        bodies_(static_cast<std::size_t>(m_.nbody)) {
    robot_.notes = std::move(text_.notes);
    for (int p = 0; p < m_.npair && text_.tests_listed_pairs; ++p) {
      const int g = m_.pair_geom1[p], h = m_.pair_geom2[p];
      listed_geoms_.insert({g, h});
      listed_pairs_.insert(std::minmax(g, h));
    }
  }

  Robot read() {
    robot_.body.name = printable(m_.names);  // the model's own name is the first of all names
    for (int b = 0; b < m_.nbody; ++b) add_body(b);
    for (int g = 0; g < m_.ngeom; ++g) add_geom(g);
    add_counts("planes and height fields are left out", left_out_);
    add_counts("mocap bodies are held where they are", mocap_);
    add_pairs();
    return std::move(robot_);
  }

 private:
  // What a body of the library is part of: a link, and the place in it, which is that of a <frame>.
  struct Body {
    std::uint32_t link = 0;
    RigidMotion place;
  };

  // How a link is carried: the first link of its rigid body, and whether that one has joints.
  struct Carrier {
    std::uint32_t first = 0;
    bool moves = false;
  };

  void add_counts(const char* what, std::size_t count) {
    if (count > 0) robot_.notes.push_back(what + (": " + std::to_string(count)));
  }

  int flags_of(int b) const { return m_.nuser_body > 0 ? static_cast<int>(m_.body_user[b * m_.nuser_body]) : 0; }

  void add_body(int b) {
    const Body above = b > 0 ? bodies_[static_cast<std::size_t>(m_.body_parentid[b])] : Body{};
    RigidMotion place;
    if (b > 0) place = compose(above.place, motion_at(m_.body_pos + 3 * b, m_.body_quat + 4 * b));
    if ((flags_of(b) & kMjcfFrame) != 0) {
      bodies_[static_cast<std::size_t>(b)] = {above.link, place};
      return;
    }
    const auto index = static_cast<std::uint32_t>(robot_.links.size());
    bodies_[static_cast<std::size_t>(b)] = {index, {}};
    if (index == kMaxLinks) throw ImportError(path_ + ": more than " + std::to_string(kMaxLinks) + " bodies");
    const char* const name = mj_id2name(&m_, mjOBJ_BODY, b);
    robot_.body.link_names.push_back(b == 0                             ? "world"
                                     : name != nullptr && *name != '\0' ? printable(name)
                                                                        : "body " + std::to_string(index));
    robot_.body.link_parents.push_back(b == 0 ? -1 : static_cast<std::int32_t>(above.link));
    RobotLink link;
    link.place = place;
    if (!in_range(link.place))
      throw ImportError(path_ + ": body " + robot_.body.link_names.back() +
                        ": its place is not a number or out of range");
    link.first_joint = static_cast<std::uint32_t>(robot_.joints.size());
    link.floats = (flags_of(b) & (kMjcfFreeBody | kMjcfMocap)) != 0;
    for (int j = m_.body_jntadr[b]; j >= 0 && j < m_.body_jntadr[b] + m_.body_jntnum[b]; ++j) {
      if (m_.jnt_type[j] == mjJNT_FREE) link.floats = true;
      add_joint(j);
    }
    link.joint_count = static_cast<std::uint32_t>(robot_.joints.size()) - link.first_joint;
    robot_.links.push_back(link);
    if ((flags_of(b) & kMjcfMocap) != 0) ++mocap_;
    const bool moves = m_.body_jntnum[b] > 0 || (flags_of(b) & kMjcfFreeBody) != 0;
    carriers_.push_back(b == 0 || moves || link.floats ? Carrier{index, moves} : carriers_[above.link]);
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
    if (m_.geom_contype[g] == 0 && m_.geom_conaffinity[g] == 0 && listed_geoms_.count(g) == 0)
      return;  // only to look at
    const mjtNum* const size = m_.geom_size + 3 * g;
    RobotShape shape;
    const Body& body = bodies_[static_cast<std::size_t>(m_.geom_bodyid[g])];
    shape.place = compose(body.place, motion_at(m_.geom_pos + 3 * g, m_.geom_quat + 4 * g));
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
        const int* const faces = m_.mesh_face + 3 * m_.mesh_faceadr[mesh];
        for (int c = 0; c < 3 * m_.mesh_facenum[mesh]; ++c)
          shape.corners.push_back(shape.vertices.at(static_cast<std::size_t>(faces[c])));
        break;
      }
      default: ++left_out_, ++robot_.left_out.shapes; return;
    }
    add_shape(robot_, body.link, shape,
              path_ + ": body " + robot_.body.link_names[body.link] + ": geom " + name_or_number("", mjOBJ_GEOM, g));
    if (robot_.body.leaves.size() == leaf_geoms_.size()) return;  // a size is 0 as a float
    leaf_geoms_.push_back(g);
    add_triangles(shape, triangles_);
  }

  bool may_touch(int g, int h) const {
    return text_.tests_all_pairs &&
           ((m_.geom_contype[g] & m_.geom_conaffinity[h]) != 0 || (m_.geom_contype[h] & m_.geom_conaffinity[g]) != 0);
  }

  // What the pairs of geoms say of a pair of links.
  struct PairUse {
    bool is_listed = false;
    bool is_excluded = false;
    std::size_t tested = 0;  // pairs of geoms whose contact bits let them touch, or that are listed
    std::size_t all = 0;
  };

  // Which pairs of links the file excludes or lists, and which MuJoCo does not test. A pair of links is tested with all
  // its geoms if any two of them are.
  void add_pairs() {
    const std::size_t links = robot_.links.size();
    std::vector<PairUse> uses(links * links);
    const auto use_of = [&](std::size_t a, std::size_t b) -> PairUse& {
      return uses[std::min(a, b) * links + std::max(a, b)];
    };
    for (int e = 0; e < m_.nexclude; ++e) {
      const auto signature = static_cast<std::uint32_t>(m_.exclude_signature[e]);
      use_of(bodies_.at((signature >> 16) - kFirstBody).link, bodies_.at((signature & 0xffffu) - kFirstBody).link)
          .is_excluded = true;
    }
    for (std::size_t k = 0; k < leaf_geoms_.size(); ++k)
      for (std::size_t n = 0; n < k; ++n) {
        PairUse& use = use_of(robot_.body.leaves[n].link, robot_.body.leaves[k].link);
        const bool listed = listed_pairs_.count(std::minmax(leaf_geoms_[n], leaf_geoms_[k])) != 0;
        ++use.all;
        if (listed) use.is_listed = true;
        if (listed || (!use.is_excluded && may_touch(leaf_geoms_[n], leaf_geoms_[k]))) ++use.tested;
      }
    MujocoPairs& pairs = robot_.mujoco.emplace();
    std::size_t mixed = 0;
    for (std::uint32_t a = 0; a < links; ++a)
      for (std::uint32_t b = a + 1; b < links; ++b) {
        const PairUse& use = use_of(a, b);
        const bool is_welded = carriers_[a].first == carriers_[b].first || !(carriers_[a].moves || carriers_[b].moves);
        if (use.is_listed) {
          pairs.listed.push_back({a, b});
        } else if (use.is_excluded || (use.all > 0 && use.tested == 0)) {
          robot_.body.ignored_pairs.push_back({a, b});
        } else if (use.all > 0 && is_welded) {
          pairs.welded.push_back({a, b});
        } else if (use.all > 0 && text_.filters_parents && (carries(a, b) || carries(b, a))) {
          pairs.adjacent.push_back({a, b});
        }
        if (use.tested > 0 && use.tested < use.all && (use.is_listed || !is_welded)) ++mixed;
      }
    add_counts("of some pairs of bodies the file tests some geoms only; all their geoms are tested", mixed);
  }

  // Whether the rigid body of one link is the one above that of another, and not the world.
  bool carries(std::uint32_t a, std::uint32_t b) const {
    const std::int32_t above = robot_.body.link_parents[carriers_[b].first];
    return above > 0 && carriers_[static_cast<std::size_t>(above)].first == carriers_[a].first &&
           carriers_[a].first != 0;
  }

  std::string path_;
  LeafTriangles* const triangles_;
  MjcfText text_;
  Robot robot_;
  Model model_;
  const mjModel& m_;
  std::vector<Body> bodies_;
  std::vector<Carrier> carriers_;  // of each link
  std::vector<int> leaf_geoms_;    // of each leaf
  std::set<int> listed_geoms_;     // in a <pair>
  std::set<std::pair<int, int>> listed_pairs_;
  std::size_t left_out_ = 0, mocap_ = 0;
};

}  // namespace

bool reads_mjcf() { return true; }

Robot read_mjcf(const XmlText& text, const RobotOptions& options, LeafTriangles* triangles) {
  return MjcfReader(text, options, triangles).read();
}

}  // namespace cab::scenes
