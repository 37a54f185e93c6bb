// Makes text from a file safe for a one-line message and for JSON.
#include "scenes/import/printable.h"

#include <algorithm>
#include <cstdint>

namespace cab::scenes {
namespace {

constexpr std::size_t kMostListed = 6;

// The number of bytes of the well-formed UTF-8 sequence at the beginning of text, or 0 if text does not begin with one.
std::size_t sequence_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t count = byte(0) < 0x80   ? 1
                            : byte(0) < 0xc2 ? 0
                            : byte(0) < 0xe0 ? 2
                            : byte(0) < 0xf0 ? 3
                            : byte(0) < 0xf5 ? 4
                                             : 0;
  if (count > text.size()) return 0;
  for (std::size_t i = 1; i < count; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  // Overlong forms, surrogates, and everything above U+10FFFF.
  if (byte(0) == 0xe0 && byte(1) < 0xa0) return 0;
  if (byte(0) == 0xed && byte(1) > 0x9f) return 0;
  if (byte(0) == 0xf0 && byte(1) < 0x90) return 0;
  if (byte(0) == 0xf4 && byte(1) > 0x8f) return 0;
  return count;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const std::size_t count = sequence_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    if (count == 0 || first < 0x20 || first == 0x7f) {
      line += '?';
      text.remove_prefix(1);
    } else {
      line += text.substr(0, count);
      text.remove_prefix(count);
    }
  }
  return line;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t n = 0; n < std::min(names.size(), kMostListed); ++n) text += (n > 0 ? ", " : "") + names[n];
  if (names.size() > kMostListed) text += " and " + std::to_string(names.size() - kMostListed) + " more";
  return text;
}

}  // namespace cab::scenes
