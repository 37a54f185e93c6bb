// A robot: rigid links, the joints that move them, and their collision shapes, from URDF or MJCF.
#pragma once

#include "scenes/import/import.h"
#include "scenes/scene.h"
#include "scenes/vec3d.h"

#include <cab/kinematics.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cab::scenes {

// A rigid motion: it takes the point x to rotate(rotation, x) + translation.
struct RigidMotion {
  Quat rotation = {0, 0, 0, 1};
  Vec3 translation = {0, 0, 0};
};

// A number of a joint state, with its limits: radians or metres.
struct RobotVariable {
  std::string name;
  double lower = 0;
  double upper = 0;
  double rest = 0;
};

inline bool is_beyond_limits(const RobotVariable& variable, double value) {
  return value < variable.lower || value > variable.upper;
}

// A joint that moves. Its value is multiplier * variable + offset, so joints may follow the variable of another.
struct RobotJoint {
  std::string name;
  JointKind kind = JointKind::kRevolute;
  Vec3 axis = {0, 0, 1};    // unit vector in the frame of its link
  Vec3 anchor = {0, 0, 0};  // the point of its link about which it turns, in the link's frame
  std::uint32_t variable = 0;
  double multiplier = 1;
  double offset = 0;
};

// How a link stands to its parent.
struct RobotLink {
  RigidMotion place;  // in the parent's frame, before its joints move it
  std::uint32_t first_joint = 0;
  std::uint32_t joint_count = 0;  // applied in order, each in the frame that those before leave
  bool floats =
      false;  // the file's joint is free, floating or planar: held where it is, and no neighbour of the parent
  bool welded = false;  // no joint of the file lets it move against its parent: they are one rigid body
};

// Counts of what a file has and the robot has not, or not so. Each has a note.
struct LeftOut {
  std::uint32_t shapes = 0;   // of size 0, of a missing mesh, or of a kind that is not tested
  std::uint32_t joints = 0;   // that move, and are held where they are
  std::uint32_t guesses = 0;  // of what the file does not say
};

// Pairs of links by MuJoCo's rules, which for MJCF stand for adjacent_pairs (scenes/robot/adjacency.h). Links that
// no joint moves against each other are one rigid body.
struct MujocoPairs {
  std::vector<LinkPair> welded;    // of one rigid body, or of two that no joint moves
  std::vector<LinkPair> adjacent;  // of a rigid body and the one above it, unless that is the world
  std::vector<LinkPair> listed;    // in a <pair>: tested whatever else holds, and in neither of the others
};

// A robot as read from a file. Lengths are in metres. The frame of the robot is that of its first link.
struct Robot {
  Character body;  // names, links, leaves (one per collision shape) and the pairs that the file excludes; no poses
  std::vector<RobotLink> links;  // as many as in body.link_parents
  std::vector<RobotJoint> joints;
  std::vector<RobotVariable> variables;
  std::vector<std::string> leaf_sources;  // where the shape of each leaf is written, for messages; of a leaf of
                                          // triangles, where its first mesh is
  LeftOut left_out;
  std::vector<std::string> notes;     // what was left out, held still or guessed
  std::optional<MujocoPairs> mujoco;  // of MJCF
};

// What becomes of a mesh that a URDF file names and that is not there.
enum class MissingMesh : std::uint8_t {
  kRefuse,    // the robot is refused
  kLeaveOut,  // the link loses this shape
  kBall,      // a ball about the origin of the mesh
};

struct RobotOptions {
  std::vector<std::pair<std::string, std::string>> packages;  // name and folder, for package:// and model:// paths
  MissingMesh missing_mesh = MissingMesh::kRefuse;
  double ball_radius = 0;                  // metres, with kBall
  std::vector<std::string> ignored_words;  // elements and attributes of MJCF that are not read: passed over
  std::string root;                        // a folder whose meshes and MJCF files an MJCF file may name; empty: none
  bool surface = false;                    // meshes become leaves of their triangles; false: convex hulls
  std::uint32_t leaves_per_link = 1;       // of a mesh: hulls at most, 1 to 64; unread with surface
  std::optional<SandboxLimits> sandbox;    // read the robot in a child process with these limits; empty: in this one
};

// Reads a robot. The first element of the file tells the format: <robot> is URDF and <mujoco> is MJCF. Meshes become
// convex hulls, with options.leaves_per_link above 1 those of cut_meshes (scenes/robot/pieces.h), or with
// options.surface what take_surfaces (scenes/robot/surface.h) makes. A mesh with a relative path
// is looked for from the file's folder. A path package://NAME/REST is looked for in the folder that options.packages
// gives for NAME; else in a folder NAME that contains the file or stands beside one that does, in a folder there or
// below ROS_PACKAGE_PATH whose package.xml says NAME, and where AMENT_PREFIX_PATH and ROS_PACKAGE_PATH have a folder
// NAME. Throws ImportError: one line that names the file, the line or element, and the reason.
//
// With options.sandbox, a first child process finds the files that the robot's file names, and a second one reads it.
// The first can open what is below the file's folder and files package.xml (scenes/robot/packages.h). The second can
// open what is below the file's folder, and for URDF the meshes and what is below their folders, for MJCF the meshes
// and included files that may_open_for_mjcf (scenes/robot/mjcf_tree.h) allows.
Robot import_robot(const std::string& path, const RobotOptions& options);

// The files that import_robot opens beside the one at `path`, if they are there: meshes, included files, and folders of
// meshes. Throws ImportError.
std::vector<std::string> companion_files(const std::string& path, const RobotOptions& options);

// The triangles of each leaf of a robot, as its file has them: x y z of three corners each, in the frame of the leaf's
// link. Of a leaf that is no mesh there are none.
using LeafTriangles = std::vector<std::vector<float>>;

// Reads the triangles of the robot that import_robot reads from the same path with the same options, whose `surface`
// and leaves_per_link have no effect. Throws ImportError.
LeafTriangles import_triangles(const std::string& path, const RobotOptions& options);

// What an SRDF file disables.
struct DisabledPairs {
  std::vector<LinkPair> pairs;     // each with the lower index first, sorted, once
  std::vector<std::string> notes;  // another robot's name, links that the robot lacks, elements about collisions that
                                   // are not read
};

// Reads an SRDF file of a robot, with `sandbox` in a child process. A pair is disabled by disable_collisions, or by
// disable_default_collisions of one of its links unless enable_collisions names the pair, as by srdfdom since 0.6.3.
// Throws ImportError.
DisabledPairs read_disabled_pairs(const std::string& path, const Robot& robot,
                                  const std::optional<SandboxLimits>& sandbox);

// Whether this build reads MJCF.
bool reads_mjcf();

}  // namespace cab::scenes
