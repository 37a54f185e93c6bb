#include "perf/measure/crowd/hit_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "perf/base/hit_sum.h"

namespace cab::perf {
namespace {

// How many records are written at a time.
constexpr std::size_t kRecordsAtATime = std::size_t{1} << 15;

[[noreturn]] void fail(const std::string& what, const std::string& path, int reason) {
  throw std::runtime_error("cannot " + what + ' ' + path + ": " + std::strerror(reason));
}

void write_all(int file, const std::string& path, const void* data, std::size_t size) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("write", path, errno);
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace

HitFile::HitFile(const std::string& path) : path_(path) {
  // Without O_NONBLOCK a pipe of this name would keep the run waiting.
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
  if (file_ < 0 && errno == ELOOP) throw std::runtime_error(path + " is a symbolic link, which is not followed");
  if (file_ < 0) fail("open", path, errno);
  try {
    struct stat found;
    if (fstat(file_, &found) != 0) fail("open", path, errno);
    if (!S_ISREG(found.st_mode)) throw std::runtime_error(path + " is no regular file");
    if (flock(file_, LOCK_EX | LOCK_NB) == 0) return;
    if (errno == EWOULDBLOCK)
      throw std::runtime_error("another run writes to " + path + "; wait for its end, or choose another folder");
    fail("lock", path, errno);
  } catch (const std::runtime_error&) {
    close(file_);
    throw;
  }
}

void HitFile::go_on_behind(std::uint64_t hit_count, std::uint64_t hits_sum) {
  std::uint64_t sum = 0, read = 0;
  std::vector<HitRecord> records(static_cast<std::size_t>(std::min<std::uint64_t>(hit_count, kRecordsAtATime)));
  while (read < hit_count) {
    const std::size_t wanted =
        static_cast<std::size_t>(std::min<std::uint64_t>(hit_count - read, records.size())) * sizeof(HitRecord);
    const std::size_t found = read_all(records.data(), wanted, read * sizeof(HitRecord));
    if (found < wanted)
      throw std::runtime_error(
          path_ + " is shorter than at the last checkpoint: " + std::to_string(read * sizeof(HitRecord) + found) +
          " bytes, not " + std::to_string(hit_count * sizeof(HitRecord)));
    for (std::size_t i = 0; i < wanted / sizeof(HitRecord); ++i) sum += hit_number(records[i].frame, records[i].hit);
    read += wanted / sizeof(HitRecord);
  }
  if (sum != hits_sum)
    throw std::runtime_error(path_ + " is damaged: its hits are not those of the last checkpoint; restore it, or " +
                             "choose another folder");
  cut_to(hit_count * sizeof(HitRecord));
}

HitFile::~HitFile() { close(file_); }

// Returns how many bytes there are, fewer than `size` at the end of the file.
std::size_t HitFile::read_all(void* data, std::size_t size, std::uint64_t from) const {
  auto* const to = static_cast<char*>(data);
  std::size_t have = 0;
  while (have < size) {
    const ssize_t count = pread(file_, to + have, size - have, static_cast<off_t>(from + have));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("read", path_, errno);
    if (count == 0) break;
    have += static_cast<std::size_t>(count);
  }
  return have;
}

void HitFile::append(std::uint32_t frame, Span<const Hit> hits) {
  std::vector<HitRecord> records;
  try {
    for (std::size_t first = 0; first < hits.size; first += kRecordsAtATime) {
      records.clear();
      for (std::size_t i = first; i < std::min(hits.size, first + kRecordsAtATime); ++i)
        records.push_back({frame, hits[i]});
      write_all(file_, path_, records.data(), records.size() * sizeof(HitRecord));
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
  // What a run that was killed has left, or a link of this name, goes: nothing is written through it.
  const std::string aside = path + ".new";
  unlink(aside.c_str());
  const int file = open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) fail("open", aside, errno);
  try {
    write_all(file, path, text.data(), text.size());
  } catch (const std::runtime_error&) {
    close(file);
    unlink(aside.c_str());
    throw;
  }
  int reason = fsync(file) != 0 ? errno : 0;
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
