// The text of an MJCF file as libmujoco 2.2.2 reads it: also of files newer than that, with the files that they
// include, and without what says nothing of shapes, joints and masks.
#pragma once

#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

#include <cstddef>
#include <string>
#include <vector>

namespace cab::scenes {

// What the text says of a body in its one number of user data, as a sum.
inline constexpr int kMjcfFrame = 1;     // it stands for a <frame> of the body above
inline constexpr int kMjcfFreeBody = 2;  // it has a free joint, which libmujoco would not take where the body stands
inline constexpr int kMjcfMocap = 4;     // it is a mocap body

struct MjcfText {
  struct Line {
    std::size_t file = 0;
    int line = 0;
  };

  std::string xml;                 // one element a line; meshes by their full paths, or by their vertices
  std::vector<Line> lines;         // where each line was written
  std::vector<std::string> files;  // "robot.xml", "robot.xml: in arm.xml"
  bool filters_parents = true;     // false: the file disables `filterparent`
  bool tests_all_pairs = true;     // false: no pair is tested that no <pair> lists
  bool tests_listed_pairs = true;  // false: a <pair> says nothing
  std::vector<std::string> notes;

  // "robot.xml: line 12".
  std::string place_of(std::size_t line) const {
    return files[lines[line].file] + ": line " + std::to_string(lines[line].line);
  }
};

// Makes the text. Elements and attributes that are not known, and that might change shapes, joints or masks, are
// refused by name, but those of options.ignored_words. Throws ImportError.
MjcfText mjcf_text(const XmlText& text, const RobotOptions& options);

}  // namespace cab::scenes
