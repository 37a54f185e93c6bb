// Files that a command writes.
#pragma once

#include <memory>
#include <ostream>
#include <string>

namespace cab::perf {

// A file to write, or none if the path is empty. It is opened before the work of which it holds the result, and written
// beside its place, under a name that begins with its own. close() moves it there. Until then an older file of that
// name stays as it is. Without close(), and at signals that end the command, the new file is removed. What is not a
// regular file, such as a device or a pipe, is written directly. A failure throws std::runtime_error with the path and
// the system's reason.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // False if the path is empty. Then there is nothing to write to or to close.
  explicit operator bool() const { return buffer_ != nullptr; }
  std::ostream& stream() { return stream_; }
  void close();

 private:
  class Buffer;
  std::string path_;
  std::string target_;  // the path behind symbolic links
  std::string aside_;   // empty: the target itself is written
  std::unique_ptr<Buffer> buffer_;
  std::ostream stream_;
};

}  // namespace cab::perf
