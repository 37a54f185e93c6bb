// A fist and a head, both round: where they touch, how deep, and how near they are when they do not touch.
#include <cab/world.h>

#include <cmath>
#include <cstdio>

// A batch of one ball. The box of its leaf serves the box tests, its convex part the exact test.
static cab::BatchId add_ball(cab::World& world, float radius) {
  // quote
  cab::ConvexPart ball;
  ball.kind = cab::ShapeKind::kEllipsoid;
  for (float& size : ball.size) size = radius;
  const cab::Leaf leaf = {0, cab::axis_aligned_box({0, 0, 0}, {radius, radius, radius}), {&ball, 1}};
  // end quote
  const std::int32_t parents[] = {-1};
  cab::BatchId batch;
  cab::exit_on_error(world.add_batch({parents, {}, {&leaf, 1}, {}}, 1, &batch));
  return batch;
}

int main() {
  cab::World world;
  const cab::BatchId fist = add_ball(world, .1f), head = add_ball(world, .15f);
  cab::exit_on_error(world.add_rule({fist, head}));
  // quote
  world.job().policies.exact = cab::Exact::kConvex;
  world.want_contacts();
  // end quote

  const float pose[7] = {0, 0, 0, 1, 0, 0, 0};
  const double fist_at[3] = {100, 1.5, 7};
  double head_at[3] = {0, 1.5, 7};
  for (cab::BatchInput& input : world.inputs()) input.poses.data = pose;
  world.input(fist)->origins = fist_at;
  world.input(head)->origins = head_at;
  const auto near = [](float value, double expected) { return std::fabs(double{value} - expected) < 1e-5; };

  // quote
  // The centers are .2 apart, the radii add up to .25. The normal points from the fist to the head. Each point lies on
  // its own ball, inside of the other; both are relative to the fist's origin.
  head_at[0] = 100.2;
  cab::exit_on_error(world.run());
  if (world.hits().size != 1) return 1;
  const cab::Contact deep = world.contacts()[0];  // contact i belongs to hit i
  // end quote
  bool right =
      near(deep.normal[0], 1) && near(deep.depth, .05) && near(deep.point_a[0], .1) && near(deep.point_b[0], .05);

  // The boxes overlap, the balls do not: a false positive of the boxes, which the exact test rejects.
  head_at[2] = 7.2;
  cab::exit_on_error(world.run());
  const cab::FrameStats& stats = world.job().stats;
  right = right && world.hits().empty() && stats.exact_tests == 1 && stats.false_positives == 1;

  // quote
  // The gap is .05. With a margin of .1 that is a hit: its depth is negative, its points are the two nearest ones.
  head_at[0] = 100.3;
  head_at[2] = 7;
  world.job().margin = .1f;
  cab::exit_on_error(world.run());
  // end quote
  if (world.hits().size != 1) return 1;
  const cab::Contact apart = world.contacts()[0];
  right = right && near(apart.depth, -.05) && near(apart.point_a[0], .1) && near(apart.point_b[0], .15);
  std::printf("depth %.3f, gap %.3f\n", double{deep.depth}, -double{apart.depth});
  return right ? 0 : 1;
}
