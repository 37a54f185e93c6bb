// Forward kinematics: the joints of a body, of which compute_link_poses (cab/cab.h) makes poses. Joints of URDF and
// MJCF are written with these: fixed ones are places alone, continuous ones kRevolute, a free one three kPrismatic and
// a kBall.
#pragma once

#include <cab/types.h>

namespace cab {

// How a joint moves its link.
enum class JointKind : std::uint8_t {
  kRevolute,   // it turns about its axis by one value, in radians
  kPrismatic,  // it moves along its axis by one value, in the links' unit
  kBall,       // it turns by the rotation vector that three values are, in radians
};

// A joint. Its values are multiplier * state[variable] + offset, so that joints may follow the variable of another. A
// kBall takes three variables from `variable` on.
struct JointDesc {
  JointKind kind = JointKind::kRevolute;  // how it moves its link
  std::uint32_t variable = 0;             // index of its first variable in a state
  double axis[3] = {0, 0, 1};             // x y z in its link's frame, of length 1. kBall: not read
  double anchor[3] = {0, 0, 0};  // x y z of the point that stays where it is when it turns, in its link's frame
  double multiplier = 1;         // finite
  double offset = 0;             // finite
};

// Where a link is in its parent's frame, and the joints that move it from there.
struct LinkPlaceDesc {
  double rotation[4] = {0, 0, 0, 1};  // quaternion x y z w of length 1, from the link's frame to the parent's
  double translation[3] = {0, 0, 0};  // x y z in the parent's frame
  std::uint32_t joint_count = 0;      // how many joints it has, each in the frame that those before it leave
};

// The links of a body and their joints. Spans are read by the call alone, by begin_frame until end_frame.
struct KinematicsDesc {
  Span<const std::int32_t> link_parents;  // as ArticulationDesc::link_parents: parents come first, -1 for a root
  Span<const LinkPlaceDesc> links;        // one per link. That of a root is its place in the body's frame
  Span<const JointDesc> joints;           // those of the first link, then those of the second, and so on
  std::uint32_t variable_count = 0;       // numbers of a state
};

}  // namespace cab
