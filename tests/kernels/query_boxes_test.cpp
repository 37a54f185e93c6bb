// The kernels of query_boxes.h on every instruction set: no box is missed that a query meets in long double, by judges
// that know a box as the image of a cube: all points center + sum x_k axis_k with |x_k| <= half_k, however skew.
#include "kernels/query_boxes.h"

#include "layout/rounded_up.h"
#include "perf/judge/oracle/random.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using oracle::Random;
using Real = long double;
using Point = std::array<Real, 3>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kAllLanes = (1u << kLanes) - 1;

// Sixteen boxes about an instance, no coordinate of which exceeds `reach`.
struct Boxes {
  BoxTile tile;
  double reach = 0;
};

// Boxes whose axes are rounded, and skew by up to 12 u more, as posed boxes may be. Many are flat, thin or points.
Boxes any_boxes(Random& random) {
  constexpr double kSkew = 12 * 0x1p-24;
  const double size = random.log_uniform(1e-12, 1e12);
  Boxes out;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    Box box;
    double axis[3][3];
    random.rotation(axis);
    if (random.chance(0.2))
      for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 3; ++c) axis[k][c] = k == c;
    for (int k = 0; k < 3; ++k) {
      box.center[k] = static_cast<float>(size * random.uniform(-1, 1));
      box.half[k] = static_cast<float>(random.chance(0.15) ? 0 : size * random.log_uniform(1e-4, 0.5));
      for (int c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[k][c] + kSkew * random.uniform(-1, 1) / 4);
    }
    set_lane(box, lane, out.tile);
    for (int c = 0; c < 3; ++c) {
      double extent = std::fabs(static_cast<double>(box.center[c]));
      for (int k = 0; k < 3; ++k)
        extent += static_cast<double>(box.half[k]) * std::fabs(static_cast<double>(box.axis[k][c]));
      out.reach = std::max(out.reach, extent);
    }
  }
  return out;
}

// A box in long double.
struct Judged {
  Point center;
  Real axis[3][3];
  Real half[3];

  Judged(const BoxTile& tile, std::uint32_t lane) {
    for (std::size_t c = 0; c < 3; ++c) {
      center[c] = static_cast<Real>(tile.center[c][lane]);
      half[c] = static_cast<Real>(tile.half[c][lane]);
      for (std::size_t k = 0; k < 3; ++k) axis[k][c] = static_cast<Real>(tile.axis[k][c][lane]);
    }
  }

  // The x with sum x_k axis_k = v, by Cramer's rule.
  Point coordinates_of(const Point& v) const {
    const auto determinant = [](const Real* a, const Real* b, const Real* c) {
      return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]);
    };
    const Real all = determinant(axis[0], axis[1], axis[2]);
    return {determinant(v.data(), axis[1], axis[2]) / all, determinant(axis[0], v.data(), axis[2]) / all,
            determinant(axis[0], axis[1], v.data()) / all};
  }

  Point point_at(const Point& x) const {
    Point out = center;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) out[c] += x[k] * axis[k][c];
    return out;
  }

  // The range of t for which from + t along is in the box. Returns false if it is empty.
  bool meets(const Point& from, const Point& along, Real begin, Real end, Real* first) const {
    const Point x = coordinates_of({from[0] - center[0], from[1] - center[1], from[2] - center[2]});
    const Point speed = coordinates_of(along);
    for (std::size_t k = 0; k < 3; ++k) {
      if (speed[k] == 0) {
        if (std::fabs(x[k]) > half[k]) return false;
        continue;
      }
      const Real a = (-half[k] - x[k]) / speed[k], b = (half[k] - x[k]) / speed[k];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    *first = begin;
    return begin <= end;
  }

  // The distance of a point, by moving the nearest point of the box along one axis after the other until it stays.
  Real distance_to(const Point& p) const {
    Point x = {};
    Point rest = {p[0] - center[0], p[1] - center[1], p[2] - center[2]};
    for (int sweep = 0; sweep < 60; ++sweep)
      for (std::size_t k = 0; k < 3; ++k) {
        Real along = 0, length = 0;
        for (std::size_t c = 0; c < 3; ++c) along += axis[k][c] * rest[c], length += axis[k][c] * axis[k][c];
        const Real to = std::clamp(x[k] + along / length, -half[k], half[k]), by = to - x[k];
        for (std::size_t c = 0; c < 3; ++c) rest[c] -= by * axis[k][c];
        x[k] = to;
      }
    return std::sqrt(rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2]);
  }
};

// A point in, on or about a box.
Point point_about(Random& random, const Boxes& boxes, double margin) {
  const Judged box(boxes.tile, random.index(kLanes));
  Point x;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t where = random.index(4);
    x[k] = where == 0 ? -box.half[k] : where == 1 ? box.half[k] : random.uniform(-1, 1) * box.half[k];
    if (where == 3) x[k] += margin * random.uniform(-1, 1);
  }
  return box.point_at(x);
}

double norm_1(const Point& p) { return static_cast<double>(std::fabs(p[0]) + std::fabs(p[1]) + std::fabs(p[2])); }

// A ray through a point, about where it is nearest to the instance's origin: as the engine takes it to floats.
struct AnyRay {
  double at[3];
  double direction[3];
  double radius;
  kernel::BoxRay floats;
};

AnyRay any_ray(Random& random, const Boxes& boxes) {
  AnyRay out;
  const Point through = point_about(random, boxes, 0.2 * boxes.reach);
  oracle::Vec3<double> direction = random.unit_vector();
  const Judged other(boxes.tile, random.index(kLanes));
  const std::uint32_t kind = random.index(4);
  if (kind == 0)  // along an axis of a box
    for (std::size_t c = 0; c < 3; ++c) direction[c] = static_cast<double>(other.axis[0][c]);
  if (kind == 1) direction[random.index(3)] *= random.chance(0.5) ? 0 : 1e-14;
  direction = oracle::normalized(direction);
  double along = 0;
  for (std::size_t c = 0; c < 3; ++c) along += static_cast<double>(through[c]) * direction[c];
  out.radius = random.chance(0.5) ? 0 : boxes.reach * random.log_uniform(1e-6, 1);
  double sum = boxes.reach + out.radius;
  for (std::size_t c = 0; c < 3; ++c) {
    out.direction[c] = direction[c];
    out.at[c] = static_cast<double>(through[c]) - along * direction[c];
    sum += std::fabs(out.at[c]);
    out.floats.at[c] = static_cast<float>(out.at[c]);
    out.floats.direction[c] = static_cast<float>(direction[c]);
  }
  out.floats.radius = float_above(out.radius);
  out.floats.rounding = float_above(kQueryBoxPad * sum);
  out.floats.begin = random.chance(0.3) ? float_below(along - boxes.reach * random.uniform(0, 2)) : -1e30f;
  out.floats.end = random.chance(0.3) ? float_above(along + boxes.reach * random.uniform(0, 2)) : kInfinity;
  return out;
}

using Entries = std::array<float, kLanes>;

// What a kernel answers, which is the same on every instruction set.
template <class Call>
std::uint32_t answer(Entries& entries, Call&& call) {
  std::uint32_t out = 0;
  for (const kernel::KernelTable* const table : available_kernels()) {
    CAPTURE(name_of(*table));
    alignas(64) float entry[kLanes] = {};
    const std::uint32_t met = call(*table, entry);
    if (table->isa == Isa::kScalar) {
      out = met;
      std::copy_n(entry, kLanes, entries.begin());
    }
    CHECK(met == out);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) CHECK(same_bits(entry[lane], entries[lane]));
  }
  return out;
}

}  // namespace

TEST_CASE("query boxes: leaves become lanes, and the last leaf fills the last tile") {
  Random random(71);
  for (const std::uint32_t leaves : {1u, 2u, 15u, 16u, 17u, 31u, 32u, 40u})
    for (const std::uint32_t live : {1u, 3u, 15u, 16u}) {
      CAPTURE(leaves);
      CAPTURE(live);
      std::vector<BoxTile> boxes(leaves);
      for (BoxTile& tile : boxes)
        for (std::size_t i = 0; i < sizeof(tile) / sizeof(float); ++i)
          (&tile.center[0][0])[i] = static_cast<float>(random.uniform(-1, 1));
      const std::uint32_t tiles = tile_count(leaves);
      for (const kernel::KernelTable* const table : available_kernels()) {
        CAPTURE(name_of(*table));
        std::vector<BoxTile> out(live * tiles + 1);
        BoxTile untouched;
        for (std::size_t i = 0; i < sizeof(untouched) / sizeof(float); ++i) (&untouched.center[0][0])[i] = 7;
        out.back() = untouched;
        table->boxes_by_leaf(boxes.data(), leaves, live, out.data());
        CHECK(same_bits(out.back(), untouched));
        for (std::uint32_t i = 0; i < live; ++i)
          for (std::uint32_t place = 0; place < tiles * kLanes; ++place)
            for (std::uint32_t row = 0; row < 15; ++row) {
              const std::uint32_t leaf = std::min(place, leaves - 1);
              const float* const from = &boxes[leaf].center[0][0] + row * kLanes;
              const float* const to = &out[i * tiles + place / kLanes].center[0][0] + row * kLanes;
              REQUIRE(to[place % kLanes] == from[i]);
            }
      }
    }
}

TEST_CASE("query boxes: no box is missed that a ray meets, and none is entered later than it is") {
  Random random(72);
  std::size_t met_count = 0, touching_count = 0, apart_count = 0, told_count = 0;
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Boxes boxes = any_boxes(random);
    const AnyRay ray = any_ray(random, boxes);
    Entries entry;
    const std::uint32_t met = answer(entry, [&](const kernel::KernelTable& table, float* to) {
      return table.ray_boxes(boxes.tile, ray.floats, to);
    });
    const Point from = {ray.at[0], ray.at[1], ray.at[2]};
    const Point along = {ray.direction[0], ray.direction[1], ray.direction[2]};
    const auto begin = static_cast<Real>(ray.floats.begin), end = static_cast<Real>(ray.floats.end);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      CAPTURE(lane);
      const Judged box(boxes.tile, lane);
      Real first = 0;
      if (box.meets(from, along, begin, end, &first)) {
        ++met_count;
        CHECK((met >> lane & 1) == 1);
        CHECK(static_cast<Real>(entry[lane]) <= first);
        continue;
      }
      // A moved sphere: where it touches is found by the distance at some points of its way.
      for (int k = 0; k < 4 && ray.radius > 0; ++k) {
        const Real t = std::clamp<Real>(ray.radius * random.uniform(-2, 2), begin, end);
        const Point at = {from[0] + t * along[0], from[1] + t * along[1], from[2] + t * along[2]};
        if (box.distance_to(at) > ray.radius) continue;
        ++touching_count;
        CHECK((met >> lane & 1) == 1);
        CHECK(static_cast<Real>(entry[lane]) <= t);
      }
      // What is apart by far more than all pads is told.
      Judged grown = box;
      for (Real& half : grown.half)
        half +=
            4 * (static_cast<Real>(ray.floats.radius) + static_cast<Real>(ray.floats.rounding)) + 1e-4L * boxes.reach;
      if (grown.meets(from, along, begin, end, &first)) continue;
      ++apart_count;
      told_count += (met >> lane & 1) == 0;
    }
  }
  MESSAGE("met: ", met_count, ", touched by spheres: ", touching_count, ", apart: ", apart_count);
  CHECK(met_count >= least_count(1500, 6000));
  CHECK(touching_count >= least_count(2000, 6000));
  CHECK(apart_count >= least_count(8000, 6000));
  CHECK(told_count == apart_count);
}

TEST_CASE("query boxes: a box that a ray surely meets is met no later than it says") {
  Random random(74);
  std::size_t sure_count = 0, met_count = 0;
  for (std::uint64_t round = rounds(6000); round > 0; --round) {
    const Boxes boxes = any_boxes(random);
    AnyRay ray = any_ray(random, boxes);
    Entries surely, entry;
    const std::uint32_t sure = answer(surely, [&](const kernel::KernelTable& table, float* to) {
      return table.ray_in_boxes(boxes.tile, ray.floats, to);
    });
    const std::uint32_t met = answer(entry, [&](const kernel::KernelTable& table, float* to) {
      return table.ray_boxes(boxes.tile, ray.floats, to);
    });
    CHECK((sure & ~met) == 0);
    const Point from = {ray.at[0], ray.at[1], ray.at[2]};
    const Point along = {ray.direction[0], ray.direction[1], ray.direction[2]};
    const auto begin = static_cast<Real>(ray.floats.begin), end = static_cast<Real>(ray.floats.end);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      CAPTURE(lane);
      Real first = 0;
      const bool is_met = Judged(boxes.tile, lane).meets(from, along, begin, end, &first);
      met_count += is_met;
      if (!(sure >> lane & 1)) continue;
      ++sure_count;
      CHECK(is_met);  // by the centre of a sphere that is moved
      CHECK(first <= static_cast<Real>(surely[lane]) * (1 + 1e-15L) + 1e-18L);
      CHECK(entry[lane] <= surely[lane]);
    }
  }
  MESSAGE("surely met: ", sure_count, " of ", met_count);
  CHECK(sure_count >= least_count(1000, 6000));
  CHECK(4 * sure_count > met_count);
}

TEST_CASE("query boxes: distances of a point are off by less than step 12.8 says") {
  Random random(73);
  Real worst = 0;
  std::size_t inside = 0;
  for (std::uint64_t round = rounds(3000); round > 0; --round) {
    const Boxes boxes = any_boxes(random);
    const Point at = point_about(random, boxes, boxes.reach * random.log_uniform(1e-8, 10));
    const float point[3] = {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])};
    Entries distance_sq;
    answer(distance_sq, [&](const kernel::KernelTable& table, float* to) {
      table.point_boxes(boxes.tile, point, to);
      return kAllLanes;
    });
    const Real size = norm_1(at) + boxes.reach;
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      CAPTURE(lane);
      const Real distance = Judged(boxes.tile, lane).distance_to(at);
      const Real off = std::fabs(std::sqrt(static_cast<Real>(distance_sq[lane])) - distance);
      inside += distance == 0;
      worst = std::max(worst, off / size);
      CHECK(off <= kQueryBoxDistance * size);
    }
  }
  MESSAGE("worst: ", static_cast<double>(worst) * 0x1p24, " u");
  CHECK(inside >= least_count(100, 3000));
}

TEST_CASE("query boxes: rays along directions of 0 meet the boxes that they are in") {
  Boxes boxes;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    set_lane({{0, 0, static_cast<float>(lane)}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 0, 0.25f}}, lane, boxes.tile);
  Entries entry;
  for (const float along : {1.0f, -1.0f}) {
    const kernel::BoxRay ray = {{0.5f, 0, 0}, {0, 0, along}, 0, 0, along > 0 ? 3.0f : -7.0f, along > 0 ? 7.0f : -3.0f};
    CHECK(answer(entry, [&](const kernel::KernelTable& table, float* to) {
            return table.ray_boxes(boxes.tile, ray, to);
          }) == 0b11111000);
    CHECK(entry[5] <= (along > 0 ? 4.75f : -5.25f));
    CHECK(entry[5] > (along > 0 ? 4.749f : -5.251f));
  }
}

}  // namespace cab::tests
