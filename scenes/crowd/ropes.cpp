#include "scenes/crowd/ropes.h"

#include "scenes/random.h"
#include "scenes/vec3d.h"

#include <cmath>
#include <string>

namespace cab::scenes {
namespace {

constexpr std::uint64_t kRopeSeed = 6;
constexpr double kTwoPi = 6.283185307179586;

// The direction of all ropes is x rotated about y and then about z. No axis of the world lies along it.
constexpr double kPitch = -.5, kYaw = 1.1;  // rad

constexpr double kJitter = .2,
                 kSway = .05;  // of a thickness: how far a bundle starts from its grid point, and how far it sways
constexpr double kSwaySpeed = 2, kWaveSpeed = 3, kTurnSpeed = 1.5;  // rad per second

// A wave is a sine-generated curve (Langbein and Leopold 1966): link k turns by kBend sin(phase + 2 pi (k + .5) / 16).
// Its joints then lie on -C1 cos(p) - C3 cos(3 p), p the phase there. C1 = L J1(kBend) / sin(pi / 16) and
// C3 = L J3(kBend) / sin(3 pi / 16), with the Bessel functions of the first and third order.
constexpr double kBend = .6, kLinksOfWave = 16;
constexpr double kWaveFirst = .146958, kWaveThird = .000792;  // metres
constexpr double kWaveReach = .148;                           // of a joint from the line, metres

// The joints of a spring or a braid lie on a helix. The radius of a braid follows from the spacing.
constexpr double kCoilRadius = .24;  // metres
constexpr double kLinksOfCoil = 16, kLinksOfBraid = 24;

Quat turn_x(double angle) { return {std::sin(angle / 2), 0, 0, std::cos(angle / 2)}; }
Quat turn_y(double angle) { return {0, std::sin(angle / 2), 0, std::cos(angle / 2)}; }
Quat turn_z(double angle) { return {0, 0, std::sin(angle / 2), std::cos(angle / 2)}; }

// The largest distance of a rope's joints from its bundle's line, metres.
double distance_from_line(const RopeOptions& options) {
  switch (options.shape) {
    case RopeShape::kWavy: return kWaveReach;
    case RopeShape::kCoiled: return kCoilRadius;
    case RopeShape::kBraided: return options.spacing * kRopeThickness / 2;
    case RopeShape::kStraight: break;
  }
  return 0;
}

// A link in the frame of its bundle's line: the place of its joint, and the rotation from x to its direction.
struct LinkPlace {
  Vec3 joint;
  Quat turn;
};

// Follows a wave link by link, or the line if bend is 0.
class Wave {
 public:
  Wave(double bend, double phase) : bend_(bend), phase_(phase) {
    if (bend > 0) joint_[1] = -kWaveFirst * std::cos(phase) - kWaveThird * std::cos(3 * phase);
  }
  LinkPlace next() {
    const double angle = bend_ * std::sin(phase_ + kTwoPi * (link_++ + .5) / kLinksOfWave);
    const LinkPlace place = {joint_, turn_z(angle)};
    joint_ = joint_ + kRopeLinkLength * Vec3{std::cos(angle), std::sin(angle), 0};
    return place;
  }

 private:
  double bend_, phase_, link_ = 0;
  Vec3 joint_ = {0, 0, 0};
};

// Link k of a helix whose chords are the links. Its rise follows from its length and its chord across the circle.
LinkPlace on_helix(double radius, double links_of_turn, double phase, std::uint32_t k) {
  const double step = kTwoPi / links_of_turn, across = 2 * radius * std::sin(step / 2);
  const double rise = std::sqrt(kRopeLinkLength * kRopeLinkLength - across * across), angle = phase + step * k;
  return {{rise * k, radius * std::cos(angle), radius * std::sin(angle)},
          multiply(turn_x(angle + step / 2), turn_y(-std::atan2(across, rise)))};
}

}  // namespace

Character make_rope(std::uint32_t link_count) {
  Character rope;
  rope.name = "rope";
  for (std::uint32_t l = 0; l < link_count; ++l) {
    BodyLeaf leaf;
    leaf.link = l;
    leaf.box.center[0] = leaf.box.half[0] = static_cast<float>(kRopeLinkLength / 2);
    leaf.box.half[1] = leaf.box.half[2] = static_cast<float>(kRopeThickness / 2);
    for (std::size_t k = 0; k < 3; ++k) leaf.box.axis[k][k] = 1;
    rope.link_names.push_back("link " + std::to_string(l));
    rope.link_parents.push_back(static_cast<std::int32_t>(l) - 1);
    rope.leaves.push_back(leaf);
  }
  return rope;
}

void pose_rope(const RopeOptions& options, const RopePlace& place, double t, float* poses, double* origin) {
  Random random = Random::of(kRopeSeed, place.bundle);
  const double roll = random.angle(), phase = random.angle(), sway = random.angle();
  const double aside = random.uniform(-kJitter, kJitter) + kSway * std::sin(sway + kSwaySpeed * t);
  const double above = random.uniform(-kJitter, kJitter) + kSway * std::cos(sway + kSwaySpeed * t);
  const double along = random.uniform(0, kRopeLinkLength);

  const Quat way = multiply(turn_z(kYaw), turn_y(kPitch));
  const double reach = distance_from_line(options), gap = options.spacing * kRopeThickness;
  const bool is_wavy = options.shape == RopeShape::kWavy;
  const double column_step = 2 * reach + gap, row_step = is_wavy ? gap : column_step;
  const Vec3 start = rotate(
      way, {along, column_step * place.column + kRopeThickness * aside, row_step * place.row + kRopeThickness * above});
  for (std::size_t c = 0; c < 3; ++c) origin[c] = start[c];

  const Quat rolled = is_wavy ? way : multiply(way, turn_x(roll));
  Wave wave(is_wavy ? kBend : 0, phase - kWaveSpeed * t);
  const double rotated = phase + kTwoPi / 2 * place.strand + kTurnSpeed * t;
  for (std::uint32_t l = 0; l < options.link_count; ++l) {
    const LinkPlace link = is_wavy || options.shape == RopeShape::kStraight ? wave.next()
                           : options.shape == RopeShape::kCoiled            ? on_helix(reach, kLinksOfCoil, rotated, l)
                                                                 : on_helix(reach, kLinksOfBraid, rotated, l);
    for (const double component : multiply(rolled, link.turn)) *poses++ = static_cast<float>(component);
    for (const double component : rotate(rolled, link.joint)) *poses++ = static_cast<float>(component);
  }
}

}  // namespace cab::scenes
