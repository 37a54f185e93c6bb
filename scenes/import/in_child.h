// Reads a file in a child process with limits, for any type of result.
#pragma once

#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/sandbox/payload.h"

#include <functional>
#include <string>
#include <vector>

namespace cab::scenes {

// The name of the file that a child reads at the moment, in memory that it shares with its parent. It is for files that
// name others: if the child is stopped, the parent can say in which.
class CurrentFile {
 public:
  // Empty. Throws MachineError if there is no memory.
  CurrentFile();
  CurrentFile(const CurrentFile&) = delete;
  CurrentFile& operator=(const CurrentFile&) = delete;
  ~CurrentFile();

  // Keeps at most the first 4095 bytes.
  void set(const std::string& path);
  std::string get() const;

 private:
  char* text_;
};

// What a child has besides its limits.
struct ChildFiles {
  std::vector<std::string> readable;     // files and folders that it can open
  const CurrentFile* current = nullptr;  // named if the child is stopped and this is not empty
  std::string other = {};                // a second file to read, named beside the first; empty: none
};

// What `read`, which reads the file at `path`, returns in a child process. The child can open only that file,
// more.other, what is below their folders, and more.readable. What `read` throws comes back as an ImportError. If the
// child crashes or breaks a limit, an ImportError says so, with the files' names; a MachineError if the machine stopped
// the child or has none. unprotected: SandboxResult::unprotected.
std::string payload_from_child(const std::string& path, const SandboxLimits& limits,
                               const std::function<std::string()>& read, const ChildFiles& more,
                               std::string& unprotected);

// What `read` returns in this process. What it refuses is told in a short line, as from a child.
template <class Read>
auto in_this_process(const Read& read) {
  try {
    return read();
  } catch (const ImportError& error) { throw ImportError(brief(printable(error.what()))); }
}

// Adds a note to results that have notes.
template <class T>
auto note_unprotected(T& result, const std::string& unprotected, int) -> decltype(result.notes.push_back({})) {
  if (!unprotected.empty())
    result.notes.push_back("it was read in a child process without " + unprotected +
                           ", which this system lacks or forbids");
}
template <class T>
void note_unprotected(T&, const std::string&, long) {}

// The same for a type of result: unpack(bytes) makes it of the bytes that `read` returns, with a PayloadReader. Its
// notes say what the child had to do without.
template <class Unpack>
auto from_child(const std::string& path, const SandboxLimits& limits, const std::function<std::string()>& read,
                Unpack unpack, const ChildFiles& more = {}) {
  std::string unprotected;
  const std::string bytes = payload_from_child(path, limits, read, more, unprotected);
  try {
    auto result = unpack(bytes);
    note_unprotected(result, unprotected, 0);
    return result;
  } catch (const PayloadError& error) {
    throw ImportError(printable(path) + ": reading it gave a damaged result: " + error.what());
  }
}

}  // namespace cab::scenes
