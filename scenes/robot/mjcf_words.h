// The words of MJCF: what becomes of each before libmujoco reads a file.
#pragma once

#include <cstdint>
#include <string_view>

namespace cab::scenes {

// The version of MuJoCo whose elements and attributes the table has.
inline constexpr const char* kMjcfWordsVersion = "3.12.0";

enum class MjcfUse : std::uint8_t {
  kRead,     // it says something of shapes, joints or masks, and is read
  kCut,      // it says nothing of them
  kRefused,  // it says something of them, and is not read
  kUnknown,  // the table does not have it
};

// What becomes of an attribute, and of an element inside another. An element is named by its tag; inside <composite>,
// where tags mean other things, as "composite/TAG".
MjcfUse mjcf_attribute(std::string_view element, std::string_view attribute);
MjcfUse mjcf_child(std::string_view parent, std::string_view element);

// Whether the table has the attributes of an element.
bool mjcf_has_row(std::string_view element);

}  // namespace cab::scenes
