#include "perf/record/mapped_file.h"

#include <cerrno>
#include <cstring>

#include "perf/record/attempt.h"

#if defined(__unix__) && !defined(__EMSCRIPTEN__)
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#include <fstream>
#endif

namespace cab::record {

#if defined(__unix__) && !defined(__EMSCRIPTEN__)

void MappedFile::open(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe is told to be no file at once
  if (file < 0) throw Failure(std::strerror(errno));
  struct stat status = {};
  const int failed = fstat(file, &status) != 0 ? errno : 0;
  const bool is_file = failed == 0 && S_ISREG(status.st_mode);
  void* mapped = nullptr;
  int why = failed;
  if (is_file && status.st_size > 0) {
    mapped = mmap(nullptr, static_cast<std::size_t>(status.st_size), PROT_READ, MAP_PRIVATE, file, 0);
    why = mapped == MAP_FAILED ? errno : 0;
  }
  close(file);
  if (why != 0) throw Failure(std::strerror(why));
  if (!is_file) throw Failure("it is not a file");
  data_ = static_cast<const std::uint8_t*>(mapped);
  size_ = static_cast<std::size_t>(status.st_size);
}

MappedFile::~MappedFile() {
  if (data_ != nullptr) munmap(const_cast<std::uint8_t*>(data_), size_);
}

#else

void MappedFile::open(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw Failure("it cannot be opened for reading");
  size_ = static_cast<std::size_t>(file.tellg());
  read_.resize((size_ + 7) / 8);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(read_.data()), static_cast<std::streamsize>(size_));
  if (!file) throw Failure("it cannot be read");
  data_ = reinterpret_cast<const std::uint8_t*>(read_.data());
}

MappedFile::~MappedFile() = default;

#endif

}  // namespace cab::record
