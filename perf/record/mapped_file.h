// A file's bytes, mapped into memory where the system can.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::record {

class MappedFile {
 public:
  MappedFile() = default;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  // Throws Failure with the system's reason.
  void open(const std::string& path);

  const std::uint8_t* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
  std::vector<std::uint64_t> read_;  // the bytes, where they are not mapped
};

}  // namespace cab::record
