// A fist and a head, both round: where they touch, how deep, and how near they are when they do not touch.
#include <cab/cab.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

// A batch of one ball. The box of its leaf serves the box tests, its convex part the exact test.
static cab::BatchId add_ball(cab::Engine& engine, float radius) {
  cab::ConvexPart ball;
  ball.kind = cab::ShapeKind::kEllipsoid;
  for (float& size : ball.size) size = radius;
  const cab::Box box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {radius, radius, radius}};
  const cab::Leaf leaf = {0, box, {&ball, 1}};
  const std::int32_t parents[] = {-1};
  cab::ArticulationId articulation;
  check(cab::add_articulation(engine, {{parents, 1}, {}, {&leaf, 1}, {}}, &articulation));
  cab::BatchId batch;
  check(cab::add_batch(engine, {articulation, 1, cab::BatchKind::kCharacters}, &batch));
  return batch;
}

int main() {
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const cab::BatchId fist = add_ball(*engine, .1f), head = add_ball(*engine, .15f);

  const float pose[7] = {0, 0, 0, 1, 0, 0, 0};
  const double fist_at[3] = {100, 1.5, 7};
  double head_at[3] = {0, 1.5, 7};
  cab::BatchInput inputs[2];
  inputs[0].batch = fist;
  inputs[0].poses.data = pose;
  inputs[0].origins = {fist_at, 3};
  inputs[1].batch = head;
  inputs[1].poses.data = pose;
  inputs[1].origins = {head_at, 3};
  const cab::PairRule rule = {fist, head, cab::Pairing::kBetween};
  cab::Hit hit;
  cab::Contact contact = {};
  cab::FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = {&rule, 1};
  job.policies.exact = cab::Exact::kConvex;
  job.hits = {&hit, 1};
  job.contacts = {&contact, 1};  // as long as hits; entry i belongs to hit i
  const auto near = [](float value, double expected) { return std::fabs(double{value} - expected) < 1e-5; };

  // The centers are .2 apart, the radii add up to .25. The normal points from the fist to the head. Each point lies on
  // its own ball, inside of the other; both are relative to the fist's origin.
  head_at[0] = 100.2;
  check(cab::run_frame(*engine, job));
  bool right = job.hit_count == 1 && near(contact.normal[0], 1) && near(contact.depth, .05) &&
               near(contact.point_a[0], .1) && near(contact.point_b[0], .05);
  std::printf("depth %.3f", double{contact.depth});

  // The boxes overlap, the balls do not: a false positive of the boxes, which the exact test rejects.
  head_at[2] = 7.2;
  check(cab::run_frame(*engine, job));
  right = right && job.hit_count == 0 && job.stats.exact_tests == 1 && job.stats.false_positives == 1;

  // The gap is .05. With a margin of .1 that is a hit: its depth is negative, its points are the two nearest ones.
  head_at[0] = 100.3;
  head_at[2] = 7;
  job.margin = .1f;
  check(cab::run_frame(*engine, job));
  right = right && job.hit_count == 1 && near(contact.depth, -.05) && near(contact.point_a[0], .1) &&
          near(contact.point_b[0], .15);
  std::printf(", gap %.3f\n", -double{contact.depth});

  cab::destroy_engine(engine);
  return right ? 0 : 1;
}
