// `cab scan`: becomes Python with the package cab_scan.
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "perf/scan/options.h"
#include "perf/scan/package.h"

namespace cab::perf {

int scan_command(const ScanOptions& options) {
  const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe");
  const std::vector<std::filesystem::path> places = find_scan_package(command);
  if (places.empty())
    throw std::runtime_error(
        "the Python package cab_scan is not beside this command: neither in ../share/cab/scan "
        "nor in the build tree");
  std::string path;
  for (const std::filesystem::path& place : places) path += place.string() + ":";
  if (const char* const given = std::getenv("PYTHONPATH")) path += given;
  if (path.back() == ':') path.pop_back();
  setenv("PYTHONPATH", path.c_str(), 1);
  setenv("CAB_COMMAND", command.c_str(), 0);  // which reads recordings

  const char* const chosen = std::getenv("CAB_PYTHON");
  std::string python = chosen != nullptr && *chosen != 0 ? chosen : "python3";
  std::vector<std::string> words = {python, "-m", "cab_scan"};
  words.insert(words.end(), options.arguments.begin(), options.arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  execvp(python.c_str(), pointers.data());
  throw std::runtime_error("cannot run " + python + ": " + std::strerror(errno) +
                           "; install python3, or let CAB_PYTHON name it");
}

}  // namespace cab::perf
