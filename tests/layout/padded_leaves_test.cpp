// Padded leaves: how far they reach along random directions, against the support functions of the shapes they are of.
#include <cab/padded_leaves.h>

#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/harness/random_rig.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// How far a part reaches along a direction, from its link's origin.
double reach(const ConvexPart& part, const Vec3<double>& n) {
  const double q[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
  double column[3][3];
  quaternion_matrix(q, column);
  double along[3], at = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    along[k] = column[k][0] * n[0] + column[k][1] * n[1] + column[k][2] * n[2];
    at += double{part.position[k]} * n[k];
  }
  const double a = part.size[0], b = part.size[1], c = part.size[2];
  switch (part.kind) {
    case ShapeKind::kSphere: return at + a;
    case ShapeKind::kCapsule: return at + a + b * std::fabs(along[2]);
    case ShapeKind::kCylinder: return at + a * std::hypot(along[0], along[1]) + b * std::fabs(along[2]);
    case ShapeKind::kBox: return at + a * std::fabs(along[0]) + b * std::fabs(along[1]) + c * std::fabs(along[2]);
    case ShapeKind::kEllipsoid: return at + std::hypot(a * along[0], b * along[1], c * along[2]);
    case ShapeKind::kHalfSpace: return at;
    case ShapeKind::kConvexHull: break;
  }
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < part.vertices.size; v += 3)
    most =
        std::max(most, part.vertices[v] * along[0] + part.vertices[v + 1] * along[1] + part.vertices[v + 2] * along[2]);
  return at + most;
}

// How much farther than the padding a part may reach, as a factor of it.
double most_factor(const ConvexPart& part) {
  switch (part.kind) {
    case ShapeKind::kBox: return std::sqrt(3.0);
    case ShapeKind::kCylinder: return std::sqrt(2.0);
    case ShapeKind::kConvexHull: return 1.2585;
    case ShapeKind::kEllipsoid: {
      const double least = std::min({part.size[0], part.size[1], part.size[2]}),
                   most = std::max({part.size[0], part.size[1], part.size[2]}), ratio = std::sqrt(most / least);
      return (ratio + 1 / ratio) / 2;
    }
    default: return 1;
  }
}

constexpr ShapeKind kKinds[] = {ShapeKind::kBox,    ShapeKind::kEllipsoid, ShapeKind::kCapsule,  ShapeKind::kConvexHull,
                                ShapeKind::kSphere, ShapeKind::kCylinder,  ShapeKind::kHalfSpace};

// Leaves on two links, with parts in boxes that hold them.
struct Body {
  std::vector<std::vector<float>> vertices;
  std::vector<std::vector<ConvexPart>> parts;
  std::vector<Leaf> leaves;

  explicit Body(Random& random) {
    const double away = random.chance(0.2) ? 1000 : 1;
    vertices.reserve(32);
    parts.reserve(8);
    for (unsigned l = 0; l < 8; ++l) {
      Leaf& leaf = leaves.emplace_back();
      leaf.link = l % 2;
      leaf.box = random_box(random, away * random.unit_vector(), 0.1, 1);
      std::vector<ConvexPart>& of = parts.emplace_back();
      for (unsigned p = random.index(4); p > 0; --p) of.push_back(random_part(random, leaf.box));
      leaf.parts = of;
    }
  }

  // Of a box's size or less, and the box grows until it holds the part.
  ConvexPart random_part(Random& random, Box& box) {
    ConvexPart part;
    part.kind = kKinds[random.index(7)];
    double q[4];
    random_turn(random, q);
    for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
    for (std::size_t c = 0; c < 3; ++c) {
      part.position[c] = box.center[c] + static_cast<float>(random.uniform(-0.1, 0.1));
      part.size[c] = static_cast<float>(random.log_uniform(1e-3, 0.5));
    }
    if (part.kind == ShapeKind::kConvexHull) {
      const unsigned count = 3 + random.index(random.chance(0.2) ? 300 : 20);
      const bool flat = random.chance(0.2), on_ball = random.chance(0.3);
      std::vector<float>& to = vertices.emplace_back();
      for (unsigned v = 0; v < count; ++v) {
        Vec3<double> point = (on_ball ? 0.5 : random.uniform(0, 0.5)) * random.unit_vector();
        if (flat) point[2] = 0.25;
        for (std::size_t c = 0; c < 3; ++c) to.push_back(static_cast<float>(point[c]));
      }
      to.insert(to.end(), to.begin(), to.begin() + 9);  // the first ones twice
      part.vertices = to;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3<double> n{{box.axis[k][0], box.axis[k][1], box.axis[k][2]}};
      const double middle = n[0] * box.center[0] + n[1] * box.center[1] + n[2] * box.center[2];
      const double needed = std::max(reach(part, n) - middle, middle + reach(part, -1.0 * n));
      box.half[k] = std::max(box.half[k], static_cast<float>(needed * (1 + 1e-6) + 1e-6));
    }
    return part;
  }
};

}  // namespace

TEST_CASE("a padded leaf reaches as far as its padding asks for along every direction, and hardly farther") {
  std::array<std::size_t, 7> seen = {};
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Body body(random);
    const float padding[] = {static_cast<float>(random.log_uniform(1e-4, 2)), 0};
    PaddedLeaves padded;
    REQUIRE(padded.set(body.leaves, padding) == Status::kOk);
    REQUIRE(padded.leaves().size == body.leaves.size());
    for (std::size_t l = 0; l < body.leaves.size(); ++l) {
      const Leaf &from = body.leaves[l], &to = padded.leaves()[l];
      CHECK(to.link == from.link);
      REQUIRE(to.parts.size == from.parts.size);
      if (from.link == 1) {
        CHECK(std::memcmp(&to.box, &from.box, sizeof(Box)) == 0);
        CHECK(to.parts.data == from.parts.data);
        continue;
      }
      const double by = padding[0];
      for (int k = 0; k < 3; ++k) CHECK(double{to.box.half[k]} >= double{from.box.half[k]} + by);
      for (std::size_t p = 0; p < to.parts.size; ++p) {
        const ConvexPart &part = from.parts[p], &grown = to.parts[p];
        CAPTURE(static_cast<int>(part.kind));
        CHECK(grown.kind == part.kind);
        ++seen[static_cast<std::size_t>(part.kind)];
        const double q[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
        double column[3][3];
        quaternion_matrix(q, column);
        // Of the support functions here; those of points 1000 away have that many digits less.
        const double size = std::fabs(part.position[0]) + std::fabs(part.position[1]) + std::fabs(part.position[2]) + 1;
        double least = 1e9, most = -1e9;
        for (int d = 0; d < 200; ++d) {
          Vec3<double> n = random.unit_vector();
          if (part.kind == ShapeKind::kHalfSpace) n = Vec3<double>{{column[2][0], column[2][1], column[2][2]}};
          const double gain = reach(grown, n) - reach(part, n);
          least = std::min(least, gain);
          most = std::max(most, gain);
        }
        CHECK(least >= by - 1e-14 * size - (part.kind == ShapeKind::kHalfSpace ? 1e-7 * by : 0));
        CHECK(most <= by * most_factor(part) * (1 + 1e-5) + 1e-6 * size);
        if (part.kind == ShapeKind::kConvexHull && part.vertices.size > 900)
          CHECK(grown.vertices.size <= 4 * part.vertices.size);
      }
    }
    // The engine takes them: parts lie in their boxes.
    const std::int32_t parents[] = {-1, 0};
    Arena arena(default_allocator());
    Articulation out;
    std::uint32_t bad_leaf = 0;
    CHECK(build_articulation({parents, {}, padded.leaves(), {}}, arena, &out, &bad_leaf) == Status::kOk);
  }
  for (const std::size_t count : seen) CHECK(count >= least_count(100, 300));
}

TEST_CASE("a leaf without parts is its box, and a padding that is no length is refused") {
  const Leaf leaf = {0, {{1, 2, 3}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, 0, 2}}, {}};
  PaddedLeaves padded;
  const float padding[] = {.25f};
  REQUIRE(padded.set({&leaf, 1}, padding) == Status::kOk);
  const Box& box = padded.leaves()[0].box;
  for (int k = 0; k < 3; ++k) {
    CHECK(box.center[k] == leaf.box.center[k]);
    CHECK(box.half[k] >= leaf.box.half[k] + .25f);
    CHECK(double{box.half[k]} == doctest::Approx(double{leaf.box.half[k]} + .25).epsilon(1e-4));
  }
  CHECK(padded.leaves()[0].parts.empty());
  for (const float wrong : {-1e-9f, kNan, 2e18f, std::numeric_limits<float>::infinity()})
    CHECK(padded.set({&leaf, 1}, {&wrong, 1}) == Status::kBadMargin);
  CHECK(padded.set({&leaf, 1}, {}) == Status::kBadLeafLink);
}

}  // namespace cab::tests
