// The humanoid of crowds: a person of 16 boxes that sways and walks by a closed formula. z is up, lengths are metres.
#pragma once

#include "scenes/random.h"
#include "scenes/scene.h"
#include "scenes/vec3d.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

inline constexpr std::uint32_t kHumanoidLinks = 16;
inline constexpr std::uint32_t kHumanoidPoseFloats = kHumanoidLinks * 7;

// The links and leaf boxes of the humanoid, without poses. The origin of a link's frame is at its joint. The leaf box
// lies along the frame's axes and is also the link's exact shape.
Character make_humanoid();

// The motion of one humanoid. Link l rotates about axes[l] by bases[l] + .3 amplitude sin(phase + .7 l + 2 pi t). The
// whole figure is rotated by yaw about z; it faces its own +y and walks that way.
struct HumanoidMotion {
  std::array<Vec3, kHumanoidLinks> axes;
  std::array<double, kHumanoidLinks> bases;  // rad
  double phase;                              // rad
  double yaw;                                // rad
  double speed;                              // m/s
};

// Draws axes uniform on the sphere, bases normal with the link's amplitude as deviation, phase and yaw uniform, and
// speed uniform in [.85, 1.15).
HumanoidMotion draw_humanoid(Random& random);

// Poses one humanoid at t seconds; its pelvis is above (x, y) at time 0. Writes kHumanoidPoseFloats floats of poses
// (kQuaternionTranslation, computed in double and rounded once) and the three doubles of the origin. The origin is the
// pelvis joint, and the poses are relative to it.
void pose_humanoid(const HumanoidMotion& motion, double x, double y, double t, float* poses, double* origin);

}  // namespace cab::scenes
