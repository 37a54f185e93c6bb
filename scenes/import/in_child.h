// Reads a file in a child process with limits, for any type of result.
#pragma once

#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/sandbox/payload.h"

#include <functional>
#include <string>

namespace cab::scenes {

// What `read`, which reads the file at `path`, returns in a child process. The child can open only that file, `other`
// if it is not empty, and what is below their folders. What `read` throws comes back as an ImportError. If the child
// crashes, breaks a limit or cannot be made, an ImportError says so, with the files' names.
std::string payload_from_child(const std::string& path, const SandboxLimits& limits,
                               const std::function<std::string()>& read, const std::string& other = {});

// The same for a type of result: unpack(bytes) makes it of the bytes that `read` returns, with a PayloadReader.
template <class Unpack>
auto from_child(const std::string& path, const SandboxLimits& limits, const std::function<std::string()>& read,
                Unpack unpack, const std::string& other = {}) {
  const std::string bytes = payload_from_child(path, limits, read, other);
  try {
    return unpack(bytes);
  } catch (const PayloadError& error) {
    throw ImportError(printable(path) + ": reading it gave a damaged result: " + error.what());
  }
}

}  // namespace cab::scenes
