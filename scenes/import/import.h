// Skeletal animation from files: a clip becomes a character of ellipsoids between joints; clips become a scene
// on one clock in one world.
#pragma once

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
  char up = 0;                               // 'x', 'y' or 'z' for the height check; 0 = the tallest axis
};

// A skeleton as the file has it: every joint, end sites included, and its world position in every frame. Joint 0
// is the root, every other joint comes after its parent. An end site of a BVH file is named after its joint, with
// "/End".
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

// Reads one file's skeleton and its first animation: BVH from its checked text through assimp, everything else
// through assimp. Throws ImportError.
Skeleton import_skeleton(const std::string& path, const ImportOptions& options);

// One clip: the character (poses and origins for every frame of the file; one of each if it is static) and its
// own clock.
struct Clip {
  Character character;
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  std::vector<std::string> notes;
};

// Skeleton to links: one link a joint with a non-zero segment (to a child joint or end site), named after the joint
// and rigid with it; its frame sits at the joint. A segment below a ten-thousandth of the figure's height counts as
// zero. If several links have no link above them, the root joint gets a link of its own, a ball. Each segment is an
// ellipsoid along the bone with anthropometric thickness (body_parts.h); each link has one leaf box about all of its
// ellipsoids. Links that meet at a joint are ignored pairs. Poses are relative to an origin in double: the root
// joint's place plus options.offset. notes says what was merged, dropped or doubted. Throws ImportError.
Clip make_clip(const Skeleton& skeleton, const std::string& name, const ImportOptions& options);

// import_skeleton, then make_clip; the character is named after the file, without its folders.
Clip import_clip(const std::string& path, const ImportOptions& options);

// Puts clips on one clock: the smallest frame time; every clip shows its nearest earlier frame, each frame lasting
// until the next; the end of the shortest clip ends the scene. Static clips hold for all frames. Throws
// ImportError when the scene would not fit in memory, std::invalid_argument without clips.
Scene make_world(std::vector<Clip> clips);

}  // namespace cab::scenes
