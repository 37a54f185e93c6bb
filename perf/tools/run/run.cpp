// `cab run`: finds which links of motion files in one world touch in which frame.
#include <cab/cab.h>

#include <array>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/base/mask_words.h"
#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/replay/recorded_engine.h"
#include "perf/tools/run/import_summary.h"
#include "perf/tools/run/options.h"
#include "perf/tools/run/touching_pairs.h"
#include "scenes/import/companions.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The results of a run that the command prints and writes.
struct RunTotals {
  FrameStats stats;
  std::uint64_t hits = 0;
  std::uint64_t frames_with_hits = 0;
  std::vector<TouchingPair> pairs;  // the worst first
};

// Whether the exact test gives the normal, depth and points of each hit.
bool gives_contacts(const RunOptions& options) {
  return options.policies.exact == Exact::kConvex || options.policies.exact == Exact::kFcl;
}

// Throws UsageError for options that contradict each other.
void check(const RunOptions& options) {
  check_files(options.world);
  if (options.policies.exact == Exact::kNone && options.min_depth > 0)
    throw UsageError("--min-depth: boxes alone have no depth; leave out --exact none");
  check_exact(options.world, options.policies.exact);
  if (options.min_depth > 0) check_exact(options.world, Exact::kConvex);
  if (!options.containment && options.policies.exact != Exact::kSurface)
    throw UsageError("--no-containment: needs --exact surface, which looks for what is inside");
  check_outputs({{"--hits", options.hits_path}, {"--json", options.json_path}, {"--record", options.recording.path}},
                input_paths(options.world),
                [&options](const std::string& file) { return scenes::companion_files(file, options.world.sandbox); });
}

FrameRange choose_frames(const RunOptions& options, const scenes::Scene& scene) {
  if (!options.frames) return {0, scene.frame_count};
  if (options.frames->end > scene.frame_count)
    throw UsageError("--frames: " + std::to_string(options.frames->first) + ":" + std::to_string(options.frames->end) +
                     " goes beyond the scene's " + std::to_string(scene.frame_count) +
                     " frames; stay within 0:" + std::to_string(scene.frame_count));
  return *options.frames;
}

void write_hits_header(std::ostream& out, bool contacts) {
  out << "frame,character_a,link_a,character_b,link_b,seconds";
  if (contacts) out << ",depth_metres,normal_x,normal_y,normal_z,point_x,point_y,point_z";
  out << '\n';
}

// Writes a hit as a CSV line. The point, in the world, is half way between the two deepest ones. Fields of a contact
// that the exact test could not give stay empty.
void write_hit(std::ostream& out, const scenes::Scene& scene, const Touch& touch, bool contacts) {
  const scenes::Character& a = scene.characters[touch.character_a];
  const scenes::Character& b = scene.characters[touch.character_b];
  out << touch.frame << ',' << csv_field(a.name) << ',' << csv_field(a.link_names[touch.link_a]) << ','
      << csv_field(b.name) << ',' << csv_field(b.link_names[touch.link_b]) << ','
      << shortest(touch.frame * scene.frame_seconds);
  if (contacts && !has_contact(touch)) out << ",,,,,,,";
  if (contacts && has_contact(touch)) {
    const Contact& contact = touch.contact;
    out << ',' << shortest(contact.depth);
    for (const float component : contact.normal) out << ',' << shortest(component);
    for (std::size_t k = 0; k < 3; ++k) {
      const double origin = a.origins.empty() ? 0 : a.origins[std::size_t{touch.frame} * 3 + k];
      const double middle = (static_cast<double>(contact.point_a[k]) + static_cast<double>(contact.point_b[k])) / 2;
      out << ',' << shortest(origin + middle);
    }
  }
  out << '\n';
}

void count_touches(RunTotals& totals, const std::vector<Touch>& touches) {
  totals.hits += touches.size();
  for (std::size_t t = 0; t < touches.size(); ++t)
    if (t == 0 || touches[t].frame != touches[t - 1].frame) ++totals.frames_with_hits;
}

std::size_t count_links(const scenes::Scene& scene) {
  std::size_t links = 0;
  for (const scenes::Character& character : scene.characters) links += character.link_parents.size();
  return links;
}

// Prints what the engine counted and timed.
void print_stats(const RunOptions& options, const scenes::Scene& scene, const EngineSession& session,
                 const RunTotals& totals, FrameRange frames) {
  const FrameStats& stats = totals.stats;
  const bool exact = options.policies.exact != Exact::kNone;
  std::cout << '\n';
  TextTable table;
  table.add_row({"characters", std::to_string(scene.characters.size())});
  table.add_row({"links", std::to_string(count_links(scene))});
  table.add_row({"frames", std::to_string(frames.count())});
  table.add_row({"frames with hits", std::to_string(totals.frames_with_hits)});
  table.add_row({"box tests", std::to_string(stats.box_tests)});
  table.add_row({"#coll", std::to_string(stats.leaf_pairs)});
  table.add_row({"#false", exact ? std::to_string(stats.false_positives) : "-"});
  table.add_row({"hits", std::to_string(totals.hits)});
  if (stats.instances_masked > 0) table.add_row({"masked instances", std::to_string(stats.instances_masked)});
  table.add_row({"t[upd]", fixed(stats.seconds_update, 5), "s"});
  table.add_row({"t[test]", fixed(stats.seconds_test, 5), "s"});
  table.add_row({"t[query]", exact ? fixed(stats.seconds_query, 5) : "-", exact ? "s" : ""});
  table.add_row({"t[total]", fixed(stats.seconds_total, 5), "s"});
  table.add_row({"exact test", policy_value(options.policies, "exact")});
  table.add_row({"ISA", to_string(session.isa())});
  table.add_row({"threads", std::to_string(session.thread_count())});
  table.add_row({"pose hash", hex(scenes::pose_hash(scene))});
  table.print(std::cout);
}

// Warns of poses that took part in nothing.
void warn_of_masked(const scenes::Scene& scene, const EngineSession& session, const FrameStats& stats,
                    const FrameRange& frames) {
  if (stats.instances_masked == 0) return;
  std::cerr << "warning: " << stats.instances_masked << " poses of " << scene.characters.size() << " characters in "
            << frames.count() << " frames are masked: they touch nothing, whatever they meet\n";
  const std::optional<MaskedPose> first = session.first_masked();
  if (!first) return;
  const scenes::Character& character = scene.characters[first->character];
  tell("  the first", "frame " + std::to_string(first->frame) + " of " + character.name + ", " +
                          words_of(first->reason, character.link_names));
}

// The name that files give to a reason why two links are masked.
struct ReasonName {
  IgnoredReason reason;
  const char* name;
};
constexpr ReasonName kReasonNames[] = {
    {kIgnoredExplicitly, "joint"}, {kIgnoredByHops, "hops"}, {kIgnoredAtRest, "rest"}};

// The number of pairs of different links of a character.
std::size_t count_pairs(const scenes::Character& character) {
  return character.link_parents.size() * (character.link_parents.size() - 1) / 2;
}

// How many pairs within all characters --self leaves out for a reason, and for none of those before it.
std::array<std::size_t, std::size(kReasonNames)> count_masked(const scenes::Scene& scene,
                                                              const EngineSession& session) {
  std::array<std::size_t, std::size(kReasonNames)> counts = {};
  for (std::uint32_t c = 0; c < scene.characters.size(); ++c)
    for (const IgnoredPair& pair : session.ignored_pairs(c))
      for (std::size_t r = 0; r < counts.size(); ++r) {
        if ((pair.reasons & kReasonNames[r].reason) == 0) continue;
        ++counts[r];
        break;
      }
  return counts;
}

// Says in a line how many pairs --self leaves out, and which option brings them back.
void print_masked(const WorldOptions& world, const scenes::Scene& scene, const EngineSession& session) {
  const auto [joint, hops, rest] = count_masked(scene, session);
  std::size_t all = 0;
  for (const scenes::Character& character : scene.characters) all += count_pairs(character);
  std::cout << "left out of --self: " << joint + hops + rest << " of " << all << " pairs of links: " << joint
            << " share a joint";
  if (hops > 0)
    std::cout << ", " << hops << " more are at most " << world.ignored_hops
              << (world.ignored_hops == 1 ? " joint" : " joints") << " apart (--hops 0 brings them back)";
  if (rest > 0)
    std::cout << ", " << rest << " more touch in frame " << *world.rest_frame
              << " (without --rest-frame they are back)";
  std::cout << '\n';
}

// The pairs within all characters, if these are tested.
MaskedPairs masked_pairs(const scenes::Scene& scene, const EngineSession& session, bool within) {
  MaskedPairs pairs;
  for (std::uint32_t c = 0; within && c < scene.characters.size(); ++c) {
    pairs.masked += session.ignored_pairs(c).size();
    pairs.all += count_pairs(scene.characters[c]);
  }
  return pairs;
}

Json masked_to_json(const scenes::Character& character, const std::vector<IgnoredPair>& pairs) {
  Json json;
  json["pair_count"] = count_pairs(character);
  json["masked_count"] = pairs.size();
  json["masked"] = Json::array();
  for (const IgnoredPair& pair : pairs) {
    Json reasons = Json::array();
    for (const ReasonName& row : kReasonNames)
      if (pair.reasons & row.reason) reasons.push_back(row.name);
    json["masked"].push_back(
        {{"link_a", character.link_names[pair.a]}, {"link_b", character.link_names[pair.b]}, {"reasons", reasons}});
  }
  return json;
}

Json to_json(const RunOptions& options, const scenes::Scene& scene, const scenes::ImportReport& report,
             const EngineSession& session, const RunTotals& totals, FrameRange frames) {
  const FrameStats& stats = totals.stats;
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["characters"] = Json::array();
  for (std::uint32_t c = 0; c < scene.characters.size(); ++c) {
    json["characters"].push_back({{"name", scene.characters[c].name},
                                  {"file", options.world.files[c]},
                                  {"links", scene.characters[c].link_parents.size()},
                                  {"metres_per_unit", report.units[c].metres},
                                  {"unit_from", to_string(report.units[c].source)}});
    if (const std::string motion = motion_path(options.world, c); !motion.empty())
      json["characters"].back()["motion"] = motion;
    if (options.within)
      json["characters"].back()["self"] = masked_to_json(scene.characters[c], session.ignored_pairs(c));
  }
  json["character_count"] = scene.characters.size();
  json["link_count"] = count_links(scene);
  json["frame_count"] = frames.count();
  json["first_frame"] = frames.first;
  json["end_frame"] = frames.end;
  json["scene_frame_count"] = scene.frame_count;
  json["frame_seconds"] = scene.frame_seconds;
  json["policies"] = policies_json(options.policies);
  json["within_characters"] = options.within;
  if (options.within) json["ignored_hops"] = options.world.ignored_hops;
  if (options.world.rest_frame) json["rest_frame"] = *options.world.rest_frame;
  json["box_tests"] = stats.box_tests;
  json["coll"] = stats.leaf_pairs;
  json["exact_tests"] = stats.exact_tests;
  json["false_positives"] = stats.false_positives;
  json["hits"] = totals.hits;
  json["frames_with_hits"] = totals.frames_with_hits;
  if (options.min_depth > 0) json["min_depth_metres"] = options.min_depth;
  json["pairs"] = pairs_json(scene, totals.pairs);
  json["instances_masked"] = stats.instances_masked;
  json["update_thread_seconds"] = stats.seconds_update;
  json["test_thread_seconds"] = stats.seconds_test;
  json["query_thread_seconds"] = stats.seconds_query;
  json["total_wall_seconds"] = stats.seconds_total;
  json["isa"] = to_string(session.isa());
  json["threads"] = session.thread_count();
  json["pose_hash"] = hex(scenes::pose_hash(scene));
  json["altered"] = import_json(report, masked_pairs(scene, session, options.within));
  json["size_doubts"] = report.size_doubts;
  json["notes"] = scene.notes;
  return json;
}

// Writes the recording. Its frames run once more, since one block of the run above has many frames.
void write_recording(const RunOptions& options, const scenes::Scene& scene, FrameRange frames,
                     const EngineSession& session, std::uint64_t hits) {
  RecordSettings settings;
  settings.path = options.recording.path;
  settings.title = scene.name;
  settings.policies = options.policies;
  settings.min_depth = options.min_depth;
  settings.containment = options.containment;
  settings.isa = session.isa();
  settings.thread_count = options.thread_count;
  settings.metres_per_unit = 1;
  settings.up = scene.up;
  settings.compress = options.recording.compress;
  settings.pose_step = options.recording.pose_step;
  RecordTotals totals;
  {
    ProgressBar bar("recording", frames.count());
    totals = record_scene(scene, frames, options.within, settings, [&bar] { bar.advance(1); });
  }
  if (!options.recording.is_aside)
    std::cout << "recording: " << scenes::printable(settings.path) << ", " << totals.bytes << " bytes\n";
  if (totals.hits != hits)
    std::cerr << "note: with poses rounded to 16 bits there are " << totals.hits << " hits, not " << hits << '\n';
}

}  // namespace

int run_command(const RunOptions& options) {
  check(options);
  OutputFile hits(options.hits_path), json(options.json_path);
  scenes::ImportReport report;
  const scenes::Scene scene = import_world(options.world, &report);
  if (scene.characters.size() == 1 && !options.within)
    std::cerr << "warning: one character has nothing to touch; give a second file or --self\n";
  const FrameRange frames = choose_frames(options, scene);

  const bool contacts = gives_contacts(options);
  if (hits) write_hits_header(hits.stream(), contacts);
  EngineSession session(
      scene, {options.isa, options.thread_count, frames, options.within, options.min_depth, options.containment});
  print_import(scene, report, options.quiet, std::cerr);
  RunTotals totals;
  TouchingPairs pairs;
  {
    ProgressBar bar("frames", frames.count());
    totals.stats = session.run(options.policies, contacts, [&](const BlockResult& block) {
      count_touches(totals, block.touches);
      pairs.add(block.touches);
      if (hits)
        for (const Touch& touch : block.touches) write_hit(hits.stream(), scene, touch, contacts);
      bar.advance(block.frames.count());
    });
  }
  totals.pairs = pairs.worst_first();
  if (hits) hits.close();
  print_pairs({scene, frames, totals.frames_with_hits, options.policies.exact, options.min_depth}, totals.pairs,
              std::cout);
  if (options.within) print_masked(options.world, scene, session);
  if (options.stats) print_stats(options, scene, session, totals, frames);
  warn_of_masked(scene, session, totals.stats, frames);
  if (!options.recording.path.empty()) write_recording(options, scene, frames, session, totals.hits);
  write_json(json, to_json(options, scene, report, session, totals, frames));
  print_size_doubts(report, std::cerr);
  return 0;
}

}  // namespace cab::perf
