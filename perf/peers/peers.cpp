// `cab peers`: the same crowds through other libraries, each set-up verified and timed in turns with the engine.
#include <cab/cab.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/oracle/exact_pose.h"
#include "perf/oracle/overlap_exact.h"
#include "perf/peers/options.h"
#include "perf/peers/peer.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;
using Pairs = std::vector<LeafPair>;

// The frames of all runs: 1/30 s apart, there and back, so that every frame is one step of motion from the last.
constexpr std::uint32_t kFrameOrder[] = {0, 1, 2, 3, 2, 1};
constexpr std::uint32_t kFrameCount = 4;
constexpr double kFramesPerSecond = 30;

// In a turn a set-up runs one frame that is not measured, since the turn before filled the caches with other data, and
// then these.
constexpr std::uint32_t kMeasuredFrames = 2;

// The number of characters of the verification, so that brute force takes only a moment.
constexpr std::uint32_t kVerifiedCharacters = 200;

// Up to this many characters every set-up runs all rounds. With more characters there are fewer rounds. If the scene
// ran with fewer characters before, only ours and the best set-ups of each library in that run take part: the fastest
// of all, and the fastest that works alone.
constexpr std::uint32_t kFullRoundCharacters = 10000;
constexpr std::uint32_t kLeastRounds = 3;

// The numbers of characters if none are given.
const std::vector<std::uint32_t>& default_character_counts(const std::string& scene) {
  static const std::vector<std::uint32_t> uniform = {1000, 10000, 100000}, jitter = {1000, 10000};
  return scene == "uniform" ? uniform : jitter;
}

// A pair counts as a threshold pair when its gap or depth is at most this share of its boxes' half extents' sum and of
// their coordinates. The engine's slack is 2^-17.1 of the former (docs/numerics.md), and a float of a world coordinate
// and the arithmetic on it are some 2^-23 of the latter.
constexpr double kThresholdOfSize = 0x1p-15;
constexpr double kThresholdOfPlace = 0x1p-21;

// The processor time of the process, summed over threads. Other users of the machine do not change it.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// ------------------------------------------------------------------------------------------------------ the judge

// The judge's answer about a pair of leaves.
enum class Verdict { kOverlap, kApart, kThreshold };

// All leaf boxes of a posed crowd in double, and the judge of perf/oracle on them.
class JudgedCrowd {
 public:
  JudgedCrowd(const scenes::Character& figure, const scenes::PosedGroup& posed)
      : leaves_(static_cast<std::uint32_t>(figure.leaves.size())), origins_(posed.origins) {
    oracle::Rig rig;
    rig.parents = figure.link_parents;
    for (const scenes::BodyLeaf& leaf : figure.leaves) rig.leaves.push_back({leaf.link, leaf.box, {}});
    oracle::Poses poses;
    poses.link_count = rig.link_count();
    poses.instance_count = static_cast<std::uint32_t>(posed.origins.size() / 3);
    poses.data = posed.poses;
    boxes_.reserve(std::size_t{poses.instance_count} * leaves_);
    for (std::uint32_t i = 0; i < poses.instance_count; ++i)
      for (const oracle::ExactBox& box : exact_leaf_boxes(rig, poses, i))
        boxes_.push_back(oracle::convert<double>(box));
  }

  Verdict verdict(const LeafPair& pair) const {
    const oracle::OracleBox<double>&a = boxes_[pair.a], &b = boxes_[pair.b];
    const oracle::AxisGaps gaps = axis_gaps(a, b, between(pair));
    const double gap = *std::max_element(gaps.begin(), gaps.end());
    const double place = std::max(norm_max(place_of(pair.a)), norm_max(place_of(pair.b)));
    const double threshold = kThresholdOfSize * (half_sum(a) + half_sum(b)) + kThresholdOfPlace * place;
    return std::abs(gap) <= threshold ? Verdict::kThreshold : gap > 0 ? Verdict::kApart : Verdict::kOverlap;
  }

  // Brute force over all leaves of different characters: the pairs that overlap, threshold pairs with a gap of at most
  // zero included.
  Pairs overlapping_pairs() const {
    Pairs pairs;
    const auto count = static_cast<std::uint32_t>(boxes_.size());
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = (a / leaves_ + 1) * leaves_; b < count; ++b) {
        const oracle::Vec3<double> d = between({a, b});
        const double reach = half_sum(boxes_[a]) + half_sum(boxes_[b]);
        if (dot(d, d) <= reach * reach && separating_axes(boxes_[a], boxes_[b], d).none()) pairs.push_back({a, b});
      }
    return pairs;
  }

 private:
  oracle::Vec3<double> place_of(std::uint32_t leaf) const {
    const double* const origin = origins_.data() + std::size_t{leaf / leaves_} * 3;
    return oracle::Vec3<double>{{origin[0], origin[1], origin[2]}} + center_of(boxes_[leaf]);
  }
  oracle::Vec3<double> between(const LeafPair& pair) const { return place_of(pair.b) - place_of(pair.a); }

  std::uint32_t leaves_;
  std::vector<double> origins_;
  std::vector<oracle::OracleBox<double>> boxes_;  // relative to their characters' origins
};

// How a set-up's pairs differ from reference pairs.
struct Differences {
  std::uint64_t pairs = 0;            // that it found
  std::uint64_t misses = 0;           // overlap and were not found
  std::uint64_t false_positives = 0;  // found, and apart or found before
  std::uint64_t threshold = 0;        // found by one of the two alone, at the threshold
};

// Adds to `found` how sorted pairs differ from sorted reference pairs. Each differing pair is judged, so the reference
// need not be right. Where the reference is wrong, of_reference counts it (null: the reference is brute force).
void add_differences(const JudgedCrowd& judge, const Pairs& pairs, const Pairs& reference, Differences& found,
                     Differences* of_reference) {
  found.pairs += pairs.size();
  Pairs missing, more;
  std::set_difference(reference.begin(), reference.end(), pairs.begin(), pairs.end(), std::back_inserter(missing));
  std::set_difference(pairs.begin(), pairs.end(), reference.begin(), reference.end(), std::back_inserter(more));
  for (const LeafPair& pair : missing) {
    const Verdict verdict = judge.verdict(pair);
    found.threshold += verdict == Verdict::kThreshold;
    found.misses += verdict == Verdict::kOverlap;
    if (of_reference != nullptr) of_reference->false_positives += verdict == Verdict::kApart;
  }
  for (const LeafPair& pair : more) {
    const Verdict verdict = judge.verdict(pair);
    const bool twice = std::binary_search(reference.begin(), reference.end(), pair);
    found.threshold += !twice && verdict == Verdict::kThreshold;
    found.false_positives += twice || verdict == Verdict::kApart;
    if (of_reference != nullptr) of_reference->misses += !twice && verdict == Verdict::kOverlap;
  }
}

// ------------------------------------------------------------------------------------------------- the contestants

// A set-up of a peer, or cab on one instruction set, without a world.
struct Contestant {
  std::string name;
  std::string meaning;
  std::string library;     // empty: cab
  Isa isa = Isa::kAuto;    // if this is cab
  PeerSetup setup = {};    // if this is a peer
  Differences small = {};  // from brute force, with kVerifiedCharacters, over all scenes and frames
  bool ours() const { return library.empty(); }
};

// A contestant with a world. `run` is measured; sorted_pairs gives the pairs of the last run.
class Runner {
 public:
  Runner(const Contestant& contestant, const scenes::Crowd& crowd) {
    const scenes::CrowdGroup& group = crowd.groups.front();
    leaves_ = static_cast<std::uint32_t>(group.figure.leaves.size());
    if (contestant.ours()) {
      session_ = std::make_unique<CrowdSession>(crowd, contestant.isa, 1);
      policies_.strategy = Strategy::kAuto;
    } else {
      frame_ = contestant.setup.make(group.figure, group.count);
    }
  }

  // Processor seconds from poses to pairs.
  double run(const std::vector<scenes::PosedGroup>& posed) {
    const double start = processor_seconds();
    if (session_) {
      session_->run(posed, policies_);
    } else {
      pairs_.clear();
      frame_(posed.front(), pairs_);
    }
    return processor_seconds() - start;
  }

  // The pairs of the last frame, sorted. A link of these figures has one leaf, so a hit of cab is a pair of leaves.
  Pairs sorted_pairs() const {
    Pairs pairs = pairs_;
    if (session_)
      for (const Hit& hit : session_->hits())
        pairs.push_back(ordered_pair(hit.instance_a * leaves_ + hit.leaf_a, hit.instance_b * leaves_ + hit.leaf_b));
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

 private:
  std::uint32_t leaves_ = 0;
  std::unique_ptr<CrowdSession> session_;
  Policies policies_;
  PeerFrame frame_;
  Pairs pairs_;
};

// A library that is not in this build. It has no set-ups.
[[maybe_unused]] Peer missing(const char* name, const char* package) { return {name, package, "", {}}; }

std::vector<Peer> all_peers() {
  std::vector<Peer> peers = {fcl_peer()};
#ifdef CAB_WITH_BULLET
  peers.push_back(bullet_peer());
#else
  peers.push_back(missing("bullet", "libbullet-dev"));
#endif
#ifdef CAB_WITH_EMBREE
  peers.push_back(embree_peer());
#else
  peers.push_back(missing("embree", "libembree-dev"));
#endif
#ifdef CAB_WITH_ODE
  peers.push_back(ode_peer());
#else
  peers.push_back(missing("ode", "libode-dev"));
#endif
  return peers;
}

// The peers that the options name, or all.
std::vector<Peer> choose_peers(const PeersOptions& options) {
  std::vector<Peer> peers = all_peers(), chosen;
  if (options.peers.empty()) return peers;
  for (const std::string& name : options.peers) {
    const auto peer = std::find_if(peers.begin(), peers.end(), [&](const Peer& p) { return name == p.name; });
    if (peer == peers.end())
      throw UsageError("--peers: '" + name + "' is not a library of peers; choose fcl, bullet, embree, ode");
    if (peer->version.empty())
      throw UsageError("--peers: this build lacks " + name + "; install " + peer->package + " and build again");
    if (std::count(options.peers.begin(), options.peers.end(), name) > 1)
      throw UsageError("--peers: " + name + " is given twice; give each library once");
    chosen.push_back(*peer);
  }
  return chosen;
}

std::vector<Contestant> make_contestants(const PeersOptions& options, const std::vector<Peer>& peers) {
  std::vector<Contestant> contestants;
  const auto add_ours = [&](Isa isa, const std::string& meaning) {
    Contestant ours{std::string("cab ") + to_string(isa), meaning, ""};
    ours.isa = isa;
    contestants.push_back(ours);
  };
  const Isa isa = CrowdSession({}, options.isa, 1).isa();
  add_ours(isa, "this engine");
  if (isa != Isa::kScalar) add_ours(Isa::kScalar, "this engine without SIMD, the same algorithm");
  for (const Peer& peer : peers)
    for (const PeerSetup& setup : peer.setups) {
      Contestant other{std::string(peer.name) + ' ' + setup.name, setup.meaning, peer.name};
      other.setup = setup;
      contestants.push_back(other);
    }
  return contestants;
}

// ------------------------------------------------------------------------------------------------------- the runs

struct Row {
  Differences differences;      // from the pairs of cab, in the last of the frames
  std::vector<double> seconds;  // per frame, of each round; empty: not run
};

struct Run {
  std::string scene;
  std::uint32_t character_count = 0;
  std::vector<Row> rows;  // of each contestant
  // The time of a row over that of cab, round by round.
  Spread ratio(std::size_t row) const {
    std::vector<double> ratios;
    for (std::size_t r = 0; r < rows[row].seconds.size(); ++r)
      ratios.push_back(rows[row].seconds[r] / rows[0].seconds[r]);
    return spread_of(ratios);
  }
};

// The fastest, by the medians of their times, of the contestants that were run and for which which(contestant) holds;
// the number of contestants if there is none.
template <class Which>
std::size_t fastest(const Run& run, const std::vector<Contestant>& contestants, Which&& which) {
  std::size_t best = contestants.size();
  double least = 0;
  for (std::size_t c = 0; c < contestants.size(); ++c) {
    if (run.rows[c].seconds.empty() || !which(contestants[c])) continue;
    const double seconds = median(run.rows[c].seconds);
    if (best == contestants.size() || seconds < least) {
      best = c;
      least = seconds;
    }
  }
  return best;
}

// Marks cab and, of each library, the fastest set-up of all and the fastest that works alone.
std::vector<bool> best_of_each(const Run& run, const std::vector<Contestant>& contestants) {
  std::vector<bool> best;
  for (std::size_t c = 0; c < contestants.size(); ++c) {
    const auto same = [&](const Contestant& other) { return other.library == contestants[c].library; };
    const auto same_alone = [&](const Contestant& other) { return same(other) && other.setup.alone; };
    best.push_back(contestants[c].ours() || fastest(run, contestants, same) == c ||
                   fastest(run, contestants, same_alone) == c);
  }
  return best;
}

std::vector<std::vector<scenes::PosedGroup>> pose_frames(const scenes::Crowd& crowd) {
  std::vector<std::vector<scenes::PosedGroup>> frames(kFrameCount);
  for (std::uint32_t f = 0; f < kFrameCount; ++f) scenes::pose_crowd(crowd, f / kFramesPerSecond, frames[f]);
  return frames;
}

// Compares every set-up with brute force, in frames that follow each other, so that trees are updated too.
void verify(const std::string& scene, std::vector<Contestant>& contestants) {
  const scenes::Crowd crowd = scenes::make_crowd(scene, kVerifiedCharacters);
  std::vector<Runner> runners;
  for (const Contestant& contestant : contestants) runners.emplace_back(contestant, crowd);
  const auto frames = pose_frames(crowd);
  for (const std::uint32_t f : kFrameOrder) {
    const JudgedCrowd judge(crowd.groups.front().figure, frames[f].front());
    const Pairs expected = judge.overlapping_pairs();
    for (std::size_t c = 0; c < runners.size(); ++c) {
      runners[c].run(frames[f]);
      add_differences(judge, runners[c].sorted_pairs(), expected, contestants[c].small, nullptr);
    }
  }
}

// Runs the chosen contestants in turns. chosen: which contestants run; the first always does.
Run measure(const PeersOptions& options, const std::string& scene, std::uint32_t count,
            const std::vector<Contestant>& contestants, const std::vector<bool>& chosen) {
  Run run;
  run.scene = scene;
  run.character_count = count;
  run.rows.resize(contestants.size());
  std::uint32_t rounds = options.rounds;
  if (count > kFullRoundCharacters) {
    const std::uint64_t fewer = std::uint64_t{rounds} * kFullRoundCharacters / count;
    rounds = std::min(rounds, std::max(kLeastRounds, static_cast<std::uint32_t>(fewer)));
  }
  const scenes::Crowd crowd = scenes::make_crowd(scene, count);
  const auto frames = pose_frames(crowd);
  std::vector<std::pair<std::size_t, Runner>> runners;  // with their contestants' numbers
  for (std::size_t c = 0; c < contestants.size(); ++c)
    if (chosen[c]) runners.emplace_back(c, Runner(contestants[c], crowd));
  ProgressBar bar(scene + " " + std::to_string(count), (std::uint64_t{rounds} + 1) * runners.size());

  // Every contestant first runs all frames once. This builds its world and makes room for the most pairs. The pairs of
  // the last of these frames are compared, when each world has been updated.
  {
    const JudgedCrowd judge(crowd.groups.front().figure, frames.back().front());
    Pairs ours;
    for (auto& [c, runner] : runners) {
      for (const auto& frame : frames) runner.run(frame);
      const Pairs pairs = runner.sorted_pairs();
      if (c == 0) ours = pairs;
      add_differences(judge, pairs, ours, run.rows[c].differences, &run.rows[0].differences);
      bar.advance(1);
    }
  }

  constexpr std::uint32_t kTurn = 1 + kMeasuredFrames;
  for (std::uint32_t r = 0; r < rounds; ++r)
    for (auto& [c, runner] : runners) {
      double seconds = 0;
      for (std::uint32_t k = 0; k < kTurn; ++k) {
        const double frame = runner.run(frames[kFrameOrder[(kFrameCount + r * kTurn + k) % std::size(kFrameOrder)]]);
        if (k > 0) seconds += frame;
      }
      run.rows[c].seconds.push_back(seconds / kMeasuredFrames);
      bar.advance(1);
    }
  return run;
}

// ----------------------------------------------------------------------------------------------------- the output

std::string versions(const std::vector<Peer>& peers, bool built) {
  std::string text;
  for (const Peer& peer : peers)
    if (peer.version.empty() != built)
      text += (text.empty() ? "" : ", ") + std::string(peer.name) + ' ' +
              (built ? peer.version : std::string("(") + peer.package + ")");
  return text;
}

void add_counts(std::vector<std::string>& cells, const Differences& d) {
  for (const std::uint64_t count : {d.pairs, d.misses, d.false_positives, d.threshold})
    cells.push_back(std::to_string(count));
}

void print_verification(const PeersOptions& options, const std::vector<Contestant>& contestants) {
  std::cout << "beside brute force in double, " << kVerifiedCharacters << " characters, " << std::size(kFrameOrder)
            << " frames of";
  for (const std::string& scene : options.scenes) std::cout << ' ' << scene;
  std::cout << ":\n";
  TextTable table;
  table.add_row({"", "pairs", "misses", "false positives", "at threshold"});
  for (const Contestant& contestant : contestants) {
    std::vector<std::string> cells = {contestant.name};
    add_counts(cells, contestant.small);
    table.add_row(std::move(cells));
  }
  table.print(std::cout);
}

// The fastest set-up of any peer, or the fastest that works alone. Set-ups that miss pairs or add pairs do not count.
// If no set-up is left, returns the number of contestants.
std::size_t best_peer(const Run& run, const std::vector<Contestant>& contestants, bool alone) {
  return fastest(run, contestants, [&](const Contestant& c) {
    const Differences& d = run.rows[static_cast<std::size_t>(&c - contestants.data())].differences;
    return !c.ours() && (c.setup.alone || !alone) && d.misses == 0 && d.false_positives == 0;
  });
}

void print_run(const Run& run, const std::vector<Contestant>& contestants) {
  std::cout << '\n'
            << run.scene << ", " << run.character_count << " characters, " << run.rows.front().seconds.size()
            << " rounds; processor ms per frame, and as a multiple of ours:\n";
  TextTable table;
  table.add_row({"", "alone", "median", "least", "most", "ratio", "least", "most", "pairs", "misses", "false positives",
                 "at threshold"});
  std::string left_out;
  for (std::size_t c = 0; c < contestants.size(); ++c) {
    if (run.rows[c].seconds.empty()) {
      left_out += (left_out.empty() ? "" : ", ") + contestants[c].name;
      continue;
    }
    const Spread time = spread_of(run.rows[c].seconds), ratio = run.ratio(c);
    std::vector<std::string> cells = {contestants[c].name, contestants[c].setup.alone ? "yes" : ""};
    for (const double value : {time.median, time.least, time.most}) cells.push_back(fixed(1e3 * value, 3));
    for (const double value : {ratio.median, ratio.least, ratio.most}) cells.push_back(fixed(value, 1));
    add_counts(cells, run.rows[c].differences);
    table.add_row(std::move(cells));
  }
  table.print(std::cout);
  if (!left_out.empty()) std::cout << "not run, slower with fewer characters: " << left_out << '\n';
  for (const bool alone : {true, false})
    if (const std::size_t c = best_peer(run, contestants, alone); c < contestants.size())
      std::cout << (alone ? "best peer alone: " : "best peer of all: ") << contestants[c].name << ", "
                << fixed(run.ratio(c).median, 1) << " times ours\n";
}

void add_counts(Json& json, const Differences& d) {
  json["pairs"] = d.pairs;
  json["misses"] = d.misses;
  json["false_positives"] = d.false_positives;
  json["threshold_pairs"] = d.threshold;
}

// The figures of one set-up in one run; the CSV file has one line each, with the same keys.
Json row_json(const Run& run, const Contestant& contestant, std::size_t c) {
  Json row;
  row["scene"] = run.scene;
  row["characters"] = run.character_count;
  row["setup"] = contestant.name;
  row["alone"] = contestant.setup.alone;
  row["rounds"] = run.rows[c].seconds.size();
  const auto add_spread = [&row](const std::string& key, const Spread& s) {
    row[key + "_median"] = s.median;
    row[key + "_least"] = s.least;
    row[key + "_most"] = s.most;
  };
  add_spread("seconds", spread_of(run.rows[c].seconds));
  add_spread("ratio", run.ratio(c));
  add_counts(row, run.rows[c].differences);
  return row;
}

void check(const PeersOptions& options) {
  for (const std::string& scene : options.scenes)
    if (scenes::find_scene(scenes::kPeersCommand, scene) == nullptr)
      throw UsageError("--scene: '" + scene + "' is not for peers; choose " +
                       scenes::scene_names(scenes::kPeersCommand, ", "));
  for (const std::uint32_t count : options.character_counts)
    if (count == 0 || count > 1000000)
      throw UsageError("--characters: " + std::to_string(count) + " is not within 1 to 1000000");
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, {});
}

}  // namespace

int peers_command(const PeersOptions& options) {
  check(options);
  const std::vector<Peer> peers = choose_peers(options);
  std::vector<Contestant> contestants = make_contestants(options, peers);
  std::cout << "libraries: " << versions(peers, true) << '\n';
  if (const std::string missing = versions(peers, false); !missing.empty())
    std::cout << "not in this build, since their packages were not found when it was configured: " << missing << '\n';
  std::cout << "threads 1; alone: by the library's own bounds and tests; outside: scalar code of ours around it\n";
  for (const Contestant& contestant : contestants)
    std::cout << "  " << contestant.name << ": " << contestant.meaning << '\n';
  std::cout << '\n';

  for (const std::string& scene : options.scenes) verify(scene, contestants);
  print_verification(options, contestants);
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["libraries"] = versions(peers, true);
  json["not_in_this_build"] = versions(peers, false);
  json["verification"] = Json::array();
  for (const Contestant& contestant : contestants) {
    Json row;
    row["setup"] = contestant.name;
    row["alone"] = contestant.setup.alone;
    row["meaning"] = contestant.meaning;
    add_counts(row, contestant.small);
    json["verification"].push_back(row);
  }
  bool right = true;
  const auto judge_ours = [&right](const Differences& d) { right = right && d.misses == 0 && d.false_positives == 0; };
  std::vector<Json> rows;
  for (const std::string& scene : options.scenes) {
    std::vector<bool> best;  // of the last run of the scene
    std::vector<std::uint32_t> counts =
        options.character_counts.empty() ? default_character_counts(scene) : options.character_counts;
    std::sort(counts.begin(), counts.end());
    for (const std::uint32_t count : counts) {
      const bool all = count <= kFullRoundCharacters || best.empty();
      const Run run =
          measure(options, scene, count, contestants, all ? std::vector<bool>(contestants.size(), true) : best);
      best = best_of_each(run, contestants);
      print_run(run, contestants);
      std::cout.flush();
      for (std::size_t c = 0; c < contestants.size(); ++c) {
        if (run.rows[c].seconds.empty()) continue;
        rows.push_back(row_json(run, contestants[c], c));
        if (contestants[c].ours()) judge_ours(run.rows[c].differences);
      }
      for (const bool alone : {true, false})
        if (const std::size_t c = best_peer(run, contestants, alone); c < contestants.size())
          json["best"].push_back({{"scene", scene},
                                  {"characters", count},
                                  {"alone", alone},
                                  {"setup", contestants[c].name},
                                  {"ratio_median", run.ratio(c).median}});
    }
  }
  for (const Contestant& contestant : contestants)
    if (contestant.ours()) judge_ours(contestant.small);
  json["runs"] = rows;
  if (!options.json_path.empty()) write_json(options.json_path, json);
  if (!options.csv_path.empty()) write_csv(options.csv_path, rows);
  if (!right) std::cerr << "cab peers: this engine's own pairs differ from the judge's beyond the threshold\n";
  return right ? 0 : 1;
}

}  // namespace cab::perf
