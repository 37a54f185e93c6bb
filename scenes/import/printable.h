// Makes text from a file safe for a one-line message, for a terminal and for JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cab::scenes {

// The text with "?" for every byte that is not part of well-formed UTF-8, and for every character that is not shown or
// changes how others are shown: controls (C0, DEL, C1), ends of lines and paragraphs (U+2028, U+2029), annotations
// (U+FFF9 to U+FFFB), and Unicode's Default_Ignorable_Code_Point, which has what turns the direction of writing, joins
// or parts letters, or has no width. perf/tools/scan/cab_scan/printable.py hides the same characters.
std::string printable(std::string_view text);

// A line of at most 280 bytes: of a longer one, which must be printable, the middle is left out.
std::string brief(const std::string& line);

// The first six names, such as "a, b, c, d, e, f and 3 more".
std::string listed(const std::vector<std::string>& names);

}  // namespace cab::scenes
