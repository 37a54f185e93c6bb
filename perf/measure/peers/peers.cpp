// `cab peers`: the same crowds through other libraries, each set-up verified and timed in turns with the engine.
#include <cab/cab.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/processor_time.h"
#include "perf/base/report.h"
#include "perf/base/statistics.h"
#include "perf/base/usage.h"
#include "perf/measure/peers/all_peers.h"
#include "perf/measure/peers/crowd_leaves.h"
#include "perf/measure/peers/judge.h"
#include "perf/measure/peers/options.h"
#include "perf/measure/peers/past.h"
#include "perf/measure/peers/peer.h"
#include "perf/measure/peers/queries.h"
#include "perf/measure/peers/robots.h"
#include "perf/measure/peers/surfaces.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// In a turn a set-up runs one frame that is not measured, since the turn before filled the caches with other data, and
// then these.
constexpr std::uint32_t kMeasuredFrames = 2;

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

// ------------------------------------------------------------------------------------------------- the contestants

// A set-up of a peer, or cab on one instruction set, without a world.
struct Contestant {
  std::string name;
  std::string meaning;
  std::string library;         // empty: cab
  Isa isa = Isa::kAuto;        // if this is cab
  Exact exact = Exact::kNone;  // likewise
  PeerSetup setup = {};        // if this is a peer
  Differences small = {};      // from brute force, with kVerifiedCharacters, over all scenes and frames
  bool ours() const { return library.empty(); }
};

// A contestant with a world. `run` is measured; sorted_pairs gives the pairs of the last run.
class Runner {
 public:
  Runner(const Contestant& contestant, const scenes::Crowd& crowd) : leaves_(crowd) {
    if (contestant.ours()) {
      session_ = std::make_unique<CrowdSession>(crowd, contestant.isa, 1);
      policies_.exact = contestant.exact;
    } else {
      frame_ = contestant.setup.make(crowd);
    }
  }

  // Processor seconds from poses to pairs.
  double run(const std::vector<scenes::PosedGroup>& posed) {
    const double start = processor_seconds();
    if (session_) {
      session_->run(posed, policies_);
    } else {
      pairs_.clear();
      frame_(posed, pairs_);
    }
    return processor_seconds() - start;
  }

  // The pairs of the last frame, sorted. A link of these figures has one leaf, so a hit of cab is a pair of leaves.
  Pairs sorted_pairs() const {
    Pairs pairs = pairs_;
    if (session_)
      for (const Hit& hit : session_->hits())
        pairs.push_back(ordered_pair(leaves_.number_of(hit.batch_a.value - 1, hit.instance_a, hit.leaf_a),
                                     leaves_.number_of(hit.batch_b.value - 1, hit.instance_b, hit.leaf_b)));
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  }

 private:
  CrowdLeaves leaves_;
  std::unique_ptr<CrowdSession> session_;
  Policies policies_;
  PeerFrame frame_;
  Pairs pairs_;
};

// The shape of a leaf: a capsule where its box is round about z and longer along it, else the ellipsoid that touches
// all faces of its box.
scenes::ShapePart shape_in(const Box& box) {
  scenes::ShapePart part;
  std::copy_n(box.center, 3, part.shape.position);
  const float(&half)[3] = box.half;
  if (half[0] == half[1] && half[0] < half[2]) {
    part.shape.kind = ShapeKind::kCapsule;
    part.shape.size[0] = half[0];
    part.shape.size[1] = half[2] - half[0];
  } else {
    part.shape.kind = ShapeKind::kEllipsoid;
    std::copy_n(half, 3, part.shape.size);
  }
  return part;
}

// The crowd of a scene. Of shapes, each leaf has one.
scenes::Crowd make_crowd(const std::string& scene, std::uint32_t count, Leaves leaves) {
  scenes::Crowd crowd = scenes::make_crowd(scene, count);
  if (leaves == Leaves::kBoxes) return crowd;
  for (scenes::CrowdGroup& group : crowd.groups)
    for (scenes::BodyLeaf& leaf : group.figure.leaves) leaf.parts.push_back(shape_in(leaf.box));
  return crowd;
}

// Cab first, then the set-ups of each library for such leaves.
std::vector<Contestant> make_contestants(const PeersOptions& options, const std::vector<Peer>& peers, Leaves leaves) {
  std::vector<Contestant> contestants;
  const auto add_ours = [&](Isa isa, Exact exact, const std::string& meaning) {
    const std::string by = exact == Exact::kNone ? "" : exact == Exact::kFcl ? "fcl " : "convex ";
    Contestant ours{"cab " + by + to_string(isa), meaning, ""};
    ours.isa = isa;
    ours.exact = exact;
    contestants.push_back(ours);
  };
  const Isa isa = CrowdSession({}, options.isa, 1).isa();
  const Exact exact = leaves == Leaves::kBoxes ? Exact::kNone : Exact::kConvex;
  const std::string how = leaves == Leaves::kBoxes ? "" : ", exact = convex";
  add_ours(isa, exact, "this engine" + how);
  if (isa != Isa::kScalar) add_ours(Isa::kScalar, exact, "this engine without SIMD, the same algorithm" + how);
  if (leaves == Leaves::kShapes) add_ours(isa, Exact::kFcl, "this engine, exact = fcl");
  for (const Peer& peer : peers)
    for (const PeerSetup& setup : peer.setups) {
      if (setup.leaves != leaves) continue;
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

struct RunPlan {
  std::string scene;
  Leaves leaves;
  std::uint32_t character_count;
  std::uint32_t rounds;  // fewer are run of large crowds
};

struct Run {
  RunPlan plan;
  std::vector<Row> rows;  // of each contestant
  // The time of a row over that of cab, round by round.
  Spread ratio(std::size_t row) const { return ratio_of(rows[row].seconds, rows[0].seconds); }
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

// Compares every set-up with brute force, in frames that follow each other, so that trees are updated too.
void verify(const std::string& scene, Leaves leaves, std::vector<Contestant>& contestants) {
  const scenes::Crowd crowd = make_crowd(scene, kVerifiedCharacters, leaves);
  std::vector<Runner> runners;
  for (const Contestant& contestant : contestants) runners.emplace_back(contestant, crowd);
  const auto frames = pose_frames(crowd);
  for (const std::uint32_t f : kFrameOrder) {
    const JudgedCrowd judge(crowd, frames[f]);
    const Pairs expected = judge.touching_pairs();
    for (std::size_t c = 0; c < runners.size(); ++c) {
      runners[c].run(frames[f]);
      add_differences(judge, runners[c].sorted_pairs(), expected, contestants[c].small, nullptr);
    }
  }
}

// Runs the chosen contestants in turns. chosen: which contestants run; the first always does.
Run measure(const RunPlan& plan, const std::vector<Contestant>& contestants, const std::vector<bool>& chosen) {
  Run run;
  run.plan = plan;
  run.rows.resize(contestants.size());
  const std::uint32_t count = plan.character_count;
  std::uint32_t rounds = plan.rounds;
  if (count > kFullRoundCharacters) {
    const std::uint64_t fewer = std::uint64_t{rounds} * kFullRoundCharacters / count;
    rounds = std::min(rounds, std::max(kLeastRounds, static_cast<std::uint32_t>(fewer)));
  }
  const scenes::Crowd crowd = make_crowd(plan.scene, count, plan.leaves);
  const auto frames = pose_frames(crowd);
  std::vector<std::pair<std::size_t, Runner>> runners;  // with their contestants' numbers
  for (std::size_t c = 0; c < contestants.size(); ++c)
    if (chosen[c]) runners.emplace_back(c, Runner(contestants[c], crowd));
  ProgressBar bar(plan.scene + " " + std::to_string(count), (std::uint64_t{rounds} + 1) * runners.size());
  bar.begin_long_step();

  // Every contestant first runs all frames once. This builds its world and makes room for the most pairs. The pairs of
  // the last of these frames are compared, when each world has been updated.
  {
    const JudgedCrowd judge(crowd, frames.back());
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

void add_counts(std::vector<std::string>& cells, const Differences& d) {
  for (const std::uint64_t count : {d.pairs, d.misses, d.false_positives, d.threshold})
    cells.push_back(std::to_string(count));
}

// Prints the first misses and false positives of one set-up.
void print_examples(const std::string& name, const Differences& d) {
  for (const std::string& example : d.examples) std::cout << "  " << name << ": " << example << '\n';
}

void print_verification(const PeersOptions& options, Leaves leaves, const std::vector<Contestant>& contestants) {
  std::cout << name_of(leaves) << " beside brute force by a judge, " << kVerifiedCharacters << " characters, "
            << std::size(kFrameOrder) << " frames of";
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
  for (const Contestant& contestant : contestants) print_examples(contestant.name, contestant.small);
  std::cout << '\n';
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
            << run.plan.scene << " by " << name_of(run.plan.leaves) << ", " << run.plan.character_count
            << " characters, " << run.rows.front().seconds.size()
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
  for (std::size_t c = 0; c < contestants.size(); ++c) print_examples(contestants[c].name, run.rows[c].differences);
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
  row["scene"] = run.plan.scene;
  row["leaves"] = name_of(run.plan.leaves);
  row["characters"] = run.plan.character_count;
  row["setup"] = contestant.name;
  row["alone"] = contestant.setup.alone;
  row["rounds"] = run.rows[c].seconds.size();
  add_spread(row, "seconds", spread_of(run.rows[c].seconds));
  add_spread(row, "ratio", run.ratio(c));
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

// Verifies and measures all set-ups for leaves of one sort.
void run_leaves(const PeersOptions& options, const std::vector<Peer>& peers, Leaves leaves, PeerResults& results) {
  const auto judge = [&results](const Contestant& contestant, const Differences& d) {
    if (contestant.ours()) results.right = results.right && d.misses == 0 && d.false_positives == 0;
  };
  std::vector<Contestant> contestants = make_contestants(options, peers, leaves);
  for (const Contestant& contestant : contestants)
    std::cout << "  " << contestant.name << ": " << contestant.meaning << '\n';
  std::cout << '\n';
  for (const std::string& scene : options.scenes) verify(scene, leaves, contestants);
  print_verification(options, leaves, contestants);
  for (const Contestant& contestant : contestants) {
    Json row;
    row["setup"] = contestant.name;
    row["leaves"] = name_of(leaves);
    row["alone"] = contestant.setup.alone;
    row["meaning"] = contestant.meaning;
    add_counts(row, contestant.small);
    results.verification.push_back(row);
    judge(contestant, contestant.small);
  }
  for (const std::string& scene : options.scenes) {
    std::vector<bool> best;  // of the last run of the scene
    std::vector<std::uint32_t> counts =
        options.character_counts.empty() ? default_character_counts(scene) : options.character_counts;
    std::sort(counts.begin(), counts.end());
    for (const std::uint32_t count : counts) {
      const bool all = count <= kFullRoundCharacters || best.empty();
      const Run run = measure({scene, leaves, count, options.rounds}, contestants,
                              all ? std::vector<bool>(contestants.size(), true) : best);
      best = best_of_each(run, contestants);
      print_run(run, contestants);
      std::cout.flush();
      for (std::size_t c = 0; c < contestants.size(); ++c) {
        if (run.rows[c].seconds.empty()) continue;
        results.rows.push_back(row_json(run, contestants[c], c));
        judge(contestants[c], run.rows[c].differences);
      }
      for (const bool alone : {true, false})
        if (const std::size_t c = best_peer(run, contestants, alone); c < contestants.size())
          results.best.push_back({{"scene", scene},
                                  {"leaves", name_of(leaves)},
                                  {"characters", count},
                                  {"alone", alone},
                                  {"setup", contestants[c].name},
                                  {"ratio_median", run.ratio(c).median}});
    }
  }
}

}  // namespace

int peers_command(const PeersOptions& options) {
  if (!options.robot.file.empty()) return robots_command(options);
  if (!options.surfaces.empty()) return surfaces_command(options);
  check(options);
  if (options.past) return past_command(options);
  if (options.queries) return queries_command(options);
  OutputFile json_file(options.json_path), csv_file(options.csv_path);
  const std::vector<Peer> peers = choose_peers(options.peers);
  print_libraries(peers);
  std::cout << "alone: by the library's own bounds and tests; outside: scalar code of ours around it\n";
  PeerResults results;
  for (const Leaves leaves : options.leaves) {
    std::cout << "\nleaves are " << name_of(leaves) << ":\n";
    run_leaves(options, peers, leaves, results);
  }
  return write_results(results, peers, "pairs", json_file, csv_file);
}

}  // namespace cab::perf
