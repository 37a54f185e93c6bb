// Robots from URDF, through urdfdom.
#include "scenes/robot/urdf.h"

#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/shapes.h"

#include <console_bridge/console.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Collects what urdfdom would print. The library has one handler for all threads.
class CollectErrors : public console_bridge::OutputHandler {
 public:
  CollectErrors() { console_bridge::useOutputHandler(this); }
  ~CollectErrors() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level == console_bridge::CONSOLE_BRIDGE_LOG_ERROR) errors += (errors.empty() ? "" : "; ") + text;
  }
  std::string errors;
};

// Parses a text. *errors receives what urdfdom would print.
urdf::ModelInterfaceSharedPtr parse(const XmlText& text, std::string* errors) {
  CollectErrors collected;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text.bytes());
  } catch (const std::exception& error) {
    collected.log(error.what(), console_bridge::CONSOLE_BRIDGE_LOG_ERROR, "", 0);
  }
  *errors = printable(collected.errors.empty() ? "urdfdom gives no reason" : collected.errors);
  if (!model) throw ImportError(text.place_in(*errors) + ": " + *errors);
  return model;
}

// The joint above a link.
struct JointAbove {
  std::string name;
  std::string parent;  // the link above the joint
  std::string line;    // of the joint, with its file
};

// Throws if a link is above itself. urdfdom would never free such links.
void check_loops(const std::map<std::string, JointAbove>& above) {
  for (const auto& [link, joint] : above) {
    std::size_t steps = 0;
    for (auto at = above.find(joint.parent); at != above.end(); at = above.find(at->second.parent))
      if (++steps > above.size())
        throw ImportError(joint.line + ": joint " + printable(joint.name) + ": link " + printable(link) +
                          " is in or below a loop of joints");
  }
}

// Checks what urdfdom would not survive, or would pass over in silence, so that each has its line.
void check_elements(const XmlText& text) {
  std::size_t links = 0;
  std::map<std::string, JointAbove> above;  // of each child link
  for (const tinyxml2::XMLElement* element = text.root().FirstChildElement(); element != nullptr;
       element = element->NextSiblingElement()) {
    const std::string line = printable(text.path()) + ": line " + std::to_string(element->GetLineNum());
    if (std::strncmp(element->Name(), "xacro:", 6) == 0)
      throw ImportError(line + ": <" + printable(element->Name()) + "> is of xacro; let xacro expand the file first");
    if (element->Name() == std::string("link") && ++links > kMaxLinks)
      throw ImportError(line + ": more than " + std::to_string(kMaxLinks) + " links");
    if (element->Name() != std::string("joint")) continue;
    const auto link_of = [&](const char* tag) {
      const tinyxml2::XMLElement* const end = element->FirstChildElement(tag);
      return end != nullptr ? end->Attribute("link") : nullptr;
    };
    const char* const child = link_of("child");
    const char* const parent = link_of("parent");
    const char* const name = element->Attribute("name");
    if (child == nullptr || parent == nullptr || name == nullptr) continue;
    if (above.size() > kMaxLinks) throw ImportError(line + ": more than " + std::to_string(kMaxLinks) + " joints");
    const auto [other, is_new] = above.emplace(child, JointAbove{name, parent, line});
    if (!is_new && other->second.name != name)
      throw ImportError(line + ": link " + printable(child) + " is the child of two joints, " +
                        printable(other->second.name) + " and " + printable(name));
  }
  check_loops(above);
}

Vec3 vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

RigidMotion motion_of(const urdf::Pose& pose) {
  return {normalized({pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}), vector_of(pose.position)};
}

class UrdfReader {
 public:
  UrdfReader(const XmlText& text, const RobotOptions& options, CurrentFile* current)
      : text_(text), options_(options), current_(current), model_(parse(text, &errors_)) {}

  Robot read() {
    robot_.body.name = printable(model_->getName());
    add_links();
    for (std::size_t l = 0; l < order_.size(); ++l) {
      add_joint(static_cast<std::uint32_t>(l));
      check_collisions(*order_[l]);
      for (std::size_t c = 0; c < order_[l]->collision_array.size(); ++c)
        add_collision(static_cast<std::uint32_t>(l), c);
    }
    resolve_mimics();
    return std::move(robot_);
  }

 private:
  // Lists all links, parents before children.
  void add_links() {
    std::vector<std::pair<urdf::LinkConstSharedPtr, std::int32_t>> open = {{model_->getRoot(), -1}};
    while (!open.empty()) {
      const auto [link, parent] = open.back();
      open.pop_back();
      const auto index = static_cast<std::int32_t>(order_.size());
      order_.push_back(link);
      robot_.body.link_names.push_back(printable(link->name));
      robot_.body.link_parents.push_back(parent);
      robot_.links.push_back({});
      for (auto child = link->child_links.rbegin(); child != link->child_links.rend(); ++child)
        open.emplace_back(*child, index);
    }
  }

  // The place of a link in its parent, and the joint that moves it.
  void add_joint(std::uint32_t l) {
    RobotLink& link = robot_.links[l];
    link.first_joint = static_cast<std::uint32_t>(robot_.joints.size());
    if (l == 0) return;
    const urdf::Joint& source = *order_[l]->parent_joint;
    const std::string place = text_.place_of("joint", source.name) + ": joint " + printable(source.name);
    link.place = motion_of(source.parent_to_joint_origin_transform);
    if (!in_range(link.place)) throw ImportError(place + ": its origin is not a number or out of range");
    if (source.type == urdf::Joint::FIXED) return;
    if (source.type == urdf::Joint::PLANAR || source.type == urdf::Joint::FLOATING) {
      link.floats = true;
      robot_.notes.push_back("joint " + printable(source.name) + " is " +
                             (source.type == urdf::Joint::PLANAR ? "planar" : "floating") + ": held at its origin");
      return;
    }
    RobotJoint joint;
    joint.name = printable(source.name);
    joint.kind = source.type == urdf::Joint::PRISMATIC ? JointKind::kPrismatic : JointKind::kRevolute;
    joint.axis = vector_of(source.axis);
    const double axis_length = length(joint.axis);
    if (!(axis_length > 0 && axis_length <= kMaxImportValue)) throw ImportError(place + ": its axis has no direction");
    joint.axis = (1 / axis_length) * joint.axis;
    joint.variable = static_cast<std::uint32_t>(robot_.variables.size());
    if (!source.mimic) robot_.variables.push_back(variable_of(source, place));
    link.joint_count = 1;
    robot_.joints.push_back(joint);
    sources_.push_back(&source);
  }

  RobotVariable variable_of(const urdf::Joint& source, const std::string& place) {
    RobotVariable variable = {printable(source.name), -kPi, kPi, 0};
    if (source.type == urdf::Joint::CONTINUOUS) return variable;
    const double lower = source.limits->lower, upper = source.limits->upper;
    if (!(lower <= upper)) throw ImportError(place + ": its lower limit is above its upper limit");
    if (std::fabs(lower) <= kMaxImportValue && std::fabs(upper) <= kMaxImportValue) {
      variable.lower = lower;
      variable.upper = upper;
      if (lower > 0 || upper < 0) variable.rest = .5 * (lower + upper);
    } else if (source.type == urdf::Joint::REVOLUTE) {
      robot_.notes.push_back("joint " + variable.name + " has limits beyond 1e9: it turns freely");
    } else {
      throw ImportError(place + ": its limits are beyond 1e9 m");
    }
    return variable;
  }

  // Joints that mimic another take its variable. Those may mimic a third one.
  void resolve_mimics() {
    const auto joint_named = [&](const std::string& name) {
      const auto same = [&](const urdf::Joint* joint) { return joint->name == name; };
      return static_cast<std::size_t>(std::find_if(sources_.begin(), sources_.end(), same) - sources_.begin());
    };
    for (std::size_t j = 0; j < sources_.size(); ++j) {
      RobotJoint& joint = robot_.joints[j];
      const std::string place = text_.place_of("joint", sources_[j]->name) + ": joint " + joint.name;
      std::size_t followed = j;
      for (std::size_t steps = 0; sources_[followed]->mimic; ++steps) {
        const urdf::JointMimic& mimic = *sources_[followed]->mimic;
        if (steps == sources_.size()) throw ImportError(place + ": it mimics a joint that mimics it");
        joint.offset += joint.multiplier * mimic.offset;
        joint.multiplier *= mimic.multiplier;
        followed = joint_named(mimic.joint_name);
        if (followed == sources_.size())
          throw ImportError(place + ": it mimics " + printable(mimic.joint_name) + ", which is no joint that moves");
      }
      if (!(std::fabs(joint.multiplier) <= kMaxImportValue && std::fabs(joint.offset) <= kMaxImportValue))
        throw ImportError(place + ": its mimic has a multiplier or offset that is not a number or beyond 1e9");
      joint.variable = robot_.joints[followed].variable;
    }
  }

  // urdfdom passes over a collision element that it cannot parse. The link would lose a shape.
  void check_collisions(const urdf::Link& link) const {
    std::size_t written = 0;
    for (const tinyxml2::XMLElement* element = text_.root().FirstChildElement("link"); element != nullptr;
         element = element->NextSiblingElement("link")) {
      const char* const name = element->Attribute("name");
      if (name == nullptr || name != link.name) continue;
      for (element = element->FirstChildElement("collision"); element != nullptr;
           element = element->NextSiblingElement("collision"))
        ++written;
      break;
    }
    if (written != link.collision_array.size())
      throw ImportError(text_.place_of("link", link.name) + ": link " + printable(link.name) + ": urdfdom reads " +
                        std::to_string(link.collision_array.size()) + " of its " + std::to_string(written) +
                        " collision shapes: " + errors_);
  }

  void add_collision(std::uint32_t l, std::size_t number) {
    const urdf::Collision& collision = *order_[l]->collision_array[number];
    const std::string source = text_.place_of("link", order_[l]->name) + ": link " + robot_.body.link_names[l] +
                               ": collision " + std::to_string(number + 1);
    if (!collision.geometry) throw ImportError(source + ": it has no geometry");
    RobotShape shape;
    shape.place = motion_of(collision.origin);
    if (!in_range(shape.place)) throw ImportError(source + ": its origin is not a number or out of range");
    const urdf::Geometry& geometry = *collision.geometry;
    switch (geometry.type) {
      case urdf::Geometry::BOX:
        shape.kind = ShapeKind::kBox;
        shape.size = .5 * vector_of(static_cast<const urdf::Box&>(geometry).dim);
        break;
      case urdf::Geometry::SPHERE:
        shape.kind = ShapeKind::kSphere;
        shape.size = {static_cast<const urdf::Sphere&>(geometry).radius, 0, 0};
        break;
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
        shape.kind = ShapeKind::kCylinder;
        shape.size = {cylinder.radius, .5 * cylinder.length, 0};
        break;
      }
      case urdf::Geometry::MESH:
        if (!set_mesh(static_cast<const urdf::Mesh&>(geometry), source, shape)) return;
        break;
    }
    add_shape(robot_, l, shape, source);
  }

  // Makes the shape a hull of the mesh, or what the options say if the mesh is missing. Returns whether there is one.
  bool set_mesh(const urdf::Mesh& mesh, const std::string& source, RobotShape& shape) {
    const std::string named = source + ": mesh " + printable(mesh.filename);
    const std::string path = find_mesh(mesh.filename, text_.path(), options_, named);
    if (path.empty()) {
      if (options_.missing_mesh == MissingMesh::kRefuse)
        throw ImportError(named + ": no such file (--package NAME=DIR says where a package is, --missing-mesh what " +
                          "stands for a mesh)");
      const bool is_ball = options_.missing_mesh == MissingMesh::kBall;
      robot_.notes.push_back(named + " is missing: " + (is_ball ? "a ball stands for it" : "left out"));
      shape.kind = ShapeKind::kSphere;
      shape.size = {options_.ball_radius, 0, 0};
      return is_ball;
    }
    const auto found = meshes_.emplace(path, std::vector<Vec3>());
    if (found.second) {
      if (current_ != nullptr) current_->set(path);
      found.first->second = read_mesh(path, named);
      if (current_ != nullptr) current_->set({});
    }
    shape.kind = ShapeKind::kConvexHull;
    for (const Vec3& v : found.first->second)
      shape.vertices.push_back({mesh.scale.x * v[0], mesh.scale.y * v[1], mesh.scale.z * v[2]});
    return true;
  }

  const XmlText& text_;
  const RobotOptions& options_;
  CurrentFile* const current_;
  std::string errors_;  // what urdfdom said about a model that it read
  urdf::ModelInterfaceSharedPtr model_;
  std::vector<urdf::LinkConstSharedPtr> order_;
  std::vector<const urdf::Joint*> sources_;          // of robot_.joints
  std::map<std::string, std::vector<Vec3>> meshes_;  // by path
  Robot robot_;
};

}  // namespace

Robot read_urdf(const XmlText& text, const RobotOptions& options, CurrentFile* current) {
  check_elements(text);
  return UrdfReader(text, options, current).read();
}

std::vector<std::string> mesh_files(const XmlText& text, const RobotOptions& options) {
  std::set<std::string> names;
  for (const auto* link = text.root().FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    for (const auto* shape = link->FirstChildElement("collision"); shape;
         shape = shape->NextSiblingElement("collision")) {
      const tinyxml2::XMLElement* const geometry = shape->FirstChildElement("geometry");
      const tinyxml2::XMLElement* const mesh = geometry ? geometry->FirstChildElement("mesh") : nullptr;
      const char* const name = mesh ? mesh->Attribute("filename") : nullptr;
      if (name) names.insert(name);
    }
  std::set<std::string> files;
  for (const std::string& name : names) {
    try {
      files.insert(find_mesh(name, text.path(), options, name));
    } catch (const ImportError&) {
      continue;  // read_urdf says which link names it
    }
  }
  files.erase(std::string());
  return {files.begin(), files.end()};
}

}  // namespace cab::scenes
