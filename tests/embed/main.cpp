// Two arms of two jointed links each: which links touch?
#include <cab/cab.h>

#include <cstdio>
#include <cstdlib>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

int main() {
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));

  // Once: link 1 hangs on link 0. Each is a box 1 long, with its joint at the frame's origin and x along it.
  const std::int32_t parents[] = {-1, 0};
  const cab::Box bone = {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .1f, .1f}};
  const cab::Leaf leaves[] = {{0, bone, {}}, {1, bone, {}}};
  cab::ArticulationId arm;
  check(cab::add_articulation(*engine, {parents, {}, leaves, {}}, &arm));
  cab::BatchId arms;
  check(cab::add_batch(*engine, {arm, 2, cab::BatchKind::kCharacters}, &arms));

  // Every frame: a quaternion x y z w and a translation for each link of each arm, and where each arm stands.
  const float poses[2][2][7] = {{{0, 0, 0, 1, 0, 0, 0}, {0, 0, .7071068f, .7071068f, 1, 0, 0}},  // bent upwards
                                {{0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 1, 0, 0}}};                 // straight
  const double origins[] = {0, 0, 0, .6, .5, 0};
  const cab::PairRule rule = {arms, arms, cab::Pairing::kBetween};
  cab::BatchInput input;
  input.batch = arms;
  input.poses.data = &poses[0][0][0];
  input.origins = origins;
  cab::Hit hits[16];
  cab::FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.hits = hits;
  check(cab::run_frame(*engine, job));
  for (std::size_t i = 0; i < job.hit_count; ++i)
    std::printf("link %d of arm %u touches link %d of arm %u\n", hits[i].link_a, hits[i].instance_a, hits[i].link_b,
                hits[i].instance_b);
  cab::destroy_engine(engine);
}
