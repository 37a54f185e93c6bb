#include "perf/crowd/hit_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace cab::perf {
namespace {

// How many records are written at a time.
constexpr std::size_t kRecordsAtATime = std::size_t{1} << 15;

[[noreturn]] void fail(const std::string& what, const std::string& path, int reason) {
  throw std::runtime_error("cannot " + what + ' ' + path + ": " + std::strerror(reason));
}

}  // namespace

HitFile::HitFile(const std::string& path, std::uint64_t size) : path_(path) {
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) fail("open", path, errno);
  struct stat found;
  int reason = fstat(file_, &found) != 0 ? errno : 0;
  if (reason == 0 && static_cast<std::uint64_t>(found.st_size) < size) {
    close(file_);
    throw std::runtime_error(path + " is shorter than at the last checkpoint: " + std::to_string(found.st_size) +
                             " bytes, not " + std::to_string(size));
  }
  if (reason == 0 && ftruncate(file_, static_cast<off_t>(size)) != 0) reason = errno;
  if (reason == 0 && lseek(file_, static_cast<off_t>(size), SEEK_SET) < 0) reason = errno;
  if (reason != 0) {
    close(file_);
    fail("open", path, reason);
  }
  size_ = size;
}

HitFile::~HitFile() { close(file_); }

void HitFile::write_all(const void* data, std::size_t size) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file_, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("write", path_, errno);
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

void HitFile::append(std::uint32_t frame, Span<const Hit> hits) {
  std::vector<HitRecord> records;
  try {
    for (std::size_t first = 0; first < hits.size; first += kRecordsAtATime) {
      records.clear();
      for (std::size_t i = first; i < std::min(hits.size, first + kRecordsAtATime); ++i)
        records.push_back({frame, hits[i]});
      write_all(records.data(), records.size() * sizeof(HitRecord));
    }
  } catch (const std::runtime_error&) {
    cut_to(size_);
    throw;
  }
  size_ += hits.size * sizeof(HitRecord);
}

void HitFile::cut_to(std::uint64_t size) {
  if (ftruncate(file_, static_cast<off_t>(size)) != 0) fail("cut", path_, errno);
  if (lseek(file_, static_cast<off_t>(size), SEEK_SET) < 0) fail("cut", path_, errno);
  size_ = size;
}

void HitFile::sync() {
  if (fsync(file_) != 0) fail("write", path_, errno);
}

void replace_file(const std::string& path, const std::string& text) {
  const std::string aside = path + ".new";
  const int file = open(aside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail("open", aside, errno);
  const ssize_t written = write(file, text.data(), text.size());
  int reason = written < 0 ? errno : static_cast<std::size_t>(written) < text.size() ? ENOSPC : 0;
  if (reason == 0 && fsync(file) != 0) reason = errno;
  if (close(file) != 0 && reason == 0) reason = errno;
  if (reason == 0 && rename(aside.c_str(), path.c_str()) != 0) reason = errno;
  if (reason != 0) {
    unlink(aside.c_str());
    fail("write", path, reason);
  }
  // The new name must be on the disk too.
  const std::string folder = std::filesystem::absolute(path).parent_path().string();
  const int opened = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) fail("open", folder, errno);
  const int failed = fsync(opened) != 0 ? errno : 0;
  close(opened);
  if (failed != 0) fail("write", folder, failed);
}

}  // namespace cab::perf
