// Runs the code that README.md shows: 10 000 cubes in a line, each of which touches the next.
#include <cab/cab.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

static std::uint32_t used = 0;

static void use(std::uint32_t instance_a, std::uint32_t link_a, std::uint32_t instance_b, std::uint32_t link_b) {
  if (instance_b == instance_a + 1 && link_a == 0 && link_b == 0) ++used;
}

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

static cab::Status run(cab::Engine* engine, cab::BatchId crowd, const float* poses, const double* origins,
                       cab::Hit* hits, std::size_t hit_capacity) {
#include "tests/howtos/readme_snippet.inl"
  return status;
}

int main() {
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const std::int32_t parents[] = {-1};
  const cab::Leaf leaves[] = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .5f, .5f}}, {}}};
  cab::ArticulationDesc cube;
  cube.link_parents = {parents, 1};
  cube.leaves = {leaves, 1};
  cab::ArticulationId articulation;
  check(cab::add_articulation(*engine, cube, &articulation));
  cab::BatchId crowd;
  check(cab::add_batch(*engine, {articulation, 10000, cab::BatchKind::kCharacters}, &crowd));

  std::vector<float> poses(std::size_t{7} * 10000, 0.f);
  std::vector<double> origins(std::size_t{3} * 10000, 0.);
  for (std::size_t i = 0; i < 10000; ++i) {
    poses[7 * i + 3] = 1;
    origins[3 * i] = .75 * static_cast<double>(i);
  }
  std::vector<cab::Hit> hits(20000);
  check(run(engine, crowd, poses.data(), origins.data(), hits.data(), hits.size()));
  cab::destroy_engine(engine);
  return used == 9999 ? 0 : 1;
}
