// Ropes: long chains of equal links side by side, all inclined the same way. z is up, lengths are metres.
#pragma once

#include "scenes/scene.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

// The shape of a rope about its straight line.
enum class RopeShape : std::uint8_t {
  kStraight,  // along the line
  kWavy,      // a wave across the grid, so that ropes above each other cross
  kCoiled,    // a spring about the line
  kBraided,   // two ropes of a bundle that wind about each other
};
inline constexpr std::array<const char*, 4> kRopeShapeNames = {"straight", "wavy", "coiled", "braided"};

inline constexpr std::uint32_t kLeastRopeLinks = 2;
inline constexpr double kLeastSpacing = .1, kMostSpacing = 10;

struct RopeOptions {
  std::uint32_t link_count = 64;  // kLeastRopeLinks to kMaxLinks
  RopeShape shape = RopeShape::kStraight;
  double spacing = 1.5;  // distance of neighbours at their closest, in thicknesses of a rope; at 1 they touch
};

// Size of a link, metres.
inline constexpr double kRopeLinkLength = .1, kRopeThickness = .04;

// The links and leaf boxes of one rope, without poses. The origin of a link's frame is at its joint, and the link lies
// along x. The leaf box is also the link's exact shape.
Character make_rope(std::uint32_t link_count);

// Which rope of a crowd it is. A bundle starts at a point of a grid. It has one strand, number 0, or the two strands of
// a braid.
struct RopePlace {
  std::uint32_t bundle;  // its number, which decides its random draws
  std::uint32_t column, row;
  std::uint32_t strand;
};

// Poses one rope at t seconds by the equations in docs/crowd.md. Writes link_count times 7 floats of poses
// (kQuaternionTranslation, computed in double and rounded once) and the three doubles of the origin. The origin is the
// start of the bundle's line, and the poses are relative to it.
void pose_rope(const RopeOptions& options, const RopePlace& place, double t, float* poses, double* origin);

}  // namespace cab::scenes
