#include "scenes/import/printable.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace cab::scenes {
namespace {

constexpr std::size_t kMostListed = 6;

struct Characters {
  char32_t first, last;
};
constexpr Characters kHidden[] = {{0x0, 0x1f},        {0x7f, 0x9f},       {0xad, 0xad},      {0x34f, 0x34f},
                                  {0x61c, 0x61c},     {0x115f, 0x1160},   {0x17b4, 0x17b5},  {0x180b, 0x180f},
                                  {0x200b, 0x200f},   {0x2028, 0x202e},   {0x2060, 0x206f},  {0x3164, 0x3164},
                                  {0xfe00, 0xfe0f},   {0xfeff, 0xfeff},   {0xffa0, 0xffa0},  {0xfff0, 0xfffb},
                                  {0x1bca0, 0x1bca3}, {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff}};

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

// The character of a well-formed sequence.
char32_t decoded(std::string_view sequence) {
  const auto first = static_cast<unsigned char>(sequence[0]);
  constexpr unsigned kFirstBits[] = {0, 0x7f, 0x1f, 0x0f, 0x07};  // by length
  char32_t character = first & kFirstBits[sequence.size()];
  for (const char c : sequence.substr(1)) character = character << 6 | (static_cast<unsigned char>(c) & 0x3fu);
  return character;
}

bool is_shown(char32_t c) {
  return std::none_of(std::begin(kHidden), std::end(kHidden),
                      [c](const Characters& hidden) { return hidden.first <= c && c <= hidden.last; });
}

}  // namespace

std::string printable(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const std::size_t count = sequence_length(text);
    if (count > 0 && is_shown(decoded(text.substr(0, count))))
      line += text.substr(0, count);
    else
      line += '?';
    text.remove_prefix(std::max<std::size_t>(count, 1));
  }
  return line;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t n = 0; n < std::min(names.size(), kMostListed); ++n) text += (n > 0 ? ", " : "") + names[n];
  if (names.size() > kMostListed) text += " and " + std::to_string(names.size() - kMostListed) + " more";
  return text;
}

std::string brief(const std::string& line) {
  constexpr std::size_t kMost = 280, kHead = 190, kTail = 85;
  if (line.size() <= kMost) return line;
  const auto is_inside = [&](std::size_t i) { return (static_cast<unsigned char>(line[i]) & 0xc0) == 0x80; };
  std::size_t head = kHead, tail = line.size() - kTail;
  while (is_inside(head)) --head;
  while (is_inside(tail)) ++tail;
  return line.substr(0, head) + " ... " + line.substr(tail);
}

}  // namespace cab::scenes
