// A thousand fighters of two teams: which links touch an opponent, and whom does a shot meet?
#include <cab/world.h>

#include <cstdio>
#include <vector>

int main() {
  // Once: a torso and an arm that hangs on it, each with a box in its own frame.
  const std::int32_t parents[] = {-1, 0};
  const cab::Leaf leaves[] = {{0, cab::axis_aligned_box({0, .9f, 0}, {.25f, .9f, .15f}), {}},
                              {1, cab::axis_aligned_box({.35f, 0, 0}, {.35f, .06f, .06f}), {}}};
  constexpr std::uint32_t kCount = 1000, kRed = 1, kBlue = 2;
  cab::World world;
  cab::BatchId fighters;
  cab::exit_on_error(world.add_batch({parents, {}, leaves, {}}, kCount, &fighters));
  cab::exit_on_error(world.add_rule({fighters, fighters}));

  // Every frame: a quaternion x y z w and a translation per link, where each fighter stands, its team and its foes.
  std::vector<float> poses;
  std::vector<double> origins;
  std::vector<std::uint32_t> teams, foes;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0, /* the arm: */ 0, 0, 0, 1, .25f, 1.4f, 0});
    origins.insert(origins.end(), {.8 * (i % 40), 0, 1. * (i / 40)});
    teams.push_back(i / 2 % 2 ? kBlue : kRed);
    foes.push_back(i / 2 % 2 ? kRed : kBlue);
  }
  cab::BatchInput& input = *world.input(fighters);
  input.poses.data = poses.data(), input.origins = origins;
  input.layers = teams, input.layer_masks = foes;
  cab::exit_on_error(world.run());
  const cab::Hit& hit = world.hits()[0];
  std::printf("%zu pairs of links touch; first link %d of fighter %u and link %d of fighter %u\n", world.hits().size,
              hit.link_a, hit.instance_a, hit.link_b, hit.instance_b);

  cab::Query shot;  // at the blue ones of the first row, as high as their arms
  shot.position[0] = -5, shot.position[1] = 1.4, shot.direction[0] = 1;
  shot.length = 100, shot.layer_mask = kBlue;
  cab::QueryJob job;
  job.queries = {&shot, 1};
  cab::exit_on_error(world.run_queries(job));
  for (const cab::QueryHit& met : world.query_hits())
    std::printf("the shot meets link %u of fighter %u after %.2f m\n", met.link, met.instance, met.distance);
}
