// Files that a command writes.
#pragma once

#include <memory>
#include <ostream>
#include <string>

namespace cab::perf {

// Where a file is that a path names: after following symbolic links, also those that lead to nothing yet, and without
// "." and "..". The path itself if the system does not say.
std::string place_of(const std::string& path);

// Whether something is there that is no regular file, such as a terminal or a pipe.
bool is_device(const std::string& path);

// A new file beside the place of an older one, under a name that begins with its own: PATH.new- and the number of this
// process. keep() moves it there; until then the older file stays as it is. Without keep(), and at signals that end the
// command (perf/base/signals.h), the new file is removed. A process that is killed or crashes leaves it. What is not a
// regular file, such as a device or a pipe, is to be written directly. A failure throws std::runtime_error with the
// path and the system's reason.
class FileAside {
 public:
  explicit FileAside(const std::string& path);
  ~FileAside();
  FileAside(const FileAside&) = delete;
  FileAside& operator=(const FileAside&) = delete;

  // The path of the file to write, which is there and empty, or that of the device.
  const std::string& path() const { return aside_.empty() ? path_ : aside_; }
  void keep();

 private:
  std::string path_;
  std::string target_;  // the path after following symbolic links
  std::string aside_;   // empty: the path itself is written
};

// A new, empty file for what only this command reads, under a name of its own in a folder. It is removed at the end,
// and at signals that end the command. A failure throws std::runtime_error with the path and the system's reason.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& folder);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// A file to write, or none if the path is empty. It is opened before the work of which it holds the result, and written
// aside as FileAside has it; close() moves it to its place. A failure throws std::runtime_error with the path and the
// system's reason.
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
  std::unique_ptr<FileAside> aside_;
  std::unique_ptr<Buffer> buffer_;
  std::ostream stream_;
};

}  // namespace cab::perf
