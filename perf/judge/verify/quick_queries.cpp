// Verifies many queries of each kind at leaf boxes, shapes without their depth, by a judge in double that asks the one
// in long double only about pairs that are too close for doubles. It judges which links are met and at which distance;
// points, normals and depths are judged with `queries`.
#include "perf/judge/oracle/quick_queries.h"
#include "perf/judge/verify/parts.h"
#include "perf/judge/verify/query_world.h"

namespace cab::perf {
namespace {

// Queries of each regime and want per round: many, since a world takes as long to make as some thousand rays to judge.
constexpr std::uint32_t kQueries = 1000;

// The method of a task: what its queries want.
constexpr const char* kMethods[] = {"any", "closest", "all"};

void judge_queries(Task& task, std::size_t method, const QueryWorld& made, const oracle::QuickQueries& judge) {
  QueryAnswer answer;
  ask_queries(task, task.subject->kernels->isa, made, Exact::kNone, answer);
  Tally& tally = task.tallies[method];
  std::size_t begin = 0;
  for (std::size_t q = 0; q < made.about.queries.size(); ++q) {
    const Span<const QueryHit> hits = answer.hits_of(q, begin);
    const oracle::QuickCounts counts = judge.count(answer.job, q, hits);
    ++tally.judged;
    tally.pairs += counts.pairs;
    tally.undecided += counts.uncertain;
    tally.touching += counts.must;
    tally.hits += hits.size;
    tally.lost += counts.lost;
    tally.false_positives += counts.extra;
    if (!counts.fault.empty()) task.violation(method, counts.fault + "; " + to_text(made.about.queries[q]));
  }
  if (begin != answer.job.hit_count) task.violation(method, "there are hits of no query");
  compare_isas(task, method, made, Exact::kNone, answer);
}

template <QueryKind kKind>
void run(Task& task) {
  QueryWorld made(task.random, false);
  const oracle::QuickQueries judge(made.scene);
  for (std::size_t method = 0; method < std::size(kMethods); ++method) {
    made.about = {};
    for (std::uint32_t i = 0; i < kQueries; ++i) {
      oracle::add_query(task.random, made.scene, static_cast<oracle::QueryRegime>(task.regime), kKind, made.about);
      Query& query = made.about.queries.back();
      if (kKind == QueryKind::kRay) query.radius = 0;
      query.with_depth = false;
      query.want = static_cast<QueryWant>(method);
    }
    judge_queries(task, method, made, judge);
  }
}

template <QueryKind kKind>
VerifyPart part_of(const char* name) {
  return {name, name, Columns::kQuick, query_regimes(), {std::begin(kMethods), std::end(kMethods)}, run<kKind>};
}

}  // namespace

VerifyPart rays_part() { return part_of<QueryKind::kRay>("rays"); }
VerifyPart spheres_part() { return part_of<QueryKind::kSphere>("spheres"); }
VerifyPart points_part() { return part_of<QueryKind::kPoint>("points"); }
VerifyPart boxes_part() { return part_of<QueryKind::kBox>("boxes"); }
VerifyPart capsules_part() { return part_of<QueryKind::kCapsule>("capsules"); }
VerifyPart regions_part() { return part_of<QueryKind::kRegion>("regions"); }

}  // namespace cab::perf
