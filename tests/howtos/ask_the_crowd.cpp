// A shot, a blast and a guard among 400 people: who is hit first, who is near, and who comes next.
#include <cab/world.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main() {
  constexpr std::uint32_t kSide = 20, kCount = kSide * kSide;
  const std::int32_t parents[] = {-1, 0};
  const cab::Leaf leaves[] = {{0, cab::axis_aligned_box({0, .8f, 0}, {.3f, .8f, .2f}), {}},
                              {1, cab::axis_aligned_box({0, 0, 0}, {.1f, .1f, .1f}), {}}};
  cab::World world;
  cab::BatchId people;
  cab::exit_on_error(world.add_batch({parents, {}, leaves, {}}, kCount, &people));

  // A body that stands, and a head 1.7 above the ground. People stand 2 apart.
  std::vector<float> poses;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 1.7f, 0});
    origins.insert(origins.end(), {2.0 * (i % kSide), 0, 2.0 * (i / kSide)});
  }
  world.input(people)->poses.data = poses.data();
  world.input(people)->origins = origins;

  // quote
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
  cab::QueryJob job;
  job.queries = queries;
  cab::exit_on_error(world.run_queries(job));
  const cab::Span<const cab::QueryHit> hits = world.query_hits();
  // end quote

  // Hits stand in the order of queries. The shot meets the head of person 1, 2 away less half a head; four bodies are
  // in the blast, whose centre is too low for heads; the guard's nearest is the body of person 0.
  int in_blast = 0;
  bool right =
      hits[0].query == 0 && hits[0].instance == 1 && hits[0].link == 1 && std::fabs(hits[0].distance - 1.9f) < 1e-5f;
  for (const cab::QueryHit& hit : hits) in_blast += hit.query == 1 && hit.link == 0;
  const cab::QueryHit& last = hits[hits.size - 1];
  right = right && in_blast == 4 && last.query == 2 && last.instance == 0 && std::fabs(last.distance - 2.7f) < 1e-5f;
  std::printf("the shot meets link %u of person %u after %.1f; %d bodies are in the blast; the guard sees person %u\n",
              hits[0].link, hits[0].instance, static_cast<double>(hits[0].distance), in_blast, last.instance);
  return right ? 0 : 1;
}
