// Reads a file in a child process with limits.
#include "scenes/import/in_child.h"

#include "scenes/import/printable.h"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

constexpr std::size_t kCurrentFileBytes = 4096;

// `read`, whose every exception is an ImportError, but for those of memory.
std::string read_or_refuse(const std::string& name, const std::function<std::string()>& read) {
  try {
    return read();
  } catch (const ImportError&) { throw; } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) { throw ImportError(name + ": cannot be read: " + error.what()); }
}

}  // namespace

CurrentFile::CurrentFile() {
  void* const page = mmap(nullptr, kCurrentFileBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (page == MAP_FAILED)
    throw MachineError(std::string("no memory to share with a child process: ") + strerror(errno));
  text_ = static_cast<char*>(page);
}

CurrentFile::~CurrentFile() { munmap(text_, kCurrentFileBytes); }

void CurrentFile::set(const std::string& path) {
  const std::size_t size = std::min(path.size(), kCurrentFileBytes - 1);
  std::memcpy(text_, path.data(), size);
  text_[size] = '\0';
}

std::string CurrentFile::get() const { return {text_, strnlen(text_, kCurrentFileBytes)}; }

std::string payload_from_child(const std::string& path, const SandboxLimits& limits,
                               const std::function<std::string()>& read, const ChildFiles& more,
                               std::string& unprotected) {
  const std::string name = printable(path) + (more.other.empty() ? "" : " with " + printable(more.other));
  std::vector<std::string> readable = more.readable;
  for (const std::string& file : {path, more.other}) {
    if (file.empty()) continue;
    const std::filesystem::path folder = std::filesystem::path(file).parent_path();
    readable.push_back(folder.empty() ? "." : folder.string());
    readable.push_back(file);
    // The user named it, so it is read wherever a link of that name leads.
    std::error_code error;
    const std::filesystem::path target = std::filesystem::canonical(file, error);
    if (!error) readable.push_back(target.string());
  }
  SandboxResult result;
  try {
    result = run_sandboxed(limits, readable, [&] { return read_or_refuse(name, read); });
  } catch (const std::system_error& error) {
    throw MachineError(name + ": there is no child process to read it in: " + error.what());
  }
  unprotected = result.unprotected;
  switch (result.end) {
    case SandboxResult::End::kPayload: return std::move(result.bytes);
    case SandboxResult::End::kRefused: throw ImportError(brief(printable(result.bytes)));
    case SandboxResult::End::kStopped:
    case SandboxResult::End::kMachine: break;
  }
  const std::string current = more.current == nullptr ? std::string() : printable(more.current->get());
  const std::string words = brief(name + ": reading it " + result.bytes + (current.empty() ? "" : ", in " + current));
  if (result.end == SandboxResult::End::kMachine) throw MachineError(words);
  throw ImportError(words);
}

}  // namespace cab::scenes
