// A shooter's server with skins: each shot meets the skin itself, where it was at the shooter's own time.
#include <cab/skin.h>
#include <cab/world.h>

#include <cmath>
#include <cstdio>
#include <vector>

constexpr std::uint32_t kPlayers = 64, kTicks = 64;
constexpr double kTick = 1.0 / 64, kWaist = .9, kHalf = .15;

// How far a player leans at a time, in radians.
static double lean(std::uint32_t player, double time) { return .3 * std::sin(time + player); }

// A column of four sides on two joints, hips and chest, whose skin bends at the waist.
static cab::rig::SkinBodies make_body() {
  const std::int32_t parents[] = {-1, 0};
  std::vector<float> vertices, weights, binds(32), rest(32);
  std::vector<std::uint32_t> triangles, bones;
  for (std::uint32_t ring = 0; ring <= 18; ++ring)
    for (std::uint32_t side = 0; side < 4; ++side) {
      const double z = .1 * ring, of_chest = std::fmin(1, std::fmax(0, (z - .75) / .3));
      for (const double x : {side % 3 == 0 ? -kHalf : kHalf, side < 2 ? -kHalf : kHalf, z})
        vertices.push_back(static_cast<float>(x));
      for (std::uint32_t bone = 0; bone < 2; ++bone) {
        bones.push_back(bone);
        weights.push_back(static_cast<float>(bone == 1 ? of_chest : 1 - of_chest));
      }
      if (ring == 18) continue;
      const std::uint32_t low = 4 * ring + side, beside = 4 * ring + (side + 1) % 4;
      for (const std::uint32_t v : {low, beside, low + 4, beside, beside + 4, low + 4}) triangles.push_back(v);
    }
  for (std::uint32_t joint = 0; joint < 2; ++joint) {
    for (std::uint32_t k = 0; k < 16; k += 5) rest[16 * joint + k] = binds[16 * joint + k] = 1;
    rest[16 * joint + 14] = joint == 1 ? static_cast<float>(kWaist) : 0;
    binds[16 * joint + 14] = -rest[16 * joint + 14];
  }
  // quote
  cab::rig::Skin skin;
  skin.joint_parents = parents;
  skin.poses = rest;
  skin.vertices = vertices;
  skin.triangles = triangles;
  skin.influence_count = 2;
  skin.influence_bones = bones;
  skin.influence_weights = weights;
  skin.inverse_bind = binds;
  cab::rig::SkinBodies bodies;
  if (surface_from_skin(skin, {}, &bodies) != cab::rig::SkinStatus::kOk) std::printf("no surface\n");
  // end quote
  return bodies;
}

int main() {
  const cab::rig::SkinBodies body = make_body();
  cab::World world;
  cab::BatchId players;
  cab::exit_on_error(world.add_batch(body.desc(), kPlayers, &players));
  cab::HistoryId history;
  cab::exit_on_error(cab::add_history(world.engine(), {players, kTicks}, &history));  // one second
  cab::ReserveDesc room;
  room.queries = kPlayers;
  cab::exit_on_error(cab::reserve(world.engine(), room));

  std::vector<float> poses(7 * 2 * kPlayers);
  std::vector<double> origins(3 * kPlayers);
  cab::BatchInput& input = *world.input(players);
  input.poses.data = poses.data();
  input.origins = origins;
  std::size_t met = 0, right = 0;
  for (int tick = 0; tick < 200; ++tick) {
    const double now = tick * kTick;
    for (std::uint32_t p = 0; p < kPlayers; ++p) {
      float *const hips = poses.data() + 14 * p, *const chest = hips + 7;
      origins[3 * p] = 2 * p;
      hips[3] = 1;
      chest[0] = static_cast<float>(std::sin(lean(p, now) / 2));  // about x
      chest[3] = static_cast<float>(std::cos(lean(p, now) / 2));
      chest[6] = static_cast<float>(kWaist);
    }
    cab::exit_on_error(cab::record_tick(world.engine(), history, input, now));

    // Along y, 1.5 m above the ground, at where each player was 80 ms ago and more.
    std::vector<cab::Query> shots(kPlayers);
    for (std::uint32_t p = 0; p < kPlayers; ++p) {
      shots[p].time = now - .08 - .001 * p;
      shots[p].position[0] = 2 * p + .05;
      shots[p].position[1] = -50;
      shots[p].position[2] = 1.5;
      shots[p].direction[1] = 1;
      shots[p].length = 100;
    }
    std::vector<cab::QueryHit> hits(kPlayers);
    std::vector<cab::SurfacePoint> points(kPlayers);
    // quote
    cab::QueryJob job;
    job.queries = shots;
    job.histories = {&history, 1};
    job.exact = cab::Exact::kSurface;
    job.hits = hits;
    job.surface_points = points;
    cab::exit_on_error(cab::run_queries(world.engine(), job));
    // end quote
    met += job.hit_count;
    for (std::size_t h = 0; h < job.hit_count; ++h) {
      // Where the front of the chest is 1.5 m above the ground; and the three corners of a triangle say the same place.
      const double angle = lean(hits[h].instance, shots[hits[h].query].time), c = std::cos(angle), s = std::sin(angle);
      const double y = -kHalf * c - (1.5 - kWaist + kHalf * s) / c * s;
      const float* const weight = points[h].weights;
      if (tick >= static_cast<int>(kTicks) && hits[h].link == 1 && std::fabs(hits[h].distance - 50 - y) < 1e-3 &&
          std::fabs(weight[0] + weight[1] + weight[2] - 1) < 1e-5f)
        ++right;
    }
  }
  std::printf("%zu shots met a skin, %zu of them right by a full history\n", met, right);
  return right == (200 - kTicks) * kPlayers ? 0 : 1;
}
