// Reads a file in a child process with limits.
#include "scenes/import/in_child.h"

#include "scenes/import/printable.h"

#include <exception>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

// `read`, whose every exception is an ImportError, but for those of memory.
std::string read_or_refuse(const std::string& name, const std::function<std::string()>& read) {
  try {
    return read();
  } catch (const ImportError&) { throw; } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) { throw ImportError(name + ": cannot be read: " + error.what()); }
}

}  // namespace

std::string payload_from_child(const std::string& path, const SandboxLimits& limits,
                               const std::function<std::string()>& read, const std::string& other) {
  const std::string name = printable(path) + (other.empty() ? "" : " with " + printable(other));
  std::vector<std::string> readable;
  for (const std::string& file : {path, other}) {
    if (file.empty()) continue;
    const std::filesystem::path folder = std::filesystem::path(file).parent_path();
    readable.push_back(folder.empty() ? "." : folder.string());
    readable.push_back(file);
  }
  SandboxResult result;
  try {
    result = run_sandboxed(limits, readable, [&] { return read_or_refuse(name, read); });
  } catch (const std::system_error& error) {
    throw ImportError(name + ": there is no child process to read it in: " + error.what());
  }
  switch (result.end) {
    case SandboxResult::End::kPayload: return std::move(result.bytes);
    case SandboxResult::End::kRefused: throw ImportError(printable(result.bytes));
    case SandboxResult::End::kStopped: break;
  }
  throw ImportError(name + ": reading it " + result.bytes);
}

}  // namespace cab::scenes
