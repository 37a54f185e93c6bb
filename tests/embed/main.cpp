// Two arms of two jointed links each: which links touch?
#include <cab/world.h>

#include <cstdio>

int main() {
  // Once: link 1 hangs on link 0. Each is a box 1 long, with its joint at the frame's origin and x along it.
  const std::int32_t parents[] = {-1, 0};
  const cab::Box bone = cab::axis_aligned_box({.5f, 0, 0}, {.5f, .1f, .1f});
  const cab::Leaf leaves[] = {{0, bone, {}}, {1, bone, {}}};
  cab::World world;
  cab::BatchId arms;
  cab::exit_on_error(world.add_batch({parents, {}, leaves, {}}, 2, &arms));
  cab::exit_on_error(world.add_rule({arms, arms}));

  // Every frame: a quaternion x y z w and a translation for each link of each arm, and where each arm stands.
  const float poses[2][2][7] = {{{0, 0, 0, 1, 0, 0, 0}, {0, 0, .7071068f, .7071068f, 1, 0, 0}},  // bent upwards
                                {{0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 0, 0}}};                 // straight
  const double origins[] = {0, 0, 0, .6, .5, 0};
  world.input(arms)->poses.data = &poses[0][0][0];
  world.input(arms)->origins = origins;
  cab::exit_on_error(world.run());
  for (const cab::Hit& hit : world.hits())
    std::printf("link %d of arm %u touches link %d of arm %u\n", hit.link_a, hit.instance_a, hit.link_b,
                hit.instance_b);
}
