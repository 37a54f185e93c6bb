// Ropes: long chains of equal links side by side, all slanting the same way. z is up, lengths are metres.
#pragma once

#include "scenes/scene.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

// How a rope lies about its straight line.
enum class RopeShape : std::uint8_t {
  kStraight,  // on it
  kWavy,      // a wave across the rows of ropes, so that those above each other cross
  kCoiled,    // a spring
  kBraided,   // a bundle of two that wind about each other
};
inline constexpr std::array<const char*, 4> kRopeShapeNames = {"straight", "wavy", "coiled", "braided"};

inline constexpr std::uint32_t kLeastRopeLinks = 2;
inline constexpr double kLeastSpacing = .1, kMostSpacing = 10;

struct RopeOptions {
  std::uint32_t link_count = 64;  // kLeastRopeLinks to kMaxLinks
  RopeShape shape = RopeShape::kStraight;
  double spacing = 1.5;  // of neighbours where they come closest, in thicknesses of a rope: at 1 they touch
};

// Of a link, metres.
inline constexpr double kRopeLinkLength = .1, kRopeThickness = .04;

// Links and leaf boxes of one rope, without poses. A link's frame sits at its joint, the link along x; its leaf box is
// its exact shape too.
Character make_rope(std::uint32_t link_count);

// Which rope: a strand (0, or 0 and 1 of a braid) of a bundle, whose line starts at a point of a grid.
struct RopePlace {
  std::uint32_t bundle;  // what is drawn for it
  std::uint32_t column, row;
  std::uint32_t strand;
};

// One rope at t seconds, by the equations in docs/crowd.md. Writes link_count times 7 floats of poses
// (kQuaternionTranslation, computed in double, rounded once) relative to its origin, the start of its bundle's line,
// and the origin's three doubles.
void pose_rope(const RopeOptions& options, const RopePlace& place, double t, float* poses, double* origin);

}  // namespace cab::scenes
