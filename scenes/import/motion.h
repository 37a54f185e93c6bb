// The motion of named nodes, of the file that has the meshes or of another one.
#pragma once

#include "scenes/affine.h"
#include "scenes/import/import.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cab::scenes {

struct Motion {
  std::string file;                // its name in messages
  std::vector<std::string> names;  // [node] empty if another node of the file is meant by the name
  std::vector<bool> is_moved;      // [node] whether it has a track
  double frame_seconds = 0;
  std::uint32_t frame_count = 0;
  // A node's transform in its parent's frame. It keeps alive what it reads.
  std::function<Affine(std::size_t node, std::uint32_t frame)> local;
  std::vector<double> rest_scale;   // [node] of its rest pose, in the parent's frame
  std::vector<double> scale_above;  // [node] the product over the nodes above it
  double stated_unit = 0;           // metres per unit that its file states; 0: none
  double applied_unit = 1;          // the share of it that is in the nodes' transforms already
  std::vector<std::string> notes;
  std::vector<Alteration> alterations;
};

// The joints of a file that has a skeleton alone, without end sites.
Motion motion_of_skeleton(Skeleton skeleton, const std::string& file);

// [name] the index of the other file's name that is equal, or -1. Names without an equal are compared by what follows
// their last colon, if no other name of either file ends so. Empty names match nothing.
std::vector<std::int32_t> match_names(const std::vector<std::string>& names, const std::vector<std::string>& others);

}  // namespace cab::scenes
