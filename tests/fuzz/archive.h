// The files of a tar archive, as .ci/pack_corpus packs them.
#pragma once

#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cab::fuzz {

struct ArchiveFile {
  std::string name;
  std::string bytes;
};

// The format is ustar (POSIX.1-1988), and only plain files are taken. Throws std::runtime_error, which begins with the
// archive's path, if `bytes` are cut short, or damaged elsewhere than in a file's own bytes.
inline std::vector<ArchiveFile> files_of_archive(const std::string& path, const std::string& bytes) {
  constexpr std::size_t kBlock = 512;
  std::size_t at = 0;
  const auto check = [&](bool holds, const char* fault) {
    if (!holds) throw std::runtime_error(path + ": byte " + std::to_string(at) + ": " + fault);
  };
  const auto octal = [&](std::string_view digits) {
    std::uint64_t value = 0;
    check(std::from_chars(digits.data(), digits.data() + digits.size(), value, 8).ec == std::errc(), "no octal number");
    return value;
  };
  std::vector<ArchiveFile> files;
  while (bytes.find_first_not_of('\0', at) != std::string::npos) {
    check(bytes.size() - at >= kBlock, "the header is cut short");
    const std::string_view header(bytes.data() + at, kBlock), name = header.substr(0, 100);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kBlock; ++i) sum += i >= 148 && i < 156 ? ' ' : static_cast<std::uint8_t>(header[i]);
    check(octal(header.substr(148, 8)) == sum, "the header is damaged");
    check(header.substr(257, 5) == "ustar" && header[156] == '0', "not a plain file");
    const std::uint64_t size = octal(header.substr(124, 12));
    check(size <= bytes.size() - at - kBlock, "the file is cut short");
    files.push_back({std::string(name.substr(0, name.find('\0'))), bytes.substr(at + kBlock, size)});
    at += kBlock + (size + kBlock - 1) / kBlock * kBlock;
  }
  check(at + 2 * kBlock <= bytes.size(), "the end is missing");
  return files;
}

}  // namespace cab::fuzz
