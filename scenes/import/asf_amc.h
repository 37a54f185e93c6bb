// Acclaim's motion files: a skeleton (ASF) and a motion of it (AMC), as the CMU motion capture database has them.
#pragma once

#include "scenes/import/import.h"

#include <string>

namespace cab::scenes {

// The text of a file, and its printable name for messages.
struct NamedText {
  std::string name;
  std::string text;
};

// A skeleton in the pose of the file: one frame. Joint 0 is "root". Every bone is a joint where it begins, and every
// bone without children ends in an end site, whose name is that of the bone with "/End". The frame of a joint has the
// world's axes in the rest pose. Throws ImportError with name and line.
Skeleton read_asf(const NamedText& asf, const ImportOptions& options);

// The same skeleton in motion. Every frame must have all values of all bones. The file does not say its frame rate;
// without options.frames_per_second it is 120, as in the CMU database.
Skeleton read_asf_amc(const NamedText& asf, const NamedText& amc, const ImportOptions& options);

struct AsfFile {
  std::string path;
  bool has_name_of_motion = true;  // else it is the only one in the folder
};

// The skeleton file of a motion file: in the same folder STEM.asf, or for 11_01.amc also 11.asf, or the only file there
// that ends in .asf. Throws ImportError.
AsfFile find_asf(const std::string& amc_path);

}  // namespace cab::scenes
