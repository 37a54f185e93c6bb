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
  std::size_t first_value = 0;       // index of this joint's first value among the values of a frame
};

// The contents of a file. Lengths and angles are in the file's units.
struct BvhText {
  std::vector<BvhJoint> joints;   // in file order, end sites included: a parent precedes its children
  std::size_t channel_count = 0;  // values of a frame
  std::uint32_t frame_count = 0;
  double frame_seconds = 0;
  std::vector<double> values;  // [frame][channel]
  std::vector<std::string> notes;
};

// Reads and checks the whole text. Throws ImportError with path and line. It checks the grammar, every number (finite,
// at most 1e9 in magnitude), frames >= 1, frames x channels x 2 <= bytes, frame time finite and > 0, and the limits of
// joints, depth and frames that bound assimp's recursion and the memory in use. Frames may be wrapped over lines, but a
// frame that begins a line must end one, unless no frame does. What begins with # or // is a comment up to the end of
// its line. The bytes become what assimp's stricter reader understands: a hierarchy of the same joints and channels,
// and the file's own values.
BvhText check_bvh_text(std::string& bytes, const std::string& path);

}  // namespace cab::scenes
