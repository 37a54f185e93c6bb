#include "scenes/crowd/humanoid.h"

#include <cmath>

namespace cab::scenes {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kSway = .3;         // of a link's amplitude
constexpr double kPhaseOfLink = .7;  // rad from link to link
constexpr double kLeastSpeed = .85, kGreatestSpeed = 1.15;

struct Link {
  const char* name;
  std::int32_t parent;
  Vec3 joint;   // in the parent's frame; the pelvis' in the world
  Vec3 center;  // of the box, in the link's frame
  Vec3 half;
  double amplitude;  // rad
};

constexpr std::array<Link, kHumanoidLinks> kLinks = {{
    {"pelvis", -1, {0, 0, .95}, {0, 0, 0}, {.17, .10, .10}, .10},
    {"abdomen", 0, {0, 0, .10}, {0, 0, .09}, {.15, .10, .09}, .15},
    {"chest", 1, {0, 0, .18}, {0, 0, .14}, {.18, .12, .14}, .15},
    {"head", 2, {0, 0, .30}, {0, 0, .14}, {.09, .11, .14}, .25},
    {"left upper arm", 2, {.22, 0, .24}, {0, 0, -.15}, {.055, .055, .15}, .6},
    {"left forearm", 4, {0, 0, -.30}, {0, 0, -.13}, {.045, .045, .13}, .6},
    {"left hand", 5, {0, 0, -.26}, {0, 0, -.09}, {.045, .02, .09}, .3},
    {"right upper arm", 2, {-.22, 0, .24}, {0, 0, -.15}, {.055, .055, .15}, .6},
    {"right forearm", 7, {0, 0, -.30}, {0, 0, -.13}, {.045, .045, .13}, .6},
    {"right hand", 8, {0, 0, -.26}, {0, 0, -.09}, {.045, .02, .09}, .3},
    {"left thigh", 0, {.10, 0, -.03}, {0, 0, -.22}, {.08, .08, .22}, .4},
    {"left shin", 10, {0, 0, -.44}, {0, 0, -.21}, {.06, .06, .21}, .4},
    {"left foot", 11, {0, 0, -.42}, {0, .06, -.03}, {.05, .13, .035}, .2},
    {"right thigh", 0, {-.10, 0, -.03}, {0, 0, -.22}, {.08, .08, .22}, .4},
    {"right shin", 13, {0, 0, -.44}, {0, 0, -.21}, {.06, .06, .21}, .4},
    {"right foot", 14, {0, 0, -.42}, {0, .06, -.03}, {.05, .13, .035}, .2},
}};

Quat turn_about(const Vec3& axis, double angle) {
  const double s = std::sin(angle / 2);
  return {s * axis[0], s * axis[1], s * axis[2], std::cos(angle / 2)};
}

}  // namespace

Character make_humanoid() {
  Character humanoid;
  humanoid.name = "humanoid";
  for (std::uint32_t l = 0; l < kHumanoidLinks; ++l) {
    const Link& link = kLinks[l];
    BodyLeaf leaf;
    leaf.link = l;
    for (std::size_t k = 0; k < 3; ++k) {
      leaf.box.center[k] = static_cast<float>(link.center[k]);
      leaf.box.half[k] = static_cast<float>(link.half[k]);
      leaf.box.axis[k][k] = 1;
    }
    humanoid.link_names.emplace_back(link.name);
    humanoid.link_parents.push_back(link.parent);
    humanoid.leaves.push_back(leaf);
  }
  return humanoid;
}

HumanoidMotion draw_humanoid(Random& random) {
  HumanoidMotion motion;
  for (std::uint32_t l = 0; l < kHumanoidLinks; ++l) {
    motion.axes[l] = random.unit_vector();
    motion.bases[l] = kLinks[l].amplitude * random.normal();
  }
  motion.phase = random.angle();
  motion.yaw = random.angle();
  motion.speed = random.uniform(kLeastSpeed, kGreatestSpeed);
  return motion;
}

void pose_humanoid(const HumanoidMotion& motion, double x, double y, double t, float* poses, double* origin) {
  origin[0] = x - motion.speed * t * std::sin(motion.yaw);
  origin[1] = y + motion.speed * t * std::cos(motion.yaw);
  origin[2] = kLinks[0].joint[2];
  std::array<Quat, kHumanoidLinks> rotations;
  std::array<Vec3, kHumanoidLinks> positions;
  for (std::uint32_t l = 0; l < kHumanoidLinks; ++l) {
    const Link& link = kLinks[l];
    const double sway = std::sin(motion.phase + kPhaseOfLink * l + kTwoPi * t);
    const Quat turn = turn_about(motion.axes[l], motion.bases[l] + kSway * link.amplitude * sway);
    if (link.parent < 0) {
      rotations[l] = multiply(turn_about({0, 0, 1}, motion.yaw), turn);
      positions[l] = {0, 0, 0};
    } else {
      const auto parent = static_cast<std::size_t>(link.parent);
      rotations[l] = multiply(rotations[parent], turn);
      positions[l] = positions[parent] + rotate(rotations[parent], link.joint);
    }
    for (const double component : rotations[l]) *poses++ = static_cast<float>(component);
    for (const double component : positions[l]) *poses++ = static_cast<float>(component);
  }
}

}  // namespace cab::scenes
