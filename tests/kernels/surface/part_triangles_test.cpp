// Triangles touch a convex part, or are apart from it, where long double says so, with the same answers on every
// instruction set.
#include "kernels/surface/part_triangles.h"

#include "perf/judge/oracle/box_tile.h"
#include "perf/judge/oracle/random.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::tests {
namespace {

using oracle::Point;
using oracle::Random;
using oracle::Real;
using oracle::Triangle;
using D = oracle::Vec3<double>;

// How triangles lie to the part, in its frame.
enum class PartRegime {
  kRegular,
  kSmall,    // 1e-3 to 1e-1 of the part's unit
  kLarge,    // 10 to 1e3 of it
  kNeedles,  // one edge of 1e-6 to 1e-2 of the others
  kNoArea,   // corners on a line, or in one point
  kAcross,   // in a plane across an axis, mostly that of a side
  kNear,     // a corner within 1e-8 to 1e-3 of where the part or the margin ends
};
constexpr std::uint32_t kPartRegimeCount = 7;

// What parts are drawn: their kinds, and balls, which are round parts without a length.
enum class Drawn { kBall, kCapsule, kBox, kHalfSpace, kHull };
constexpr std::uint32_t kDrawnCount = 5;

// A part, and triangles of floats about it.
struct PartScene {
  static constexpr std::uint32_t kCount = 40;
  Drawn drawn;
  double unit;  // no length of the part is larger
  double axis[3][3], center[3];
  float half[3] = {}, margin = 0;
  std::vector<float> vertices;
  std::vector<TrianglePatch> patches;

  // away: of the part from the origin, in units.
  PartScene(Random& random, Drawn of, PartRegime regime, double length, double away) : drawn(of), unit(length) {
    random.rotation(axis);
    for (std::size_t c = 0; c < 3; ++c) {
      center[c] = unit * away * random.uniform(-1, 1);
      if (drawn != Drawn::kHalfSpace) half[c] = static_cast<float>(unit * random.log_uniform(0.05, 1));
    }
    if (drawn == Drawn::kBall) half[2] = 0;
    if (random.chance(0.4)) margin = static_cast<float>(unit * random.log_uniform(1e-4, 1));
    vertices.resize(std::size_t{12} * kCount);
    patches.resize(tile_count(kCount));
    for (std::uint32_t t = 0; t < kCount; ++t) {
      const Triangle<double> triangle = draw(random, regime);
      for (std::uint32_t i = 0; i < 3; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
          double at = center[c];
          for (std::size_t k = 0; k < 3; ++k) at += triangle.corner[i][k] * axis[k][c];
          vertices[4 * (std::size_t{3} * t + i) + c] = static_cast<float>(at);
        }
        patches[t / kLanes].corner[i][t % kLanes] = 3 * t + i;
      }
    }
  }

  // All lengths of the pairs together, as near_part adds them.
  double size() const {
    double out = static_cast<double>(margin), farthest = 0;
    for (std::size_t c = 0; c < 3; ++c) out += std::fabs(center[c]) + static_cast<double>(half[c]);
    for (std::size_t v = 0; v < vertices.size(); v += 4)
      farthest = std::max(farthest, std::fabs(static_cast<double>(vertices[v])) +
                                        std::fabs(static_cast<double>(vertices[v + 1])) +
                                        std::fabs(static_cast<double>(vertices[v + 2])));
    return out + farthest;
  }

  kernel::SurfacePart part() {
    static constexpr ConvexKind kKinds[] = {ConvexKind::kRound, ConvexKind::kRound, ConvexKind::kBox,
                                            ConvexKind::kHalfSpace, ConvexKind::kHull};
    kernel::SurfacePart out = {
        {vertices.data(), nullptr, 0}, patches.data(), kKinds[static_cast<std::size_t>(drawn)], 0, {}, {}, {}, margin};
    int exponent = 0;
    std::frexp(size(), &exponent);
    out.scale = std::ldexp(1.0f, -exponent);
    for (std::size_t c = 0; c < 3; ++c) {
      out.center[c] = static_cast<float>(center[c]);
      out.half[c] = half[c] * out.scale;
      for (std::size_t k = 0; k < 3; ++k) out.axis[k][c] = static_cast<float>(axis[k][c]);
    }
    return out;
  }

  // How far a triangle is from the part; of a half space how high it begins.
  Real distance_of(std::uint32_t triangle) const {
    Triangle<Real> at{};
    for (std::uint32_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          at.corner[i][k] +=
              (static_cast<Real>(vertices[4 * (std::size_t{3} * triangle + i) + c]) - static_cast<Real>(center[c])) *
              static_cast<Real>(axis[k][c]);
    if (drawn == Drawn::kHalfSpace) return std::min({at.corner[0][2], at.corner[1][2], at.corner[2][2]});
    if (drawn == Drawn::kBox || drawn == Drawn::kHull) return distance_to_box(at, {{half[0], half[1], half[2]}});
    const Point end{{0, 0, half[2]}};
    return distance(at, {{end, Real{-1} * end, end}}) - half[0];
  }

 private:
  Triangle<double> draw(Random& random, PartRegime regime) const {
    const auto point = [&](double scale) {
      return unit * D{{random.uniform(-scale, scale), random.uniform(-scale, scale), random.uniform(-scale, scale)}};
    };
    const double scale = regime == PartRegime::kSmall   ? random.log_uniform(1e-3, 1e-1)
                         : regime == PartRegime::kLarge ? random.log_uniform(10, 1e3)
                                                        : 1;
    const D place = point(1.2);
    Triangle<double> out;
    for (D& corner : out.corner) corner = place + point(scale);
    const std::size_t k = random.index(3), across = random.index(3);
    D &one = out.corner[k], &next = out.corner[(k + 1) % 3], &last = out.corner[(k + 2) % 3];
    const double side = (random.chance(0.5) ? 1 : -1) * static_cast<double>(half[across]);
    if (regime == PartRegime::kNeedles) one = next + point(random.log_uniform(1e-6, 1e-2));
    if (regime == PartRegime::kNoArea) {
      one = random.chance(0.5) ? next : 0.5 * (next + last);
      if (random.chance(0.3)) last = one = next;
    }
    if (regime == PartRegime::kAcross)
      for (D& corner : out.corner) corner[across] = place[across];
    if (regime == PartRegime::kAcross && random.chance(0.7))
      for (D& corner : out.corner) corner[across] = side;
    if (regime == PartRegime::kNear) {
      const double beyond = random.chance(0.5) ? static_cast<double>(margin) : 0;
      const bool is_round = drawn == Drawn::kBall || drawn == Drawn::kCapsule;
      D outward{}, to{};
      outward[across] = side < 0 ? -1 : 1;
      if (is_round) outward = random.unit_vector();
      for (std::size_t c = 0; c < 3; ++c) {
        const double end = static_cast<double>(half[c]);
        if (!is_round) to[c] = c == across ? side : end * random.uniform(-1, 1);
        if (is_round && c == 2) to[c] = outward[2] > 0 ? end : -end;
      }
      to = to + (beyond + (is_round ? static_cast<double>(half[0]) : 0)) * outward +
           point(random.log_uniform(1e-8, 1e-3));
      // All of it is on the outer side of that corner, or anywhere.
      const D by = to - one;
      const bool is_outside = random.chance(0.5);
      for (D& corner : out.corner) {
        corner = corner + by;
        const double along = dot(corner - to, outward);
        if (is_outside && along < 0) corner = corner - (2 * along) * outward;
      }
    }
    return out;
  }
};

enum class Answer { kTouching, kApart, kUndecided };

Answer answer_of(const kernel::KernelTable& kernels, const kernel::SurfacePart& part, std::uint32_t triangle) {
  std::uint32_t count = 1;
  if (kernels.test_part(part, &triangle, &count)) return Answer::kTouching;
  return count ? Answer::kUndecided : Answer::kApart;
}

}  // namespace

TEST_CASE("triangles touch a part or are apart from it as they are called, however far away and in any unit") {
  Random random(203);
  std::size_t touching = 0, apart = 0, regular = 0, undecided_regular = 0;
  const std::uint64_t count = rounds(1400);
  for (std::uint64_t round = 0; round < count; ++round) {
    CAPTURE(round);
    const auto drawn = static_cast<Drawn>(round % kDrawnCount);
    const auto regime = static_cast<PartRegime>(round / kDrawnCount % kPartRegimeCount);
    const double units[] = {1, 1e-4, 1e4}, far[] = {0, 1, 100, 1e7}, away = far[random.index(4)];
    PartScene scene(random, drawn, regime, units[random.index(3)], away);
    const kernel::SurfacePart part = scene.part();
    const std::vector<const kernel::KernelTable*> tables = available_kernels();
    std::vector<std::uint32_t> all;
    std::vector<Answer> answers;
    for (std::uint32_t t = 0; t < PartScene::kCount; ++t) {
      all.push_back(t);
      answers.push_back(answer_of(*tables[0], part, t));
      const Real distance = scene.distance_of(t), margin = static_cast<Real>(scene.margin);
      if (answers[t] == Answer::kTouching) REQUIRE(distance <= margin);
      if (answers[t] == Answer::kApart) REQUIRE(distance > margin);
      touching += answers[t] == Answer::kTouching;
      apart += answers[t] == Answer::kApart;
      // With a margin boxes leave open what is near their edges and corners.
      const bool is_easy = regime == PartRegime::kRegular && drawn != Drawn::kHull && away <= 1;
      if (!is_easy || (drawn == Drawn::kBox && margin > 0)) continue;
      ++regular;
      undecided_regular += answers[t] == Answer::kUndecided;
    }
    for (const kernel::KernelTable* kernels : tables)
      for (const std::uint32_t given : {1u, 15u, 16u, 17u, PartScene::kCount}) {
        CAPTURE(name_of(*kernels));
        std::vector<std::uint32_t> triangles(all.data(), all.data() + given), open;
        bool touch = false;
        for (std::uint32_t t = 0; t < given; ++t) {
          touch = touch || answers[t] == Answer::kTouching;
          if (answers[t] == Answer::kUndecided) open.push_back(t);
        }
        std::uint32_t left = given;
        REQUIRE(kernels->test_part(part, triangles.data(), &left) == touch);
        if (touch) continue;
        triangles.resize(left);
        REQUIRE(triangles == open);
      }
  }
  MESSAGE(touching << " touching, " << apart << " apart, of " << regular << " regular ones " << undecided_regular
                   << " undecided");
  CHECK(touching >= least_count(8000, 1400));
  CHECK(apart >= least_count(8000, 1400));
  CHECK(undecided_regular * 100 <= regular);
}

}  // namespace cab::tests
