// `cab peers --robot`: states of a robot through cab, FCL and MuJoCo, in turns, and beside the triangles of its meshes.
#include "perf/measure/peers/robots.h"

#include <cab/cab.h>
#include <cab/collision_checker.h>
#include <cab/version.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "perf/base/processor_time.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/measure/peers/robot_judge.h"
#include "perf/measure/peers/robot_setup.h"
#include "perf/tools/robot/choose_matrix.h"
#include "scenes/robot/adjacency.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/pieces.h"
#include "scenes/robot/surface.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// Of so many states at first, so many pairs that cab's shapes leave out are judged: whose boxes touch, and as many
// others. With so many states every set-up warms up.
constexpr std::size_t kSampledStates = 4096, kSampledPairs = 5000, kWarmUp = 1000;

RobotPairs choose_pairs(const RobotCommandOptions& options, const scenes::Robot& robot) {
  scenes::DisabledPairs disabled;
  if (!options.srdf_path.empty())
    disabled = scenes::read_disabled_pairs(options.srdf_path, robot, options.import.sandbox);
  for (const std::vector<std::string>& notes : {robot.notes, disabled.notes})
    for (const std::string& note : notes) tell("note", note);
  scenes::RobotSessionOptions session;
  session.policies.exact = Exact::kConvex;
  RobotPairs pairs;
  for (const scenes::DisabledPair& pair : choose_matrix(options, robot, disabled.pairs, session).masked)
    pairs.masked.push_back(pair.links);
  const std::vector<bool> shaped = scenes::shaped_links(robot);
  for (std::uint32_t a = 0; a < shaped.size(); ++a)
    for (std::uint32_t b = a + 1; b < shaped.size(); ++b) {
      const auto is_pair = [&](const LinkPair& pair) { return pair.a == a && pair.b == b; };
      if (shaped[a] && shaped[b] && std::none_of(pairs.masked.begin(), pairs.masked.end(), is_pair))
        pairs.tested.push_back({a, b});
    }
  return pairs;
}

void require(Status status) {
  if (status != Status::kOk) throw std::runtime_error(std::string("the robot: ") + to_string(status));
}

// One robot in cab, on one thread.
class Checker {
 public:
  Checker(const scenes::Robot& robot, const RobotPairs& pairs, Isa isa, Exact exact)
      : variables_(robot.variables.size()), kinematics_(robot), checker_(EngineDesc{isa, 1}) {
    require(checker_.status());
    const scenes::ArticulationStorage storage(robot.body);
    ArticulationDesc desc = storage.desc();
    desc.ignored_pairs = pairs.masked;
    require(checker_.set_robot(desc, kinematics_.desc()));
    checker_.world().job().policies.exact = exact;
  }

  // Whether links touch. A state is done at its first touching pair.
  void check(Span<const double> states, Span<std::uint8_t> touching) {
    answers_.resize(touching.size);
    require(checker_.check(states, answers_));
    for (std::size_t s = 0; s < touching.size; ++s) touching[s] = answers_[s] != StateAnswer::kFree;
  }

  // Finds all pairs of links that touch, and calls on_hit(state, hit).
  template <class OnHit>
  void find_hits(Span<const double> states, OnHit&& on_hit) {
    const std::size_t step = checker_.chunk() * variables_;
    for (std::size_t at = 0; at < states.size; at += step) {
      const Span<const double> chunk = {states.data + at, std::min(step, states.size - at)};
      require(checker_.find_hits(chunk, static_cast<std::uint32_t>(chunk.size / variables_)));
      for (const Hit& hit : checker_.world().hits()) on_hit(at / variables_ + hit.instance_a, hit);
    }
  }

  // The poses of one state: 7 numbers per link.
  std::vector<float> poses(const double* state) const {
    std::vector<float> poses(kinematics_.pose_floats());
    kinematics_.write_poses({state, variables_}, poses);
    return poses;
  }

  Isa isa() const { return engine_isa(checker_.world().engine()); }

 private:
  std::size_t variables_;
  scenes::Kinematics kinematics_;
  CollisionChecker checker_;
  std::vector<StateAnswer> answers_;
};

// Who answers. What shapes of --also miss is no fault of the engine's.
enum class RobotLibrary : std::uint8_t { kOurs, kOther };

// A set-up, and what was found of it.
struct RobotRow {
  RobotSetup setup;
  RobotLibrary library;
  bool by_surface = false;           // it tests triangles, which have no inside
  std::vector<double> seconds = {};  // per state, of each round
  std::uint64_t touching = 0, false_positives = 0, misses = 0, inside = 0;

  // Counts an answer beside the truth.
  void count(bool answer, RobotTouch truth) {
    touching += answer;
    false_positives += answer && truth == RobotTouch::kApart;
    const bool is_missed = !answer && truth != RobotTouch::kApart;
    if (by_surface && truth == RobotTouch::kInside)
      inside += is_missed;
    else
      misses += is_missed;
  }
};

class RobotRun {
 public:
  // also: the same robot with other shapes, or null.
  RobotRun(const RobotCommandOptions& options, Isa isa, const scenes::Robot& robot, const RobotPairs& pairs,
           const scenes::Robot* also)
      : options_(options),
        robot_(robot),
        pairs_(pairs),
        triangles_(import_triangles(options.file, options.import)),
        judge_(robot, triangles_) {
    const auto add = [&](const std::string& name, const std::string& meaning, const scenes::Robot& of, Isa on,
                         Exact exact) {
      const auto checker = std::make_shared<Checker>(of, pairs, on, exact);
      const auto check = [checker](auto states, auto touching) { checker->check(states, touching); };
      rows_.push_back({{name, meaning, check}, RobotLibrary::kOurs, exact == Exact::kSurface});
      return checker;
    };
    const auto add_all_pairs = [&](const std::string& name, const std::shared_ptr<Checker>& checker, Exact exact) {
      const auto find = [checker](Span<const double> states, Span<std::uint8_t> touching) {
        std::fill_n(touching.data, touching.size, std::uint8_t{0});
        checker->find_hits(states, [&](std::size_t state, const Hit&) { touching[state] = 1; });
      };
      rows_.push_back({{name + ", all pairs", "the same, and all pairs of links that touch", find},
                       RobotLibrary::kOurs,
                       exact == Exact::kSurface});
    };
    const auto add_ours = [&](const std::string& name, const std::string& meaning, Isa on, Exact exact) {
      return add(name, meaning, robot, on, exact);
    };
    boxes_ = add_ours("cab boxes", "boxes about shapes, exact = none", isa, Exact::kNone);
    shapes_ = add_ours("cab shapes", "hulls of meshes, and all other shapes, exact = convex", isa, Exact::kConvex);
    add_all_pairs("cab shapes", shapes_, Exact::kConvex);
    if (shapes_->isa() != Isa::kScalar)
      add_ours("cab shapes, scalar", "cab shapes without SIMD", Isa::kScalar, Exact::kConvex);
    const bool has_meshes =
        std::any_of(triangles_.begin(), triangles_.end(), [](const auto& corners) { return !corners.empty(); });
    if (has_meshes && options_.import.leaves_per_link > 1) {
      scenes::Robot pieces = robot;
      cut_meshes(pieces, triangles_, options_.import.leaves_per_link);
      const std::string meaning = std::to_string(pieces.body.leaves.size()) + " shapes, meshes cut into hulls";
      add_all_pairs("cab pieces", add("cab pieces", meaning, pieces, isa, Exact::kConvex), Exact::kConvex);
    }
    if (has_meshes) {
      scenes::Robot surface = robot;
      take_surfaces(surface, triangles_);
      const auto checker = add("cab surface", "triangles of meshes, and all other shapes, exact = surface", surface,
                               isa, Exact::kSurface);
      add_all_pairs("cab surface", checker, Exact::kSurface);
    }
    if (also) {
      add("cab also", std::to_string(also->body.leaves.size()) + " shapes of --also", *also, isa, Exact::kConvex);
      rows_.back().library = RobotLibrary::kOther;
    }
    if (has_meshes) rows_.push_back({fcl_setup(robot, pairs, triangles_), RobotLibrary::kOther, true});
#ifdef CAB_WITH_MUJOCO
    try {
      for (RobotSetup& setup : mujoco_setups(robot, pairs)) rows_.push_back({std::move(setup), RobotLibrary::kOther});
    } catch (const std::runtime_error& error) {
      tell("note", std::string("mujoco refuses the robot: ") + error.what());
    }
#endif
  }

  // Runs all set-ups in turns, each round on other states.
  void run(std::uint64_t rounds) {
    const std::uint64_t count = options_.random_count;
    rounds = std::min(rounds, count);
    std::vector<double> states = states_of(0, std::min<std::uint64_t>(count, kSampledStates));
    judge_left_out(states);
    states.resize(std::min(states.size(), kWarmUp * robot_.variables.size()));
    std::vector<std::uint8_t> touching(states.size() / robot_.variables.size());
    for (RobotRow& row : rows_) row.setup.check(states, touching);
    ProgressBar bar("states", count);
    for (std::uint64_t r = 0; r < rounds; ++r) {
      const std::uint64_t begin = count * r / rounds, end = count * (r + 1) / rounds;
      run_round(states_of(begin, end), end - begin);
      bar.advance(end - begin);
    }
  }

  // Whether cab's shapes and surfaces miss nothing.
  bool right() const {
    return lost_ + lost_states_ == 0 && std::none_of(rows_.begin(), rows_.end(), [](const RobotRow& row) {
             return row.library == RobotLibrary::kOurs && row.misses > 0;
           });
  }

  // Prints the head, and the meanings of the set-ups.
  void print_head() const {
    std::cout << robot_.body.name << ": " << options_.random_count << " states, " << pairs_.tested.size()
              << " tested pairs of links; threads 1, ISA " << to_string(shapes_->isa()) << '\n';
    for (const RobotRow& row : rows_) std::cout << "  " << row.setup.name << ": " << row.setup.meaning << '\n';
  }

  // Prints the table, and returns it.
  Json print_table() const {
    const auto count = static_cast<double>(options_.random_count);
    const auto share = [&](std::uint64_t states) { return fixed(100 * static_cast<double>(states) / count, 2) + " %"; };
    Json json = {{"robot", robot_.body.name},
                 {"tested_pairs", pairs_.tested.size()},
                 {"states", options_.random_count},
                 {"seed", options_.seed},
                 {"isa", to_string(shapes_->isa())},
                 {"states_in_collision", judged_ + inside_},
                 {"states_inside_alone", inside_},
                 {"left_out_pairs", near_ + far_},
                 {"left_out_pairs_that_touch", lost_},
                 {"states_of_fcl_alone", claims_},
                 {"states_of_fcl_alone_that_touch", lost_states_},
                 {"cab_version", CAB_VERSION_STRING},
                 {"runs", Json::array()}};
#ifdef CAB_WITH_MUJOCO
    json["mujoco_version"] = mujoco_version();
#endif
    TextTable table;
    table.add_row({"", "us per state", "least", "most", "in collision", "false positives", "share", "misses"});
    for (const RobotRow& row : rows_) {
      const Spread time = spread_of(row.seconds);
      table.add_row({row.setup.name, fixed(1e6 * time.median, 3), fixed(1e6 * time.least, 3), fixed(1e6 * time.most, 3),
                     share(row.touching), std::to_string(row.false_positives),
                     fixed(100 * static_cast<double>(row.false_positives) /
                               static_cast<double>(std::max<std::uint64_t>(row.touching, 1)),
                           2) +
                         " %",
                     std::to_string(row.misses)});
      Json run = {{"setup", row.setup.name},
                  {"states_in_collision", row.touching},
                  {"false_positives", row.false_positives},
                  {"misses", row.misses}};
      if (row.by_surface) run["misses_inside"] = row.inside;
      add_spread(run, "seconds", time);
      json["runs"].push_back(std::move(run));
    }
    table.add_row({"judge", fixed(1e6 * judge_seconds_ / count, 3), "", "", share(judged_ + inside_), "", "", ""});
    std::cout << '\n';
    table.print(std::cout);
    if (inside_ > 0)
      std::cout << "states of them in which a shape is inside a mesh and no triangles touch: " << inside_ << '\n';
    std::cout << "pairs of links that cab's shapes leave out, judged: " << near_ << " whose boxes touch, " << far_
              << " others; of these touch: " << lost_ << '\n'
              << "states that FCL alone finds: " << claims_ << "; of these touch: " << lost_states_ << '\n';
    return json;
  }

 private:
  std::vector<double> states_of(std::uint64_t begin, std::uint64_t end) const {
    const std::size_t variables = robot_.variables.size();
    std::vector<double> states((end - begin) * variables);
    for (std::uint64_t s = begin; s < end; ++s)
      scenes::random_state(robot_, options_.seed, s, states.data() + (s - begin) * variables);
    return states;
  }

  RobotTouch touch(const std::vector<double>& states, std::size_t state, std::uint32_t link_a,
                   std::uint32_t link_b) const {
    return judge_.touch(shapes_->poses(states.data() + state * robot_.variables.size()), link_a, link_b);
  }

  void run_round(const std::vector<double>& states, std::size_t count) {
    std::vector<RobotTouch> truth(count, RobotTouch::kApart);
    std::vector<std::uint8_t> touching(count);
    double start = processor_seconds();
    // Hulls hold their meshes, so the pairs that cab's shapes leave out are apart; judge_left_out checks that.
    shapes_->find_hits(states, [&](std::size_t state, const Hit& hit) {
      if (truth[state] != RobotTouch::kSurface)
        truth[state] = std::max(truth[state], touch(states, state, hit.link_a, hit.link_b));
    });
    judge_seconds_ += processor_seconds() - start;
    std::vector<std::vector<std::uint8_t>> answers;
    for (RobotRow& row : rows_) {
      start = processor_seconds();
      row.setup.check(states, touching);
      row.seconds.push_back((processor_seconds() - start) / static_cast<double>(count));
      answers.push_back(touching);
      if (row.library == RobotLibrary::kOther && row.by_surface) judge_claims(states, touching, truth);
    }
    judged_ += static_cast<std::uint64_t>(std::count(truth.begin(), truth.end(), RobotTouch::kSurface));
    inside_ += static_cast<std::uint64_t>(std::count(truth.begin(), truth.end(), RobotTouch::kInside));
    for (std::size_t r = 0; r < rows_.size(); ++r)
      for (std::size_t s = 0; s < count; ++s) rows_[r].count(answers[r][s] != 0, truth[s]);
  }

  // Judges all pairs of the states in which a rival's triangles touch and no pair of cab's shapes does by the judge, so
  // that what cab loses is not called the rival's error.
  void judge_claims(const std::vector<double>& states, const std::vector<std::uint8_t>& claimed,
                    std::vector<RobotTouch>& truth) {
    const double start = processor_seconds();
    for (std::size_t s = 0; s < truth.size(); ++s) {
      if (claimed[s] == 0 || truth[s] != RobotTouch::kApart) continue;
      ++claims_;
      for (const LinkPair& pair : pairs_.tested) truth[s] = std::max(truth[s], touch(states, s, pair.a, pair.b));
      lost_states_ += truth[s] != RobotTouch::kApart;
    }
    judge_seconds_ += processor_seconds() - start;
  }

  void judge_left_out(const std::vector<double>& states) {
    std::array<std::set<std::tuple<std::size_t, std::uint32_t, std::uint32_t>>, 2> found;
    for (const bool exact : {false, true})
      (exact ? shapes_ : boxes_)->find_hits(states, [&](std::size_t state, const Hit& hit) {
        found[exact].insert({state, hit.link_a, hit.link_b});
      });
    for (std::size_t s = 0; s < states.size() / robot_.variables.size(); ++s)
      for (const LinkPair& pair : pairs_.tested) {
        if (found[1].count({s, pair.a, pair.b}) != 0) continue;
        std::size_t& sampled = found[0].count({s, pair.a, pair.b}) != 0 ? near_ : far_;
        if (sampled == kSampledPairs) continue;
        ++sampled;
        lost_ += touch(states, s, pair.a, pair.b) != RobotTouch::kApart;
      }
  }

  const RobotCommandOptions& options_;
  const scenes::Robot& robot_;
  const RobotPairs& pairs_;
  const scenes::LeafTriangles triangles_;
  RobotJudge judge_;
  std::shared_ptr<Checker> boxes_, shapes_;
  std::vector<RobotRow> rows_;
  std::uint64_t judged_ = 0;        // states in collision by surfaces
  std::uint64_t inside_ = 0;        // others, in which something is inside a mesh
  std::size_t near_ = 0, far_ = 0;  // judged pairs that cab's shapes leave out
  std::size_t lost_ = 0;            // of these, how many touch
  std::size_t claims_ = 0;          // states that FCL alone finds, judged in full
  std::size_t lost_states_ = 0;     // of these, how many touch
  double judge_seconds_ = 0;
};

// The same robot in another file.
scenes::Robot import_also(const std::string& file, const scenes::RobotOptions& import, const scenes::Robot& robot) {
  scenes::Robot also = scenes::import_robot(file, import);
  const auto same = [](const scenes::RobotVariable& a, const scenes::RobotVariable& b) { return a.name == b.name; };
  if (also.body.link_names != robot.body.link_names || also.body.link_parents != robot.body.link_parents ||
      !std::equal(also.variables.begin(), also.variables.end(), robot.variables.begin(), robot.variables.end(), same))
    throw std::runtime_error(file + ": has other links or joints than the robot");
  return also;
}

}  // namespace

int robots_command(const PeersOptions& options) {
  const RobotCommandOptions& o = options.robot;
  check_outputs({{"--json", options.json_path}}, {o.file, o.srdf_path, options.also},
                [&o](const std::string& file) { return scenes::companion_files(file, o.import); });
  OutputFile json(options.json_path);
  scenes::RobotOptions whole = o.import;
  whole.leaves_per_link = 1;
  const scenes::Robot robot = scenes::import_robot(o.file, whole);
  if (robot.variables.empty()) throw std::runtime_error("no joint of the robot moves: it has one state alone");
  const RobotPairs pairs = choose_pairs(o, robot);
  std::optional<scenes::Robot> also;
  if (!options.also.empty()) also = import_also(options.also, whole, robot);
  RobotRun run(o, options.isa, robot, pairs, also ? &*also : nullptr);
  run.print_head();
  run.run(options.rounds);
  write_json(json, run.print_table());
  if (!run.right()) std::cerr << "cab peers: shapes of this engine miss what touches by the judge\n";
  return run.right() ? 0 : 1;
}

}  // namespace cab::perf
