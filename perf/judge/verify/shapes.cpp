// Verifies exact tests: random pairs of convex shapes by kinds and regimes. Every instruction set must give the same
// answers to a block of sixteen. What the kernels leave open is decided in double, as a frame does. No pair that
// touches may be apart, and what touches is at most a stated fraction of the sizes apart. A sample goes through
// run_frame: its contacts must be deep enough to part the shapes, and are compared with the least depth.
#include <cmath>

#include "perf/base/report.h"
#include "perf/harness/world.h"
#include "perf/judge/verify/parts.h"
#include "perf/judge/verify/random_block.h"

namespace cab::perf {
namespace {

using oracle::ConvexCase;
using oracle::Real;

// Blocks of sixteen pairs of each two kinds and each regime, per round.
constexpr std::uint32_t kBlocks = 2;

// One of this many blocks has a pair whose contact is judged: the least depth takes a thousand times as long as the
// rest.
constexpr double kContactShare = 1.0 / 64;

// docs/embedding.md: two shapes that are reported are at most this far apart, in parts of their size and of the
// distances of their links and shapes from their origins.
constexpr Real kWidestGap = 0x1p-40L;

// What float leaves of the depth and the normal of a contact, in parts of the size.
constexpr Real kContactRounding = 4e-7L;

// Depths below this part of the size are not compared with the least one.
constexpr Real kDeep = 1e-3L;

const char* name_of(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox: return "box";
    case ShapeKind::kEllipsoid: return "ellipsoid";
    case ShapeKind::kCapsule: return "capsule";
    case ShapeKind::kConvexHull: return "hull";
    case ShapeKind::kSphere: return "sphere";
    case ShapeKind::kCylinder: return "cylinder";
    case ShapeKind::kHalfSpace: return "half space";
  }
  return "";
}

struct Kinds {
  ShapeKind a, b;
};

// Half extent of the box of a half space, in which nothing is too far away to be found.
constexpr float kPlaneBox = 1e17f;

// Every two kinds but two half spaces, which have no distance; the method of a task.
const std::vector<Kinds>& kinds_by_method() {
  static const std::vector<Kinds> all = [] {
    std::vector<Kinds> out;
    for (const ShapeKind& a : oracle::kCaseKinds)
      for (const ShapeKind* b = &a; b != std::end(oracle::kCaseKinds); ++b)
        if (a != ShapeKind::kHalfSpace || *b != ShapeKind::kHalfSpace) out.push_back({a, *b});
    return out;
  }();
  return all;
}

std::string list_of(const float* numbers, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += (i == 0 ? "(" : " ") + shortest(numbers[i]);
  return out + ")";
}

std::string to_text(const oracle::PosedPart& posed) {
  const ConvexPart& part = posed.part;
  return std::string(name_of(part.kind)) + " size " + list_of(part.size, 3) + " position " + list_of(part.position, 3) +
         " rotation " + list_of(part.rotation, 4) + " pose " + list_of(posed.pose, 7) + ", " +
         std::to_string(posed.vertices.size() / 3) + " vertices";
}

void report(Task& task, std::size_t method, const std::string& what, const ConvexCase& made) {
  task.violation(method, what + "; A: " + to_text(made.a) + "; B: " + to_text(made.b) + "; shift (" +
                             shortest(made.shift[0]) + " " + shortest(made.shift[1]) + " " + shortest(made.shift[2]) +
                             ")");
}

// The gap of shapes that are apart, in parts of kWidestGap of their size and their distances from their origins.
double wide_as(const ConvexCase& made) {
  const oracle::JudgedCase judged = judge_case(made, oracle::Effort::kMeasure);
  Real size = judged.size;
  for (const oracle::PosedPart* posed : {&made.a, &made.b})
    for (std::size_t c = 0; c < 3; ++c) size += std::fabs(posed->pose[4 + c]) + std::fabs(posed->part.position[c]);
  return static_cast<double>(judged.verdict.gap_at_most / size / kWidestGap);
}

// ------------------------------------------------------------------------------------------------------- contacts

// A body of one link with one part, in a box about it.
oracle::Member body_of(const oracle::PosedPart& posed, const ConvexShape& shape, const double (&origin)[3]) {
  oracle::Member out;
  const float half = shape.kind == ConvexKind::kHalfSpace ? kPlaneBox : shape.reach * 1.0001f;
  const float* const at = shape.position;
  out.rig.parents = {-1};
  out.rig.leaves = {
      {0, {{at[0], at[1], at[2]}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}}, {&posed.part, 1}}};
  out.poses.link_count = out.poses.instance_count = 1;
  out.poses.data.assign(posed.pose, posed.pose + 7);
  out.poses.origins.assign(origin, origin + 3);
  return out;
}

// The contact that a frame reports for the pair of a lane. Returns whether there is a hit.
bool find_contact(const Task& task, const RandomBlock& made, std::uint32_t lane, Contact& contact) {
  const ConvexCase& one = made.cases[lane];
  oracle::World world;
  world.members.push_back(body_of(one.a, *made.block.a.shape[lane], {0, 0, 0}));
  world.members.push_back(body_of(one.b, *made.block.b.shape[lane], one.shift));
  const oracle::EnginePtr engine = oracle::make_engine_for(world, {.isa = task.subject->kernels->isa});
  const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
  const PairRule rule = {{1}, {2}};
  Hit hit;
  FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = {&rule, 1};
  job.policies.exact = Exact::kConvex;
  job.hits = {&hit, 1};
  job.contacts = {&contact, 1};
  oracle::require(task.subject->run_frame(*engine, job));
  return job.hit_count == 1;
}

// Judges the contact of a pair that touches.
void judge_contact(Task& task, std::size_t method, const RandomBlock& made, std::uint32_t lane) {
  const ConvexCase& one = made.cases[lane];
  Contact contact = {};
  if (!find_contact(task, made, lane, contact)) {
    report(task, method, "a frame does not report shapes that touch", one);
    return;
  }
  Tally& tally = task.tallies[method];
  ++tally.contacts;
  const oracle::JudgedCase judged = judge_case(one, oracle::Effort::kMeasure);
  const Real rounding = kContactRounding * judged.size, least = -judged.verdict.gap_at_most;
  ConvexCase parted = one;
  bind_vertices(parted);
  for (std::size_t c = 0; c < 3; ++c)
    parted.shift[c] += static_cast<double>(contact.normal[c] * (contact.depth + rounding));
  bool is_finite = std::isfinite(contact.depth);
  for (std::size_t c = 0; c < 3; ++c)
    is_finite = is_finite && std::isfinite(contact.point_a[c]) && std::isfinite(contact.point_b[c]);
  if (!is_finite || contact.depth < 0)
    report(task, method, "a contact is not finite, or its depth is negative", one);
  else if (!(judge_case(parted, oracle::Effort::kMeasure).verdict.gap_at_most >= -rounding))
    report(task, method, "the depth of a contact, " + shortest(contact.depth) + ", does not part the shapes", one);
  if (least < kDeep * judged.size) return;
  tally.above_1 += contact.depth > 1.01L * least;
  tally.above_10 += contact.depth > 1.1L * least;
}

// --------------------------------------------------------------------------------------------------------- answers

// Judges the answer for one pair: what the kernels say or, where they leave it open, the test in double.
void judge_answer(Task& task, std::size_t method, const ConvexCase& made, oracle::Truth truth, bool is_apart) {
  Tally& tally = task.tallies[method];
  tally.touching += truth == oracle::Truth::kTouching;
  if (is_apart && truth == oracle::Truth::kTouching) {
    ++tally.false_apart;
    report(task, method, "shapes that touch are called apart", made);
  } else if (!is_apart && truth == oracle::Truth::kApart) {
    ++tally.false_positives;
    const double wide = wide_as(made);
    tally.widest_gap = std::max(tally.widest_gap, wide);
    if (wide > 1)
      report(task, method, "shapes that are called touching are " + shortest(wide) + " times 2^-40 apart", made);
  }
}

void judge_block(Task& task, std::size_t method, const RandomBlock& made) {
  Tally& tally = task.tallies[method];
  const kernel::ConvexAnswer answer = task.subject->kernels->test_convex_pairs(made.block);
  std::uint32_t differing = answer.apart & answer.touching;
  for (const kernel::KernelTable* kernels : all_kernels()) {
    const kernel::ConvexAnswer other = kernels->test_convex_pairs(made.block);
    differing |= (other.apart ^ answer.apart) | (other.touching ^ answer.touching);
  }
  const std::uint32_t with_contact = task.random.chance(kContactShare) ? task.random.index(kLanes) : kLanes;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const ConvexCase& one = made.cases[lane];
    const auto in_lane = [lane](std::uint32_t mask) { return (mask >> lane & 1) != 0; };
    ++tally.judged;
    if (in_lane(differing)) {
      ++tally.differing;
      report(task, method, "instruction sets differ", one);
    }
    bool is_apart = in_lane(answer.apart);
    if (!is_apart && !in_lane(answer.touching)) {
      const kernel::ConvexAnswer in_double = task.subject->answer_in_double(made.block, lane);
      ++tally.undecided;
      tally.still_undecided += in_double.apart == 0 && in_double.touching == 0;
      is_apart = in_double.apart != 0;
    }
    const oracle::JudgedShapes shapes(one);
    const oracle::Truth truth = oracle::truth_of(shapes.a, shapes.b);
    judge_answer(task, method, one, truth, is_apart);
    if (lane == with_contact && truth == oracle::Truth::kTouching) judge_contact(task, method, made, lane);
  }
}

void run(Task& task) {
  const auto regime = static_cast<oracle::ConvexRegime>(task.regime);
  for (std::uint32_t block = 0; block < kBlocks; ++block) {
    for (std::size_t method = 0; method < kinds_by_method().size(); ++method) {
      Kinds kinds = kinds_by_method()[method];
      if (task.random.chance(0.5)) std::swap(kinds.a, kinds.b);
      judge_block(task, method, RandomBlock(task.random, regime, kinds.a, kinds.b));
    }
  }
}

}  // namespace

// The regimes are those of oracle::ConvexRegime, in its order.
VerifyPart shapes_part() {
  std::vector<std::string> regimes = {"regular", "thin",  "unequal", "near",   "concentric", "aligned",
                                      "far",     "units", "needles", "plates", "nested",     "equal"};
  std::vector<std::string> methods;
  for (const Kinds& kinds : kinds_by_method())
    methods.push_back(std::string(name_of(kinds.a)) + "-" + name_of(kinds.b));
  return {"shapes", "pairs", Columns::kShapes, std::move(regimes), std::move(methods), run};
}

}  // namespace cab::perf
