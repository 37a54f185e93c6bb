// `cab crowd`: many characters at once; times, memory and counts per frame.
#include <cab/cab.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "layout/bit_hash.h"
#include "perf/base/crowd_session.h"
#include "perf/base/engine_session.h"
#include "perf/base/hit_sum.h"
#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/measure/crowd/mpi_run.h"
#include "perf/measure/crowd/options.h"
#include "scenes/crowd/humanoid.h"
#include "scenes/import/companions.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The poses of all frames are kept if they are not larger than this. Otherwise each frame is posed again before each
// run.
constexpr std::size_t kKeptPoseBytes = std::size_t{2} << 30;

// A count: one line in the table, one field in JSON and in CSV.
struct Counted {
  const char* name;
  const char* key;
  std::uint64_t FrameStats::*count;
};
constexpr Counted kCounts[] = {
    {"candidates", "candidates", &FrameStats::candidates},
    {"box tests", "box_tests", &FrameStats::box_tests},
    {"leaf pairs", "leaf_pairs", &FrameStats::leaf_pairs},
    {"exact tests", "exact_tests", &FrameStats::exact_tests},
    {"false positives", "false_positives", &FrameStats::false_positives},
    {"masked instances", "instances_masked", &FrameStats::instances_masked},
    {"resting instances", "instances_resting", &FrameStats::instances_resting},
    {"kept hits", "hits_kept", &FrameStats::hits_kept},
};

// ------------------------------------------------------------------------------------------------------- the order

// How the characters of a group are stored: character order[i] of the scene is character i of the engine. Empty: as in
// the scene.
using Order = std::vector<std::uint32_t>;

template <class T>
void reorder(const Order& order, std::vector<T>& values) {
  const std::size_t per_character = values.size() / order.size();
  std::vector<T> out;
  out.reserve(values.size());
  for (const std::uint32_t character : order) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(character * per_character);
    out.insert(out.end(), first, first + static_cast<std::ptrdiff_t>(per_character));
  }
  values = std::move(out);
}

void reorder(const std::vector<Order>& orders, std::vector<scenes::PosedGroup>& posed) {
  for (std::size_t g = 0; g < orders.size(); ++g) {
    reorder(orders[g], posed[g].poses);
    reorder(orders[g], posed[g].origins);
    reorder(orders[g], posed[g].orientations);
    reorder(orders[g], posed[g].moved);
  }
}

// The hits of a frame with the scene's numbers of its characters, sorted by these.
std::vector<Hit> scene_hits(const std::vector<Order>& orders, Span<const Hit> hits) {
  std::vector<Hit> out(hits.begin(), hits.end());
  if (orders.empty()) return out;
  for (Hit& hit : out) {
    hit.instance_a = orders[hit.batch_a.value - 1][hit.instance_a];
    if (hit.batch_b.value <= orders.size()) hit.instance_b = orders[hit.batch_b.value - 1][hit.instance_b];
    if (hit.batch_a.value == hit.batch_b.value && hit.instance_b < hit.instance_a) {
      std::swap(hit.instance_a, hit.instance_b);
      std::swap(hit.link_a, hit.link_b);
      std::swap(hit.leaf_a, hit.leaf_b);
    }
  }
  const auto key = [](const Hit& hit) {
    return std::make_tuple(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b, hit.link_a,
                           hit.link_b);
  };
  std::sort(out.begin(), out.end(), [&key](const Hit& a, const Hit& b) { return key(a) < key(b); });
  return out;
}

// ----------------------------------------------------------------------------------------------------- the rounds

// The poses of frames 0 .. frame_count - 1. They are made outside of the measured time.
class FramePoses {
 public:
  FramePoses(const scenes::Crowd& crowd, std::uint32_t frame_count) : crowd_(crowd) {
    std::size_t frame_bytes = 0;
    for (const scenes::CrowdGroup& group : crowd.groups)
      frame_bytes +=
          group.count * (group.figure.link_parents.size() * 7 * sizeof(float) + 3 * sizeof(double) + 4 * sizeof(float));
    kept_.resize(frame_count <= kKeptPoseBytes / frame_bytes ? frame_count : 0);
  }
  const std::vector<scenes::PosedGroup>& at(std::uint32_t frame) {
    std::vector<scenes::PosedGroup>& posed = kept_.empty() ? last_ : kept_[frame];
    if (kept_.empty() || posed.empty()) {
      scenes::pose_crowd(crowd_, frame / kCrowdFramesPerSecond, posed);
      reorder(orders_, posed);
    }
    return posed;
  }
  bool all_kept() const { return !kept_.empty(); }
  // Stores the characters of all frames in another order, by group.
  void store_in(std::vector<Order> orders) {
    orders_ = std::move(orders);
    for (std::vector<scenes::PosedGroup>& posed : kept_) posed.clear();
  }
  const std::vector<Order>& orders() const { return orders_; }

 private:
  const scenes::Crowd& crowd_;
  std::vector<Order> orders_;  // by group; empty: the scene's
  std::vector<std::vector<scenes::PosedGroup>> kept_;
  std::vector<scenes::PosedGroup> last_;
};

struct CrowdRun {
  const scenes::CrowdScene* scene = nullptr;
  std::uint32_t character_count = 0;
  std::size_t most_links = 0, most_leaves = 0;  // of a character
  std::optional<std::uint32_t> boxes_per_link;  // of `detailed`
  std::optional<scenes::RopeOptions> ropes;     // of `ropes`
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 0;
  std::size_t engine_bytes = 0;
  FrameStats stats;                // counts: the sum of all frames, once
  FrameStats first;                // counts of the first frame
  std::uint64_t hits = 0;          // of all frames, once
  std::uint64_t pairs = 0;         // of characters that have a hit, likewise
  std::uint64_t in_contact = 0;    // characters that touch anything, of all frames, if asked for
  std::uint64_t hits_hash = 0;     // of all frames; or of the bytes of in_contact
  std::uint64_t hits_sum = 0;      // of all frames, whatever the order of the hits
  std::vector<FrameStats> rounds;  // times: the sum of the frames of each round
};

void add_hits(cab::BitHash& hash, std::uint32_t frame, const std::vector<Hit>& hits) {
  for (const Hit& hit : hits)
    for (const std::uint32_t number : {frame, hit.batch_a.value, hit.instance_a, std::uint32_t{hit.link_a},
                                       hit.batch_b.value, hit.instance_b, std::uint32_t{hit.link_b}})
      hash.add(number);
}

// How many pairs of characters sorted hits are of.
std::uint64_t pair_count(Span<const Hit> hits) {
  std::uint64_t out = 0;
  for (std::size_t i = 0; i < hits.size; ++i) {
    const auto pair = [&hits](std::size_t at) {
      return std::make_tuple(hits[at].batch_a.value, hits[at].instance_a, hits[at].batch_b.value, hits[at].instance_b);
    };
    out += i == 0 || pair(i) != pair(i - 1);
  }
  return out;
}

// Adds a frame's bytes; returns how many are set.
std::uint64_t add_in_contact(cab::BitHash& hash, const std::vector<Order>& orders,
                             std::vector<std::vector<std::uint8_t>> in_contact) {
  std::uint64_t count = 0;
  for (std::size_t g = 0; g < in_contact.size(); ++g) {
    const std::vector<std::uint8_t> stored = in_contact[g];
    if (!orders.empty())
      for (std::size_t i = 0; i < stored.size(); ++i) in_contact[g][orders[g][i]] = stored[i];
    for (const std::uint8_t byte : in_contact[g]) {
      hash.add(std::uint32_t{byte});
      count += byte;
    }
  }
  return count;
}

// How many hits a frame reported, or characters in contact.
std::size_t reported(const CrowdSession& session) {
  std::size_t out = session.hits().size;
  for (const std::vector<std::uint8_t>& group : session.in_contact())
    out += std::accumulate(group.begin(), group.end(), std::size_t{0});
  return out;
}

// One frame; the time of sweeping from the frame before is part of it.
FrameStats run_frame_of(const CrowdOptions& options, std::uint32_t frame, FramePoses& poses, CrowdSession& session) {
  const std::vector<scenes::PosedGroup>& posed = poses.at(frame);
  const double seconds = options.sweep ? session.sweep(poses.at(frame > 0 ? frame - 1 : 0), posed) : 0;
  FrameStats stats = session.run(posed, options.policies, options.in_contact);
  stats.seconds_update += seconds;
  stats.seconds_bound += seconds;
  stats.seconds_total += seconds;
  return stats;
}

CrowdRun measure(const CrowdOptions& options, const scenes::Crowd& crowd) {
  FramePoses poses(crowd, options.frame_count);
  if (options.sweep && !poses.all_kept())
    throw std::runtime_error(
        "--sweep keeps the poses of all frames, which are too large; lower --frames or --characters");
  const bool has_rest = !poses.at(0)[0].moved.empty();
  CrowdSession session(crowd, options.isa, options.thread_count,
                       has_rest ? options.at_rest.value_or(AtRest::kSkipped) : AtRest::kMoved);
  if (options.coarse.share > 0) session.use_coarse(options.coarse, poses.at(0));
  CrowdRun run;
  run.character_count = crowd.count();
  run.isa = session.isa();
  run.thread_count = session.thread_count();
  ProgressBar bar("frames", (std::uint64_t{options.rounds} + 1) * options.frame_count);

  if (options.spatial_order) {
    session.run(poses.at(0), options.policies, options.in_contact);
    std::vector<Order> orders;
    for (std::size_t g = 0; g < crowd.groups.size(); ++g)
      orders.push_back(session.spatial_order(g, crowd.groups[g].count));
    poses.store_in(std::move(orders));
  }

  // Everyone counts as moved in the first frame.
  if (has_rest) session.run(poses.at(options.frame_count - 1), options.policies, options.in_contact);

  // The round that warms up also counts, and finds how many hits the buffer must hold.
  cab::BitHash hash;
  std::vector<std::size_t> hit_counts;
  for (std::uint32_t f = 0; f < options.frame_count; ++f) {
    const FrameStats stats = run_frame_of(options, f, poses, session);
    add_stats(run.stats, stats);
    if (f == 0) run.first = stats;
    const std::vector<Hit> hits = scene_hits(poses.orders(), session.hits());
    add_hits(hash, f, hits);
    run.hits_sum += hits_sum(f, hits);
    if (options.in_contact) run.in_contact += add_in_contact(hash, poses.orders(), session.in_contact());
    hit_counts.push_back(reported(session));
    run.hits += session.hits().size;
    run.pairs += pair_count(session.hits());
    bar.advance(1);
  }
  run.hits_hash = hash.value();

  for (std::uint32_t r = 0; r < options.rounds; ++r) {
    FrameStats sum;
    for (std::uint32_t f = 0; f < options.frame_count; ++f) {
      add_stats(sum, run_frame_of(options, f, poses, session));
      if (reported(session) != hit_counts[f])
        throw std::runtime_error("frame " + std::to_string(f) + " gave another number of hits when it ran again");
      bar.advance(1);
    }
    run.rounds.push_back(sum);
  }
  run.engine_bytes = session.engine_bytes();
  return run;
}

// ----------------------------------------------------------------------------------------------------- the output

// Seconds per frame, over the rounds.
Spread phase_spread(const CrowdOptions& options, const CrowdRun& run, double FrameStats::*seconds) {
  std::vector<double> values;
  for (const FrameStats& round : run.rounds) values.push_back(round.*seconds / options.frame_count);
  return spread_of(std::move(values));
}

double per_character(const CrowdRun& run, double whole) { return whole / run.character_count; }

// A sum over all frames, divided by the number of frames.
double per_frame(const CrowdOptions& options, std::uint64_t sum) {
  return static_cast<double>(sum) / options.frame_count;
}

double pairs_in_first_frame(const CrowdRun& run) {
  return per_character(run, static_cast<double>(run.first.leaf_pairs));
}

bool is_expected(const CrowdRun& run) {
  const double expected = run.scene->pairs_per_character;
  return std::abs(pairs_in_first_frame(run) - expected) <= run.scene->tolerance * expected;
}

// How the pairs of the first frame compare with the expected number.
std::string expectation(const CrowdOptions& options, const CrowdRun& run) {
  if (run.scene->pairs_per_character == 0 || options.coarse.share > 0 || options.area) return "no expected value";
  return std::string(is_expected(run) ? "within " : "outside ") + fixed(100 * run.scene->tolerance, 0) + " % of " +
         shortest(run.scene->pairs_per_character);
}

void print_table(const CrowdOptions& options, const CrowdRun& run) {
  std::cout << options.scene << ": " << run.character_count << " characters of " << run.most_leaves << " boxes, "
            << options.frame_count << " frames, " << options.rounds << " rounds (" << to_string(run.isa) << ", threads "
            << run.thread_count << (options.spatial_order ? ", in spatial order" : "")
            << (options.sweep ? ", swept" : "");
  if (options.coarse.share > 0)
    std::cout << ", " << shortest(options.coarse.share) << " at a level of at most " << options.coarse.leaves << ' '
              << kLodKindNames[static_cast<std::size_t>(options.coarse.kind)] << " leaves";
  for (std::uint32_t f = 0; f < policy_table().size; ++f)
    std::cout << ", " << policy_table()[f].name << ' ' << policy_value(options.policies, f);
  std::cout << ")\n";

  TextTable times;
  times.add_row({"", "median", "least", "most"});
  const auto add_time = [&times](const std::string& name, const Spread& s) {
    times.add_row({name, fixed(1e3 * s.median, 4), fixed(1e3 * s.least, 4), fixed(1e3 * s.most, 4), "ms"});
  };
  const Spread s = phase_spread(options, run, &FrameStats::seconds_total);
  add_time("frame", s);
  for (const Phase& phase : kPhases)
    add_time(std::string("  ") + phase.name, phase_spread(options, run, phase.seconds));
  const auto ns = [&](double seconds) { return fixed(1e9 * per_character(run, seconds), 1); };
  const auto rate = [&](double seconds) { return fixed(run.character_count / seconds, 0); };
  times.add_row({"per character", ns(s.median), ns(s.least), ns(s.most), "ns"});
  times.add_row({"characters per second", rate(s.median), rate(s.most), rate(s.least)});
  times.print(std::cout);

  std::cout << '\n';
  TextTable counts;
  counts.add_row({"", "per frame", "per character"});
  for (const Counted& counted : kCounts) {
    const double count = per_frame(options, run.stats.*counted.count);
    counts.add_row({counted.name, fixed(count, 1), fixed(per_character(run, count), 3)});
  }
  const double found = per_frame(options, options.in_contact ? run.in_contact : run.hits);
  counts.add_row({options.in_contact ? "in_contact" : "hits", fixed(found, 1), fixed(per_character(run, found), 3)});
  if (!options.in_contact) {
    const double pairs = per_frame(options, run.pairs);
    counts.add_row({"pairs of characters", fixed(pairs, 1), fixed(per_character(run, pairs), 3)});
  }
  counts.add_row({"engine's bytes", std::to_string(run.engine_bytes),
                  fixed(per_character(run, static_cast<double>(run.engine_bytes)), 1)});
  counts.print(std::cout);
  if (options.in_contact) {
    std::cout << "\nhash of who is in contact in all frames: " << hex(run.hits_hash) << '\n';
    return;
  }
  std::cout << "\npairs per character in the first frame: " << fixed(pairs_in_first_frame(run), 3) << ", "
            << expectation(options, run) << "\nhash of all frames' hits: " << hex(run.hits_hash)
            << "\nsum over all frames' hits: " << hex(run.hits_sum) << '\n';
}

// Every figure by its key; the CSV file has the same keys in the same order.
Json to_json(const CrowdOptions& options, const CrowdRun& run) {
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["scene"] = options.scene;
  json["characters"] = run.character_count;
  json["links"] = run.most_links;
  json["leaves"] = run.most_leaves;
  json["boxes_per_link"] = run.boxes_per_link ? Json(*run.boxes_per_link) : Json();
  json["rope_shape"] = run.ropes ? Json(scenes::kRopeShapeNames[static_cast<std::size_t>(run.ropes->shape)]) : Json();
  json["rope_spacing"] = run.ropes ? Json(run.ropes->spacing) : Json();
  json["frames"] = options.frame_count;
  json["rounds"] = options.rounds;
  json["isa"] = to_string(run.isa);
  json["threads"] = run.thread_count;
  json["spatial_order"] = options.spatial_order;
  json["sweep"] = options.sweep;
  json["area_per_character"] = options.area ? Json(*options.area) : Json();
  json["coarse"] = options.coarse.share;
  json["lod"] = kLodKindNames[static_cast<std::size_t>(options.coarse.kind)];
  json["lod_leaves"] = options.coarse.leaves;
  json.update(policies_json(options.policies));
  const Spread frame_seconds = phase_spread(options, run, &FrameStats::seconds_total);
  add_spread(json, "total_wall_seconds", frame_seconds);
  const auto add_seconds = [&](const char* key, double FrameStats::*seconds) {
    add_spread(json, std::string(key) + "_thread_seconds", phase_spread(options, run, seconds));
  };
  for (const Phase& phase : kPhases) add_seconds(phase.key, phase.seconds);
  add_seconds("bound", &FrameStats::seconds_bound);
  add_seconds("sort", &FrameStats::seconds_sort);
  add_seconds("filter", &FrameStats::seconds_filter);
  add_seconds("write", &FrameStats::seconds_write);
  json["nanoseconds_per_character"] = 1e9 * per_character(run, frame_seconds.median);
  json["characters_per_second"] = run.character_count / frame_seconds.median;
  json["engine_bytes"] = run.engine_bytes;
  json["bytes_per_character"] = per_character(run, static_cast<double>(run.engine_bytes));
  for (const Counted& counted : kCounts) json[counted.key] = run.stats.*counted.count;
  json["instances_posed"] = run.stats.instances_posed;
  json["candidates_apart"] = run.stats.candidates_apart;
  json["report"] = options.in_contact ? "in_contact" : "hits";
  json["in_contact"] = options.in_contact ? Json(run.in_contact) : Json();
  json["hits"] = run.hits;
  json["character_pairs"] = run.pairs;
  json["hits_per_character"] = per_character(run, per_frame(options, run.hits));
  json["pairs_per_character"] = pairs_in_first_frame(run);
  json["expected_pairs_per_character"] = Json();
  json["pairs_as_expected"] = Json();
  if (run.scene->pairs_per_character > 0 && !options.in_contact && options.coarse.share == 0 && !options.area) {
    json["expected_pairs_per_character"] = run.scene->pairs_per_character;
    json["pairs_as_expected"] = is_expected(run);
  }
  json["hits_hash"] = hex(run.hits_hash);
  json["hits_sum"] = hex(run.hits_sum);
  return json;
}

// Throws UsageError for options that contradict each other.
void check(const CrowdOptions& options, const scenes::CrowdScene& scene) {
  const std::string& name = options.scene;
  if (!options.mpi && options.character_count > kMaxCrowd)
    throw UsageError("--characters: one process takes at most " + std::to_string(kMaxCrowd) + "; --mpi takes more");
  if (scene.clips == scenes::ClipUse::kNeeded && options.clips.empty())
    throw UsageError("--scene " + name + " needs --clip FILE");
  if (scene.needs_trajectories && options.trajectories_path.empty())
    throw UsageError("--scene " + name + " needs --trajectories FILE");
  if (scene.clips == scenes::ClipUse::kNone &&
      (!options.clips.empty() || !options.metres_per_unit.empty() || options.up != 0))
    throw UsageError("--clip, --units and --up are not for --scene " + name + ", whose characters are its own");
  if (!scene.needs_trajectories && !options.trajectories_path.empty())
    throw UsageError("--trajectories is not for --scene " + name + ", whose characters have places of their own");
  if (options.trajectories_path.empty() && options.frames_per_second)
    throw UsageError("--fps is for --trajectories; add --trajectories FILE");
  if (options.clips.empty() && (!options.metres_per_unit.empty() || options.up != 0))
    throw UsageError("--units and --up are for clips; add --clip FILE");
  if (name != "detailed" && options.boxes_per_link)
    throw UsageError("--boxes-per-link is for --scene detailed, not for " + name);
  if (name != "ropes" && (options.rope_shape || options.rope_spacing))
    throw UsageError("--shape and --spacing are for --scene ropes, not for " + name);
  if (name != "ropes" && name != "rigs" && options.link_count)
    throw UsageError("--links is for --scene ropes and --scene rigs, not for " + name);
  if (options.at_rest && name != "city") throw UsageError("--at-rest is for --scene city, not for " + name);
  if (options.coarse.share > 0 && (options.spatial_order || options.sweep || options.in_contact))
    throw UsageError("--coarse has no figures with --spatial-order, --sweep and --in-contact");
  if (options.area && name != "uniform" && name != "rigs")
    throw UsageError("--area is for --scene uniform and --scene rigs, not for " + name);
  if (options.skin_leaves && name != "skins") throw UsageError("--skin-leaves is for --scene skins, not for " + name);
  if (options.policies.exact == Exact::kSurface && name != "skins")
    throw UsageError("--exact surface: needs --scene skins, whose triangles it tests");
  if (options.level && name != "level") throw UsageError("--level is for --scene level, not for " + name);
  if (name == "rigs" && options.link_count && *options.link_count < scenes::kHumanoidLinks)
    throw UsageError("--links: a body of --scene rigs has at least " + std::to_string(scenes::kHumanoidLinks));
  check_given("--units", options.metres_per_unit.size(), options.clips.size(), "clip");
  std::vector<std::string> inputs = options.clips;
  inputs.push_back(options.trajectories_path);
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, inputs,
                [&options](const std::string& file) { return scenes::companion_files(file, options.sandbox); });
}

// quiet: notes about files are not printed.
scenes::CrowdSources import_sources(const CrowdOptions& options, bool quiet = false) {
  scenes::CrowdSources sources;
  sources.up = options.up;
  sources.boxes_per_link = options.boxes_per_link.value_or(sources.boxes_per_link);
  sources.ropes.link_count = options.link_count.value_or(sources.ropes.link_count);
  sources.rig_links = options.link_count.value_or(sources.rig_links);
  sources.level = options.level.value_or(sources.level);
  sources.skin_leaves = options.skin_leaves.value_or(sources.skin_leaves);
  sources.area = options.area.value_or(sources.area);
  sources.ropes.shape = options.rope_shape.value_or(sources.ropes.shape);
  sources.ropes.spacing = options.rope_spacing.value_or(sources.ropes.spacing);
  for (std::size_t c = 0; c < options.clips.size(); ++c) {
    scenes::ImportOptions import;
    import.up = options.up;
    import.sandbox = options.sandbox;
    if (!options.metres_per_unit.empty())
      set_unit(options.metres_per_unit[options.metres_per_unit.size() == 1 ? 0 : c], import);
    sources.clips.push_back(scenes::import_clip(options.clips[c], import));
    if (quiet) continue;
    for (const std::string& note : sources.clips.back().notes)
      tell("note", sources.clips.back().character.name + ": " + note);
  }
  if (!options.trajectories_path.empty()) {
    sources.trajectories =
        scenes::import_trajectories(options.trajectories_path, options.frames_per_second.value_or(0), options.sandbox);
    if (quiet) return sources;
    for (const std::string& note : sources.trajectories.notes) tell("note", options.trajectories_path + ": " + note);
  }
  return sources;
}

// All that decides the hits of a run, but for what is in files.
std::string program_of(const CrowdOptions& options, const scenes::CrowdSources& defaults) {
  std::string out = std::string("cab ") + CAB_VERSION_STRING + " scene=" + options.scene;
  const auto add = [&out](const char* name, const std::string& value) { out += std::string(" ") + name + '=' + value; };
  add("characters", std::to_string(options.character_count));
  add("frames", std::to_string(options.frame_count));
  add("checkpoint", std::to_string(options.checkpoint));
  for (std::uint32_t f = 0; f < policy_table().size; ++f)
    add(policy_table()[f].name, policy_value(options.policies, f));
  add("area", shortest(options.area.value_or(defaults.area)));
  add("boxes_per_link", std::to_string(options.boxes_per_link.value_or(defaults.boxes_per_link)));
  add("links", options.link_count ? std::to_string(*options.link_count) : "default");
  add("level", scenes::kLevelKindNames[static_cast<std::size_t>(options.level.value_or(defaults.level))]);
  add("shape", scenes::kRopeShapeNames[static_cast<std::size_t>(options.rope_shape.value_or(defaults.ropes.shape))]);
  add("spacing", shortest(options.rope_spacing.value_or(defaults.ropes.spacing)));
  for (const std::string& clip : options.clips) add("clip", clip);
  if (!options.trajectories_path.empty()) add("trajectories", options.trajectories_path);
  return out;
}

}  // namespace

int crowd_command(const CrowdOptions& options) {
  const scenes::CrowdScene& scene = scenes::crowd_scene(options.scene);
  check(options, scene);
  if (options.mpi)
    return run_by_mpi(options, program_of(options, {}), [&options](bool quiet) {
      return scenes::make_crowd(options.scene, options.character_count, import_sources(options, quiet));
    });
  OutputFile json(options.json_path), csv(options.csv_path);
  const scenes::CrowdSources sources = import_sources(options);
  const scenes::Crowd crowd = scenes::make_crowd(options.scene, options.character_count, sources);
  CrowdRun run = measure(options, crowd);
  run.scene = &scene;
  if (options.scene == "detailed") run.boxes_per_link = sources.boxes_per_link;
  if (options.scene == "ropes") run.ropes = sources.ropes;
  for (const scenes::CrowdGroup& group : crowd.groups) {
    run.most_links = std::max(run.most_links, group.figure.link_parents.size());
    run.most_leaves = std::max(run.most_leaves, group.figure.leaves.size());
  }
  print_table(options, run);
  const Json figures = to_json(options, run);
  write_json(json, figures);
  write_csv(csv, {figures});
  return 0;
}

}  // namespace cab::perf
