// Bytes of files that a user names.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace cab::scenes {

// Whether there is a regular file at a path.
bool is_file(const std::filesystem::path& path);

// The size of a file in bytes. It must be regular, not empty and at most kMaxFileBytes long; otherwise throws
// ImportError. `name` is how messages name the file.
std::size_t check_file(const std::string& path, const std::string& name);

// The first `size` bytes of a file, or the whole file if it has become shorter. Throws ImportError.
std::string read_bytes(const std::string& path, const std::string& name, std::size_t size);

// The whole of a text file as check_file takes it, without the byte order mark of UTF-8 that it may begin with. Throws
// ImportError.
std::string read_text(const std::string& path, const std::string& name);

// The extension of a path in lower case, with its dot; empty if there is none.
std::string lower_extension(const std::string& path);

}  // namespace cab::scenes
