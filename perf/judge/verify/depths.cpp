// Verifies depths that are promised to be the least: contacts of boxes, hulls of at most 32 vertices, capsules and
// spheres, by the kernels. The judge tries every face of the difference of two shapes. Along its normal, a depth must
// also part the shapes. Every instruction set must give the same bits, with a margin too.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/float_mode.h"
#include "perf/base/report.h"
#include "perf/judge/verify/parts.h"
#include "perf/judge/verify/random_block.h"

namespace cab::perf {
namespace {

using oracle::ConvexCase;
using oracle::Point;
using oracle::Real;

// Hulls of more vertices are not judged here: the judge's time grows with the fourth power of their number.
constexpr std::size_t kMostJudged = 32;

// layout/include/cab/types.h: by how much a depth is above the least one at most, in parts of the size (the worst of
// 4 000 000 is 4.2e-7). The centres of hulls are kept in float, so the direction is that of hulls that are off by 2^-24
// of how far they are from the origins of their links; six flat hulls of 1e-5, 0.1 away, were above 1e-6 by that.
constexpr Real kAboveLeast = 1e-6L, kCentre = 0x1p-23L;

// What rounding leaves, in parts of the lengths that went into a pair.
constexpr Real kRounding = 0x1p-36L;

// Depths below this part of the size are not compared in per cent.
constexpr Real kDeep = 1e-3L;

// blocks: of sixteen pairs, of each regime and round: more where the search has more to try and fewer pairs touch.
struct Kinds {
  ShapeKind a, b;
  std::uint32_t blocks;
};

constexpr ShapeKind kKinds[] = {ShapeKind::kConvexHull, ShapeKind::kBox, ShapeKind::kCapsule, ShapeKind::kSphere};

// Every two of them; the method of a task.
const std::vector<Kinds>& kinds_by_method() {
  static const std::vector<Kinds> all = [] {
    std::vector<Kinds> out;
    for (const ShapeKind& a : kKinds)
      for (const ShapeKind* b = &a; b != std::end(kKinds); ++b) {
        const auto hulls = (a == ShapeKind::kConvexHull) + (*b == ShapeKind::kConvexHull);
        out.push_back({a, *b, hulls == 2 ? 5u : hulls == 1 ? 3u : 2u});
      }
    return out;
  }();
  return all;
}

// How far a shape reaches along a direction.
Real reach_along(const oracle::JudgeShape& shape, const Point& direction) {
  Real along[3];
  for (std::size_t k = 0; k < 3; ++k) along[k] = dot(oracle::to_vec3(shape.pose.column[k]), direction);
  const Real at = dot(shape.pose.at, direction);
  Real most = 0;
  switch (shape.kind) {
    case oracle::JudgeKind::kBox:
      for (std::size_t k = 0; k < 3; ++k) most += shape.size[k] * std::fabs(along[k]);
      break;
    case oracle::JudgeKind::kCapsule: most = shape.size[0] + shape.size[1] * std::fabs(along[2]); break;
    case oracle::JudgeKind::kHull:
      most = -HUGE_VALL;
      for (const Point& v : shape.vertices) most = std::max(most, v[0] * along[0] + v[1] * along[1] + v[2] * along[2]);
      break;
    default: most = shape.size[0];
  }
  return at + most;
}

bool is_judged(const ConvexCase& one) {
  return std::max(one.a.vertices.size(), one.b.vertices.size()) <= 3 * kMostJudged;
}

void judge_lane(Task& task, std::size_t method, const ConvexCase& one, const kernel::ConvexContacts& found,
                std::uint32_t lane) {
  const oracle::JudgedShapes shapes(one);
  if (oracle::truth_of(shapes.a, shapes.b) != oracle::Truth::kTouching) return;
  const oracle::JudgedCase judged = judge_case(one, oracle::Effort::kMeasure);
  Tally& tally = task.tallies[method];
  ++tally.judged;
  const auto report = [&](const std::string& what) {
    task.violation(method, what + "; A: " + to_text(one.a) + "; B: " + to_text(one.b) + "; shift (" +
                               shortest(one.shift[0]) + " " + shortest(one.shift[1]) + " " + shortest(one.shift[2]) +
                               ")");
  };
  Real at_links = judged.size, lengths = judged.size;
  for (const oracle::PosedPart* posed : {&one.a, &one.b})
    for (std::size_t c = 0; c < 3; ++c) {
      at_links += std::fabs(posed->part.position[c]);
      lengths += std::fabs(posed->pose[4 + c]) + std::fabs(posed->part.position[c]);
    }
  const Real depth = found.depth[lane], least = -judged.verdict.gap_at_most, above = depth - least;
  const Point normal = {{found.normal[0][lane], found.normal[1][lane], found.normal[2][lane]}};
  const Real needed = reach_along(shapes.a, normal) + reach_along(shapes.b, Real{-1} * normal);
  tally.off = std::max(tally.off, static_cast<double>(above / judged.size * 0x1p24L));
  if (!(above <= kAboveLeast * judged.size + kCentre * at_links + kRounding * lengths))
    report("the depth of a contact, " + shortest(found.depth[lane]) + ", is above the least, " +
           shortest(static_cast<double>(least)));
  if (!(needed - depth <= kRounding * lengths) || !(std::fabs(dot(normal, normal) - 1) <= 1e-12L))
    report("the depth of a contact, " + shortest(found.depth[lane]) + ", does not part the shapes");
  if (least < kDeep * judged.size) return;
  tally.above_1 += depth > 1.01L * least;
  tally.above_10 += depth > 1.1L * least;
}

void judge_block(Task& task, std::size_t method, Kinds kinds) {
  if (task.random.chance(0.5)) std::swap(kinds.a, kinds.b);
  const RandomBlock made(task.random, static_cast<oracle::ConvexRegime>(task.regime), kinds.a, kinds.b);
  kernel::ConvexBlock within = made.block;
  std::fill_n(within.margin, kLanes, 1.0f);
  kernel::ConvexContacts found = {}, found_within = {}, other = {};
  task.subject->kernels->contact_pairs(made.block, found);
  task.subject->kernels->contact_pairs(within, found_within);
  if (std::memcmp(&found, &found_within, sizeof(found)) != 0) task.violation(method, "a margin changes contacts");
  for (const kernel::KernelTable* kernels : all_kernels())
    for (const bool has_margin : {false, true}) {
      kernels->contact_pairs(has_margin ? within : made.block, other);
      if (std::memcmp(has_margin ? &found_within : &found, &other, sizeof(other)) == 0) continue;
      ++task.tallies[method].differing;
      task.violation(method, "instruction sets differ");
      break;
    }
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    if (is_judged(made.cases[lane])) judge_lane(task, method, made.cases[lane], found, lane);
}

void run(Task& task) {
  const kernel::FloatMode mode;
  for (std::size_t method = 0; method < kinds_by_method().size(); ++method)
    for (std::uint32_t block = 0; block < kinds_by_method()[method].blocks; ++block)
      judge_block(task, method, kinds_by_method()[method]);
}

}  // namespace

VerifyPart depths_part() {
  std::vector<std::string> methods;
  for (const Kinds& kinds : kinds_by_method())
    methods.push_back(std::string(name_of(kinds.a)) + "-" + name_of(kinds.b));
  return {"depths", "depths", Columns::kDepths, convex_regimes(), std::move(methods), run};
}

}  // namespace cab::perf
