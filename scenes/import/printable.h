// Makes text from a file safe for a one-line message and for JSON.
#pragma once

#include <string>
#include <string_view>

namespace cab::scenes {

// The text with "?" for every control character and for every byte that is not part of well-formed UTF-8.
std::string printable(std::string_view text);

}  // namespace cab::scenes
