// Where the Python package cab_scan is.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace cab::perf {

// The folders for PYTHONPATH of a command: that of cab_scan, and in a build tree that of the module cab too. Empty if
// cab_scan is not beside the command.
std::vector<std::filesystem::path> find_scan_package(const std::filesystem::path& command);

}  // namespace cab::perf
