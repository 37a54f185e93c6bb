#include "perf/base/output_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <streambuf>
#include <system_error>

#include "perf/base/signals.h"

namespace cab::perf {
namespace {

[[noreturn]] void fail(const char* what, const std::string& path, int reason) {
  throw std::runtime_error(std::string(what) + path + ": " + std::strerror(reason));
}

// A new file. What an earlier process of the same number has left is removed.
int open_new(const std::string& path) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
  const int file = open(path.c_str(), kFlags, 0666);
  if (file >= 0 || errno != EEXIST || unlink(path.c_str()) != 0) return file;
  return open(path.c_str(), kFlags, 0666);
}

}  // namespace

std::string place_of(const std::string& path) {
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40;  // as Linux follows
  std::error_code error;
  fs::path place = path;
  for (int links = 0; links < kMostLinks && fs::is_symlink(fs::symlink_status(place, error)); ++links) {
    const fs::path behind = fs::read_symlink(place, error);
    if (error) return path;
    place = place.parent_path() / behind;  // an absolute one replaces all
  }
  place = fs::absolute(place, error);
  if (!error) place = fs::weakly_canonical(place, error);
  return error ? path : place.string();
}

bool is_device(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

FileAside::FileAside(const std::string& path) : path_(path) {
  struct stat status = {};
  const bool exists = stat(path.c_str(), &status) == 0;
  if (!exists && errno != ENOENT) fail("cannot write ", path_, errno);
  if (exists && !S_ISREG(status.st_mode)) {
    if (S_ISDIR(status.st_mode)) fail("cannot write ", path_, EISDIR);
    return;
  }
  if (exists && access(path.c_str(), W_OK) != 0) fail("cannot write ", path_, errno);
  target_ = place_of(path);
  aside_ = target_ + ".new-" + std::to_string(getpid());
  remove_at_signals(aside_);  // before it exists: a signal may come at once
  const int file = open_new(aside_);
  if (file < 0) {
    const int reason = errno;
    keep_at_signals(aside_);
    fail("cannot write ", path_, reason);
  }
  if (exists) fchmod(file, status.st_mode & 07777);
  ::close(file);
}

FileAside::~FileAside() {
  if (aside_.empty()) return;
  unlink(aside_.c_str());
  keep_at_signals(aside_);
}

void FileAside::keep() {
  if (aside_.empty()) return;
  if (std::rename(aside_.c_str(), target_.c_str()) != 0) fail("cannot write ", path_, errno);
  keep_at_signals(aside_);
  aside_.clear();
}

TemporaryFile::TemporaryFile(const std::string& folder) : path_(folder + "/cab-XXXXXX") {
  // No signal comes between the file and the note to remove it.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const int file = mkostemp(path_.data(), O_CLOEXEC);
  const int reason = errno;
  if (file >= 0) remove_at_signals(path_);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (file < 0) fail("cannot write ", path_, reason);
  ::close(file);
}

TemporaryFile::~TemporaryFile() {
  unlink(path_.c_str());
  keep_at_signals(path_);
}

// Keeps the reason of the first failure, which a std::filebuf does not.
class OutputFile::Buffer : public std::streambuf {
 public:
  explicit Buffer(int file) : file_(file) { setp(bytes_.data(), bytes_.data() + bytes_.size()); }
  ~Buffer() override { close(); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  // Returns 0, or the reason of the first failure as errno has it.
  int close() {
    if (file_ < 0) return reason_;
    sync();
    if (::close(file_) != 0 && reason_ == 0) reason_ = errno;
    file_ = -1;
    return reason_;
  }

 protected:
  int_type overflow(int_type c) override {
    if (sync() != 0) return traits_type::eof();
    return traits_type::eq_int_type(c, traits_type::eof()) ? traits_type::not_eof(c)
                                                           : sputc(traits_type::to_char_type(c));
  }

  int sync() override {
    for (const char* begin = pbase(); reason_ == 0 && begin < pptr();) {
      const ssize_t written = write(file_, begin, static_cast<std::size_t>(pptr() - begin));
      if (written >= 0)
        begin += written;
      else if (errno != EINTR)
        reason_ = errno;
    }
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    return reason_ == 0 ? 0 : -1;
  }

 private:
  int file_;
  int reason_ = 0;
  std::array<char, 1 << 16> bytes_;
};

OutputFile::OutputFile(const std::string& path) : path_(path), stream_(nullptr) {
  if (path.empty()) return;
  aside_ = std::make_unique<FileAside>(path);
  const int file = open(aside_->path().c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) fail("cannot write ", path_, errno);
  buffer_ = std::make_unique<Buffer>(file);
  stream_.rdbuf(buffer_.get());
}

OutputFile::~OutputFile() = default;

void OutputFile::close() {
  if (const int reason = buffer_->close()) fail("cannot write all of ", path_, reason);
  aside_->keep();
}

}  // namespace cab::perf
