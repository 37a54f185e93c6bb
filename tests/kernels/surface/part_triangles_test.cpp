// Triangles touch a convex part, or are apart from it, where long double says so, with the same answers on every
// instruction set.
#include "kernels/surface/part_triangles.h"

#include "layout/convex_shapes.h"
#include "perf/judge/oracle/box_tile.h"
#include "perf/judge/oracle/convex_judge.h"
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
enum class Drawn { kBall, kCapsule, kBox, kHalfSpace, kHull, kCylinder, kEllipsoid };
constexpr std::uint32_t kDrawnCount = 7;

// A part, and triangles of floats about it.
struct PartScene {
  static constexpr std::uint32_t kCount = 40;
  static constexpr float kStretch = 4;  // the scale of the part's pose, with which all lengths below are multiplied
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
    if (drawn == Drawn::kCylinder) half[1] = half[0];
    if (drawn == Drawn::kHull) {
      // Now and then a polygon.
      if (random.chance(0.1)) half[random.index(3)] = 0;
      for (std::uint32_t v = 0, count = 4 + random.index(random.chance(0.2) ? 120 : 20); v < count; ++v) {
        const D at = random.unit_vector();
        for (std::size_t c = 0; c < 3; ++c) hull.push_back(half[c] * static_cast<float>(at[c]));
      }
    }
    make_shape();
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
    int exponent = 0;
    std::frexp(size(), &exponent);
    const float scale = std::ldexp(1.0f, -exponent);
    kernel::SurfacePart out = {
        {vertices.data(), nullptr, 0},   patches.data(), shape, scale, {}, {}, {}, kStretch * scale,
        kStretch * shape->reach * scale, margin};
    for (std::size_t c = 0; c < 3; ++c) {
      double at = center[c];
      for (std::size_t k = 0; k < 3; ++k) {
        at += static_cast<double>(kStretch * shape->position[k]) * axis[k][c];
        out.axis[k][c] = static_cast<float>(axis[k][c]);
      }
      out.center[c] = static_cast<float>(at);
      out.half[c] = (drawn == Drawn::kHull ? kStretch * shape->size[c] : half[c]) * scale;
    }
    return out;
  }

  // Bounds of how far a triangle is from the part; of a half space of how high it begins.
  struct Bounds {
    Real least, most;
  };
  Bounds distance_of(std::uint32_t triangle) const {
    Triangle<Real> at{};
    for (std::uint32_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          at.corner[i][k] +=
              (static_cast<Real>(vertices[4 * (std::size_t{3} * triangle + i) + c]) - static_cast<Real>(center[c])) *
              static_cast<Real>(axis[k][c]);
    const auto exactly = [](Real distance) { return Bounds{distance, distance}; };
    if (drawn == Drawn::kHalfSpace) return exactly(std::min({at.corner[0][2], at.corner[1][2], at.corner[2][2]}));
    if (drawn == Drawn::kBox) return exactly(distance_to_box(at, {{half[0], half[1], half[2]}}));
    if (drawn == Drawn::kBall || drawn == Drawn::kCapsule) {
      const Point end{{0, 0, half[2]}};
      return exactly(distance(at, {{end, Real{-1} * end, end}}) - half[0]);
    }
    oracle::JudgeShape convex, other;
    if (drawn == Drawn::kEllipsoid) {
      convex.kind = oracle::JudgeKind::kEllipsoid;
      std::copy_n(half, 3, convex.size);
    } else if (drawn == Drawn::kCylinder) {
      convex.kind = oracle::JudgeKind::kCylinder;
      convex.size[0] = half[0];
      convex.size[1] = half[2];
    } else {
      convex.kind = oracle::JudgeKind::kHull;
      convex.vertices = corners;
    }
    other.kind = oracle::JudgeKind::kHull;
    other.vertices = at.corner;
    const oracle::Effort effort = margin > 0 ? oracle::Effort::kMeasure : oracle::Effort::kDecide;
    const oracle::Verdict verdict = judge(convex, other, effort);
    return {verdict.gap_at_least, verdict.gap_at_most};
  }

 private:
  void make_shape() {
    static constexpr ShapeKind kKinds[] = {ShapeKind::kSphere,    ShapeKind::kCapsule,    ShapeKind::kBox,
                                           ShapeKind::kHalfSpace, ShapeKind::kConvexHull, ShapeKind::kCylinder,
                                           ShapeKind::kEllipsoid};
    convex_part.kind = kKinds[static_cast<std::size_t>(drawn)];
    const bool has_length = drawn == Drawn::kCapsule || drawn == Drawn::kCylinder;
    for (std::size_t c = 0; c < 3; ++c) convex_part.size[c] = half[has_length && c == 1 ? 2 : c] / kStretch;
    for (std::size_t v = 0; v < hull.size(); v += 3) corners.push_back({{hull[v], hull[v + 1], hull[v + 2]}});
    for (float& number : hull) number /= kStretch;
    convex_part.vertices = hull;
    static constexpr std::uint32_t kBegin[] = {0, 1};
    Articulation articulation;
    articulation.leaf_count = 1;
    articulation.parts = {&convex_part, 1};
    articulation.leaf_part_begin = {kBegin, 2};
    shape = make_convex_shapes(articulation, arena).shapes.data;
  }

  // A point in which the part ends, and the direction of a plane there that it does not cross.
  D end_of(Random& random, std::size_t across, double side, D& outward) const {
    const D length{{half[0], half[1], half[2]}};
    outward = random.unit_vector();
    if (drawn == Drawn::kBall || drawn == Drawn::kCapsule)
      return length[0] * outward + D{{0, 0, outward[2] > 0 ? length[2] : -length[2]}};
    if (drawn == Drawn::kEllipsoid) {
      const D scaled{{length[0] * outward[0], length[1] * outward[1], length[2] * outward[2]}};
      D at = (1 / norm(scaled)) * scaled;
      for (std::size_t c = 0; c < 3; ++c) at[c] *= length[c];
      return at;
    }
    if (drawn == Drawn::kHull) {
      D out{};
      double highest = -HUGE_VAL;
      for (const Point& corner : corners) {
        const D at = convert<double>(corner);
        if (dot(at, outward) > highest) out = at;
        highest = std::max(highest, dot(at, outward));
      }
      return out;
    }
    if (drawn == Drawn::kCylinder) {
      // On the rim, on the side, or on an end.
      const double by = length[0] / std::hypot(outward[0], outward[1]);
      D at{{by * outward[0], by * outward[1], outward[2] > 0 ? length[2] : -length[2]}};
      if (random.chance(0.3)) {
        outward = {{at[0] / length[0], at[1] / length[0], 0}};
        at[2] *= random.uniform(-1, 1);
      } else if (random.chance(0.5)) {
        const double inwards = random.uniform(0, 1);
        outward = {{0, 0, at[2] > 0 ? 1.0 : -1.0}};
        at = {{at[0] * inwards, at[1] * inwards, at[2]}};
      }
      return at;
    }
    outward = D{};
    outward[across] = side < 0 ? -1 : 1;
    D at;
    for (std::size_t c = 0; c < 3; ++c) at[c] = c == across ? side : length[c] * random.uniform(-1, 1);
    return at;
  }

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
      D outward;
      D to = end_of(random, across, side, outward);
      to = to + beyond * outward + point(random.log_uniform(1e-8, 1e-3));
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

  Arena arena{default_allocator()};
  ConvexPart convex_part;
  std::vector<float> hull;  // ConvexPart::vertices
  const ConvexShape* shape = nullptr;
  std::vector<Point> corners;  // of a hull
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
  constexpr std::uint64_t kRounds = 1960;
  std::size_t touching = 0, apart = 0, regular = 0, undecided_regular = 0;
  const std::uint64_t count = rounds(kRounds);
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
      const PartScene::Bounds distance = scene.distance_of(t);
      const Real margin = static_cast<Real>(scene.margin);
      if (answers[t] == Answer::kTouching) REQUIRE(distance.least <= margin);
      if (answers[t] == Answer::kApart) REQUIRE(distance.most > margin);
      touching += answers[t] == Answer::kTouching;
      apart += answers[t] == Answer::kApart;
      // With a margin boxes leave open what is near their edges and corners.
      const bool is_easy = regime == PartRegime::kRegular && away <= 1;
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
  CHECK(touching >= least_count(8000, kRounds));
  CHECK(apart >= least_count(8000, kRounds));
  CHECK(undecided_regular * 100 <= regular);
}

}  // namespace cab::tests
