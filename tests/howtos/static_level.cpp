// A level that stands still: hills as triangles of a height field, a wall as a box, and a floor below; and which
// triangle of the hills a foot stands on.
#include <cab/world.h>

#include <cmath>
#include <cstdio>
#include <vector>

// Hills of kCells by kCells cells, each 1 wide, two triangles per cell: 2 c and 2 c + 1 of cell c.
constexpr std::uint32_t kCells = 32;
static float height_at(std::uint32_t x, std::uint32_t z) {
  return std::sin(.4f * static_cast<float>(x)) + std::cos(.3f * static_cast<float>(z));
}

int main() {
  std::vector<float> vertices;
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t z = 0; z <= kCells; ++z)
    for (std::uint32_t x = 0; x <= kCells; ++x)
      vertices.insert(vertices.end(), {static_cast<float>(x), height_at(x, z), static_cast<float>(z)});
  for (std::uint32_t z = 0; z < kCells; ++z)
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t corner = z * (kCells + 1) + x, below = corner + kCells + 1;
      triangles.insert(triangles.end(), {corner, below, corner + 1, corner + 1, below, below + 1});
    }

  // quote
  // What was cooked before is not loaded: triangles are added anew when a level is, some microseconds each. They are
  // copied. A triangle has no inside, so a half space below catches what fell through.
  cab::StaticBody wall;
  wall.box = cab::axis_aligned_box({0, 0, 0}, {.5f, 3, 8});
  wall.origin[0] = 20;
  cab::ConvexPart ground;
  ground.kind = cab::ShapeKind::kHalfSpace;  // below its own z; turned here so that z is up along y
  ground.rotation[0] = -std::sqrt(.5f), ground.rotation[3] = std::sqrt(.5f);
  cab::StaticBody floor;
  floor.box = cab::axis_aligned_box({0, -5, 0}, {100, 5, 100});
  floor.parts = {&ground, 1};
  floor.origin[1] = -3;
  const cab::StaticBody bodies[] = {wall, floor};
  cab::StaticDesc desc;
  desc.bodies = bodies;
  desc.vertices = vertices;
  desc.triangles = triangles;
  // end quote

  cab::World world;
  cab::BatchId level, feet;
  cab::ConvexPart ball;
  ball.kind = cab::ShapeKind::kSphere;
  for (float& size : ball.size) size = .25f;
  const cab::Leaf foot = {0, cab::axis_aligned_box({0, 0, 0}, {.25f, .25f, .25f}), {&ball, 1}};
  const std::int32_t parents[] = {-1};
  cab::exit_on_error(world.add_batch({parents, {}, {&foot, 1}, {}}, 3, &feet));  // a of each hit, as it came first
  // quote
  cab::exit_on_error(world.add_static_batch(desc, &level));
  cab::exit_on_error(world.add_rule({feet, level}));
  // end quote
  world.job().policies.exact = cab::Exact::kConvex;

  // The first foot stands on the hills, the second at the wall, above the hills, the third has fallen through.
  const float poses[21] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  const double origins[9] = {7.3, (height_at(7, 4) + height_at(8, 4)) / 2., 4.2, 19.3, 2.5, 2, 60, -3.1, 60};
  world.input(feet)->poses.data = poses;
  world.input(feet)->origins = origins;
  cab::exit_on_error(world.run());

  // Instances of the level: bodies first, in their order, then the triangles.
  bool on_hills = false, at_wall = false, on_floor = false, elsewhere = false;
  for (const cab::Hit& hit : world.hits()) {
    const std::uint32_t body = hit.instance_b, body_count = 2;
    if (body >= body_count) {
      const std::uint32_t triangle = body - body_count, cell = triangle / 2;
      std::printf("foot %u is on triangle %u, of the cell at %u, %u\n", hit.instance_a, triangle, cell % kCells,
                  cell / kCells);
      on_hills = on_hills || (cell % kCells == 7 && cell / kCells == 4);
      elsewhere = elsewhere || hit.instance_a != 0;
    } else {
      std::printf("foot %u meets the %s\n", hit.instance_a, body == 0 ? "wall" : "floor");
      (body == 0 ? at_wall : on_floor) = hit.instance_a == (body == 0 ? 1u : 2u);
    }
  }
  return on_hills && at_wall && on_floor && !elsewhere ? 0 : 1;
}
