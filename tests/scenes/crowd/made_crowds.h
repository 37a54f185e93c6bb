// What tests of crowds make their crowds from: a clip and a track by formula, and the poses of one moment.
#pragma once

#include "scenes/crowd/crowd.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace cab::tests {

inline std::vector<scenes::PosedGroup> posed_at(const scenes::Crowd& crowd, double seconds) {
  std::vector<scenes::PosedGroup> posed;
  scenes::pose_crowd(crowd, seconds, posed);
  return posed;
}

// A stick of two limbs along +y of 1 m each that moves along +z at 1 m/s, 10 frames per second for 2 s.
inline scenes::Clip walking_stick() {
  scenes::Skeleton skeleton;
  skeleton.joint_names = {"hips", "chest", "end"};
  skeleton.joint_parents = {-1, 0, 1};
  skeleton.is_end_site = {false, false, true};
  skeleton.rest_offsets = {0, 0, 0, 0, 1, 0, 0, 1, 0};
  skeleton.frame_seconds = .1;
  skeleton.frame_count = 20;
  for (std::uint32_t f = 0; f < skeleton.frame_count; ++f)
    for (int joint = 0; joint < 3; ++joint) {
      const double sway = .01 * f;
      skeleton.rotations.insert(skeleton.rotations.end(), {0, 0, 0, 1});
      skeleton.positions.insert(skeleton.positions.end(), {0, .5 + sway + joint, .1 * f});
    }
  return scenes::make_clip(skeleton, "stick", {});
}

// A person who walks 10 m in 10 s from (x, y) in a direction, rad.
inline scenes::Track straight_track(double x, double y, double direction) {
  scenes::Track track;
  for (int s = 0; s < 2; ++s) {
    track.seconds.push_back(10.0 * s);
    track.places.insert(track.places.end(), {x + 10 * s * std::cos(direction), y + 10 * s * std::sin(direction)});
    track.headings.push_back(direction);
  }
  return track;
}

}  // namespace cab::tests
