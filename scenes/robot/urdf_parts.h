// The parts of a URDF text that say where collision shapes are and how they move, for urdfdom.
#pragma once

#include "scenes/robot/xml_text.h"

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cab::scenes {

struct UrdfParts {
  std::string text;  // URDF
  // Collisions, by the name of their link and their number in it, that are a <capsule> in the file. urdfdom before
  // version 4 does not know it, so that `text` has a <cylinder> of the same radius and length for it.
  std::set<std::pair<std::string, std::size_t>> capsules;
  std::uint32_t guess_count = 0;   // values that the file does not say, each in a note
  std::vector<std::string> notes;  // what was guessed, and what is not read though it is about collisions
};

// Copies links with their collision shapes, and joints with their origins, axes, limits and mimics. Nothing else
// reaches urdfdom, which would refuse the robot for a bad visual or inertia. Throws ImportError, with the line, for
// what urdfdom would not survive and for what it would pass over in silence.
UrdfParts urdf_parts(const XmlText& text);

}  // namespace cab::scenes
