// The paper's five scenes share a clock, a tilt, and links that are boxes centred in their frames.
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

// The place of a link in the world: the centre of its box and its unit axes.
struct BodyPose {
  Vec3 center;
  std::array<Vec3, 3> axes;
};

// v rotated right-handed about a unit axis (Rodrigues).
Vec3 about(const Vec3& axis, const Vec3& v, double angle);

// Three axes, each rotated right-handed about a unit axis. That axis may be one of the three.
std::array<Vec3, 3> about(Vec3 axis, const std::array<Vec3, 3>& axes, double angle);

// The pose after the whole world is rotated by tilt about the axis (1, 2, .5) through the origin.
BodyPose tilted(const BodyPose& pose, double tilt);

// Appends a link's pose in the format kMatrix3x4Rows. Motion is rounded to float here and nowhere else.
void append_pose(const BodyPose& pose, std::vector<float>& poses);

// Adds a link with one leaf to a character. The leaf box is centred in the link's frame, and the joint with the parent
// is the middle of its -x face. The leaf has no parts.
void add_link(Character& character, const std::string& name, std::int32_t parent, const Vec3& half);

// A convex hull in the link's frame. vertices holds x y z per vertex.
ShapePart hull_part(std::vector<float> vertices);

}  // namespace cab::scenes
