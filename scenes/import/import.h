// Skeletal animation from files. A clip becomes a character of ellipsoids between joints. Clips become a scene on one
// clock in one world.
#pragma once

#include "scenes/rig/body_changes.h"
#include "scenes/scene.h"

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::scenes {

// Bad data in a file. what() is one line that names the file, the line or element, and the reason.
class ImportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ImportOptions {
  double metres_per_unit = 1.0;              // the file's length unit in metres
  std::array<double, 3> offset = {0, 0, 0};  // added to the character's place in the world, metres
  char up = 0;                               // 'x', 'y' or 'z' for the height check; 0: the tallest axis
  BodyOptions bodies;                        // stature in metres, thickness
  std::vector<BodyChange> body_changes;      // made to the guessed bodies
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
  bool is_static = false;         // the file has no animation: one frame, the rest pose
  std::vector<std::string> notes;
};

// Reads the skeleton and the first animation of a file through assimp. The text of a BVH file is checked first. Throws
// ImportError.
Skeleton import_skeleton(const std::string& path, const ImportOptions& options);

// One clip: a character and its own clock. The character has poses and origins for every frame of the file, or for one
// frame if it is static.
struct Clip {
  Character character;
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  std::vector<std::string> notes;
  SkeletonBodies bodies;  // of the skeleton's joints; empty if the clip was not made from a skeleton
};

// Makes links from a skeleton. Each joint with a body makes one link: with a bone to a child joint or an end site, with
// a cap at an end of the figure, or with a ball (scenes/rig/skeleton_bodies.h). The link has the joint's name, moves
// with it, and has its frame there. If several links have no link above them, the last joint above them all is a link
// too. Each link has one leaf box about all of its bodies. Links that share a joint are ignored pairs. Poses are
// relative to an origin in double: the place of the first link's joint plus options.offset. notes says what was merged,
// dropped, added or doubted. Throws ImportError.
Clip make_clip(const Skeleton& skeleton, const std::string& name, const ImportOptions& options);

// import_skeleton, then make_clip. The name of the character is that of the file, without its folders.
Clip import_clip(const std::string& path, const ImportOptions& options);

// Puts clips on one clock, which has the smallest of their frame times. Every clip shows its nearest earlier frame, and
// each frame lasts until the next. The scene ends with the shortest clip. Static clips stand in all frames. Throws
// ImportError if the scene would not fit in memory, and std::invalid_argument without clips.
Scene make_world(std::vector<Clip> clips);

}  // namespace cab::scenes
