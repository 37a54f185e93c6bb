// The hits of one rank, frame after frame, in a file that can be cut back to the end of any frame.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>

namespace cab::perf {

// One hit in the file, as it lies in memory. docs/scale.md describes it.
struct HitRecord {
  std::uint32_t frame;
  Hit hit;
};
static_assert(sizeof(HitRecord) == 28, "no padding in the file");

// All failures throw std::runtime_error with the path and the system's reason.
class HitFile {
 public:
  // Opens a file, makes it if it is not there, and keeps other runs from it as long as it is open. Throws too if
  // another run has it, or if it is a symbolic link or no regular file.
  explicit HitFile(const std::string& path);
  ~HitFile();
  HitFile(const HitFile&) = delete;
  HitFile& operator=(const HitFile&) = delete;

  // Continues after the first hits of the file, and cuts off what follows them. Throws if the file does not have so
  // many hits or if hits_sum is not the sum over them (perf/base/hit_sum.h): then it is damaged.
  void go_on_behind(std::uint64_t hit_count, std::uint64_t hits_sum);

  // Appends the hits of a frame. If that fails, the file is cut back to what it was before.
  void append(std::uint32_t frame, Span<const Hit> hits);

  // Cuts the file back to an earlier size.
  void cut_to(std::uint64_t size);

  // Waits until everything is on the disk.
  void sync();

  std::uint64_t size() const { return size_; }

 private:
  std::size_t read_all(void* data, std::size_t size, std::uint64_t from) const;

  std::string path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
};

// Replaces a file by one with this text: after a crash there is either the old one or the new one, as a whole.
void replace_file(const std::string& path, const std::string& text);

}  // namespace cab::perf
