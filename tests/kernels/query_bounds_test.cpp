// The kernels of query_bounds.h and walk_index.h on every instruction set: queries are taken to floats with the pads of
// the engine, and no bounds may be missed that they meet in long double, by judges that are written in other ways:
// separating axes, clamping, corners.
#include "kernels/walk_index.h"

#include "layout/error_bounds.h"
#include "layout/rounded_up.h"
#include "perf/judge/oracle/random.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace cab::tests {
namespace {

using oracle::Random;
using Real = long double;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t kAllLanes = (1u << kLanes) - 1;

struct Point {
  double v[3];
};

// Bounds as they are, and as they are stored for the kernels.
struct Row {
  double lo[kLanes][3], hi[kLanes][3];
  std::size_t stride;
  alignas(64) float sides[6 * 4 * kLanes];

  explicit Row(std::size_t times) : stride(times * kLanes) { std::fill(std::begin(sides), std::end(sides), kNan); }
  float& side(std::uint32_t s, std::uint32_t lane) { return sides[s * stride + lane]; }
  kernel::BoundsRow row() const { return {sides, stride}; }
};

// Where a query is asked, and how its numbers become floats: in the index, whose bounds grow by kQueryPad, or at the
// leaves of an instance, whose bounds are floats.
struct Frame {
  bool is_index;
  double size;  // the largest coordinate of bounds
};

Frame any_frame(Random& random) {
  const bool is_index = random.chance(0.5);
  return {is_index, is_index ? 1 : random.log_uniform(1e-15, 1e15)};
}

// Random bounds: many of them touch others or have no width.
Row any_row(Random& random, const Frame& frame) {
  Row out(1 + random.index(4));
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    for (std::uint32_t c = 0; c < 3; ++c) {
      double lo = frame.size * random.uniform(-1, 1), hi = random.chance(0.2) ? lo : frame.size * random.uniform(-1, 1);
      if (random.chance(0.3)) hi = lo + frame.size * random.log_uniform(1e-6, 0.1);
      if (random.chance(0.1)) lo = 0;
      if (lo > hi) std::swap(lo, hi);
      hi = std::min(hi, frame.size);
      if (!frame.is_index) {
        lo = static_cast<double>(static_cast<float>(lo));
        hi = static_cast<double>(static_cast<float>(hi));
      }
      out.lo[lane][c] = lo;
      out.hi[lane][c] = hi;
      const double grow = frame.is_index ? kQueryPad : 0;
      out.side(c, lane) = static_cast<float>(lo - grow);
      out.side(3 + c, lane) = static_cast<float>(hi + grow);
    }
  return out;
}

// A point in, on or about some bounds.
Point point_about(Random& random, const Row& row, double margin) {
  Point out;
  const std::uint32_t lane = random.index(kLanes);
  for (std::uint32_t c = 0; c < 3; ++c) {
    const double lo = row.lo[lane][c], hi = row.hi[lane][c];
    const std::uint32_t where = random.index(4);
    out.v[c] = where == 0 ? lo : where == 1 ? hi : random.uniform(lo, hi);
    if (where == 3) out.v[c] += margin * random.uniform(-1, 1);
  }
  return out;
}

double sum_of(const Point& p) { return std::fabs(p.v[0]) + std::fabs(p.v[1]) + std::fabs(p.v[2]); }

double rounding_pad(const Frame& frame, const Point& at, double index_pad) {
  return frame.is_index ? index_pad : kQueryLeafPad * (sum_of(at) + frame.size);
}

bool same_float(float a, float b) { return same_bits(a, b) || (std::isnan(a) && std::isnan(b)); }

using Entries = std::array<float, kLanes>;

// The lanes of one row that a walk through an index of one node meets, and when it enters each.
template <class Walk>
std::uint32_t walk_row(const kernel::BoundsRow& row, float* entry, Walk&& walk) {
  AabbTile node;
  for (std::uint32_t c = 0; c < 3; ++c) {
    std::copy_n(row.side(c), kLanes, node.lo[c]);
    std::copy_n(row.side(3 + c), kLanes, node.hi[c]);
  }
  const std::uint16_t used = kAllLanes;
  const std::uint32_t level_begin[] = {0, 1};
  kernel::IndexWalk way;
  kernel::MetBounds first;
  const bool is_met = walk(kernel::IndexNodes{&node, &used, level_begin, 1}, way, &first);
  CHECK(way.opened == 1);
  std::copy_n(way.nodes[0].entry, kLanes, entry);
  return is_met ? way.nodes[0].met | 1u << first.lane : 0;
}
std::uint32_t ray_bounds(const kernel::KernelTable& table, const kernel::BoundsRow& row, const kernel::RayLanes& ray,
                         float* entry) {
  return walk_row(row, entry, [&](const kernel::IndexNodes& index, kernel::IndexWalk& way, kernel::MetBounds* first) {
    return table.walk_ray(index, ray, way, first);
  });
}
std::uint32_t point_bounds(const kernel::KernelTable& table, const kernel::BoundsRow& row,
                           const kernel::PointLanes& point, float* entry) {
  return walk_row(row, entry, [&](const kernel::IndexNodes& index, kernel::IndexWalk& way, kernel::MetBounds* first) {
    return table.walk_point(index, point, way, first);
  });
}

// What a kernel answers, by call(table, row, entry); the same on every instruction set, and whatever is in lanes that
// are not used.
template <class Call>
std::uint32_t answer(Random& random, const Row& row, Entries* entries, Call&& call) {
  alignas(64) float first[kLanes] = {};
  std::uint32_t out = 0;
  const auto unused = static_cast<std::uint32_t>(random.next_u64()) & kAllLanes;
  constexpr float kAny[] = {kNan, kInfinity, -kInfinity, 0, -0.0f, 1e-42f, 3e38f, -1};
  Row other = row;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    if (unused >> lane & 1)
      for (std::uint32_t s = 0; s < 6; ++s) other.side(s, lane) = kAny[random.index(8)];
  alignas(64) float first_other[kLanes] = {};
  std::uint32_t out_other = 0;
  for (const kernel::KernelTable* const table : available_kernels()) {
    CAPTURE(name_of(*table));
    alignas(64) float entry[kLanes] = {}, entry_other[kLanes] = {};
    const std::uint32_t met = call(*table, row.row(), entry), met_other = call(*table, other.row(), entry_other);
    if (table->isa == Isa::kScalar) {
      out = met;
      out_other = met_other;
      std::copy_n(entry, kLanes, first);
      std::copy_n(entry_other, kLanes, first_other);
    }
    CHECK(met == out);
    CHECK(met_other == out_other);
    CHECK(met <= kAllLanes);
    CHECK(((met ^ met_other) & ~unused) == 0);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      CHECK(same_float(entry[lane], first[lane]));
      CHECK(same_float(entry_other[lane], first_other[lane]));
      if (!(unused >> lane & 1)) CHECK(same_float(entry[lane], entry_other[lane]));
    }
  }
  if (entries) std::copy_n(first, kLanes, entries->begin());
  return out;
}

// Whether the segment of a ray up to a parameter and bounds overlap: along none of their six separating axes are they
// apart.
bool segment_meets(const Row& row, std::uint32_t lane, const Point& from, const Real (&along)[3], Real end) {
  Real middle[3], way[3], half[3];
  for (std::uint32_t c = 0; c < 3; ++c) {
    half[c] = (static_cast<Real>(row.hi[lane][c]) - row.lo[lane][c]) / 2;
    way[c] = along[c] * end / 2;
    middle[c] = from.v[c] + way[c] - (static_cast<Real>(row.hi[lane][c]) + row.lo[lane][c]) / 2;
  }
  for (std::uint32_t c = 0; c < 3; ++c) {
    if (std::fabs(middle[c]) > half[c] + std::fabs(way[c])) return false;
    const std::uint32_t a = (c + 1) % 3, b = (c + 2) % 3;
    if (std::fabs(middle[a] * way[b] - middle[b] * way[a]) > half[a] * std::fabs(way[b]) + half[b] * std::fabs(way[a]))
      return false;
  }
  return true;
}

}  // namespace

TEST_CASE("query bounds: no bounds are missed that a ray meets, and none is entered later than it is") {
  std::size_t met_count = 0, tried = 0;
  Random random(61);
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Frame frame = any_frame(random);
    const Row row = any_row(random, frame);
    const Point from = point_about(random, row, 0.3 * frame.size), to = point_about(random, row, 0.3 * frame.size);
    double direction[3], size = 0;
    for (std::uint32_t c = 0; c < 3; ++c) {
      direction[c] = to.v[c] - from.v[c];
      if (random.chance(0.2)) direction[c] = random.chance(0.5) ? 0 : frame.size * 1e-14;
      size += direction[c] * direction[c];
    }
    if (!(size > 0)) continue;
    Real along[3];
    kernel::RayLanes ray;
    const double pad = rounding_pad(frame, from, kQueryRayPad), end = frame.size * random.log_uniform(1e-3, 8);
    for (std::uint32_t c = 0; c < 3; ++c) {
      direction[c] /= std::sqrt(size);
      along[c] = direction[c];
      const double least = std::max(std::fabs(direction[c]), kQueryLeastDirection);
      ray.inverse[c] = static_cast<float>(1 / (direction[c] < 0 ? -least : least));
      ray.above[c] = static_cast<float>(from.v[c] + pad);
      ray.below[c] = static_cast<float>(from.v[c] - pad);
    }
    ray.begin = 0;
    ray.end = random.chance(0.2) ? kInfinity : float_above(end + (frame.is_index ? kQueryPad : 0));
    Entries entry;
    const std::uint32_t met =
        answer(random, row, &entry, [&](const kernel::KernelTable& table, const kernel::BoundsRow& bounds, float* to_) {
          return ray_bounds(table, bounds, ray, to_);
        });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      ++tried;
      if (!segment_meets(row, lane, from, along, end)) continue;
      ++met_count;
      CAPTURE(lane);
      CAPTURE(frame.size);
      CHECK((met >> lane & 1) == 1);
      Real low = 0, high = end;
      for (int halving = 0; halving < 60; ++halving) {
        const Real middle = (low + high) / 2;
        (segment_meets(row, lane, from, along, middle) ? high : low) = middle;
      }
      CHECK(static_cast<Real>(entry[lane]) <= high * (1 + 4 * 0x1p-24L) + 1e-300L);
      CHECK(entry[lane] >= 0);
    }
  }
  MESSAGE("rays and bounds: ", tried, ", met: ", met_count);
  CHECK(met_count >= least_count(5000, 6000));
}

TEST_CASE("query bounds: a ray that misses bounds by more than its pads is told that it does") {
  Random random(62);
  std::size_t missed = 0, apart = 0;
  for (std::uint64_t round = rounds(2000); round > 0; --round) {
    const Frame frame = {true, 1};
    const Row row = any_row(random, frame);
    const Point from = point_about(random, row, 0.5);
    const oracle::Vec3<double> direction = random.unit_vector();
    Real along[3];
    kernel::RayLanes ray;
    for (std::uint32_t c = 0; c < 3; ++c) {
      along[c] = direction[c];
      ray.inverse[c] = static_cast<float>(1 / direction[c]);
      ray.above[c] = static_cast<float>(from.v[c] + kQueryRayPad);
      ray.below[c] = static_cast<float>(from.v[c] - kQueryRayPad);
    }
    ray.begin = 0;
    ray.end = 8;
    const std::uint32_t met = answer(
        random, row, nullptr, [&](const kernel::KernelTable& table, const kernel::BoundsRow& bounds, float* entry) {
          return ray_bounds(table, bounds, ray, entry);
        });
    Row grown = row;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        grown.lo[lane][c] -= 2 * kQueryPad;
        grown.hi[lane][c] += 2 * kQueryPad;
      }
      if (segment_meets(grown, lane, from, along, 8)) continue;
      ++apart;
      missed += (met >> lane & 1) == 0;
    }
  }
  CHECK(apart >= least_count(5000, 2000));
  CHECK(missed == apart);
}

TEST_CASE("query bounds: no bounds are missed that are within reach of a point, and none is said to be farther") {
  Random random(63);
  std::size_t met_count = 0, apart_count = 0;
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Frame frame = any_frame(random);
    const Row row = any_row(random, frame);
    const Point at = point_about(random, row, frame.size);
    const double pad = rounding_pad(frame, at, kQueryRayPad * (1 + sum_of(at)));
    const double most = random.chance(0.2) ? 0 : frame.size * random.log_uniform(1e-6, 4);
    kernel::PointLanes point;
    for (std::uint32_t c = 0; c < 3; ++c) {
      point.above[c] = float_above(at.v[c] + pad);
      point.below[c] = float_below(at.v[c] - pad);
    }
    const double reach = most + pad;
    point.most_sq = random.chance(0.1)
                        ? kInfinity
                        : float_above(reach * reach * (1 + kQueryRayPad)) + 4 * std::numeric_limits<float>::min();
    Entries entry;
    const std::uint32_t met =
        answer(random, row, &entry, [&](const kernel::KernelTable& table, const kernel::BoundsRow& bounds, float* to) {
          return point_bounds(table, bounds, point, to);
        });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      Real sum = 0;
      for (std::uint32_t c = 0; c < 3; ++c) {
        const Real nearest =
            std::clamp<Real>(at.v[c], static_cast<Real>(row.lo[lane][c]), static_cast<Real>(row.hi[lane][c]));
        sum += (at.v[c] - nearest) * (at.v[c] - nearest);
      }
      CAPTURE(lane);
      CAPTURE(frame.size);
      CHECK(static_cast<Real>(entry[lane]) <= sum * (1 + kQueryRayPad));
      if (std::sqrt(sum) > most && point.most_sq < kInfinity) {
        if (std::sqrt(sum) < 1.0001L * most + 1e-4L * static_cast<Real>(frame.size)) continue;
        ++apart_count;
        CHECK((met >> lane & 1) == 0);
        CHECK(static_cast<Real>(entry[lane]) >= 0.9L * sum);
        continue;
      }
      ++met_count;
      CHECK((met >> lane & 1) == 1);
    }
  }
  CHECK(met_count >= least_count(5000, 6000));
  CHECK(apart_count >= least_count(5000, 6000));
}

TEST_CASE("query bounds: no bounds are missed that overlap others, and those that are apart are told") {
  Random random(64);
  std::size_t met_count = 0, apart_count = 0;
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Frame frame = any_frame(random);
    const Row row = any_row(random, frame);
    const Point at = point_about(random, row, frame.size);
    const double pad = rounding_pad(frame, at, kQueryRayPad * (1 + sum_of(at)));
    float lo[3], hi[3];
    double half[3];
    for (std::uint32_t c = 0; c < 3; ++c) {
      half[c] = random.chance(0.2) ? 0 : frame.size * random.log_uniform(1e-6, 1);
      lo[c] = float_below(at.v[c] - (half[c] + pad));
      hi[c] = float_above(at.v[c] + (half[c] + pad));
    }
    const std::uint32_t met =
        answer(random, row, nullptr, [&](const kernel::KernelTable& table, const kernel::BoundsRow& bounds, float*) {
          return table.overlap_bounds(bounds, lo, hi);
        });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      Real gap = -1;  // the widest along an axis
      for (std::uint32_t c = 0; c < 3; ++c) {
        const Real middle = (static_cast<Real>(row.lo[lane][c]) + row.hi[lane][c]) / 2;
        const Real extent = (static_cast<Real>(row.hi[lane][c]) - row.lo[lane][c]) / 2;
        gap = std::max(gap, std::fabs(at.v[c] - middle) - extent - half[c]);
      }
      CAPTURE(lane);
      CAPTURE(frame.size);
      if (gap <= 0) {
        ++met_count;
        CHECK((met >> lane & 1) == 1);
      } else if (gap > 1e-4L * static_cast<Real>(frame.size)) {
        ++apart_count;
        CHECK((met >> lane & 1) == 0);
      }
    }
  }
  CHECK(met_count >= least_count(3000, 6000));
  CHECK(apart_count >= least_count(5000, 6000));
}

TEST_CASE("query bounds: bounds that share a side with others overlap them, and one float farther they do not") {
  Random random(66);
  for (std::uint64_t round = rounds(500); round > 0; --round) {
    Row row = any_row(random, any_frame(random));
    const std::uint32_t lane = random.index(kLanes), side = random.index(6), c = side % 3;
    const float at = row.side(side, lane);
    float lo[3] = {-kInfinity, -kInfinity, -kInfinity}, hi[3] = {kInfinity, kInfinity, kInfinity};
    const auto is_met = [&] {
      const std::uint32_t met = answer(random, row, nullptr, [&](const auto& table, const auto& bounds, float*) {
        return table.overlap_bounds(bounds, lo, hi);
      });
      return met >> lane & 1;
    };
    float& end = side < 3 ? hi[c] : lo[c];
    end = at;
    CHECK(is_met() == 1);
    end = std::nextafter(at, side < 3 ? -kInfinity : kInfinity);
    CHECK(is_met() == 0);
  }
}

TEST_CASE("query bounds: no bounds are missed of which a corner is behind a plane") {
  Random random(65);
  std::size_t met_count = 0, apart_count = 0;
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Frame frame = any_frame(random);
    const Row row = any_row(random, frame);
    oracle::Vec3<double> normal = random.unit_vector();
    if (random.chance(0.3)) normal[random.index(3)] = 0;
    if (random.chance(0.2)) normal = {{0, random.sign(), 0}};
    const double by = 1 / oracle::norm_max(normal);
    const Point through = point_about(random, row, 0.1 * frame.size);
    double offset = 0;
    float n[3];
    for (std::uint32_t c = 0; c < 3; ++c) {
      normal[c] *= by;
      n[c] = static_cast<float>(normal[c]);
      offset += normal[c] * through.v[c];
    }
    const double reach = (frame.is_index ? 2 : 3) * frame.size;
    const float most = float_above(offset + kQueryLeafPad * reach);
    const std::uint32_t met =
        answer(random, row, nullptr, [&](const kernel::KernelTable& table, const kernel::BoundsRow& bounds, float*) {
          return table.plane_bounds(bounds, n, most);
        });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      Real lowest = std::numeric_limits<Real>::infinity();
      for (unsigned corner = 0; corner < 8; ++corner) {
        Real height = 0;
        for (std::uint32_t c = 0; c < 3; ++c)
          height += static_cast<Real>(normal[c]) * (corner >> c & 1 ? row.hi[lane][c] : row.lo[lane][c]);
        lowest = std::min(lowest, height);
      }
      CAPTURE(lane);
      CAPTURE(frame.size);
      if (lowest <= offset) {
        ++met_count;
        CHECK((met >> lane & 1) == 1);
      } else if (lowest > offset + 1e-4L * static_cast<Real>(frame.size)) {
        ++apart_count;
        CHECK((met >> lane & 1) == 0);
      }
    }
  }
  CHECK(met_count >= least_count(5000, 6000));
  CHECK(apart_count >= least_count(5000, 6000));
}

TEST_CASE("query bounds: infinite and NaN bounds are never left out by that, and infinite queries meet all") {
  Random random(66);
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    Row row = any_row(random, {true, 1});
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint32_t what = random.index(4);
        if (what == 0) continue;
        row.side(c, lane) = what == 1 ? -kInfinity : what == 2 ? kNan : -1.5f;
        row.side(3 + c, lane) = what == 1 ? kInfinity : what == 2 ? kNan : 1.5f;
      }
    // From the middle of what any_row makes, as long as a ray can be.
    kernel::RayLanes ray = {{0, 0, 0}, {0, 0, 0}, {0x1p40f, -0x1p40f, 0x1p40f}, -kInfinity, kInfinity};
    kernel::PointLanes point = {{0, 0, 0}, {0, 0, 0}, kInfinity};
    const float low[3] = {-kInfinity, -kInfinity, -kInfinity}, high[3] = {kInfinity, kInfinity, kInfinity};
    const float normal[3] = {1, -0.5f, 0};
    using Table = kernel::KernelTable;
    using Bounds = kernel::BoundsRow;
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float* entry) {
            return point_bounds(table, bounds, point, entry);
          }) == kAllLanes);
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float*) {
            return table.overlap_bounds(bounds, low, high);
          }) == kAllLanes);
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float*) {
            return table.plane_bounds(bounds, normal, kInfinity);
          }) == kAllLanes);
    // A ray meets those whose known sides are about its start.
    const std::uint32_t met = answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float* entry) {
      return ray_bounds(table, bounds, ray, entry);
    });
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      bool is_about = true;
      for (std::uint32_t c = 0; c < 3; ++c)
        is_about = is_about && !(row.side(c, lane) > 0) && !(row.side(3 + c, lane) < 0);
      if (is_about) CHECK((met >> lane & 1) == 1);
    }
  }
}

TEST_CASE("query bounds: denormal bounds and queries are not lost") {
  Random random(67);
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    Row row(1);
    Point at;
    for (double& v : at.v) v = random.uniform(-1e-40, 1e-40);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      for (std::uint32_t c = 0; c < 3; ++c) {
        row.side(c, lane) = static_cast<float>(at.v[c] - random.uniform(0, 1e-40));
        row.side(3 + c, lane) = static_cast<float>(at.v[c] + random.uniform(0, 1e-40));
        row.side(c, lane) = std::nextafter(row.side(c, lane), -kInfinity);
        row.side(3 + c, lane) = std::nextafter(row.side(3 + c, lane), kInfinity);
      }
    float above[3], below[3];
    kernel::RayLanes ray;
    kernel::PointLanes point;
    for (std::uint32_t c = 0; c < 3; ++c) {
      above[c] = ray.above[c] = point.above[c] = static_cast<float>(at.v[c]);
      below[c] = ray.below[c] = point.below[c] = static_cast<float>(at.v[c]);
      ray.inverse[c] = c == random.index(3) ? 1 : 0x1p40f;
    }
    ray.begin = 0;
    ray.end = kInfinity;
    point.most_sq = 4 * std::numeric_limits<float>::min();
    using Table = kernel::KernelTable;
    using Bounds = kernel::BoundsRow;
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float* entry) {
            return ray_bounds(table, bounds, ray, entry);
          }) == kAllLanes);
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float* entry) {
            return point_bounds(table, bounds, point, entry);
          }) == kAllLanes);
    CHECK(answer(random, row, nullptr, [&](const Table& table, const Bounds& bounds, float*) {
            return table.overlap_bounds(bounds, below, above);
          }) == kAllLanes);
  }
}

TEST_CASE("query bounds: a walk through an index meets what every lane meets, the nearest of a node first") {
  Random random(68);
  std::size_t met_count = 0, skipped_count = 0;
  for (std::uint64_t round = rounds(400); round > 0; --round) {
    // A level of up to sixteen nodes below one.
    const std::uint32_t nodes = 1 + random.index(kLanes);
    std::vector<AabbTile> tiles(nodes + 1);
    std::vector<std::uint16_t> used(nodes + 1);
    AabbTile& top = tiles[nodes];
    used[nodes] = static_cast<std::uint16_t>((1u << nodes) - 1);
    for (std::uint32_t n = 0; n < nodes; ++n) {
      used[n] = static_cast<std::uint16_t>((1u << (1 + random.index(kLanes))) - 1);
      for (std::uint32_t c = 0; c < 3; ++c) {
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
          tiles[n].lo[c][lane] = static_cast<float>(random.uniform(-1, 0.9));
          tiles[n].hi[c][lane] = tiles[n].lo[c][lane] + static_cast<float>(random.uniform(0, 0.3));
        }
        const auto count = static_cast<std::ptrdiff_t>(__builtin_popcount(used[n]));
        top.lo[c][n] = *std::min_element(tiles[n].lo[c], tiles[n].lo[c] + count);
        top.hi[c][n] = *std::max_element(tiles[n].hi[c], tiles[n].hi[c] + count);
      }
    }
    const std::uint32_t level_begin[] = {0, nodes, nodes + 1};
    const kernel::IndexNodes index = {tiles.data(), used.data(), level_begin, 2};
    kernel::PointLanes point;
    for (std::uint32_t c = 0; c < 3; ++c)
      point.above[c] = point.below[c] = static_cast<float>(random.uniform(-1.2, 1.2));
    point.most_sq = static_cast<float>(random.uniform(0, 1));
    std::vector<std::pair<std::uint32_t, std::uint32_t>> wanted, first_of_all;
    for (std::uint32_t n = 0; n < nodes; ++n) {
      alignas(64) float entry[kLanes];
      const std::uint32_t met = point_bounds(*available_kernels().front(), {&tiles[n].lo[0][0], kLanes}, point, entry);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        if (met & used[n] & 1u << lane) wanted.emplace_back(n, lane);
    }
    met_count += wanted.size();
    for (const kernel::KernelTable* const table : available_kernels()) {
      CAPTURE(name_of(*table));
      std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
      kernel::IndexWalk way;
      kernel::MetBounds met, last = {};
      while (table->walk_point(index, point, way, &met)) {
        if (!found.empty() && met.node == last.node) CHECK(met.entry >= last.entry);
        found.emplace_back(met.node, met.lane);
        last = met;
      }
      if (first_of_all.empty()) first_of_all = found;
      CHECK(found == first_of_all);
      std::sort(found.begin(), found.end());
      CHECK(found == wanted);
      if (wanted.size() < 2) continue;
      // What is farther than the nearest is left out as soon as that is known.
      kernel::IndexWalk shorter_way;
      kernel::PointLanes shorter = point;
      REQUIRE(table->walk_point(index, shorter, shorter_way, &met));
      shorter.most_sq = met.entry;
      std::size_t left = 1;
      while (table->walk_point(index, shorter, shorter_way, &last)) {
        ++left;
        CHECK(last.entry <= met.entry);
      }
      skipped_count += wanted.size() - left;
    }
  }
  CHECK(met_count >= least_count(1000, 400));
  CHECK(skipped_count >= least_count(1000, 400));
}

}  // namespace cab::tests
