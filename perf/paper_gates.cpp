#include "perf/paper_gates.h"

#include <algorithm>
#include <cmath>

#include "perf/report.h"

namespace cab::perf {
namespace {

Gate near_paper(const std::string& what, std::uint64_t ours, std::uint64_t papers, double tolerance) {
  const double difference = static_cast<double>(ours) / static_cast<double>(papers) - 1;
  return {what + " " + std::to_string(ours) + " within " + fixed(100 * tolerance, 0) + " % of the paper's " +
              std::to_string(papers) + " (" + (difference < 0 ? "" : "+") + fixed(100 * difference, 1) + " %)",
          std::fabs(difference) <= tolerance};
}

// The run of the paper's method, or nothing.
const MethodRun* find_run(const std::vector<MethodRun>& runs, PaperMethod method) {
  const auto found =
      std::find_if(runs.begin(), runs.end(), [&](const MethodRun& r) { return r.method.paper == method; });
  return found == runs.end() ? nullptr : &*found;
}

// Two methods that must count the same: leaf boxes alone decide #coll.
Gate equal_coll(const MethodRun& a, const MethodRun& b) {
  return {std::string("#coll of ") + b.method.name + " " + std::to_string(b.stats.leaf_pairs) + " equals that of " +
              a.method.name,
          a.stats.leaf_pairs == b.stats.leaf_pairs};
}

}  // namespace

std::vector<Gate> check_gates(const PaperTable& table, const std::vector<MethodRun>& runs, bool full_run) {
  std::vector<Gate> gates;
  const bool same_hits = std::all_of(runs.begin(), runs.end(), [&](const MethodRun& run) {
    return run.hits == runs.front().hits && run.hits_hash == runs.front().hits_hash;
  });
  gates.push_back({"true hits " + std::to_string(runs.front().hits) + " are the same for all methods", same_hits});

  const MethodRun* cab = find_run(runs, PaperMethod::kCab);
  const MethodRun* hull = find_run(runs, PaperMethod::kAabbHull);
  for (const MethodRun& run : runs)
    if (cab && &run != cab && run.method.policies.refit == Refit::kCab) gates.push_back(equal_coll(*cab, run));
  if (cab && hull)
    gates.push_back({std::string("#coll of ") + hull->method.name + " is not below that of " + cab->method.name,
                     hull->stats.leaf_pairs >= cab->stats.leaf_pairs});
  if (!full_run) return gates;

  if (hull)
    gates.push_back(near_paper("#coll of AABB*", hull->stats.leaf_pairs, table.row(PaperMethod::kAabbHull).coll,
                               kAabbHullCollTolerance));
  if (cab) {
    gates.push_back(
        near_paper("#coll of CAB", cab->stats.leaf_pairs, table.row(PaperMethod::kCab).coll, kCabCollTolerance));
    if (table.hits_are_gated)
      gates.push_back(near_paper("true hits", cab->hits, table.row(PaperMethod::kCab).hits(), kHitsTolerance));
  }
  return gates;
}

}  // namespace cab::perf
