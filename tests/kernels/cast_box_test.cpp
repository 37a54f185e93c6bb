// The kernels of rays in double as lanes: on every instruction set the bits of one double after the other. What these
// answers are worth is judged by tests/engine/queries.
#include "kernels/cast_box.h"
#include "kernels/enter_rays.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "perf/judge/oracle/random.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

using kernel::Vec3;
using oracle::Random;

// A length from very small to very large, or 0.
double any_length(Random& random) { return random.chance(0.1) ? 0 : random.log_uniform(1e-6, 1e6); }

void set_lane(const Vec3<double>& v, std::uint32_t lane, double (&to)[3][kLanes]) {
  to[0][lane] = v.x;
  to[1][lane] = v.y;
  to[2][lane] = v.z;
}

Vec3<double> any_vector(Random& random) {
  const auto unit = random.unit_vector();
  const double by = any_length(random);
  Vec3<double> out = {by * unit[0], by * unit[1], by * unit[2]};
  if (random.chance(0.2)) out.x = 0;
  if (random.chance(0.2)) out.y = -0.0;
  return out;
}

template <class Tile>
bool same_bytes(const Tile& a, const Tile& b) {
  return std::memcmp(&a, &b, sizeof(Tile)) == 0;
}

}  // namespace

TEST_CASE("rays enter an index with the same bits on every instruction set, at its cube") {
  Random random(91);
  std::size_t entering = 0, passing = 0;
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    const double center[3] = {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
    const double scale = std::ldexp(1.0, static_cast<int>(random.index(20)) - 10);
    kernel::RayTile tile;
    std::memset(static_cast<void*>(&tile), 0, sizeof(tile));
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      set_lane({center[0], center[1], center[2]}, lane, tile.center);
      tile.scale[lane] = scale;
      set_lane(any_vector(random), lane, tile.position);
      set_lane(any_vector(random), lane, tile.direction);
      tile.length[lane] = random.chance(0.2) ? HUGE_VAL : any_length(random);
      tile.radius[lane] = random.chance(0.5) ? 0 : any_length(random);
    }
    kernel::RayTile first = tile;
    available_kernels().front()->enter_rays(first);
    for (const kernel::KernelTable* const table : available_kernels()) {
      CAPTURE(name_of(*table));
      kernel::RayTile out = tile;
      table->enter_rays(out);
      CHECK(same_bytes(out, first));
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double along[3] = {first.along[0][lane], first.along[1][lane], first.along[2][lane]};
      CHECK(std::fabs(std::hypot(along[0], along[1], along[2]) - 1) < 1e-15);
      if (!(first.enters >> lane & 1)) {
        ++passing;
        continue;
      }
      ++entering;
      // The point where it enters is on the ray, and in a cube that is a little larger than the index's.
      for (std::uint32_t c = 0; c < 3; ++c) {
        const double at = scale * (tile.position[c][lane] - center[c]) + first.entered[lane] * along[c];
        const double radius = scale * tile.radius[lane], away = std::fabs(at) + first.entered[lane] + radius;
        CHECK(first.below[c][lane] <= at - radius);
        CHECK(first.above[c][lane] >= at + radius);
        if (std::fabs(along[c]) > 1e-9) CHECK(std::fabs(at) <= 1.02 + 1.01 * radius + 1e-7 * away);
      }
    }
  }
  CHECK(entering >= least_count(800, 300));
  CHECK(passing >= least_count(800, 300));
}

TEST_CASE("rays are cast against boxes with the same bits on every instruction set, and touch their faces") {
  Random random(92);
  std::size_t met = 0, missed = 0, inside = 0;
  for (std::uint64_t round = rounds(500); round > 0; --round) {
    kernel::CastTile tile;
    std::memset(static_cast<void*>(&tile), 0, sizeof(tile));
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      double axes[3][3];
      random.rotation(axes);
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t c = 0; c < 3; ++c) tile.axis[k][c][lane] = static_cast<float>(axes[k][c]);
        tile.half[k][lane] = static_cast<float>(random.chance(0.1) ? 0 : random.uniform(0.01, 1));
        tile.center[k][lane] = static_cast<float>(random.uniform(-1, 1));
        tile.apart[k][lane] = (lane == 0 ? 0.3 : 4) * random.uniform(-1, 1);
      }
      const auto away = random.unit_vector();
      Vec3<double> to = {tile.apart[0][lane] + static_cast<double>(tile.center[0][lane]) + 0.7 * away[0],
                         tile.apart[1][lane] + static_cast<double>(tile.center[1][lane]) + 0.7 * away[1],
                         tile.apart[2][lane] + static_cast<double>(tile.center[2][lane]) + 0.7 * away[2]};
      set_lane(kernel::normalized(to), lane, tile.along);
      tile.length[lane] = random.chance(0.2) ? HUGE_VAL : random.uniform(0, 12);
    }
    kernel::CastTile first = tile;
    available_kernels().front()->cast_boxes(first);
    for (const kernel::KernelTable* const table : available_kernels()) {
      CAPTURE(name_of(*table));
      kernel::CastTile out = tile;
      table->cast_boxes(out);
      CHECK(out.meets == first.meets);
      CHECK(out.inside == first.inside);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        if (!(first.meets >> lane & 1)) continue;
        CHECK(std::memcmp(&out.distance[lane], &first.distance[lane], sizeof(float)) == 0);
        for (std::uint32_t c = 0; c < 3; ++c) {
          CHECK(std::memcmp(&out.point[c][lane], &first.point[c][lane], sizeof(float)) == 0);
          CHECK(std::memcmp(&out.normal[c][lane], &first.normal[c][lane], sizeof(float)) == 0);
        }
      }
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      // Along each axis: how far beyond the half extent the ray's point is where it enters.
      double beyond[3], most = -HUGE_VAL;
      for (std::uint32_t k = 0; k < 3; ++k) {
        double way = 0;
        for (std::uint32_t c = 0; c < 3; ++c)
          way += static_cast<double>(tile.axis[k][c][lane]) *
                 (static_cast<double>(first.distance[lane]) * tile.along[c][lane] - tile.apart[c][lane] -
                  static_cast<double>(tile.center[c][lane]));
        beyond[k] = std::fabs(way) - static_cast<double>(tile.half[k][lane]);
        most = std::max(most, beyond[k]);
      }
      if (!(first.meets >> lane & 1)) {
        ++missed;
        continue;
      }
      CHECK(most < 1e-5);
      if (first.inside >> lane & 1) {
        ++inside;
        CHECK(first.distance[lane] == 0);
      } else {
        ++met;
        CHECK(most > -1e-5);  // on a face
      }
    }
  }
  CHECK(met >= least_count(1000, 500));
  CHECK(missed >= least_count(1000, 500));
  CHECK(inside >= least_count(20, 500));
}

}  // namespace cab::tests
