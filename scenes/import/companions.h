// The files that a motion file is read with.
#pragma once

#include "scenes/sandbox/sandbox.h"

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// Of an AMC file its skeleton (find_asf), of a glTF file the files of its buffers, of an MD5 file the mesh or the
// animation of the same name. Files that are not there may be among them. With `sandbox` the file is read in a child
// process. Throws ImportError if it cannot be read, or is no glTF.
std::vector<std::string> companion_files(const std::string& path, const std::optional<SandboxLimits>& sandbox);

}  // namespace cab::scenes
