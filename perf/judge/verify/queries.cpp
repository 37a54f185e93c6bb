// Verifies queries by run_queries, by kinds and by the regimes of random queries, about leaf boxes and about exact
// shapes. By a judge in long double no link may be lost, none may be found that no grown leaf is met by, and whatever
// is written must be right. Every instruction set must answer the same bits.
#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/verify/parts.h"
#include "perf/judge/verify/query_world.h"

namespace cab::perf {
namespace {

// Queries of one kind and regime per round.
constexpr std::uint32_t kQueries = 3;

// A kind of query, and what it is asked about; the method of a task.
struct Use {
  const char* name;
  QueryKind kind;
  Exact exact;
};
constexpr Use kUses[] = {
    {"rays", QueryKind::kRay, Exact::kNone},
    {"spheres", QueryKind::kSphere, Exact::kNone},
    {"boxes", QueryKind::kBox, Exact::kNone},
    {"capsules", QueryKind::kCapsule, Exact::kNone},
    {"points", QueryKind::kPoint, Exact::kNone},
    {"regions", QueryKind::kRegion, Exact::kNone},
    {"rays, shapes", QueryKind::kRay, Exact::kConvex},
    {"spheres, shapes", QueryKind::kSphere, Exact::kConvex},
    {"boxes, shapes", QueryKind::kBox, Exact::kConvex},
    {"capsules, shapes", QueryKind::kCapsule, Exact::kConvex},
    {"points, shapes", QueryKind::kPoint, Exact::kConvex},
    {"regions, shapes", QueryKind::kRegion, Exact::kConvex},
};

void judge_use(Task& task, std::size_t use, const QueryWorld& made) {
  QueryAnswer answer;
  ask_queries(task, task.subject->kernels->isa, made, kUses[use].exact, answer);
  Tally& tally = task.tallies[use];
  std::size_t begin = 0;
  for (std::size_t q = 0; q < made.about.queries.size(); ++q) {
    const Span<const QueryHit> hits = answer.hits_of(q, begin);
    const oracle::QueryCounts counts = oracle::count_query(made.scene, answer.job, q, hits);
    ++tally.judged;
    tally.touching += counts.must;
    tally.hits += counts.hits;
    tally.lost += counts.lost;
    tally.false_positives += counts.extra;
    tally.off = std::max(tally.off, counts.off);
    if (!counts.fault.empty()) task.violation(use, counts.fault + "; " + to_text(made.about.queries[q]));
  }
  if (begin != answer.job.hit_count) task.violation(use, "there are hits of no query");
  compare_isas(task, use, made, kUses[use].exact, answer);
}

void run(Task& task) {
  QueryWorld made(task.random, true);
  for (std::size_t use = 0; use < std::size(kUses); ++use) {
    made.about = {};
    for (std::uint32_t i = 0; i < kQueries; ++i)
      oracle::add_query(task.random, made.scene, static_cast<oracle::QueryRegime>(task.regime), kUses[use].kind,
                        made.about);
    judge_use(task, use, made);
  }
}

}  // namespace

// The regimes are those of oracle::QueryRegime, in its order.
std::vector<std::string> query_regimes() {
  return {"aimed", "grazing", "parallel", "inside", "short", "far", "huge", "tiny", "thin", "nowhere"};
}

VerifyPart queries_part() {
  std::vector<std::string> methods;
  for (const Use& use : kUses) methods.emplace_back(use.name);
  return {"queries", "queries", Columns::kQueries, query_regimes(), std::move(methods), run};
}

}  // namespace cab::perf
