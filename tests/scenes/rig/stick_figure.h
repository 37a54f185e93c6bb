// A person of 1.75 m as a skeleton, made by formula: bones as in the tables, without rotations, y up, facing +z.
#pragma once

#include "scenes/import/import.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::tests {

inline constexpr double kStature = 1.75;

// Adds a joint to a skeleton of one frame.
inline void add_joint(scenes::Skeleton& s, const std::string& name, std::int32_t parent,
                      const std::array<double, 3>& offset) {
  s.joint_names.push_back(name);
  s.joint_parents.push_back(parent);
  s.is_end_site.push_back(false);
  s.rest_offsets.insert(s.rest_offsets.end(), offset.begin(), offset.end());
  s.rotations.insert(s.rotations.end(), {0, 0, 0, 1});
  for (std::size_t k = 0; k < 3; ++k)
    s.positions.push_back(offset[k] + (parent < 0 ? 0 : s.positions[3 * static_cast<std::size_t>(parent) + k]));
}

// Joints from hips to head, wrists and ankles. No segment begins at head, hands and feet.
inline scenes::Skeleton stick_figure() {
  scenes::Skeleton s;
  s.frame_seconds = 1;
  s.frame_count = 1;
  add_joint(s, "Hips", -1, {0, .53 * kStature, 0});
  add_joint(s, "Spine", 0, {0, .1 * kStature, 0});
  add_joint(s, "Neck", 1, {0, .214 * kStature, 0});
  add_joint(s, "Head", 2, {0, .04 * kStature, 0});
  for (const auto& [side, sign] : {std::pair(std::string("Left"), 1.), std::pair(std::string("Right"), -1.)}) {
    const auto first = static_cast<std::int32_t>(s.joint_names.size());
    add_joint(s, side + "Arm", 1, {sign * .129 * kStature, .18 * kStature, 0});
    add_joint(s, side + "ForeArm", first, {sign * .186 * kStature, 0, 0});
    add_joint(s, side + "Hand", first + 1, {sign * .146 * kStature, 0, 0});
    add_joint(s, side + "UpLeg", 0, {sign * .09 * kStature, 0, 0});
    add_joint(s, side + "Leg", first + 3, {0, -.245 * kStature, 0});
    add_joint(s, side + "Foot", first + 4, {0, -.246 * kStature, 0});
  }
  return s;
}

}  // namespace cab::tests
