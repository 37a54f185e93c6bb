// `cab scan`: execs python3 -m cab_scan.
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/tools/scan/options.h"
#include "perf/tools/scan/package.h"

namespace cab::perf {
namespace {

// Not `-m cab_scan`, with which modules are looked for in the current folder first: what lies beside a stranger's files
// must not run. PYTHONSAFEPATH is for the workers, and for Python from 3.11 on; cab_scan sees to older ones.
constexpr const char* kBegin =
    "import sys; sys.path[:] = filter(None, sys.path); from cab_scan.__main__ import main; sys.exit(main())";

// The folders and those of `given`, which PYTHONPATH had, but for empty ones: they mean the current folder.
std::string python_path(const std::vector<std::filesystem::path>& places, const char* given) {
  std::string path;
  const auto add = [&path](const std::string& place) {
    if (!place.empty()) path += (path.empty() ? "" : ":") + place;
  };
  for (const std::filesystem::path& place : places) add(place.string());
  std::istringstream rest(given == nullptr ? "" : given);
  for (std::string place; std::getline(rest, place, ':');) add(place);
  return path;
}

}  // namespace

int scan_command(const ScanOptions& options) {
  const std::filesystem::path command = std::filesystem::read_symlink("/proc/self/exe");
  const std::vector<std::filesystem::path> places = find_scan_package(command);
  if (places.empty())
    throw std::runtime_error(
        "the Python package cab_scan is not beside this command: neither in ../share/cab/scan "
        "nor in the build tree");
  setenv("PYTHONPATH", python_path(places, std::getenv("PYTHONPATH")).c_str(), 1);
  setenv("PYTHONSAFEPATH", "1", 1);
  setenv("CAB_COMMAND", command.c_str(), 0);  // which reads recordings
  const std::filesystem::path module = find_installed_module(command);
  if (!module.empty()) setenv("CAB_PYTHON_MODULE", module.c_str(), 0);

  const char* const chosen = std::getenv("CAB_PYTHON");
  std::string python = chosen != nullptr && *chosen != 0 ? chosen : "python3";
  std::vector<std::string> words = {python, "-c", kBegin};
  words.insert(words.end(), options.arguments.begin(), options.arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  // Ctrl-C waits until cab_scan has its handlers: before, Python would answer it with a traceback.
  sigset_t stops, before;
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  sigprocmask(SIG_BLOCK, &stops, &before);
  execvp(python.c_str(), pointers.data());
  const int reason = errno;
  sigprocmask(SIG_SETMASK, &before, nullptr);
  throw std::runtime_error("cannot run " + python + ": " + std::strerror(reason) +
                           "; install python3, or let CAB_PYTHON name it");
}

}  // namespace cab::perf
