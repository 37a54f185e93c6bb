#include "scenes/import/words.h"

#include <algorithm>

namespace cab::scenes {
namespace {

constexpr std::string_view kBlanks = " \t\r\f\v";

std::string_view without_blanks(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

}  // namespace

void split_line(std::string_view line, std::vector<std::string_view>& words) {
  words.clear();
  line = without_blanks(line);
  const bool has_commas = line.find_first_of(",;") != std::string_view::npos;
  const std::string_view separators = has_commas ? ",;" : kBlanks;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(separators), line.size());
    words.push_back(without_blanks(line.substr(0, end)));
    line.remove_prefix(std::min(end + 1, line.size()));
    if (!has_commas) line = without_blanks(line);
  }
}

std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

}  // namespace cab::scenes
