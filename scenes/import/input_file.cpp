// Bytes of files that a user names.
#include "scenes/import/input_file.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/words.h"

#include <filesystem>
#include <fstream>

namespace cab::scenes {

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

std::size_t check_file(const std::string& path, const std::string& name) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) throw ImportError(name + ": no such file");
  if (error) throw ImportError(name + ": " + error.message());
  if (status.type() == std::filesystem::file_type::directory) throw ImportError(name + ": is a directory, not a file");
  if (status.type() != std::filesystem::file_type::regular) throw ImportError(name + ": is not a regular file");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw ImportError(name + ": " + error.message());
  if (size == 0) throw ImportError(name + ": the file is empty");
  if (size > kMaxFileBytes)
    throw ImportError(name + ": the file is larger than " + std::to_string(kMaxFileBytes >> 20) + " MiB");
  return static_cast<std::size_t>(size);
}

std::string read_bytes(const std::string& path, const std::string& name, std::size_t size) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ImportError(name + ": cannot be opened for reading");
  std::string bytes(size, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  if (file.bad()) throw ImportError(name + ": cannot be read");
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::string read_text(const std::string& path, const std::string& name) {
  std::string text = read_bytes(path, name, check_file(path, name));
  if (text.compare(0, 3, "\xef\xbb\xbf") == 0) text.erase(0, 3);
  return text;
}

std::string lower_extension(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

}  // namespace cab::scenes
