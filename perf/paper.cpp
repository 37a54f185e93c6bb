// `cab paper`: the paper's scenes, its columns, ours beside the paper's, and the gates that hold between them.
#include <cab/cab.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "perf/commands.h"
#include "perf/engine_session.h"
#include "perf/paper_gates.h"
#include "perf/paper_tables.h"
#include "perf/report.h"
#include "scenes/chains.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

const std::array<Method, 3> kMethods = {{
    {"CAB", PaperMethod::kCab, {Refit::kCab, Strategy::kTree, Exact::kFcl}},
    {"AABB*", PaperMethod::kAabbHull, {Refit::kAabbHull, Strategy::kTree, Exact::kFcl}},
    {"brute (leaf boxes)", std::nullopt, {Refit::kCab, Strategy::kBrute, Exact::kFcl}},
}};

// One table as it was run.
struct TableRun {
  const PaperTable* table;
  std::uint32_t frame_count;
  Isa isa;
  std::uint32_t thread_count;
  std::uint64_t pose_hash;
  std::vector<MethodRun> runs;
  std::vector<Gate> gates;

  bool is_full() const { return frame_count == table->frame_count; }
};

// The table with a number, if its scene can be made.
const PaperTable& find_table(std::uint32_t number) {
  if (number == 1 || number == 2) return kPaperTables[number - 1];
  throw UsageError("--tables: there is no scene for table " + std::to_string(number) + "; choose from 1,2");
}

void hash_number(std::uint64_t& hash, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ ((number >> shift) & 0xffu)) * 0x100000001b3u;
}

void add_touch(MethodRun& run, const Touch& touch) {
  ++run.hits;
  for (const std::uint32_t number : {touch.frame, touch.character_a, touch.link_a, touch.character_b, touch.link_b})
    hash_number(run.hits_hash, number);
}

TableRun run_table(const PaperTable& table, const PaperOptions& options) {
  TableRun result = {};
  result.table = &table;
  result.frame_count = options.frame_count > 0 ? options.frame_count : table.frame_count;
  const scenes::Scene scene = scenes::make_chains(table.number, result.frame_count);
  EngineSession session(scene, {options.isa, options.thread_count, {0, scene.frame_count}, false});
  result.isa = session.isa();
  result.thread_count = session.thread_count();
  result.pose_hash = scenes::pose_hash(scene);

  ProgressBar bar("table " + std::to_string(table.number), kMethods.size() * result.frame_count);
  for (const Method& method : kMethods) {
    MethodRun run;
    run.method = method;
    run.hits_hash = 0xcbf29ce484222325u;
    BlockResult warm_up;
    session.run_block(0, method.policies, false, warm_up);
    run.stats = session.run(method.policies, false, [&](const BlockResult& block) {
      for (const Touch& touch : block.touches) add_touch(run, touch);
      bar.advance(block.frames.count());
    });
    result.runs.push_back(run);
  }
  result.gates = check_gates(table, result.runs, result.is_full());
  return result;
}

void print_table(const TableRun& run) {
  std::cout << "Table " << run.table->number << ": " << run.table->title << ", " << run.frame_count << " frames ("
            << to_string(run.isa) << ", threads " << run.thread_count << ", pose hash " << hex(run.pose_hash) << ")\n";
  TextTable text;
  text.add_row({"", "#coll", "#false", "t[query]", "t[upd]", "t[test]", "t[total]", "hits", "box tests"});
  for (const MethodRun& method : run.runs) {
    const FrameStats& s = method.stats;
    text.add_row({method.method.name, std::to_string(s.leaf_pairs), std::to_string(s.false_alarms),
                  fixed(s.seconds_query, 5), fixed(s.seconds_update, 5), fixed(s.seconds_test, 5),
                  fixed(s.seconds_total, 5), std::to_string(method.hits), std::to_string(s.box_tests)});
    if (!method.method.paper) continue;
    const PaperRow& p = run.table->row(*method.method.paper);
    text.add_row({"  the paper", std::to_string(p.coll), std::to_string(p.false_alarms), fixed(p.query_seconds, 2),
                  fixed(p.update_seconds, 2), fixed(p.test_seconds, 2), fixed(p.total_seconds, 2),
                  std::to_string(p.hits()), "-"});
  }
  text.print(std::cout);
  for (const Gate& gate : run.gates) std::cout << (gate.passed ? "  ok    " : "  FAIL  ") << gate.text << '\n';
  if (!run.is_full())
    std::cout << "  The paper's counts are compared in a run of all " << run.table->frame_count << " frames only.\n";
  std::cout << '\n';
}

Json method_json(const TableRun& run, const MethodRun& method) {
  const FrameStats& s = method.stats;
  Json json;
  json["method"] = method.method.name;
  for (std::uint32_t f = 0; f < policy_table().size; ++f)
    json["policies"][policy_table()[f].name] = policy_table()[f].values[policy_get(method.method.policies, f)].name;
  json["coll"] = s.leaf_pairs;
  json["false_alarms"] = s.false_alarms;
  json["hits"] = method.hits;
  json["box_tests"] = s.box_tests;
  json["query_thread_seconds"] = s.seconds_query;
  json["update_thread_seconds"] = s.seconds_update;
  json["test_thread_seconds"] = s.seconds_test;
  json["total_wall_seconds"] = s.seconds_total;
  json["hits_hash"] = hex(method.hits_hash);
  json["paper"] = Json();
  if (method.method.paper) {
    const PaperRow& p = run.table->row(*method.method.paper);
    json["paper"] = {{"coll", p.coll},
                     {"false_alarms", p.false_alarms},
                     {"hits", p.hits()},
                     {"query_seconds", p.query_seconds},
                     {"update_seconds", p.update_seconds},
                     {"test_seconds", p.test_seconds},
                     {"total_seconds", p.total_seconds}};
  }
  return json;
}

Json to_json(const std::vector<TableRun>& tables) {
  Json json;
  json["cab_version"] = CAB_VERSION;
  json["tables"] = Json::array();
  for (const TableRun& run : tables) {
    Json table;
    table["table"] = run.table->number;
    table["title"] = run.table->title;
    table["frame_count"] = run.frame_count;
    table["full_run"] = run.is_full();
    table["isa"] = to_string(run.isa);
    table["threads"] = run.thread_count;
    table["pose_hash"] = hex(run.pose_hash);
    table["methods"] = Json::array();
    for (const MethodRun& method : run.runs) table["methods"].push_back(method_json(run, method));
    table["gates"] = Json::array();
    for (const Gate& gate : run.gates) table["gates"].push_back({{"gate", gate.text}, {"passed", gate.passed}});
    json["tables"].push_back(table);
  }
  return json;
}

void write_csv(const std::string& path, const std::vector<TableRun>& tables) {
  OutputFile file(path);
  std::ostream& out = file.stream();
  out << "table,method,frames,isa,threads,coll,false_alarms,hits,box_tests,query_thread_seconds,update_thread_seconds,"
         "test_thread_seconds,total_wall_seconds,pose_hash,hits_hash,paper_coll,paper_false_alarms,"
         "paper_query_seconds,paper_update_seconds,paper_test_seconds,paper_total_seconds\n";
  for (const TableRun& run : tables)
    for (const MethodRun& method : run.runs) {
      const FrameStats& s = method.stats;
      out << run.table->number << ',' << csv_field(method.method.name) << ',' << run.frame_count << ','
          << to_string(run.isa) << ',' << run.thread_count << ',' << s.leaf_pairs << ',' << s.false_alarms << ','
          << method.hits << ',' << s.box_tests << ',' << shortest(s.seconds_query) << ',' << shortest(s.seconds_update)
          << ',' << shortest(s.seconds_test) << ',' << shortest(s.seconds_total) << ',' << hex(run.pose_hash) << ','
          << hex(method.hits_hash);
      if (method.method.paper) {
        const PaperRow& p = run.table->row(*method.method.paper);
        out << ',' << p.coll << ',' << p.false_alarms << ',' << shortest(p.query_seconds) << ','
            << shortest(p.update_seconds) << ',' << shortest(p.test_seconds) << ',' << shortest(p.total_seconds);
      } else {
        out << ",,,,,,";
      }
      out << '\n';
    }
  file.close();
}

}  // namespace

int paper_command(const PaperOptions& options) {
  for (const std::uint32_t number : options.tables) find_table(number);  // before the first table takes its time
  std::vector<TableRun> tables;
  for (const std::uint32_t number : options.tables) {
    tables.push_back(run_table(find_table(number), options));
    print_table(tables.back());
  }
  std::cout
      << "Seconds are sums over all frames: t[query], t[upd] and t[test] over the threads that worked, t[total] by "
         "the clock.\nThe paper's are from a Pentium 4 at 1.8 GHz.\n";
  if (!options.json_path.empty()) write_json(options.json_path, to_json(tables));
  if (!options.csv_path.empty()) write_csv(options.csv_path, tables);

  std::size_t failed = 0;
  for (const TableRun& run : tables)
    failed += static_cast<std::size_t>(
        std::count_if(run.gates.begin(), run.gates.end(), [](const Gate& gate) { return !gate.passed; }));
  if (failed > 0) std::cerr << "cab paper: " << failed << " gates failed\n";
  return failed > 0 ? 1 : 0;
}

}  // namespace cab::perf
