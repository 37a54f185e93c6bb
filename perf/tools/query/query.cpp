// `cab query`: asks which links rays meet, shapes overlap and points are near.
#include <cab/cab.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/mask_words.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/tools/query/aimed_rays.h"
#include "perf/tools/query/measure.h"
#include "perf/tools/query/options.h"
#include "perf/tools/query/targets.h"
#include "scenes/import/companions.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The most queries that the engine works on at a time. More would take memory and no less time.
constexpr std::uint32_t kQueryRoom = 1u << 14;

// A time of a call: one line in the table, one field in JSON.
struct QueryPhase {
  const char* name;
  const char* key;
  double QueryStats::*seconds;
};
constexpr QueryPhase kQueryPhases[] = {
    {"  bound", "bound_thread", &QueryStats::seconds_bound},
    {"  index", "index_thread", &QueryStats::seconds_index},
    {"  search", "search_thread", &QueryStats::seconds_search},
};

struct QueryCount {
  const char* name;
  const char* key;
  std::uint64_t QueryStats::*count;
};
constexpr QueryCount kQueryCounts[] = {
    {"nodes of the index", "nodes", &QueryStats::nodes},
    {"instances met", "instances", &QueryStats::instances},
    {"leaf tests", "leaf_tests", &QueryStats::leaf_tests},
    {"exact tests", "exact_tests", &QueryStats::exact_tests},
};

// All that the command prints and writes is about.
struct QueryReport {
  const QueryOptions& options;
  const Targets& targets;
  const AskedQueries& asked;
  const QueryFigures& figures;
  FrameRange frames;

  // Of all frames together.
  double asked_count() const { return static_cast<double>(asked.queries.size()) * frames.count(); }
};

// ------------------------------------------------------------------------------------------------------- the input

void check(const QueryOptions& options) {
  const bool has_scene = !options.scene.empty();
  if (!has_scene && options.world.files.empty())
    throw UsageError("give FILE or --scene NAME: what queries are asked of");
  if (has_scene && (options.all_frames || !options.frame))
    throw UsageError("a scene has no last frame; give --frame K or --frames A:B");
  check_files(options.world);
  check_exact(options.world, options.exact);
  std::vector<std::string> inputs = input_paths(options.world);
  for (const auto& paths : options.paths) inputs.insert(inputs.end(), paths.begin(), paths.end());
  check_outputs({{"--out", options.out_path}, {"--json", options.json_path}}, inputs,
                [&options](const std::string& file) { return scenes::companion_files(file, options.world.sandbox); });
  const bool has_shapes = !options.paths[1].empty() || !options.paths[2].empty() || !options.paths[3].empty();
  if (options.with_depth && !has_shapes)
    throw UsageError("--depth is for --spheres, --boxes and --capsules; give one of them");
}

FrameRange choose_frames(const QueryOptions& options, std::uint32_t frame_count) {
  if (options.all_frames) return {0, frame_count};
  const std::uint32_t frame = options.frame.value_or(frame_count - 1);
  const FrameRange frames = options.frames.value_or(FrameRange{frame, frame + 1});
  if (!options.scene.empty() || frames.end - 1 < frame_count) return frames;
  throw UsageError(std::string(options.frames ? "--frames" : "--frame") + ": there are frames 0 to " +
                   std::to_string(frame_count - 1));
}

AskedQueries read_all(const QueryOptions& options) {
  AskedQueries asked;
  for (std::size_t k = 0; k < kFileKindCount; ++k)
    for (const std::string& path : options.paths[k])
      asked.add(path, kFileKinds[k], read_queries(kFileKinds[k], path, kMaxQueries - asked.queries.size()));
  return asked;
}

void set_wants(const QueryOptions& options, AskedQueries& asked) {
  for (Query& query : asked.queries) {
    query.want = options.want;
    query.max_hits = options.max_hits;
    query.with_depth = options.with_depth;
  }
}

// ------------------------------------------------------------------------------------------------------- the hits

constexpr const char* kHitsHeader =
    "frame,file,row,kind,target,instance,link,leaf,distance_metres,point_x,point_y,point_z,normal_x,normal_y,normal_z,"
    "inside\n";

void write_query(std::ostream& out, std::uint32_t frame, const QuerySource& source, std::size_t query) {
  out << frame << ',' << csv_field(source.name) << ',' << query - source.first << ',' << kind_name(source.kind);
}

// A query that finds something, but is not asked what.
void write_found(std::ostream& out, std::uint32_t frame, const QuerySource& source, std::size_t query) {
  write_query(out, frame, source, query);
  out << ",,,,,,,,,,,,\n";
}

void write_hit(std::ostream& out, std::uint32_t frame, const QuerySource& source, const Targets& targets,
               const Query& query, const QueryHit& hit) {
  write_query(out, frame, source, hit.query);
  const TargetGroup& group = targets.groups()[targets.group_of(hit.batch)];
  out << ',' << csv_field(group.name) << ',' << hit.instance << ','
      << (group.figure ? csv_field(group.figure->link_names[hit.link]) : std::string()) << ',' << hit.leaf << ','
      << shortest(hit.distance);
  for (std::size_t k = 0; k < 3; ++k) out << ',' << shortest(query.position[k] + static_cast<double>(hit.point[k]));
  for (const float component : hit.normal) out << ',' << shortest(component);
  out << ',' << (hit.inside ? 1 : 0) << '\n';
}

void write_answers(std::ostream& out, const Targets& targets, const AskedQueries& asked, const QueryAnswers& answers) {
  const QueryHit* hit = answers.hits.begin();
  for (const QuerySource& source : asked.sources)
    for (std::size_t q = source.first; q < source.first + source.count; ++q) {
      if (asked.queries[q].want == QueryWant::kAny && answers.found[q]) write_found(out, answers.frame, source, q);
      for (; hit != answers.hits.end() && hit->query == q; ++hit)
        write_hit(out, answers.frame, source, targets, asked.queries[q], *hit);
    }
}

// ----------------------------------------------------------------------------------------------------- the figures

// Seconds per frame, over the rounds.
Spread seconds_of(const QueryReport& run, double QueryStats::*seconds) {
  std::vector<double> values;
  for (const QueryStats& round : run.figures.rounds) values.push_back(round.*seconds / run.frames.count());
  return spread_of(std::move(values));
}

// The counts of all sources of a kind; `asked` is in one frame.
struct KindCounts {
  std::uint64_t asked = 0, found = 0, hits = 0;
};

KindCounts counts_of(const QueryReport& run, QueryKind kind) {
  KindCounts sum;
  for (std::size_t s = 0; s < run.asked.sources.size(); ++s) {
    if (run.asked.sources[s].kind != kind) continue;
    sum.asked += run.asked.sources[s].count;
    sum.found += run.figures.counts[s].found;
    sum.hits += run.figures.counts[s].hits;
  }
  return sum;
}

void print_tables(const QueryReport& run) {
  const QueryOptions& options = run.options;
  const std::uint64_t count = run.targets.count();
  std::cout << (options.scene.empty() ? "files" : options.scene) << ": " << run.asked.queries.size() << " queries of "
            << count << " targets, " << run.frames.count() << " frames, " << options.rounds << " rounds ("
            << to_string(engine_isa(run.targets.engine())) << ", threads " << engine_thread_count(run.targets.engine())
            << ", want " << kWantNames[static_cast<std::size_t>(options.want)] << ", exact "
            << (options.exact == Exact::kNone ? "none" : "convex") << (options.with_depth ? ", depth" : "") << ")\n";

  TextTable kinds;
  kinds.add_row({"", "queries", "found", "hits"});
  for (const QueryKind kind : kFileKinds) {
    const KindCounts of = counts_of(run, kind);
    if (of.asked == 0) continue;
    kinds.add_row({kind_name(kind), std::to_string(of.asked * run.frames.count()), std::to_string(of.found),
                   options.want == QueryWant::kAny ? "-" : std::to_string(of.hits)});
  }
  kinds.print(std::cout);

  std::cout << '\n';
  TextTable times;
  times.add_row({"", "median", "least", "most"});
  const auto add_time = [&times](const char* name, const Spread& s) {
    times.add_row({name, fixed(1e3 * s.median, 4), fixed(1e3 * s.least, 4), fixed(1e3 * s.most, 4), "ms"});
  };
  const Spread s = seconds_of(run, &QueryStats::seconds_total);
  add_time("frame", s);
  for (const QueryPhase& phase : kQueryPhases) add_time(phase.name, seconds_of(run, phase.seconds));
  const auto ns = [&](double seconds) {
    return fixed(1e9 * seconds / static_cast<double>(run.asked.queries.size()), 1);
  };
  times.add_row({"per query", ns(s.median), ns(s.least), ns(s.most), "ns"});
  times.print(std::cout);

  std::cout << '\n';
  TextTable counts;
  counts.add_row({"", "per frame", "per query"});
  for (const QueryCount& row : kQueryCounts) {
    const double sum = static_cast<double>(run.figures.stats.*row.count);
    counts.add_row({row.name, fixed(sum / run.frames.count(), 1), fixed(sum / run.asked_count(), 3)});
  }
  counts.add_row(
      {"masked instances", fixed(static_cast<double>(run.figures.stats.instances_masked) / run.frames.count(), 1)});
  counts.print(std::cout);
  std::cout << "\nhash of all frames' hits: " << hex(run.figures.hits_hash) << '\n';
}

void warn_of_masked(const QueryReport& run) {
  if (!run.figures.first_masked) return;
  const MaskedTarget& first = *run.figures.first_masked;
  const TargetGroup& group = run.targets.groups()[first.group];
  std::cerr << "warning: " << run.figures.stats.instances_masked << " poses of " << run.targets.count()
            << " targets in " << run.frames.count() << " frames are masked: no query finds them\n  the first: frame "
            << first.frame << " of " << group.name << ", instance " << first.instance << ", "
            << words_of(first.reason, group.figure->link_names) << '\n';
}

Json to_json(const QueryReport& run, const std::vector<std::string>& notes) {
  const QueryOptions& options = run.options;
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["scene"] = options.scene.empty() ? Json() : Json(options.scene);
  json["files"] = options.world.files;
  json["targets"] = run.targets.count();
  json["queries"] = run.asked.queries.size();
  json["sources"] = Json::array();
  for (std::size_t s = 0; s < run.asked.sources.size(); ++s) {
    const QuerySource& source = run.asked.sources[s];
    json["sources"].push_back({{"name", source.name},
                               {"kind", kind_name(source.kind)},
                               {"queries", source.count},
                               {"found", run.figures.counts[s].found},
                               {"hits", run.figures.counts[s].hits}});
  }
  json["first_frame"] = run.frames.first;
  json["end_frame"] = run.frames.end;
  json["rounds"] = options.rounds;
  json["isa"] = to_string(engine_isa(run.targets.engine()));
  json["threads"] = engine_thread_count(run.targets.engine());
  json["exact"] = options.exact == Exact::kNone ? "none" : "convex";
  json["want"] = kWantNames[static_cast<std::size_t>(options.want)];
  json["max_hits"] = options.max_hits == QueryOptions().max_hits ? Json() : Json(options.max_hits);
  json["depth"] = options.with_depth;
  json["seed"] = options.random_count > 0 ? Json(options.seed) : Json();
  const Spread total = seconds_of(run, &QueryStats::seconds_total);
  add_spread(json, "total_wall_seconds", total);
  for (const QueryPhase& phase : kQueryPhases)
    add_spread(json, std::string(phase.key) + "_seconds", seconds_of(run, phase.seconds));
  json["nanoseconds_per_query"] = 1e9 * total.median / static_cast<double>(run.asked.queries.size());
  for (const QueryCount& row : kQueryCounts) json[row.key] = run.figures.stats.*row.count;
  json["instances_posed"] = run.figures.stats.instances_posed;
  json["instances_masked"] = run.figures.stats.instances_masked;
  json["hits_hash"] = hex(run.figures.hits_hash);
  json["notes"] = notes;
  return json;
}

// Asks the targets, once they are there.
void ask(const QueryOptions& options, FrameRange frames, const std::vector<std::string>& notes, Targets& targets,
         AskedQueries asked, OutputFile& out, OutputFile& json) {
  if (options.random_count > 0) {
    targets.pose(frames.first);
    asked.add("random", QueryKind::kRay, aimed_rays(targets, options.random_count, options.seed));
  }
  set_wants(options, asked);
  if (out) out.stream() << kHitsHeader;
  const QueryFigures figures =
      measure_queries(targets, asked, {options.exact, frames, options.rounds}, [&](const QueryAnswers& answers) {
        if (out) write_answers(out.stream(), targets, asked, answers);
      });
  if (out) out.close();
  const QueryReport run = {options, targets, asked, figures, frames};
  print_tables(run);
  warn_of_masked(run);
  write_json(json, to_json(run, notes));
}

}  // namespace

int query_command(const QueryOptions& options) {
  check(options);
  OutputFile out(options.out_path), json(options.json_path);
  AskedQueries asked = read_all(options);
  const EngineDesc desc = {.isa = options.isa, .thread_count = options.thread_count};
  const auto room = static_cast<std::uint32_t>(
      std::min<std::size_t>(std::max<std::size_t>(asked.queries.size(), options.random_count), kQueryRoom));
  if (!options.scene.empty()) {
    const scenes::Crowd crowd = scenes::make_crowd(options.scene, options.character_count);
    Targets targets(crowd, desc, room);
    ask(options, choose_frames(options, 1), {}, targets, std::move(asked), out, json);
    return 0;
  }
  const scenes::Scene scene = import_world(options.world);
  for (const std::string& note : scene.notes) tell("note", note);
  const FrameRange frames = choose_frames(options, scene.frame_count);
  Targets targets(scene, desc, room);
  ask(options, frames, scene.notes, targets, std::move(asked), out, json);
  return 0;
}

}  // namespace cab::perf
