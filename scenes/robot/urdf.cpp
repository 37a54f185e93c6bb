// Robots from URDF, through urdfdom.
#include "scenes/robot/urdf.h"

#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/shapes.h"
#include "scenes/robot/urdf_parts.h"

#include <console_bridge/console.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Collects what urdfdom would print. The library has one handler for all threads.
class CollectErrors : public console_bridge::OutputHandler {
 public:
  CollectErrors() { console_bridge::useOutputHandler(this); }
  ~CollectErrors() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level == console_bridge::CONSOLE_BRIDGE_LOG_ERROR) add(text);
  }
  // The library may repeat itself for each link.
  void add(const std::string& text) {
    if (std::find(errors_.begin(), errors_.end(), text) != errors_.end()) return;
    if (errors_.size() < kMostErrors) {
      errors_.push_back(text);
    } else {
      ++more_;
    }
  }
  std::string errors() const {
    std::string all;
    for (const std::string& error : errors_) all += (all.empty() ? "" : "; ") + error;
    if (more_ > 0) all += "; and " + std::to_string(more_) + " more";
    return all;
  }

 private:
  static constexpr std::size_t kMostErrors = 2;
  std::vector<std::string> errors_;
  std::size_t more_ = 0;
};

// Parses the parts of a text. *errors receives what urdfdom would print.
urdf::ModelInterfaceSharedPtr parse(const XmlText& text, const UrdfParts& parts, std::string* errors) {
  CollectErrors collected;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(parts.text);
  } catch (const std::exception& error) { collected.add(error.what()); }
  const std::string all = collected.errors();
  *errors = printable(all.empty() ? "urdfdom gives no reason" : all);
  if (!model) throw ImportError(text.place_in(*errors) + ": " + *errors);
  return model;
}

Vec3 vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

RigidMotion motion_of(const urdf::Pose& pose) {
  return {normalized({pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}), vector_of(pose.position)};
}

class UrdfReader {
 public:
  UrdfReader(const XmlText& text, const RobotOptions& options, const MeshFiles& meshes, CurrentFile* current,
             LeafTriangles* triangles)
      : text_(text),
        options_(options),
        mesh_files_(meshes),
        current_(current),
        triangles_(triangles),
        parts_(urdf_parts(text)),
        model_(parse(text, parts_, &errors_)) {}

  Robot read() {
    robot_.body.name = printable(model_->getName());
    robot_.notes = parts_.notes;
    robot_.left_out.guesses = parts_.guess_count;
    add_links();
    for (std::size_t l = 0; l < order_.size(); ++l) {
      add_joint(static_cast<std::uint32_t>(l));
      check_collisions(*order_[l]);
      for (std::size_t c = 0; c < order_[l]->collision_array.size(); ++c)
        add_collision(static_cast<std::uint32_t>(l), c);
    }
    resolve_mimics();
    for (std::string& note : robot_.notes) note = brief(note);
    return std::move(robot_);
  }

 private:
  struct MeshPoints {
    std::vector<Vec3> vertices, corners;
  };

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
    link.welded = source.type == urdf::Joint::FIXED;
    if (link.welded) return;
    if (source.type == urdf::Joint::PLANAR || source.type == urdf::Joint::FLOATING) {
      link.floats = true;
      ++robot_.left_out.joints;
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
    std::string source = text_.place_of("link", order_[l]->name) + ": link " + robot_.body.link_names[l] +
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
        const bool is_capsule = parts_.capsules.count({order_[l]->name, number}) != 0;
        // A capsule whose caps meet is a ball.
        shape.kind = !is_capsule              ? ShapeKind::kCylinder
                     : cylinder.length == 0.0 ? ShapeKind::kSphere
                                              : ShapeKind::kCapsule;
        shape.size = {cylinder.radius, .5 * cylinder.length, 0};
        break;
      }
      case urdf::Geometry::MESH: {
        const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
        source += ": mesh " + printable(mesh.filename);
        if (!set_mesh(mesh, source, shape)) return;
        break;
      }
    }
    add_shape(robot_, l, shape, source);
    if (robot_.body.leaves.size() > leaf_count_) add_triangles(shape, triangles_);
    leaf_count_ = robot_.body.leaves.size();
  }

  // Makes the shape a hull of the mesh, or what the options say if the mesh is missing. Returns whether there is one.
  bool set_mesh(const urdf::Mesh& mesh, const std::string& source, RobotShape& shape) {
    const auto file = mesh_files_.find(mesh.filename);
    if (file == mesh_files_.end()) {
      check_mesh_name(mesh.filename, source);
      if (options_.missing_mesh == MissingMesh::kRefuse)
        throw ImportError(source + ": no such file (--package NAME=DIR says where a package is, --missing-mesh what " +
                          "stands for a mesh)");
      const bool is_ball = options_.missing_mesh == MissingMesh::kBall;
      ++(is_ball ? robot_.left_out.guesses : robot_.left_out.shapes);
      robot_.notes.push_back(source + " is missing: " + (is_ball ? "a ball stands for it" : "left out"));
      shape.kind = ShapeKind::kSphere;
      shape.size = {options_.ball_radius, 0, 0};
      return is_ball;
    }
    const std::string& path = file->second;
    if (mesh.scale.x == 0 || mesh.scale.y == 0 || mesh.scale.z == 0) {
      leave_out_empty(robot_, source);
      return false;
    }
    const auto found = meshes_.emplace(path, MeshPoints());
    MeshPoints& points = found.first->second;
    if (found.second) {
      if (current_ != nullptr) current_->set(path);
      points.vertices = read_mesh(path, source, robot_.notes, triangles_ == nullptr ? nullptr : &points.corners);
      if (current_ != nullptr) current_->set({});
    }
    shape.kind = ShapeKind::kConvexHull;
    const auto scaled = [&mesh](const Vec3& v) {
      return Vec3{mesh.scale.x * v[0], mesh.scale.y * v[1], mesh.scale.z * v[2]};
    };
    for (const Vec3& vertex : points.vertices) shape.vertices.push_back(scaled(vertex));
    for (const Vec3& corner : points.corners) shape.corners.push_back(scaled(corner));
    return true;
  }

  const XmlText& text_;
  const RobotOptions& options_;
  const MeshFiles& mesh_files_;
  CurrentFile* const current_;
  LeafTriangles* const triangles_;
  std::size_t leaf_count_ = 0;
  UrdfParts parts_;
  std::string errors_;  // what urdfdom said about a model that it read
  urdf::ModelInterfaceSharedPtr model_;
  std::vector<urdf::LinkConstSharedPtr> order_;
  std::vector<const urdf::Joint*> sources_;   // of robot_.joints
  std::map<std::string, MeshPoints> meshes_;  // by path
  Robot robot_;
};

}  // namespace

Robot read_urdf(const XmlText& text, const RobotOptions& options, const MeshFiles& meshes, CurrentFile* current,
                LeafTriangles* triangles) {
  return UrdfReader(text, options, meshes, current, triangles).read();
}

MeshFiles find_meshes(const XmlText& text, const RobotOptions& options, const std::vector<std::string>& package_files) {
  MeshFinder finder(text.path(), options, package_files);
  MeshFiles files;
  for (const auto* link = text.root().FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    for (const auto* shape = link->FirstChildElement("collision"); shape;
         shape = shape->NextSiblingElement("collision")) {
      const tinyxml2::XMLElement* const geometry = shape->FirstChildElement("geometry");
      const tinyxml2::XMLElement* const mesh = geometry ? geometry->FirstChildElement("mesh") : nullptr;
      const char* const name = mesh ? mesh->Attribute("filename") : nullptr;
      if (!name || files.count(name) != 0) continue;
      if (const std::string file = finder.find(name); !file.empty()) files.emplace(name, file);
    }
  return files;
}

}  // namespace cab::scenes
