// 10 000 people stand in a row, each with an arm stretched out to the next one: which links touch?
#include <cab/world.h>

#include <cstdio>
#include <vector>

int main() {
  // Once: a torso and an arm that hangs on it, each with a box in its own frame.
  const std::int32_t parents[] = {-1, 0};
  const cab::Leaf leaves[] = {{0, cab::axis_aligned_box({0, .9f, 0}, {.25f, .9f, .15f}), {}},
                              {1, cab::axis_aligned_box({.35f, 0, 0}, {.35f, .06f, .06f}), {}}};
  cab::World world;
  cab::BatchId people;
  cab::exit_on_error(world.add_batch({parents, {}, leaves, {}}, 10000, &people));
  cab::exit_on_error(world.add_rule({people, people}));

  // Every frame: a quaternion x y z w and a translation per link, and where each person stands in the world.
  std::vector<float> poses;
  std::vector<double> origins;
  for (int i = 0; i < 10000; ++i) {
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0, /* the arm: */ 0, 0, 0, 1, .25f, 1.4f, 0});
    origins.insert(origins.end(), {.8 * i, 0, 0});
  }
  world.input(people)->poses.data = poses.data();
  world.input(people)->origins = origins;
  cab::exit_on_error(world.run());
  const cab::Hit& first = world.hits()[0];
  std::printf("%zu pairs of links touch; first link %d of person %u and link %d of person %u\n", world.hits().size,
              first.link_a, first.instance_a, first.link_b, first.instance_b);
}
