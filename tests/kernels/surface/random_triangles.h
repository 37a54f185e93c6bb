// Pairs of triangles for tests: on a grid, where the judge is exact, and of any floats.
#pragma once

#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/kernels/surface/triangle_block.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace cab::tests {

using oracle::Point;
using oracle::Random;
using oracle::Real;
using oracle::Triangle;
using oracle::Wide;

// Corners are at integers of at most 2^20.
struct GridPair {
  Triangle<Wide> a, b;
};

enum class GridRegime {
  kAny,
  kFlat,        // in one plane
  kSegments,    // one or both have no area
  kSharedEdge,  // or a shared corner, or all three
  kOnIt,        // a corner of b is on a
  kNeedles,
};
inline constexpr std::uint32_t kGridRegimeCount = 6;

class GridPairs {
 public:
  // The corners are within `size` of 0 in each coordinate, size a power of two of 4 to 2^20.
  GridPairs(Random& random, std::int64_t size) : random_(random), size_(size) {}

  GridPair draw(GridRegime regime) {
    GridPair out{any(size_ / 2), any(size_ / 2)};
    switch (regime) {
      case GridRegime::kAny: break;
      case GridRegime::kFlat: flatten(out); break;
      case GridRegime::kSegments:
        thin(out.a);
        if (random_.chance(0.5)) thin(out.b);
        if (random_.chance(0.3)) flatten(out);
        break;
      case GridRegime::kSharedEdge: {
        const std::uint32_t shared = 1 + random_.index(3), turn = random_.index(3);
        for (std::uint32_t k = 0; k < shared; ++k) out.b.corner[(k + turn) % 3] = out.a.corner[k];
        if (random_.chance(0.2)) flatten(out);
        break;
      }
      case GridRegime::kOnIt: put_on(out); break;
      case GridRegime::kNeedles:
        out.a.corner[1] = near(out.a.corner[0]);
        out.b.corner[2] = near(out.b.corner[1]);
        break;
    }
    if (random_.chance(0.5)) std::swap(out.a, out.b);
    return out;
  }

 private:
  Wide number(std::int64_t limit) {
    return static_cast<std::int64_t>(random_.next_u64() % static_cast<std::uint64_t>(2 * limit + 1)) - limit;
  }
  oracle::Vec3<Wide> point(std::int64_t limit) { return {{number(limit), number(limit), number(limit)}}; }
  Triangle<Wide> any(std::int64_t limit) { return {{point(limit), point(limit), point(limit)}}; }
  oracle::Vec3<Wide> near(const oracle::Vec3<Wide>& p) { return p + point(1); }

  // All corners are sums of two steps, from one point. In one of two cases a plane across an axis.
  void flatten(GridPair& pair) {
    const std::int64_t step = std::max<std::int64_t>(1, size_ / 16);
    const bool is_across = random_.chance(0.5);
    const oracle::Vec3<Wide> along[2] = {is_across ? oracle::Vec3<Wide>{{1, 0, 0}} : point(3),
                                         is_across ? oracle::Vec3<Wide>{{0, 1, 0}} : point(3)};
    for (Triangle<Wide>* triangle : {&pair.a, &pair.b})
      for (auto& corner : triangle->corner) corner = number(step) * along[0] + number(step) * along[1];
  }

  // Three corners on one line, two equal ones among them or not; or all equal.
  void thin(Triangle<Wide>& triangle) {
    auto& c = triangle.corner;
    const std::uint32_t k = random_.index(3);
    c[(k + 1) % 3] = c[k];
    if (random_.chance(0.2)) c[(k + 2) % 3] = c[k];
    if (random_.chance(0.5)) {  // the middle of an edge, from even corners
      for (auto& corner : c) corner = Wide{2} * point(size_ / 4);
      for (std::size_t x = 0; x < 3; ++x) c[k][x] = (c[(k + 1) % 3][x] + c[(k + 2) % 3][x]) / 2;
    }
  }

  // A corner of b becomes a point of a with weights in quarters, or one next to it.
  void put_on(GridPair& pair) {
    for (auto& corner : pair.a.corner) corner = Wide{4} * point(std::max<std::int64_t>(1, size_ / 8));
    const std::uint32_t w = random_.index(5), v = random_.index(5 - w);
    oracle::Vec3<Wide>& corner = pair.b.corner[random_.index(3)];
    for (std::size_t x = 0; x < 3; ++x)
      corner[x] =
          (Wide{w} * pair.a.corner[0][x] + Wide{v} * pair.a.corner[1][x] + Wide{4 - w - v} * pair.a.corner[2][x]) / 4;
    if (random_.chance(0.3)) corner = near(corner);
  }

  Random& random_;
  std::int64_t size_;
};

// Any floats, of about one size, near each other.
enum class FloatRegime {
  kRegular,
  kApart,     // a gap of about 1e-6 to 1 of their size
  kNeedles,   // one edge of 1e-6 to 1e-2 of the others
  kFlat,      // turned out of one plane, so that rounding bends it
  kSmall,     // one triangle is 1e-5 to 1e-1 of the other
  kTouching,  // a corner of one is within 1e-7 to 1e-3 of a point of the other
};
inline constexpr std::uint32_t kFloatRegimeCount = 6;

struct FloatPair {
  float corner[2][3][3];
};

// A pair, of the size given, up to `away` sizes from 0.
inline FloatPair draw_floats(Random& random, FloatRegime regime, double size, double away) {
  using D = oracle::Vec3<double>;
  double turned[3][3];
  random.rotation(turned);
  D corner[2][3];
  const bool is_flat = regime == FloatRegime::kFlat;
  const auto point = [&](double scale) {
    return D{
        {random.uniform(-scale, scale), random.uniform(-scale, scale), is_flat ? 0 : random.uniform(-scale, scale)}};
  };
  double scale[2] = {1, 1};
  if (regime == FloatRegime::kSmall) scale[random.index(2)] = random.log_uniform(1e-5, 1e-1);
  for (int s = 0; s < 2; ++s) {
    const D place = s == 1 ? point(0.7) : D{};
    for (D& c : corner[s]) c = place + point(scale[s]);
  }
  if (regime == FloatRegime::kNeedles)
    for (int s = 0; s < 2; ++s)
      if (s == 0 || random.chance(0.5)) {
        const std::uint32_t k = random.index(3);
        corner[s][k] = corner[s][(k + 1) % 3] + point(random.log_uniform(1e-6, 1e-2));
      }
  if (regime == FloatRegime::kApart) {  // on the two sides of a plane
    const double gap = random.log_uniform(1e-6, 1);
    for (int s = 0; s < 2; ++s) {
      double least = HUGE_VAL;
      for (D& c : corner[s]) c[2] = std::fabs(c[2]);
      for (D& c : corner[s]) least = std::min(least, c[2]);
      for (D& c : corner[s]) c[2] = s == 1 ? gap + c[2] - least : least - c[2];
    }
  }
  if (regime == FloatRegime::kTouching || (is_flat && random.chance(0.5))) {
    double w = random.chance(0.3) ? 0 : random.uniform(0, 1), v = random.uniform(0, 1 - w);
    const D on = w * corner[0][0] + v * corner[0][1] + (1 - w - v) * corner[0][2];
    const D off = on + point(random.log_uniform(1e-7, 1e-3)) - corner[1][0];
    for (D& c : corner[1]) c = c + off;
  }
  if (random.chance(0.5)) std::swap(corner[0], corner[1]);
  const D at = {{random.uniform(-away, away), random.uniform(-away, away), random.uniform(-away, away)}};
  FloatPair out;
  for (int s = 0; s < 2; ++s)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t x = 0; x < 3; ++x) {
        double v = at[x];
        for (std::size_t y = 0; y < 3; ++y) v += turned[y][x] * corner[s][k][y];
        out.corner[s][k][x] = static_cast<float>(size * v);
      }
  return out;
}

// One triangle of a block's lane, as the judge takes it.
inline Triangle<Real> triangle_of(const TriangleBlock& block, int side, std::uint32_t lane) {
  Triangle<Real> out;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t x = 0; x < 3; ++x) out.corner[k][x] = static_cast<Real>(block.corner[side][k][x][lane]);
  return out;
}

inline void put(const FloatPair& pair, TriangleBlock& block, std::uint32_t lane) {
  for (int s = 0; s < 2; ++s)
    for (int k = 0; k < 3; ++k)
      for (int x = 0; x < 3; ++x) block.corner[s][k][x][lane] = pair.corner[s][k][x];
}

inline void put(const GridPair& pair, float unit, TriangleBlock& block, std::uint32_t lane) {
  for (int k = 0; k < 3; ++k)
    for (int x = 0; x < 3; ++x) {
      const auto at = static_cast<std::size_t>(k), c = static_cast<std::size_t>(x);
      block.corner[0][k][x][lane] = unit * static_cast<float>(pair.a.corner[at][c]);
      block.corner[1][k][x][lane] = unit * static_cast<float>(pair.b.corner[at][c]);
    }
}

}  // namespace cab::tests
