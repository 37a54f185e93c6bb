// Skeletal animation from files. A clip becomes a character of ellipsoids between joints. Clips become a scene on one
// clock in one world.
#pragma once

#include "scenes/import/import_report.h"
#include "scenes/rig/body_changes.h"
#include "scenes/sandbox/sandbox.h"
#include "scenes/scene.h"

#include <cab/skin.h>

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::scenes {

// Bad data in a file. what() is one line that names the file, the line or element, and the reason.
class ImportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The machine is at fault, not the file: it killed the process that read, or had no memory or no process for it.
// Another try may succeed.
class MachineError : public ImportError {
 public:
  using ImportError::ImportError;
};

// How bodies are made of a file's meshes: rig::BodyRules, with joints by name; or as leaves of triangles.
struct SkinOptions {
  bool surface = false;  // rig::surface_from_skin by its default rules; the other members have no effect then
  std::uint32_t kinds = rig::kHullBody;
  std::uint32_t leaves_per_link = 1;
  bool inflate = false;
  std::vector<std::string> kept_joints;  // empty: by reach
  double least_reach = 0;                // metres
};

// Another file, whose nodes move those of the same name.
struct MotionFile {
  std::string path;
  double metres_per_unit = 0;  // its length unit in metres; 0: as it says, or that of the file that it moves
};

struct ImportOptions {
  std::optional<double> metres_per_unit;     // the file's length unit in metres; empty: as the file says, or 1
  bool guesses_unit = false;                 // without metres_per_unit: one that makes a person, if nothing else does
  std::array<double, 3> offset = {0, 0, 0};  // added to the character's place in the world, metres
  char up = 0;                               // 'x', 'y' or 'z' for the height check; 0: the tallest axis
  std::optional<SandboxLimits> sandbox;      // read the file in a child process with these limits; empty: in this one
  std::optional<MotionFile> motion;          // where the motion is; empty: in the file
  std::string animation;                     // name or number from 0 of the motion's animation; empty: the first
  std::optional<SkinOptions> skin;           // bodies are made of the file's meshes; empty: of its skeleton
  BodyOptions bodies;                        // stature in metres, thickness; of bodies of the skeleton
  std::vector<BodyChange> body_changes;      // made to the guessed bodies of the skeleton
  double frames_per_second = 0;              // of files that do not say it (AMC); 0: 120
};

// The meshes of a file: the arrays of rig::Skin, with inverse bind matrices that take points to metres. Empty if they
// are not asked for.
struct FileSkin {
  std::vector<float> vertices;
  std::vector<std::uint32_t> triangles;
  std::uint32_t influence_count = 0;
  std::vector<std::uint32_t> influence_bones;
  std::vector<float> influence_weights;
  std::vector<float> inverse_bind;
  std::vector<std::uint32_t> bone_joints;
  std::vector<std::uint32_t> bone_meshes;  // of mesh_names
  std::vector<std::string> mesh_names;
  // [frame][joint][6] what is left of a joint's world matrix before its rotation, an upper triangle: xx xy yy xz yz zz.
  // It scales, shears and mirrors.
  std::vector<float> stretches;
};

// The skeleton of a file: every joint, end sites included, and its world position in every frame. Joint 0 is the root,
// and every other joint comes after its parent. The name of an end site of a BVH file is that of its joint with "/End".
struct Skeleton {
  std::vector<std::string> joint_names;
  std::vector<std::int32_t> joint_parents;
  std::vector<bool> is_end_site;
  std::vector<double> rest_offsets;  // [joint][3] metres, in the parent joint's frame
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  std::vector<double> rotations;  // [frame][joint][4] world quaternion x y z w
  std::vector<double> positions;  // [frame][joint][3] world, metres, without the offset
  bool is_static = false;         // it has one frame, whose pose holds in all frames of a scene
  FileSkin skin;
  LengthUnit unit;
  std::vector<std::string> notes;
  std::vector<Alteration> alterations;
};

// Reads the skeleton, one animation and, if options.skin is given, the meshes of a file through assimp. The text of a
// BVH file is checked first, and so are the offsets and counts of a glTF file. ASF and AMC are read without assimp
// (scenes/import/asf_amc.h).
//
// With options.motion every node of the file has, in each frame of the motion, the transform in its parent's frame that
// the node of the same name has there, moved or not. Names are compared as they are, then by what follows the last
// colon. Nodes that the motion lacks keep their rest pose, and a note says which joints these are. The motion must have
// an animation and one joint at least. The file may not be BVH, ASF or AMC, which have no more than their own motion.
//
// Throws ImportError. With options.sandbox nothing in the file can do more than cause one:
// see scenes/sandbox/sandbox.h. Without it, assimp does not survive some files.
Skeleton import_skeleton(const std::string& path, const ImportOptions& options);

// One clip: a character and its own clock. The character has poses and origins for every frame of the file, or for one
// frame if it is static.
struct Clip {
  Character character;
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  std::optional<rig::Coverage> coverage;    // of solids made of meshes; lengths in metres, poses are frames
  std::optional<rig::SurfaceInfo> surface;  // of meshes whose triangles are in leaves; the same
  std::vector<std::string> notes;
  std::vector<Alteration> alterations;
  LengthUnit unit;
  std::string size_doubt;   // empty: the figure has the size of a person
  SkeletonBodies bodies;    // of the skeleton's joints; empty if the clip was not made from a skeleton
  char up = 0;              // ImportOptions::up, or the axis along which the figure is tallest
  bool is_upright = false;  // a person, by its joints' names, far longer along `up` than along the other axes
};

// Makes links from a skeleton. If options.skin is given, bodies are those of the file's meshes, as
// scenes/import/skin_clip.h says. Otherwise each joint with a body makes one link: with a bone to a child joint or an
// end site, with a cap at an end of the figure, or with a ball (scenes/rig/skeleton_bodies.h). The link has the joint's
// name, moves with it, and has its frame there. If several links have no link above them, the last joint above them all
// is a link too. Each link has one leaf box about all of its bodies. Links that share a joint are ignored pairs. Poses
// are relative to an origin in double: the place of the first link's joint plus options.offset. notes says what was
// merged, dropped, added or doubted. Throws ImportError.
Clip make_clip(const Skeleton& skeleton, const std::string& name, const ImportOptions& options);

// import_skeleton, then make_clip. The name of the character is that of the file, without its folders.
Clip import_clip(const std::string& path, const ImportOptions& options);

// Puts clips on one clock, which has the smallest of their frame times. Every clip shows its nearest earlier frame, and
// each frame lasts until the next. The scene ends with the shortest clip; notes say what it cuts off the others. Static
// clips stand in all frames. `report`, if it is not null, receives what import did to the files. Throws ImportError if
// the scene would not fit in memory, and std::invalid_argument without clips.
Scene make_world(std::vector<Clip> clips, ImportReport* report = nullptr);

}  // namespace cab::scenes
