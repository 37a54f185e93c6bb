// A shot, a blast and a guard among 400 people: who is hit first, who is near, and who comes next.
#include <cab/cab.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

static void check(cab::Status status) {
  if (status == cab::Status::kOk) return;
  std::fprintf(stderr, "cab: %s\n", cab::to_string(status));
  std::exit(1);
}

int main() {
  constexpr std::uint32_t kSide = 20, kCount = kSide * kSide;
  cab::Engine* engine = nullptr;
  check(cab::create_engine({}, &engine));
  const std::int32_t parents[] = {-1, 0};
  const cab::Leaf leaves[] = {{0, {{0, .8f, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.3f, .8f, .2f}}, {}},
                              {1, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.1f, .1f, .1f}}, {}}};
  cab::ArticulationId person;
  check(cab::add_articulation(*engine, {{parents, 2}, {}, {leaves, 2}, {}}, &person));
  cab::BatchId people;
  check(cab::add_batch(*engine, {person, kCount, cab::BatchKind::kCharacters}, &people));
  cab::ReserveDesc room;
  room.queries = 64;  // without this, run_queries has no memory to work in
  check(cab::reserve(*engine, room));

  // A body that stands, and a head 1.7 above the ground. People stand 2 apart.
  std::vector<float> poses;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 1.7f, 0});
    origins.insert(origins.end(), {2.0 * (i % kSide), 0, 2.0 * (i / kSide)});
  }
  cab::BatchInput input;
  input.batch = people;
  input.poses.data = poses.data();
  input.origins = origins;

  cab::Query shot;  // by person 0, along the first row at the height of heads
  shot.position[1] = 1.7;
  shot.direction[0] = 1;
  shot.length = 100;
  shot.ignored_batch = people;
  shot.ignored_instance = 0;
  cab::Query blast;  // 2.3 about the middle of four people
  blast.kind = cab::QueryKind::kSphere;
  blast.want = cab::QueryWant::kAll;
  blast.position[0] = blast.position[2] = 21;
  blast.radius = 2.3f;
  cab::Query guard;  // the nearest link to a point outside, at most 5 away
  guard.kind = cab::QueryKind::kPoint;
  guard.position[0] = -3;
  guard.position[1] = 1;
  guard.length = 5;

  const cab::Query queries[] = {shot, blast, guard};
  cab::QueryHit hits[64];
  cab::QueryJob job;
  job.inputs = {&input, 1};
  job.queries = {queries, 3};
  job.hits = {hits, 64};
  check(cab::run_queries(*engine, job));

  // Hits stand in the order of queries. The shot meets the head of person 1, 2 away less half a head; four bodies are
  // in the blast, whose centre is too low for heads; the guard's nearest is the body of person 0.
  int in_blast = 0;
  bool right =
      hits[0].query == 0 && hits[0].instance == 1 && hits[0].link == 1 && std::fabs(hits[0].distance - 1.9f) < 1e-5f;
  for (std::size_t i = 0; i < job.hit_count; ++i) in_blast += hits[i].query == 1 && hits[i].link == 0;
  const cab::QueryHit& last = hits[job.hit_count - 1];
  right = right && in_blast == 4 && last.query == 2 && last.instance == 0 && std::fabs(last.distance - 2.7f) < 1e-5f;
  std::printf("the shot meets link %u of person %u after %.1f; %d bodies are in the blast; the guard sees person %u\n",
              hits[0].link, hits[0].instance, static_cast<double>(hits[0].distance), in_blast, last.instance);
  cab::destroy_engine(engine);
  return right ? 0 : 1;
}
