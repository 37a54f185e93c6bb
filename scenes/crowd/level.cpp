#include "scenes/crowd/level.h"

#include "scenes/random.h"

#include <cmath>

namespace cab::scenes {
namespace {

constexpr std::uint64_t kLevelSeed = 4;

// Half extents of the boxes, and heights of the ground, in metres.
constexpr double kLeastThickness = .05, kMostThickness = .3, kLeastHeight = .2, kMostHeight = .8;
constexpr double kLowestGround = -.3, kHighestGround = .05;

Level boxes(std::uint32_t count, double side) {
  Level out;
  Random random(kLevelSeed);
  for (std::uint32_t i = 0; i < count; ++i) {
    StaticBody body;
    const double turn = random.angle();
    body.rotation[2] = static_cast<float>(std::sin(turn / 2));
    body.rotation[3] = static_cast<float>(std::cos(turn / 2));
    body.box.half[0] = static_cast<float>(random.uniform(kLeastThickness, kMostThickness));
    body.box.half[1] = static_cast<float>(random.uniform(kLeastThickness, kMostThickness));
    body.box.half[2] = static_cast<float>(random.uniform(kLeastHeight, kMostHeight));
    for (std::size_t k = 0; k < 3; ++k) body.box.axis[k][k] = 1;
    body.origin[0] = random.uniform(0, side);
    body.origin[1] = random.uniform(0, side);
    body.origin[2] = static_cast<double>(body.box.half[2]);
    out.bodies.push_back(body);
  }
  return out;
}

// Two triangles per cell of the grid.
Level ground(std::uint32_t count, double side) {
  Level out;
  Random random(kLevelSeed);
  const auto cells = static_cast<std::uint32_t>(std::ceil(std::sqrt(count / 2.0)));
  const double step = side / cells;
  for (std::uint32_t y = 0; y <= cells; ++y)
    for (std::uint32_t x = 0; x <= cells; ++x)
      for (const double at : {x * step, y * step, random.uniform(kLowestGround, kHighestGround)})
        out.vertices.push_back(static_cast<float>(at));
  const std::uint32_t row = cells + 1;
  for (std::uint32_t y = 0; y < cells; ++y)
    for (std::uint32_t x = 0; x < cells; ++x) {
      const std::uint32_t corner = y * row + x;
      out.triangles.insert(out.triangles.end(), {corner, corner + 1, corner + row + 1});
      out.triangles.insert(out.triangles.end(), {corner, corner + row + 1, corner + row});
    }
  return out;
}

}  // namespace

StaticDesc Level::desc() const {
  StaticDesc out;
  out.bodies = bodies;
  out.vertices = vertices;
  out.triangles = triangles;
  return out;
}

Level level_of(LevelKind kind, std::uint32_t count, double side) {
  return kind == LevelKind::kBoxes ? boxes(count, side) : ground(count, side);
}

}  // namespace cab::scenes
