// The contacts of pairs of shapes by every kernel against the judge: depths that part the shapes, gaps that are not too
// wide, points on both bodies, and the same bits on all instruction sets.
#include "kernels/float_mode.h"
#include "tests/kernels/convex/random_block.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::JudgedCase;
using oracle::Real;

// What is left by rounding, in parts of the size that a case is compared with. Regimes with links far from their
// origins round more: positions there have as many digits, but are larger.
constexpr Real kRounded = 0x1p-36L;

// How far a gap may be below the distance, in parts of the size.
constexpr Real kGapBelow = 1e-5L;

// How far the depth of polytopes and round shapes may be above the least: in parts of it (worst measured 7e-9), and
// where the shapes without their balls overlap by less than kBarely of the size, or not at all, in parts of the size
// (1.3e-7).
constexpr Real kAboveLeast = 1e-6L, kBarely = 1e-7L;

// Points are off if point_a - point_b differs by this share of the size from depth along the normal. They may be in few
// pairs: where a search ends on the rim of a cylinder.
constexpr Real kOff = 0.01L;

using Vector = oracle::Vec3<Real>;

Vector at(const double (&from)[3][kLanes], std::uint32_t lane) {
  return {{from[0][lane], from[1][lane], from[2][lane]}};
}

bool same_contact(const kernel::ConvexContacts& a, const kernel::ConvexContacts& b, std::uint32_t lane) {
  bool same = same_bits(a.depth[lane], b.depth[lane]);
  for (std::size_t c = 0; c < 3; ++c)
    same = same && same_bits(a.normal[c][lane], b.normal[c][lane]) &&
           same_bits(a.point_a[c][lane], b.point_a[c][lane]) && same_bits(a.point_b[c][lane], b.point_b[c][lane]);
  return same;
}

bool is_round(ShapeKind kind) { return kind == ShapeKind::kCapsule || kind == ShapeKind::kSphere; }

// The radius of the ball about a shape's points or segment.
Real radius_of(const oracle::PosedPart& posed) { return is_round(posed.part.kind) ? posed.part.size[0] : 0; }

// Whether the depth of two such shapes is the least one. A hull must have few vertices.
bool has_faces_or_is_round(const oracle::PosedPart& posed) {
  const ShapeKind kind = posed.part.kind;
  return is_round(kind) || kind == ShapeKind::kBox ||
         (kind == ShapeKind::kConvexHull && posed.vertices.size() <= 3 * kMostVertices);
}

// The largest lengths that a case's positions are sums of.
Real away_of(const ConvexCase& one, const JudgedCase& judged) {
  Real away = judged.size;
  for (const oracle::PosedPart* posed : {&one.a, &one.b})
    for (std::size_t c = 0; c < 3; ++c) away += std::fabs(posed->pose[4 + c]) + std::fabs(posed->part.position[c]);
  return away;
}

// Whether moving the second shape along the normal of a contact by its depth parts the shapes, to rounding.
bool parts(const ConvexCase& one, const kernel::ConvexContacts& found, std::uint32_t lane, Real rounded) {
  ConvexCase parted = one;
  bind_vertices(parted);
  for (std::size_t c = 0; c < 3; ++c)
    parted.shift[c] += found.normal[c][lane] * (found.depth[lane] + static_cast<double>(rounded));
  return judge_case(parted, oracle::Effort::kMeasure).verdict.gap_at_most >= -2 * rounded;
}

// What is counted over the overlapping pairs of a regime whose depth is searched for.
struct Depths {
  std::uint64_t deep = 0, above_1 = 0, above_10 = 0;

  void count(Real depth, Real least) {
    ++deep;
    above_1 += depth > Real{1.01} * least;
    above_10 += depth > Real{1.1} * least;
  }
};

// How far two ellipsoids reach into each other along a unit vector from a to b; if below 0, less their gap.
Real depth_along(const oracle::JudgedShapes& shapes, const Vector& d) {
  Real depth = dot(d, shapes.a.pose.at) - dot(d, shapes.b.pose.at);
  for (const oracle::JudgeShape* shape : {&shapes.a, &shapes.b}) {
    Real height_sq = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Real along = shape->size[k] * dot(d, oracle::to_vec3(shape->pose.column[k]));
      height_sq += along * along;
    }
    depth += std::sqrt(height_sq);
  }
  return depth;
}

Vector unit(const Vector& v) { return (1 / std::sqrt(dot(v, v))) * v; }

}  // namespace

TEST_CASE("the depth of ellipsoids is no greater than along the lines that its search begins at, nor than beside it") {
  const kernel::FloatMode mode;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r)
    for (std::uint64_t round = 0; round < rounds(40); ++round) {
      CAPTURE(r);
      CAPTURE(round);
      Random random(7000 + 1000 * r + round);
      const RandomBlock made(random, static_cast<ConvexRegime>(r), ShapeKind::kEllipsoid, ShapeKind::kEllipsoid);
      kernel::ConvexContacts found;
      available_kernels().back()->contact_pairs(made.block, found);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        CAPTURE(lane);
        const oracle::JudgedShapes shapes(made.cases[lane]);
        const Vector between = shapes.b.pose.at - shapes.a.pose.at;
        Real size = std::sqrt(dot(between, between)), aspect = 1;
        for (const oracle::JudgeShape* shape : {&shapes.a, &shapes.b}) {
          const auto [least, most] = std::minmax({shape->size[0], shape->size[1], shape->size[2]});
          size += most;
          aspect = std::max(aspect, most / least);
        }
        const Real allowed = found.depth[lane] - 1e-9L * away_of(made.cases[lane], {{}, size});
        if (dot(between, between) > 0) CHECK(allowed <= depth_along(shapes, unit(between)));
        for (const oracle::JudgeShape* shape : {&shapes.a, &shapes.b})
          for (const auto& axis : shape->pose.column) {
            Vector along = unit(oracle::to_vec3(axis));
            if (dot(along, between) < 0) along = Real{-1} * along;
            CHECK(allowed <= depth_along(shapes, along));
          }
        // Of needles and plates some depths are a few hundredths too large.
        for (int beside = 0; beside < 4 && aspect < 30; ++beside) {
          const Vector off = {{random.normal(), random.normal(), random.normal()}};
          CHECK(allowed <= depth_along(shapes, unit(at(found.normal, lane) + Real{1e-3L} * off)));
        }
      }
    }
}

TEST_CASE("a contact is as deep as parting the shapes takes, no gap is too wide, by any kernel with the same bits") {
  const kernel::FloatMode mode;
  // The judge takes nearly all of the time.
  const auto judged_lanes = static_cast<std::uint32_t>(std::min<std::uint64_t>(kLanes, rounds(kLanes)));
  std::uint64_t seed = 5000;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r) {
    CAPTURE(r);
    Depths searched;
    std::uint64_t gaps = 0;
    std::uint64_t pairs = 0, off_pairs = 0;
    Real farthest = 0;
    for (const ShapeKind kind_a : oracle::kCaseKinds)
      for (const ShapeKind kind_b : oracle::kCaseKinds) {
        CAPTURE(static_cast<int>(kind_a));
        CAPTURE(static_cast<int>(kind_b));
        const bool planes = kind_a == ShapeKind::kHalfSpace && kind_b == ShapeKind::kHalfSpace;
        if (planes) continue;  // no contact
        const bool exact = kind_a == ShapeKind::kHalfSpace || kind_b == ShapeKind::kHalfSpace ||
                           (is_round(kind_a) && is_round(kind_b)) ||
                           (kind_a == ShapeKind::kBox && kind_b == ShapeKind::kBox);
        for (std::uint64_t round = 0; round < rounds(1); ++round) {
          Random random(++seed);
          CAPTURE(seed);
          const RandomBlock made(random, static_cast<ConvexRegime>(r), kind_a, kind_b);
          kernel::ConvexContacts found;
          for (const kernel::KernelTable* kernels : available_kernels()) {
            CAPTURE(std::string(name_of(*kernels)));
            kernel::ConvexContacts other;
            kernels->contact_pairs(made.block, other);
            if (kernels == available_kernels()[0]) found = other;
            CHECK(same_bits(found, other));
            // With a margin GJK comes first.
            kernel::ConvexBlock within = made.block;
            std::fill_n(within.margin, kLanes, 1.0f);
            kernels->contact_pairs(within, other);
            CHECK(same_bits(found, other));
            for (const float margin : {0.0f, 1.0f}) {  // fewer pairs have the same contacts
              within.count = random.index(kLanes - 1) + 1;
              std::fill_n(within.margin, kLanes, margin);
              CAPTURE(within.count);
              CAPTURE(margin);
              kernels->contact_pairs(within, other);
              for (std::uint32_t lane = 0; lane < within.count; ++lane) {
                CAPTURE(lane);
                CHECK(same_contact(found, other, lane));
              }
            }
          }
          for (std::uint32_t lane = 0; lane < judged_lanes; ++lane) {
            CAPTURE(lane);
            const ConvexCase& one = made.cases[lane];
            const JudgedCase judged = judge_case(one, oracle::Effort::kMeasure);
            const Real away = away_of(one, judged), rounded = kRounded * away;
            const Real depth = found.depth[lane];
            const Vector normal = at(found.normal, lane);
            CHECK(std::fabs(dot(normal, normal) - 1) < 1e-12L);
            const Vector off = (at(found.point_a, lane) - at(found.point_b, lane)) - depth * normal;
            const Real distance_off = std::sqrt(dot(off, off)) / judged.size;
            farthest = std::max(farthest, distance_off);
            off_pairs += distance_off > kOff;
            ++pairs;
            if (judged.verdict.gap_at_least > 0) {
              ++gaps;
              CHECK(-depth <= judged.verdict.gap_at_most + rounded);
              CHECK(-depth >= judged.verdict.gap_at_least - kGapBelow * judged.size - rounded);
            } else if (judged.verdict.gap_at_most < 0) {
              const Real least = -judged.verdict.gap_at_most;
              const Real core = least - radius_of(one.a) - radius_of(one.b);  // below 0: less a gap
              CHECK(parts(one, found, lane, rounded));
              if (exact) CHECK(depth <= least + 1e-9L * away);
              if (has_faces_or_is_round(one.a) && has_faces_or_is_round(one.b))
                CHECK(depth <= least + kAboveLeast * (core < kBarely * judged.size ? judged.size : least) + rounded);
              else if (!exact && least >= Real{1e-3} * judged.size)
                searched.count(depth, least);
            }
          }
        }
      }
    MESSAGE("regime " << r << ": " << searched.deep << " depths by search, of which " << searched.above_1
                      << " are over 1 % and " << searched.above_10 << " over 10 % above the least");
    MESSAGE("regime " << r << ": " << gaps << " gaps; points are off in " << off_pairs << " of " << pairs
                      << " pairs, by at most " << static_cast<double>(farthest) << " of the size");
    CHECK(gaps > 0);
    if (judged_lanes < kLanes) continue;  // too few for shares
    CHECK(off_pairs * 100 <= pairs);
    CHECK(searched.above_10 * 20 <= searched.deep);
  }
}
