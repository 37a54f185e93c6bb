#include "perf/tools/report/sorted_records.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace cab::perf {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string("cannot ") + what + " a temporary file in " +
                           std::filesystem::temp_directory_path().string() + ": " + std::strerror(errno));
}

}  // namespace

TemporaryStore::~TemporaryStore() {
  if (file_ >= 0) close(file_);
}

std::uint64_t TemporaryStore::append(const void* bytes, std::size_t count) {
  if (file_ < 0) {
    std::string name = (std::filesystem::temp_directory_path() / "cab-report-XXXXXX").string();
    file_ = mkstemp(name.data());
    if (file_ < 0) fail("make");
    unlink(name.c_str());
  }
  const std::uint64_t begin = size_;
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = pwrite(file_, from, count, static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("write");
    size_ += static_cast<std::uint64_t>(written);
    from += written;
    count -= static_cast<std::size_t>(written);
  }
  return begin;
}

void TemporaryStore::read(std::uint64_t offset, void* bytes, std::size_t count) const {
  char* to = static_cast<char*>(bytes);
  while (count > 0) {
    const ssize_t got = pread(file_, to, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail("read");
    offset += static_cast<std::uint64_t>(got);
    to += got;
    count -= static_cast<std::size_t>(got);
  }
}

}  // namespace cab::perf
