// Where the Python package cab_scan is.
#pragma once

#include <filesystem>
#include <vector>

namespace cab::perf {

// The folders for PYTHONPATH of a command: that of cab_scan, and in a build tree that of the module cab too. Empty if
// cab_scan is not beside the command.
std::vector<std::filesystem::path> find_scan_package(const std::filesystem::path& command);

// The folder of the module cab that was installed with a command; empty if there is none.
std::filesystem::path find_installed_module(const std::filesystem::path& command);

}  // namespace cab::perf
