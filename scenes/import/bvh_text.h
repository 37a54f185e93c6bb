// The text of a BVH file, checked before assimp sees it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::scenes {

enum class BvhChannel : std::uint8_t { kPositionX, kPositionY, kPositionZ, kRotationX, kRotationY, kRotationZ };

struct BvhJoint {
  std::string name;          // an end site is named after its joint, with "/End"
  std::int32_t parent = -1;  // index in BvhText::joints
  bool is_end_site = false;
  std::array<double, 3> offset = {0, 0, 0};
  std::vector<BvhChannel> channels;  // at most three positions and three rotations
  std::size_t first_value = 0;       // of this joint among the values of a frame
};

// What a file says. Lengths and angles are the file's own.
struct BvhText {
  std::vector<BvhJoint> joints;   // in file order, end sites included: a parent precedes its children
  std::size_t channel_count = 0;  // values of a frame
  std::uint32_t frame_count = 0;
  double frame_seconds = 0;
  std::vector<double> values;  // [frame][channel]
  std::vector<std::string> notes;
};

// Reads and checks the whole text; throws ImportError with path and line. Checked: the grammar, every number
// (finite, at most 1e9 in magnitude), frames >= 1, frames x channels x 2 <= bytes, frame time finite and > 0, and
// the limits of joints, depth and frames that keep assimp's recursion and everybody's memory bounded.
// bytes is changed in place, never in length, to what assimp's stricter reader understands: keywords and channels
// in assimp's case, and "_" for the blanks inside a joint's name.
BvhText check_bvh_text(std::string& bytes, const std::string& path);

}  // namespace cab::scenes
