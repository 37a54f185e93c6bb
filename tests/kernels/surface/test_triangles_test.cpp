// Triangles against triangles: exact integers and a judge in long double, on every instruction set with the same
// answers.
#include "kernels/surface/test_triangles.h"

#include "tests/kernels/isas.h"
#include "tests/kernels/surface/random_triangles.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 2020;
constexpr std::uint32_t kAll = (1u << kLanes) - 1;

struct TriangleKernel {
  Isa isa;
  kernel::ConvexAnswer (*test)(const TriangleBlock&, std::uint32_t);
};

using namespace cab::kernel;  // the types of the list

std::vector<TriangleKernel> available_triangles() {
#define CAB_ENTRY(enumerator, name, V, runs) {Isa::enumerator, test_triangle_block<V>},
  constexpr TriangleKernel kBuilt[] = {CAB_BUILT_ISAS(CAB_ENTRY)};
#undef CAB_ENTRY
  std::vector<TriangleKernel> out;
  for (const TriangleKernel& one : kBuilt)
    if (find_kernels(one.isa)) out.push_back(one);
  return out;
}

// The answer of all instruction sets, which must be one.
ConvexAnswer answer_of(const TriangleBlock& block, std::uint32_t active = kAll) {
  static const std::vector<TriangleKernel> kernels = available_triangles();
  const ConvexAnswer out = kernels[0].test(block, active);
  for (const TriangleKernel& other : kernels) {
    const ConvexAnswer same = other.test(block, active);
    CAPTURE(isa_name(other.isa));
    REQUIRE(same.apart == out.apart);
    REQUIRE(same.touching == out.touching);
  }
  REQUIRE((out.apart & out.touching) == 0);
  REQUIRE(((out.apart | out.touching) & ~active) == 0);
  return out;
}

// What became of pairs, of which so many touch.
struct Tally {
  std::uint64_t pairs = 0, touch = 0, undecided = 0, wrong_apart = 0, wrong_touching = 0;
  void add(const ConvexAnswer& answer, std::uint32_t lane, bool touches) {
    const bool apart = answer.apart >> lane & 1, touching = answer.touching >> lane & 1;
    ++pairs;
    touch += touches;
    undecided += !apart && !touching;
    wrong_apart += apart && touches;
    wrong_touching += touching && !touches;
  }
};

template <class T>
T one_of(Random& random, const std::vector<T>& values) {
  return values[random.index(static_cast<std::uint32_t>(values.size()))];
}

// A block of random pairs of one regime without error and margin.
TriangleBlock draw_block(Random& random, FloatRegime regime, double size, double away) {
  TriangleBlock block{};
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) put(draw_floats(random, regime, size, away), block, lane);
  return block;
}

// What part of the bounds of step 20.3 the rounding of heights and of gaps along products of edges takes, at most.
double used_rounding(const FloatPair& pair) {
  TriangleLanes<float> side[2];
  Triangle<Real> exact[2];
  for (std::size_t s = 0; s < 2; ++s)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& c = pair.corner[s][k];
      side[s].corner[k] = {c[0], c[1], c[2]};
      exact[s].corner[k] = {{c[0], c[1], c[2]}};
    }
  const TrianglePair<float> lanes = pair_of(side[0], side[1]);
  const TriangleVolumes<float> volumes = volumes_of(lanes);
  const Real u = 0x1p-24L, e = lanes.a.largest, f = lanes.b.largest, away = lanes.away;
  const Real size_a = lanes.a.normal_size, size_b = lanes.b.normal_size;
  const auto edge = [&](int s, std::size_t k) { return exact[s].corner[(k + 1) % 3] - exact[s].corner[k]; };
  Real out = 0;
  const auto note = [&](float computed, const Real& truth, const Real& bound) {
    if (bound > 0) out = std::max(out, std::fabs(static_cast<Real>(computed) - truth) / bound);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    note(volumes.heights_of_b[i], dot(cross(edge(0, 0), edge(0, 1)), exact[1].corner[i] - exact[0].corner[0]),
         42 * u * size_a * (f + away));
    note(volumes.heights_of_a[i], dot(cross(edge(1, 0), edge(1, 1)), exact[0].corner[i] - exact[1].corner[0]),
         42 * u * size_b * (e + away));
    for (std::size_t j = 0; j < 3; ++j) {
      const Point along = cross(edge(0, i), edge(1, j));
      Real at[2][3];
      for (std::size_t s = 0; s < 2; ++s)
        for (std::size_t k = 0; k < 3; ++k) at[s][k] = dot(along, exact[s].corner[k] - exact[0].corner[0]);
      const auto [lo_a, hi_a] = std::minmax_element(at[0], at[0] + 3);
      const auto [lo_b, hi_b] = std::minmax_element(at[1], at[1] + 3);
      const float half_a = 0.5f * volumes.span_of_a[j], half_b = 0.5f * volumes.span_of_b[i];
      note(std::fabs(volumes.edges[i][j] + (half_a + half_b)) - (std::fabs(half_a) + std::fabs(half_b)),
           std::max(*lo_b - *hi_a, *lo_a - *hi_b),
           u * (46 * lanes.a.size[i] * lanes.b.size[j] * away + 94 * size_a * f + 46 * size_b * e));
    }
  }
  return static_cast<double>(out);
}

}  // namespace

TEST_CASE("no two triangles that touch are called apart, nor the other way round, by exact integers") {
  Random random(kSeed);
  constexpr std::uint64_t kUsual = 400;
  for (std::uint32_t r = 0; r < kGridRegimeCount; ++r) {
    const auto regime = static_cast<GridRegime>(r);
    Tally tally;
    for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
      TriangleBlock block{};
      bool touches[kLanes];
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        GridPairs pairs(random, std::int64_t{1} << one_of<int>(random, {2, 3, 4, 8, 12, 20}));
        const GridPair pair = pairs.draw(regime);
        touches[lane] = oracle::meet(pair.a, pair.b);
        put(pair, one_of<float>(random, {1, 0x1p-20f, 0x1p-12f, 3}), block, lane);
      }
      CAPTURE(round);
      const ConvexAnswer answer = answer_of(block);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) tally.add(answer, lane, touches[lane]);
    }
    CAPTURE(r);
    MESSAGE("regime " << r << ": " << tally.pairs << " pairs, " << tally.touch << " touch, " << tally.undecided
                      << " undecided");
    CHECK(tally.wrong_apart == 0);
    CHECK(tally.wrong_touching == 0);
    CHECK(tally.touch >= least_count(100, kUsual));
    CHECK(tally.pairs - tally.touch >= least_count(100, kUsual));
    // Of pairs that touch at a corner or in a plane none can be decided; of those that are apart nearly all are, but
    // for segments in one plane.
    CHECK(tally.undecided <= tally.touch + tally.pairs / 10);
  }
}

TEST_CASE("what two triangles of any floats are called, they are, and few are left undecided") {
  Random random(kSeed + 1);
  constexpr std::uint64_t kUsual = 400;
  // Pairs in a thousand that are left undecided though they overlap plainly or are 1e-4 of their size apart. Measured:
  // 1 in 6400 regular ones, and none of the others.
  constexpr std::uint64_t kMostUndecided = 1;
  constexpr Real kPlainly = 1e-4L;
  for (std::uint32_t r = 0; r < kFloatRegimeCount; ++r) {
    Tally tally;
    std::uint64_t plain = 0;
    for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
      const double size = random.log_uniform(1e-4, 1e4), away = random.chance(0.5) ? 0 : random.log_uniform(1, 100);
      const TriangleBlock block = draw_block(random, static_cast<FloatRegime>(r), size, away);
      CAPTURE(round);
      const ConvexAnswer answer = answer_of(block);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        const Real between = distance(triangle_of(block, 0, lane), triangle_of(block, 1, lane));
        tally.add(answer, lane, between == 0);
        const bool is_undecided = !((answer.apart | answer.touching) >> lane & 1);
        plain += is_undecided &&
                 (between > kPlainly * static_cast<Real>(size) || static_cast<FloatRegime>(r) == FloatRegime::kRegular);
      }
    }
    CAPTURE(r);
    MESSAGE("regime " << r << ": " << tally.pairs << " pairs, " << tally.touch << " touch, " << tally.undecided
                      << " undecided, " << plain << " of them plain");
    CHECK(tally.wrong_apart == 0);
    CHECK(tally.wrong_touching == 0);
    CHECK(1000 * plain <= kMostUndecided * tally.pairs);
  }
}

TEST_CASE("answers hold however each corner may be off by the error") {
  Random random(kSeed + 2);
  constexpr std::uint64_t kUsual = 1500;
  Tally tally;
  std::uint64_t decided_apart = 0, decided_touching = 0;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    const auto regime = one_of<FloatRegime>(
        random, {FloatRegime::kRegular, FloatRegime::kApart, FloatRegime::kNeedles, FloatRegime::kTouching});
    const double size = random.log_uniform(1e-4, 1e4);
    TriangleBlock block = draw_block(random, regime, size, 1);
    for (float& e : block.error) e = static_cast<float>(size * random.log_uniform(1e-6, 0.3));
    if (round % 3 == 0)
      for (float& m : block.margin) m = static_cast<float>(size * random.log_uniform(1e-4, 1));
    CAPTURE(round);
    const ConvexAnswer answer = answer_of(block);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      if (!((answer.apart | answer.touching) >> lane & 1)) continue;
      decided_apart += answer.apart >> lane & 1;
      decided_touching += answer.touching >> lane & 1;
      const Real half = Real{0.5} * static_cast<Real>(block.error[lane]);
      for (int trial = 0; trial < 12; ++trial) {
        Triangle<Real> moved[2] = {triangle_of(block, 0, lane), triangle_of(block, 1, lane)};
        // One triangle against the other, in the eight ways, or each corner by itself.
        for (int s = 0; s < 2; ++s)
          for (Point& corner : moved[s].corner)
            for (std::size_t x = 0; x < 3; ++x) {
              const bool is_up = trial < 8 ? ((trial >> x & 1) == s) : random.chance(0.5);
              corner[x] += is_up ? half : -half;
            }
        const auto margin = static_cast<Real>(block.margin[lane]);
        tally.add(answer, lane, margin > 0 ? distance(moved[0], moved[1]) <= margin : oracle::meet(moved[0], moved[1]));
      }
    }
  }
  MESSAGE(tally.pairs << " moved pairs, of " << decided_apart << " called apart and " << decided_touching
                      << " called touching");
  CHECK(tally.wrong_apart == 0);
  CHECK(tally.wrong_touching == 0);
  CHECK(decided_apart >= least_count(5000, kUsual));
  CHECK(decided_touching >= least_count(500, kUsual));
}

TEST_CASE("triangles are apart by more than the margin, or within it, as they are called") {
  Random random(kSeed + 3);
  constexpr std::uint64_t kUsual = 800;
  std::uint64_t wrong_apart = 0, wrong_touching = 0, apart = 0, far = 0, touching = 0, near = 0, missed = 0;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    const auto regime = static_cast<FloatRegime>(random.index(kFloatRegimeCount));
    const double size = random.log_uniform(1e-4, 1e4);
    TriangleBlock block = draw_block(random, regime, size, 2);
    Real between[kLanes];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      between[lane] = distance(triangle_of(block, 0, lane), triangle_of(block, 1, lane));
      const Real by = between[lane] > 0 ? between[lane] : static_cast<Real>(0.01 * size);
      block.margin[lane] = static_cast<float>(by * static_cast<Real>(1 + random.sign() * random.log_uniform(1e-8, 1)));
    }
    CAPTURE(round);
    const ConvexAnswer answer = answer_of(block);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const bool is_apart = between[lane] > static_cast<Real>(block.margin[lane]);
      apart += answer.apart >> lane & 1;
      far += is_apart;
      // Plainly within a margin that float can tell from 0.
      const bool is_near = between[lane] < Real{0.99L} * static_cast<Real>(block.margin[lane]) &&
                           block.margin[lane] > static_cast<float>(1e-4 * size);
      near += is_near;
      missed += is_near && !(answer.touching >> lane & 1);
      touching += answer.touching >> lane & 1;
      wrong_apart += (answer.apart >> lane & 1) && !is_apart;
      wrong_touching += (answer.touching >> lane & 1) && is_apart;
    }
  }
  MESSAGE(apart << " called apart of " << far << ", " << touching << " called touching, " << missed << " of " << near
                << " missed");
  CHECK(wrong_apart == 0);
  CHECK(wrong_touching == 0);
  CHECK(5 * apart >= far);
  CHECK(100 * missed <= near);
  CHECK(touching >= least_count(500, kUsual));
}

TEST_CASE("triangles of any size, as far apart as floats go, are called what they are or nothing") {
  Random random(kSeed + 4);
  constexpr std::uint64_t kUsual = 600;
  Tally tally;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    const auto regime = static_cast<FloatRegime>(random.index(kFloatRegimeCount));
    const double size = random.log_uniform(1e-40, 1e17);
    TriangleBlock block = draw_block(random, regime, size, random.chance(0.5) ? 0 : 5);
    for (float& e : block.error) e = random.chance(0.5) ? 0 : static_cast<float>(random.log_uniform(1e-45, 1e18));
    for (float& m : block.margin) m = random.chance(0.5) ? 0 : static_cast<float>(random.log_uniform(1e-45, 1e18));
    CAPTURE(round);
    const ConvexAnswer answer = answer_of(block);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      tally.add(
          answer, lane,
          distance(triangle_of(block, 0, lane), triangle_of(block, 1, lane)) <= static_cast<Real>(block.margin[lane]));
  }
  CHECK(tally.wrong_apart == 0);
  CHECK(tally.wrong_touching == 0);
  CHECK(tally.pairs - tally.undecided >= least_count(1000, kUsual));
}

TEST_CASE("corners of one triangle that differ by the whole range of floats give no wrong answer") {
  Random random(kSeed + 5);
  Tally tally;
  for (std::uint64_t round = 0; round < rounds(400); ++round) {
    TriangleBlock block{};
    for (auto& side : block.corner)
      for (auto& corner : side)
        for (auto& x : corner)
          for (float& v : x)
            v = random.chance(0.2) ? 0 : static_cast<float>(random.sign() * random.log_uniform(1e-44, 1e18));
    if (random.chance(0.5))  // all in range, but for what is next to 0
      for (auto& side : block.corner)
        for (auto& corner : side)
          for (auto& x : corner)
            for (float& v : x) v = std::fabs(v) > 1 ? v / 1e12f : v;
    const ConvexAnswer answer = answer_of(block);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      tally.add(answer, lane, oracle::meet(triangle_of(block, 0, lane), triangle_of(block, 1, lane)));
  }
  CHECK(tally.wrong_apart == 0);
  CHECK(tally.wrong_touching == 0);
}

TEST_CASE("a triangle so small that products underflow, next to a corner of a large one, gets no wrong answer") {
  Random random(kSeed + 8);
  constexpr std::uint64_t kUsual = 600;
  Tally tally;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    const double tiny = random.log_uniform(1e-40, 1e-15);
    TriangleBlock block = draw_block(random, FloatRegime::kTouching, tiny, 0);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      // One corner of one triangle goes to 0, and the triangle grows about it.
      const double by = random.log_uniform(1e-7, 1) / tiny;
      auto& c = block.corner[random.index(2)];
      for (auto& x : c[0]) x[lane] = 0;
      for (int k = 1; k < 3; ++k)
        for (auto& x : c[k]) x[lane] = static_cast<float>(by * x[lane]);
    }
    CAPTURE(round);
    const ConvexAnswer answer = answer_of(block);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      tally.add(answer, lane, oracle::meet(triangle_of(block, 0, lane), triangle_of(block, 1, lane)));
  }
  MESSAGE(tally.pairs << " pairs, " << tally.touch << " touch, " << tally.undecided << " undecided");
  CHECK(tally.wrong_apart == 0);
  CHECK(tally.wrong_touching == 0);
  CHECK(tally.touch >= least_count(100, kUsual));
}

TEST_CASE("volumes and gaps of two triangles err by no more than the proof allows, however they are sought out") {
  // The worst of 3000 searches is 0.16.
  constexpr double kWorst = 0.25;
  Random random(kSeed + 7);
  double worst = 0;
  for (std::uint64_t round = 0; round < rounds(100); ++round) {
    FloatPair pair =
        draw_floats(random, FloatRegime::kRegular, 1, random.chance(0.5) ? 0 : random.log_uniform(0.1, 100));
    double best = used_rounding(pair);
    for (int step = 0; step < 300; ++step) {
      FloatPair other = pair;
      for (std::uint32_t k = 0; k <= random.index(3); ++k) {
        float& x = other.corner[random.index(2)][random.index(3)][random.index(3)];
        x = random.chance(0.5) ? std::nextafter(x, static_cast<float>(random.sign() * 1e9))
                               : x + static_cast<float>(random.normal() * random.log_uniform(1e-6, 0.3));
      }
      const double used = used_rounding(other);
      if (used < best) continue;
      best = used;
      pair = other;
    }
    worst = std::max(worst, best);
  }
  MESSAGE("used at most " << worst << " of the bounds");
  CHECK(worst < kWorst);
}

TEST_CASE("lanes that are not active have no answer, and change that of no other") {
  Random random(kSeed + 6);
  for (std::uint64_t round = 0; round < rounds(100); ++round) {
    const TriangleBlock block = draw_block(random, FloatRegime::kRegular, 1, 1);
    const ConvexAnswer whole = answer_of(block);
    for (const std::uint32_t active : {0u, 1u, 0x8000u, 0x7fffu, 0xff00u, static_cast<std::uint32_t>(round) & kAll}) {
      const ConvexAnswer part = answer_of(block, active);
      CHECK(part.apart == (whole.apart & active));
      CHECK(part.touching == (whole.touching & active));
    }
  }
}

}  // namespace cab::tests
