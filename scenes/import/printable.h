// Makes text from a file safe for a one-line message and for JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cab::scenes {

// The text with "?" for every control character and for every byte that is not part of well-formed UTF-8.
std::string printable(std::string_view text);

// The first six names, such as "a, b, c, d, e, f and 3 more".
std::string listed(const std::vector<std::string>& names);

}  // namespace cab::scenes
