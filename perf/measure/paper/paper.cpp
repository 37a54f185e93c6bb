// `cab paper`: the paper's scenes by every method, measured; the gates decide the exit code.
#include <cab/cab.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <string>
#include <utility>

#include "engine/frame/all_pairs.h"
#include "layout/bit_hash.h"
#include "perf/base/engine_session.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/measure/paper/gates.h"
#include "perf/measure/paper/judged_hits.h"
#include "perf/measure/paper/mesh_query.h"
#include "perf/measure/paper/options.h"
#include "perf/measure/paper/output.h"
#include "perf/measure/paper/partial_update.h"
#include "perf/measure/paper/tables.h"
#include "scenes/paper/registry.h"

namespace cab::perf {
namespace {

constexpr Policies tree(Refit refit, Extents extents = Extents::kChildren) {
  return {refit, Strategy::kTree, Exact::kFcl, extents};
}

// The paper's rows in its order, each followed by its variants.
const std::array<Method, 13> kMethods = {{
    {"brute", PaperMethod::kBrute, {Refit::kCab, Strategy::kBrute, Exact::kFcl}, false, false, true},
    {"AABB+", PaperMethod::kAabbVertices, tree(Refit::kAabbVertices)},
    {"AABB*", PaperMethod::kAabbHull, tree(Refit::kAabbHull)},
    {"AABB* from leaves", std::nullopt, tree(Refit::kAabbHull, Extents::kLeaves)},
    {"AABB* on demand", std::nullopt, tree(Refit::kAabbHull), true},
    {"OBB", PaperMethod::kObb, tree(Refit::kCovariance)},
    {"OBB leaf extents", std::nullopt, tree(Refit::kCovariance, Extents::kLeaves)},
    {"CAB", PaperMethod::kCab, tree(Refit::kCab)},
    {"CAB sum", std::nullopt, tree(Refit::kCabSum)},
    {"CAB leaf extents", std::nullopt, tree(Refit::kCab, Extents::kLeaves)},
    {"best3", std::nullopt, tree(Refit::kBest3)},
    {"best3 leaf extents", std::nullopt, tree(Refit::kBest3, Extents::kLeaves)},
    {"all leaf pairs", std::nullopt, {Refit::kCab, Strategy::kBrute, Exact::kFcl, Extents::kChildren}},
}};

// Additional methods if the scene's links are not convex: exact queries on triangle meshes instead of convex pieces.
const std::array<Method, 2> kMeshMethods = {{
    {"AABB* on meshes", std::nullopt, tree(Refit::kAabbHull), false, true},
    {"CAB on meshes", std::nullopt, tree(Refit::kCab), false, true},
}};
constexpr std::uint32_t kMeshTable = 3;

std::vector<Method> methods_of(const PaperTable& table) {
  std::vector<Method> methods(kMethods.begin(), kMethods.end());
  if (table.number == kMeshTable) methods.insert(methods.end(), kMeshMethods.begin(), kMeshMethods.end());
  return methods;
}

// Times are medians of this many runs, with the methods in turns. If t[query] of a method exceeds the limit, it is
// taken from one run: noise averages out over that time.
constexpr std::size_t kTimedRuns = 5;
constexpr double kRepeatedQuerySeconds = 0.3;

const PaperTable& find_table(std::uint32_t number) {
  if (number >= 1 && number <= kPaperTables.size()) return kPaperTables[number - 1];
  throw UsageError("--tables: the paper has no table " + std::to_string(number) + "; choose from 1,2,3,4,5");
}

void add_touch(cab::BitHash& hash, const Touch& touch) {
  for (const std::uint32_t number : {touch.frame, touch.character_a, touch.link_a, touch.character_b, touch.link_b})
    hash.add(number);
}

double area(const Box& box) {
  const double x = 2.0 * box.half[0], y = 2.0 * box.half[1], z = 2.0 * box.half[2];
  return 2 * (x * y + y * z + z * x);
}

double mean_inner_area(EngineSession& session, const Policies& policies) {
  double sum = 0;
  std::uint64_t count = 0;
  session.visit_boxes(policies, [&](const ArticulationInfo& info, Span<const Box> boxes) {
    for (std::uint32_t node = info.leaf_count; node < info.node_count; ++node) sum += area(boxes.data[node]);
    count += info.node_count - info.leaf_count;
  });
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

std::uint64_t box_hash(EngineSession& session, const Policies& policies) {
  cab::BitHash hash;
  session.visit_boxes(policies, [&](const ArticulationInfo&, Span<const Box> boxes) {
    for (const Box& box : boxes) hash.add(box);
  });
  return hash.value();
}

Method with_exact(Method method, Exact exact) {
  method.policies.exact = exact;
  return method;
}

// The function that runs a method's frames.
RunFrame frame_of(const Method& method) { return method.all_pairs ? run_all_pairs : run_frame; }

// Runs a method with its exact queries and hands out the hits of each block. As in the paper, a query that finds a hit
// goes on to its normal and depth; those on meshes do not, since FCL gives the contacts of triangles, not of bodies.
FrameStats run_queries(EngineSession& session, const scenes::Scene& scene, const Method& method,
                       std::uint64_t& nested_count, const std::function<void(const BlockResult&)>& on_block) {
  if (!method.on_meshes) return session.run(method.policies, true, on_block, frame_of(method));
  MeshQueries queries(scene);
  const Policies boxes = with_exact(method, Exact::kNone).policies;
  FrameStats stats = session.run(boxes, false, [&](const BlockResult& block) {
    on_block({block.frames, queries.touching(block.touches), block.stats});
  });
  stats.seconds_query = queries.seconds();
  stats.seconds_total += queries.seconds();
  nested_count = queries.nested_count();
  return stats;
}

// Whether a vector has unit length, to float rounding.
bool is_unit(const float* v) {
  constexpr double kRounding = 1e-6;
  double square = 0;
  for (int c = 0; c < 3; ++c) square += static_cast<double>(v[c]) * static_cast<double>(v[c]);
  return std::fabs(square - 1) < kRounding;
}

// Measures what a method finds by its exact test, and sets run.stats. Only hits between two characters count, but all
// leaf pairs that go to the exact query count.
ExactRun run_exact(EngineSession& session, const scenes::Scene& scene, const Method& method, MethodRun& run) {
  ExactRun exact;
  cab::BitHash hash;
  BlockResult warm_up;
  session.run_block(0, method.policies, false, warm_up, frame_of(method));
  run.stats = run_queries(session, scene, method, run.nested_count, [&](const BlockResult& block) {
    for (const Touch& touch : block.touches) {
      if (touch.character_a == touch.character_b) continue;
      ++exact.hits;
      if (is_unit(touch.contact.normal)) ++exact.contact_count;
      add_touch(hash, touch);
    }
  });
  exact.hits_hash = hash.value();
  exact.seconds_query = run.stats.seconds_query;
  exact.seconds_contact = run.stats.seconds_contact;
  return exact;
}

// One run without exact tests, which would push boxes out of the caches; the hash is of the leaf pairs.
FrameStats run_boxes(EngineSession& session, const scenes::Scene& scene, const Method& method, cab::BitHash& hash) {
  const auto add = [&hash](const std::vector<Touch>& touches) {
    for (const Touch& touch : touches) add_touch(hash, touch);
  };
  if (method.on_demand) return run_partial_update(scene, session.isa(), add);
  const Policies boxes = with_exact(method, Exact::kNone).policies;
  return session.run(boxes, false, [&](const BlockResult& block) { add(block.touches); });
}

// The times of one exact test, one value per run.
struct ExactTimes {
  std::vector<double> query, contact;

  void add(const FrameStats& stats) {
    query.push_back(stats.seconds_query);
    contact.push_back(stats.seconds_contact);
  }
  // Sets the times of a method, unless its first run alone counts.
  void write_medians(ExactRun& run) const {
    if (query.empty()) return;
    run.seconds_query = median(query);
    run.seconds_contact = median(contact);
  }
};

// The times of one method, one value per run.
struct Times {
  std::vector<double> update, test;
  ExactTimes fcl, convex;
};

// Measures every method but brute, and finds the hash of its leaf pairs.
void measure(EngineSession& session, const scenes::Scene& scene, std::vector<MethodRun>& runs, ProgressBar& bar) {
  std::vector<Times> times(runs.size());
  for (std::size_t r = 0; r < kTimedRuns; ++r)
    for (std::size_t m = 0; m < runs.size(); ++m) {
      MethodRun& run = runs[m];
      if (run.method.all_pairs) continue;
      cab::BitHash hash;
      const FrameStats stats = run_boxes(session, scene, run.method, hash);
      times[m].update.push_back(stats.seconds_update);
      times[m].test.push_back(stats.seconds_test);
      run.box_hits_hash = hash.value();
      run.stats.box_tests = stats.box_tests;
      run.stats.leaf_pairs = stats.leaf_pairs;
      const auto time = [&](const ExactRun& first, Exact exact, ExactTimes& taken) {
        if (run.method.on_demand || first.seconds_query >= kRepeatedQuerySeconds) return;
        const Method method = with_exact(run.method, exact);
        taken.add(run_queries(session, scene, method, run.nested_count, [](const BlockResult&) {}));
      };
      time(run.fcl, Exact::kFcl, times[m].fcl);
      if (run.convex) time(*run.convex, Exact::kConvex, times[m].convex);
      bar.advance(scene.frame_count);
    }
  for (std::size_t m = 0; m < runs.size(); ++m) {
    if (times[m].update.empty()) continue;
    runs[m].stats.seconds_update = median(times[m].update);
    runs[m].stats.seconds_test = median(times[m].test);
    times[m].fcl.write_medians(runs[m].fcl);
    if (runs[m].convex) times[m].convex.write_medians(*runs[m].convex);
  }
  const auto is_hull = [](const MethodRun& run) { return run.method.paper == PaperMethod::kAabbHull; };
  const auto hull = std::find_if(runs.begin(), runs.end(), is_hull);
  for (MethodRun& run : runs)
    if (run.method.on_demand) {
      run.fcl = hull->fcl;
      run.convex = hull->convex;
    }
}

// The hits of a method.
std::vector<Touch> hits_of(EngineSession& session, const scenes::Scene& scene, const Method& method) {
  std::vector<Touch> hits;
  std::uint64_t nested_count = 0;
  run_queries(session, scene, method, nested_count, [&hits](const BlockResult& block) {
    hits.insert(hits.end(), block.touches.begin(), block.touches.end());
  });
  return hits;
}

// Describes the hits that differ between meshes and pieces. The queries are on the leaf pairs of CAB, which include all
// hits of every method.
std::vector<std::string> mesh_differences(EngineSession& session, const scenes::Scene& scene) {
  const Method on_pieces = {"", std::nullopt, tree(Refit::kCab)},
               on_meshes = {"", std::nullopt, tree(Refit::kCab), false, true};
  return differing_hits(scene, hits_of(session, scene, on_pieces), hits_of(session, scene, on_meshes));
}

// Judges the hits that differ between FCL and convex, likewise on the leaf pairs of CAB.
std::vector<JudgedHit> exact_differences(EngineSession& session, const scenes::Scene& scene) {
  const Method by_fcl = {"", std::nullopt, tree(Refit::kCab)};
  return judge_differences(scene, hits_of(session, scene, by_fcl),
                           hits_of(session, scene, with_exact(by_fcl, Exact::kConvex)));
}

TableRun run_table(const PaperTable& table, const PaperOptions& options) {
  TableRun result = {};
  result.table = &table;
  result.frame_count = options.frame_count > 0 ? options.frame_count : table.frame_count;
  const scenes::Scene scene = scenes::make_paper_scene(table.number, result.frame_count);
  SessionOptions session_options = {options.isa, options.thread_count, {0, scene.frame_count}};
  EngineSession session(scene, session_options);
  // Brute force also queries the links of one chain against each other, but not those of the hand.
  session_options.within = table.number != 5;
  EngineSession brute_session(scene, session_options);
  result.isa = session.isa();
  result.thread_count = session.thread_count();
  result.pose_hash = scenes::pose_hash(scene);

  const std::vector<Method> methods = methods_of(table);
  const std::uint64_t passes = methods.size() + (methods.size() - 1) * kTimedRuns;
  ProgressBar bar("table " + std::to_string(table.number), passes * result.frame_count);
  bar.begin_long_step();
  for (const Method& method : methods) {
    MethodRun run;
    run.method = method;
    if (method.on_demand) {
      // It finds the leaf pairs of AABB*, which a gate proves; so what follows from them is taken from there.
      run = result.runs.back();
      run.method = method;
      bar.advance(scene.frame_count);
    } else {
      EngineSession& used = method.all_pairs ? brute_session : session;
      if (!method.on_meshes) run.convex = run_exact(used, scene, with_exact(method, Exact::kConvex), run);
      run.fcl = run_exact(used, scene, method, run);
      bar.advance(scene.frame_count);
    }
    if (method.on_meshes && run.fcl.hits_hash != result.runs.front().fcl.hits_hash)
      run.differences = mesh_differences(session, scene);
    result.runs.push_back(run);
  }
  measure(session, scene, result.runs, bar);
  for (MethodRun& run : result.runs) {
    if (run.method.policies.strategy == Strategy::kTree) run.mean_area = mean_inner_area(session, run.method.policies);
    if (run.method.paper != PaperMethod::kCab) continue;
    result.box_hash = box_hash(session, run.method.policies);
    result.box_hit_hash = run.box_hits_hash;
  }
  result.gates = check_gates(table, result.runs, result.is_full());
  const MethodRun& brute = result.runs.front();
  const bool same = brute.convex->hits == brute.fcl.hits && brute.convex->hits_hash == brute.fcl.hits_hash;
  result.gates.push_back(
      convex_gate(brute.convex->hits, same ? std::vector<JudgedHit>() : exact_differences(session, scene)));
  result.added = count_added_false_positives(scene, options.isa);
  for (Gate& gate : false_positive_gates(result.added, result.is_full())) result.gates.push_back(std::move(gate));
  return result;
}

}  // namespace

int paper_command(const PaperOptions& options) {
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, {});
  OutputFile json(options.json_path), csv(options.csv_path);
  for (const std::uint32_t number : options.tables) find_table(number);  // throws before any table has run
  std::vector<TableRun> tables;
  for (const std::uint32_t number : options.tables) {
    tables.push_back(run_table(find_table(number), options));
    print_table(tables.back());
  }
  std::cout
      << "Seconds are sums over all frames and over the threads that worked, medians of " << kTimedRuns
      << " runs (t[query] above " << fixed(kRepeatedQuerySeconds, 1)
      << " s, and brute, of one). t[query] has the normal and depth of every hit in it, % contact of t[total].\n"
         "Exact queries are FCL's; convex: by the kernels, with the same boxes, t[upd] and t[test].\n"
         "on meshes: FCL on triangle meshes instead of convex pieces, without normal and depth, on one thread.\n"
         "AABB* on demand runs on one thread; its t[query] and hits are those of AABB*, whose leaf pairs it finds.\n"
         "brute calls on all pairs of links, those of one chain too; its hits are those between the chains.\n"
         "area: mean surface of the inner boxes. The paper's times are from a Pentium 4 at 1.8 GHz, table 5's from a "
         "Pentium 3 at 866 MHz.\n";
  write_paper_json(json, tables);
  write_paper_csv(csv, tables);

  std::size_t failed = 0;
  for (const TableRun& run : tables)
    failed += static_cast<std::size_t>(
        std::count_if(run.gates.begin(), run.gates.end(), [](const Gate& gate) { return !gate.passed; }));
  if (failed > 0) std::cerr << "cab paper: " << failed << " gates failed\n";
  return failed > 0 ? 1 : 0;
}

}  // namespace cab::perf
