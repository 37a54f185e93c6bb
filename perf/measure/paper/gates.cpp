#include "perf/measure/paper/gates.h"

#include <algorithm>
#include <cmath>

#include "perf/base/report.h"

namespace cab::perf {
namespace {

Gate near_paper(const std::string& what, std::uint64_t ours, std::uint64_t papers, double tolerance) {
  const double difference = static_cast<double>(ours) / static_cast<double>(papers) - 1;
  return {what + " " + std::to_string(ours) + " within " + fixed(100 * tolerance, 0) + " % of the paper's " +
              std::to_string(papers) + " (" + (difference < 0 ? "" : "+") + fixed(100 * difference, 1) + " %)",
          std::fabs(difference) <= tolerance};
}

// The run of a method of the paper, or null.
const MethodRun* find_run(const std::vector<MethodRun>& runs, PaperMethod method) {
  const auto found =
      std::find_if(runs.begin(), runs.end(), [&](const MethodRun& r) { return r.method.paper == method; });
  return found == runs.end() ? nullptr : &*found;
}

bool is_axis_aligned(const Method& method) {
  return method.policies.refit == Refit::kAabbHull || method.policies.refit == Refit::kAabbVertices;
}

// The gate of two methods with the same leaf boxes, which alone decide #coll.
Gate equal_coll(const MethodRun& a, const MethodRun& b) {
  return {std::string("#coll of ") + b.method.name + " " + std::to_string(b.stats.leaf_pairs) + " equals that of " +
              a.method.name,
          a.stats.leaf_pairs == b.stats.leaf_pairs && a.box_hits_hash == b.box_hits_hash};
}

bool same_hits(const ExactRun& a, const ExactRun& b) { return a.hits == b.hits && a.hits_hash == b.hits_hash; }

// The gate that exact queries on meshes give the same hits as on convex pieces. Its text names the hits that differ.
Gate equal_hits_on_meshes(const MethodRun& pieces, const MethodRun& meshes) {
  std::string text = std::string("true hits of ") + meshes.method.name + " " + std::to_string(meshes.fcl.hits) + " (" +
                     std::to_string(meshes.nested_count) + " of them one inside the other) are those on convex pieces";
  for (const std::string& difference : meshes.differences) text += "; " + difference;
  return {text, same_hits(pieces.fcl, meshes.fcl)};
}

// The gates on the hits of one exact test: every method finds the same, and each has a normal and a depth. hits_of
// returns a method's hits, or null if the method does not take part.
template <class HitsOf>
void add_hit_gates(const std::vector<MethodRun>& runs, const std::string& test, HitsOf&& hits_of,
                   std::vector<Gate>& gates) {
  const ExactRun* first = nullptr;
  bool same = true, all_contacts = true;
  for (const MethodRun& run : runs) {
    const ExactRun* hits = hits_of(run);
    if (hits == nullptr) continue;
    if (first == nullptr) first = hits;
    same = same && same_hits(*hits, *first);
    all_contacts = all_contacts && hits->contact_count == hits->hits;
  }
  if (first == nullptr) return;
  gates.push_back({"true hits by " + test + " " + std::to_string(first->hits) + " are the same for all methods", same});
  gates.push_back({"each true hit by " + test + " has a normal and a depth", all_contacts});
}

}  // namespace

std::vector<Gate> check_gates(const PaperTable& table, const std::vector<MethodRun>& runs, bool full_run) {
  std::vector<Gate> gates;
  // Those on meshes have a gate of their own.
  add_hit_gates(
      runs, "FCL", [](const MethodRun& run) { return run.method.on_meshes ? nullptr : &run.fcl; }, gates);
  add_hit_gates(
      runs, "convex", [](const MethodRun& run) { return run.convex ? &*run.convex : nullptr; }, gates);

  const MethodRun* cab = find_run(runs, PaperMethod::kCab);
  const MethodRun* hull = find_run(runs, PaperMethod::kAabbHull);
  for (const MethodRun& run : runs) {
    if (run.method.all_pairs) continue;
    if (run.method.on_meshes) gates.push_back(equal_hits_on_meshes(runs.front(), run));
    if (cab && &run != cab && !is_axis_aligned(run.method)) gates.push_back(equal_coll(*cab, run));
    if (hull && &run != hull && run.method.policies.refit == Refit::kAabbHull) gates.push_back(equal_coll(*hull, run));
  }
  if (cab && hull)
    gates.push_back({std::string("#coll of ") + hull->method.name + " is not below that of " + cab->method.name,
                     hull->stats.leaf_pairs >= cab->stats.leaf_pairs});
  if (!full_run) return gates;

  if (const MethodRun* brute = find_run(runs, PaperMethod::kBrute))
    gates.push_back({"#coll of brute " + std::to_string(brute->stats.leaf_pairs) + " is the paper's",
                     brute->stats.leaf_pairs == table.row(PaperMethod::kBrute).coll});
  if (hull)
    gates.push_back(near_paper("#coll of AABB*", hull->stats.leaf_pairs, table.row(PaperMethod::kAabbHull).coll,
                               kAabbHullCollTolerance));
  if (cab) {
    gates.push_back(
        near_paper("#coll of CAB", cab->stats.leaf_pairs, table.row(PaperMethod::kCab).coll, kCabCollTolerance));
    if (table.hits_are_gated)
      gates.push_back(near_paper("true hits", cab->fcl.hits, table.row(PaperMethod::kCab).hits(), kHitsTolerance));
  }
  return gates;
}

}  // namespace cab::perf
