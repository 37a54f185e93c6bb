// The crowd humanoid: a person of 16 boxes that sways and walks by a closed formula. z is up, lengths are metres.
#pragma once

#include "scenes/random.h"
#include "scenes/scene.h"
#include "scenes/vec3d.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

inline constexpr std::uint32_t kHumanoidLinks = 16;
inline constexpr std::uint32_t kHumanoidPoseFloats = kHumanoidLinks * 7;

// Links and leaf boxes, without poses. A link's frame sits at its joint; its leaf box is along its axes and is its exact
// shape too.
Character make_humanoid();

// What one humanoid was given: link l turns about axes[l] by bases[l] + .3 amplitude sin(phase + .7 l + 2 pi t), and the
// whole one faces its own +y rotated by yaw about z, the way that it walks.
struct HumanoidMotion {
  std::array<Vec3, kHumanoidLinks> axes;
  std::array<double, kHumanoidLinks> bases;  // rad
  double phase;                              // rad
  double yaw;                                // rad
  double speed;                              // m/s
};

// Axes uniform on the sphere, bases normal with the link's amplitude, phase and yaw uniform, speed uniform in
// [.85, 1.15).
HumanoidMotion draw_humanoid(Random& random);

// One humanoid at t seconds whose pelvis was above (x, y) at 0. Writes kHumanoidPoseFloats floats of poses
// (kQuaternionTranslation, computed in double, rounded once) relative to its origin, the pelvis joint, and the origin's
// three doubles.
void pose_humanoid(const HumanoidMotion& motion, double x, double y, double t, float* poses, double* origin);

}  // namespace cab::scenes
