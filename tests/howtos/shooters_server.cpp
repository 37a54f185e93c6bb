// A shooter's server: 100 players with 20 hit boxes, 64 ticks a second. Each shot is judged at the shooter's own time.
#include <cab/world.h>

#include <cmath>
#include <cstdio>
#include <vector>

constexpr std::uint32_t kPlayers = 100, kBoxes = 20, kTicks = 64;
constexpr double kTick = 1.0 / 64;

// Where a player runs: along a lane of their own, 2 m from the next.
static double place(std::uint32_t player, double time) { return 2 * player + 5 * time; }

int main() {
  std::vector<std::int32_t> parents(kBoxes);
  std::vector<cab::Leaf> leaves(kBoxes);
  for (std::uint32_t i = 0; i < kBoxes; ++i) {
    parents[i] = static_cast<std::int32_t>(i) - 1;
    leaves[i] = {i, cab::axis_aligned_box({0, 0, 0}, {.1f, .05f, .1f}), {}};
  }
  cab::World world;
  cab::BatchId players;
  cab::exit_on_error(world.add_batch({parents, {}, leaves, {}}, kPlayers, &players));
  // quote
  cab::HistoryId history;
  cab::exit_on_error(cab::add_history(world.engine(), {players, kTicks}, &history));  // one second
  // end quote

  std::vector<float> poses(7 * kBoxes * kPlayers);
  std::vector<double> origins(3 * kPlayers);
  for (std::uint32_t p = 0; p < kPlayers; ++p)
    for (std::uint32_t i = 0; i < kBoxes; ++i) {
      float* const pose = poses.data() + 7 * (kBoxes * p + i);
      pose[3] = 1, pose[5] = .1f * static_cast<float>(i);  // one box above the other
    }
  std::size_t met = 0, right = 0;
  cab::BatchInput& input = *world.input(players);
  input.poses.data = poses.data();
  input.origins = origins;
  for (int tick = 0; tick < 200; ++tick) {
    const double now = tick * kTick;
    for (std::uint32_t p = 0; p < kPlayers; ++p) origins[3 * p] = place(p, now);
    // quote
    cab::exit_on_error(cab::record_tick(world.engine(), history, input, now));

    // Each player shoots at where they saw the next one, who was there 80 ms ago and more.
    std::vector<cab::Query> shots(kPlayers - 1);
    for (std::uint32_t p = 0; p + 1 < kPlayers; ++p) {
      cab::Query& shot = shots[p];
      shot.time = now - .08 - .001 * p;
      shot.position[0] = place(p + 1, std::fmax(shot.time, 0));  // before the first tick counts as the first
      shot.position[1] = 1.5;
      shot.position[2] = -50;
      shot.direction[2] = 1;
      shot.length = 100;
      shot.ignored_batch = players;
      shot.ignored_instance = p;
    }
    cab::QueryJob job;
    job.queries = shots;
    job.histories = {&history, 1};
    cab::exit_on_error(world.run_queries(job));
    // end quote
    met += job.hit_count;
    for (const cab::QueryHit& hit : world.query_hits())
      if (tick >= static_cast<int>(kTicks) && hit.instance == hit.query + 1 && hit.link == 15) ++right;
  }
  std::printf("%zu shots met, %zu of them right by a full history\n", met, right);
  return right == (200 - kTicks) * (kPlayers - 1) ? 0 : 1;
}
