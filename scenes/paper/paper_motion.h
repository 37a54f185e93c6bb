// What the paper's five scenes share: their clock, their tilt, and links that are boxes centred in their frames.
#pragma once

#include "scenes/scene.h"
#include "scenes/vec3d.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::scenes {

// Frame f is at f / kFramesPerSecond seconds.
inline constexpr double kFramesPerSecond = 60;

// Where a link is: the centre of its box, and its unit axes in the world.
struct BodyPose {
  Vec3 center;
  std::array<Vec3, 3> axes;
};

// v rotated right-handed about a unit axis (Rodrigues).
Vec3 about(const Vec3& axis, const Vec3& v, double angle);

// Three axes, each rotated right-handed about a unit axis, which may be one of them.
std::array<Vec3, 3> about(Vec3 axis, const std::array<Vec3, 3>& axes, double angle);

// The pose in a scene whose whole world is rotated by tilt about (1, 2, .5), through the origin.
BodyPose tilted(const BodyPose& pose, double tilt);

// Appends a link's pose in the format kMatrix3x4; the one place where motion is rounded to float.
void append_pose(const BodyPose& pose, std::vector<float>& poses);

// Gives a character a link with one leaf: a box in the link's frame, centred on it, the joint with the parent in the
// middle of its -x face. The leaf has no parts.
void add_link(Character& character, const std::string& name, std::int32_t parent, const Vec3& half);

// A convex hull of x y z each vertex, placed as the link is.
ShapePart hull_part(std::vector<float> vertices);

}  // namespace cab::scenes
