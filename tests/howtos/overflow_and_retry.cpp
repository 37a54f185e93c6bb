// Fighters close in on each other until the hits no longer fit: grow the buffer, repeat the frame, lose nothing.
#include <cab/cab.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

int main() {
  constexpr std::uint32_t kCount = 64;
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const std::int32_t parents[] = {-1};
  const cab::Leaf leaf = {0, {{0, .9f, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .9f, .5f}}, {}};
  cab::ArticulationId fighter;
  check(cab::add_articulation(*engine, {parents, {}, {&leaf, 1}, {}}, &fighter));
  cab::BatchId crowd;
  check(cab::add_batch(*engine, {fighter, kCount}, &crowd));

  std::vector<float> poses;
  for (std::uint32_t i = 0; i < kCount; ++i) poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0});
  std::vector<double> origins(3 * kCount);
  const cab::PairRule rule = {crowd, crowd};
  cab::BatchInput input;
  input.batch = crowd;
  input.poses.data = poses.data();
  input.origins = origins;
  cab::FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};

  // All stand in a line. Each is 1 wide and touches the next one, two or three on either side.
  const struct {
    double spacing;
    std::size_t hits;
  } frames[] = {{1.5, 0}, {.75, 63}, {.4, 63 + 62}, {.3, 63 + 62 + 61}};
  std::vector<cab::Hit> hits(16);
  bool right = true;
  int retries = 0;
  for (const auto& frame : frames) {
    for (std::uint32_t i = 0; i < kCount; ++i) origins[3 * i] = i * frame.spacing;
    // quote
    job.hits = hits;
    cab::Status status = cab::run_frame(*engine, job);
    if (status == cab::Status::kHitsOverflow) {
      // hit_count is 0 and the buffer's contents are unspecified, but hits_needed is exact. Some room on top spares the
      // next frame its retry.
      hits.resize(job.hits_needed + job.hits_needed / 4);
      job.hits = hits;
      status = cab::run_frame(*engine, job);  // the same input gives the same hits, and now they fit
      ++retries;
    }
    // end quote
    check(status);
    right = right && job.hit_count == frame.hits;
  }
  std::printf("%zu hits in the last frame, %d retries\n", job.hit_count, retries);
  cab::destroy_engine(engine);
  return right && retries == 3 ? 0 : 1;
}
