#include "engine/record/file_bytes.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "engine/record/attempt.h"

#if defined(__unix__) && !defined(__EMSCRIPTEN__)
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#include <fstream>
#endif

namespace cab::record {
namespace {

constexpr std::size_t kWindowBytes = std::size_t{1} << 16;

}  // namespace

void FileBytes::open(Span<const std::uint8_t> memory) {
  memory_ = memory.data;
  size_ = memory.size;
}

Span<const std::uint8_t> FileBytes::from(std::uint64_t at, std::size_t least) {
  const auto left = static_cast<std::size_t>(size_ - at);
  if (memory_ != nullptr) return {memory_ + at, left};
  if (at < window_at_ || at - window_at_ > window_.size() || window_.size() - (at - window_at_) < least) {
    window_.resize(std::min(left, std::max(least, kWindowBytes)));
    window_at_ = at;
    copy(at, window_.size(), window_.data());
  }
  const auto begin = static_cast<std::size_t>(at - window_at_);
  return {window_.data() + begin, window_.size() - begin};
}

#if defined(__unix__) && !defined(__EMSCRIPTEN__)

void FileBytes::open(const std::string& path) {
  file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe is told to be no file at once
  struct stat status = {};
  if (file_ < 0 || fstat(file_, &status) != 0) throw Failure(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) throw Failure("it is not a file");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

void FileBytes::copy(std::uint64_t at, std::size_t count, std::uint8_t* to) const {
  if (memory_ != nullptr) std::copy_n(memory_ + at, count, to);
  while (memory_ == nullptr && count > 0) {
    const ssize_t got = pread(file_, to, count, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Failure(std::strerror(errno));
    if (got == 0) throw Failure("the file has become shorter since it was opened");
    at += static_cast<std::uint64_t>(got);
    to += got;
    count -= static_cast<std::size_t>(got);
  }
}

FileBytes::~FileBytes() {
  if (file_ >= 0) close(file_);
}

#else

// Windows lets nobody remove a file that is open, so it is read at once.
void FileBytes::open(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw Failure("it cannot be opened for reading");
  size_ = static_cast<std::uint64_t>(file.tellg());
  read_.resize(static_cast<std::size_t>((size_ + 7) / 8 + 1));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(read_.data()), static_cast<std::streamsize>(size_));
  if (!file) throw Failure("it cannot be read");
  memory_ = reinterpret_cast<const std::uint8_t*>(read_.data());
}

void FileBytes::copy(std::uint64_t at, std::size_t count, std::uint8_t* to) const {
  std::copy_n(memory_ + at, count, to);
}

FileBytes::~FileBytes() = default;

#endif

}  // namespace cab::record
