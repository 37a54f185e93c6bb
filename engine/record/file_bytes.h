// The bytes of a recording: of a file, which is read a part at a time, or of memory. A file is not mapped: a map of one
// that becomes shorter ends the program, and its bytes may change after they were checked.
#pragma once

#include <cab/span.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::record {

class FileBytes {
 public:
  FileBytes() = default;
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  ~FileBytes();

  // Opens a file, or takes memory, which must stay as it is. Throws Failure with the system's reason.
  void open(const std::string& path);
  void open(Span<const std::uint8_t> memory);

  // As they were at open.
  std::uint64_t size() const { return size_; }

  // The bytes from `at` on, at least `least` of them, which must be within size(). A file's stay until the next call.
  // Throws Failure if the file cannot be read, or has become shorter.
  Span<const std::uint8_t> from(std::uint64_t at, std::size_t least);

  // Copies `count` bytes. Throws as from().
  void copy(std::uint64_t at, std::size_t count, std::uint8_t* to) const;

  // Whether they are memory, so that what from() gives stays.
  bool is_memory() const { return memory_ != nullptr; }

 private:
  std::uint64_t size_ = 0;
  const std::uint8_t* memory_ = nullptr;
  std::vector<std::uint8_t> window_;  // of the file: what was read last
  std::uint64_t window_at_ = 0;
  [[maybe_unused]] int file_ = -1;   // where parts can be read
  std::vector<std::uint64_t> read_;  // all bytes, elsewhere
};

}  // namespace cab::record
