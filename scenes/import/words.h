// The words of a line of a text file.
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <vector>

namespace cab::scenes {

// Splits a line at blanks, or at commas or semicolons if it has any. Words have no blanks around them. Between two
// commas a word may be empty.
void split_line(std::string_view line, std::vector<std::string_view>& words);

// Reads a number, which must be the whole word. A plus sign may precede it. Returns false if it is none.
template <class T>
bool read_number(std::string_view word, T& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

// The word with the letters A to Z as a to z.
std::string lower_case(std::string_view word);

}  // namespace cab::scenes
