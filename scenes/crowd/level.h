// Levels: what a crowd stands in, as static bodies. z is up, lengths are metres.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <vector>

namespace cab::scenes {

// What a level is made of.
enum class LevelKind : std::uint8_t {
  kBoxes,      // posts and low walls on the ground, at random places
  kTriangles,  // ground that is not even, on a square grid of points
};
inline constexpr std::array<const char*, 2> kLevelKindNames = {"boxes", "triangles"};  // in the order of LevelKind

// Static bodies, with what StaticDesc points to.
struct Level {
  std::vector<StaticBody> bodies;
  std::vector<float> vertices;           // x y z each
  std::vector<std::uint32_t> triangles;  // three indices of vertices each

  std::uint32_t count() const { return static_cast<std::uint32_t>(bodies.size() + triangles.size() / 3); }
  StaticDesc desc() const;
};

// Makes a level of about `count` bodies, at least one, on the square from the world's origin to (side, side).
Level level_of(LevelKind kind, std::uint32_t count, double side);

}  // namespace cab::scenes
