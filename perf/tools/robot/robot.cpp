// `cab robot`: which links of a robot touch each other in random or given states of its joints.
#include <cab/cab.h>
#include <cab/padded_leaves.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/replay/recorded_engine.h"
#include "perf/tools/robot/choose_matrix.h"
#include "perf/tools/robot/options.h"
#include "scenes/import/printable.h"
#include "scenes/robot/adjacency.h"
#include "scenes/robot/kinematics.h"
#include "scenes/robot/matrix.h"
#include "scenes/robot/state_file.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The most pairs that the table prints. The JSON file has all.
constexpr std::size_t kPrintedPairs = 20;

// The most states of a recording. Their poses take 100 MB for a robot of 36 links.
constexpr std::uint64_t kMostRecordedStates = 100000;

// A pair of links that touches in some state.
struct TouchingPair {
  std::string link_a, link_b;
  std::uint64_t states = 0;
  std::uint64_t first_state = 0;
};

// The distances of a named pair over all states, in metres. Below 0: how deep the links touch.
struct DistanceRange {
  LinkPair links = {};
  double least = std::numeric_limits<double>::infinity();
  double greatest = -std::numeric_limits<double>::infinity();
  std::uint64_t least_state = 0;
  std::uint64_t greatest_state = 0;
};

struct RobotTotals {
  FrameStats stats;
  std::uint64_t states = 0;
  std::uint64_t colliding_states = 0;
  std::uint64_t hits = 0;
  std::vector<TouchingPair> pairs;  // the most frequent first
  std::vector<DistanceRange> distances;
};

const std::string& name_of(const scenes::Robot& robot, std::uint32_t link) { return robot.body.link_names[link]; }

// The links of the robot, and after them those of each body that stands around.
struct Links {
  const scenes::Robot& robot;
  Span<const scenes::Robot> around;
  std::vector<std::uint32_t> begin;  // of each body around

  Links(const scenes::Robot& of, Span<const scenes::Robot> bodies) : robot(of), around(bodies) {
    auto next = static_cast<std::uint32_t>(of.links.size());
    for (const scenes::Robot& body : bodies) {
      begin.push_back(next);
      next += static_cast<std::uint32_t>(body.links.size());
    }
    begin.push_back(next);
  }
  std::size_t count() const { return begin.back(); }
  std::uint32_t second_of(const Hit& hit, std::int32_t body) const {
    return hit.link_b + (body < 0 ? 0 : begin[static_cast<std::size_t>(body)]);
  }
  // Of a body around: the body's name and the link's.
  std::string name(std::uint32_t link) const {
    if (link < robot.links.size()) return name_of(robot, link);
    const auto body = static_cast<std::size_t>(std::upper_bound(begin.begin(), begin.end(), link) - begin.begin()) - 1;
    return around[body].body.name + "/" + name_of(around[body], link - begin[body]);
  }
};

// The link of a name that an option gives. It must have a shape.
std::uint32_t find_link(const scenes::Robot& robot, const std::string& option, const std::string& name) {
  const std::vector<std::string>& names = robot.body.link_names;
  const auto found = std::find(names.begin(), names.end(), name);
  const auto link = static_cast<std::uint32_t>(found - names.begin());
  if (found == names.end()) throw UsageError(option + ": the robot has no link '" + name + "'");
  if (!scenes::shaped_links(robot)[link]) throw UsageError(option + ": the link '" + name + "' has no shape");
  return link;
}

std::vector<LinkPair> named_pairs(const scenes::Robot& robot, const RobotCommandOptions& options) {
  std::vector<LinkPair> pairs;
  for (const auto& [a, b] : options.distances) {
    const LinkPair pair = {find_link(robot, "--distance", a), find_link(robot, "--distance", b)};
    if (pair.a == pair.b) throw UsageError("--distance: '" + a + "' is named twice; name two links");
    pairs.push_back({std::min(pair.a, pair.b), std::max(pair.a, pair.b)});
  }
  return pairs;
}

// The lengths of --padding by link, or nothing without that option.
std::vector<float> padding_of(const scenes::Robot& robot, const RobotCommandOptions& options) {
  if (options.padding.empty()) return {};
  if (options.around.empty())
    throw UsageError("--padding: it is against what stands around; give that by --around, or --margin for all pairs");
  std::set<std::string> given;
  std::vector<float> lengths(robot.links.size());
  for (const bool named : {false, true})
    for (const auto& [name, metres] : options.padding) {
      if (name.empty() == named) continue;
      if (!given.insert(name).second)
        throw UsageError("--padding: " + (named ? "'" + name + "'" : "a length for all links") + " is given twice");
      if (named)
        lengths[find_link(robot, "--padding", name)] = static_cast<float>(metres);
      else
        lengths.assign(lengths.size(), static_cast<float>(metres));
    }
  return lengths;
}

// Gives the robot the rest state of --rest.
void set_rest(scenes::Robot& robot, const RobotCommandOptions& options) {
  std::set<std::string> given;
  for (const auto& [name, value] : options.rest) {
    const auto same = [&name = name](const auto& named) { return named.name == name; };
    const auto variable = std::find_if(robot.variables.begin(), robot.variables.end(), same);
    if (variable == robot.variables.end()) {
      const bool follows = std::any_of(robot.joints.begin(), robot.joints.end(), same);
      throw UsageError("--rest: " + (follows ? "'" + name +
                                                   "' is no value of its own: it follows another joint, or has "
                                                   "the columns NAME.x, NAME.y and NAME.z"
                                             : "the robot has no joint '" + name + "' that moves"));
    }
    if (!given.insert(name).second) throw UsageError("--rest: '" + name + "' is given twice");
    if (is_beyond_limits(*variable, value))
      robot.notes.push_back("--rest: the value of " + name + " is beyond its limit");
    variable->rest = value;
  }
}

void count_hits(RobotTotals& totals, scenes::RobotSession& session, const Links& links, const scenes::StateChunk& chunk,
                std::vector<std::uint64_t>& states, std::vector<std::uint64_t>& first_states) {
  std::uint32_t last = std::numeric_limits<std::uint32_t>::max();
  for (const Hit& hit : chunk.hits) {
    if (hit.instance_a != last) ++totals.colliding_states;
    last = hit.instance_a;
    ++totals.hits;
    const std::size_t pair = hit.link_a * links.count() + links.second_of(hit, session.around_of(hit));
    if (states[pair]++ == 0) first_states[pair] = chunk.first + hit.instance_a;
  }
}

void add_distances(RobotTotals& totals, const scenes::StateChunk& chunk) {
  for (std::size_t c = 0; c < chunk.contacts.size; ++c) {
    DistanceRange& range = totals.distances[c % totals.distances.size()];
    const std::uint64_t state = chunk.first + c / totals.distances.size();
    const double distance = -static_cast<double>(chunk.contacts.data[c].depth);
    if (distance < range.least) range.least = distance, range.least_state = state;
    if (distance > range.greatest) range.greatest = distance, range.greatest_state = state;
  }
}

void write_hits(std::ostream& out, scenes::RobotSession& session, const Links& links, const scenes::StateChunk& chunk) {
  for (const Hit& hit : chunk.hits)
    out << chunk.first + hit.instance_a << ',' << csv_field(links.name(hit.link_a)) << ','
        << csv_field(links.name(links.second_of(hit, session.around_of(hit)))) << '\n';
}

RobotTotals check_states(scenes::RobotSession& session, const Links& links, const scenes::StateSource& states,
                         const RobotCommandOptions& options, std::ostream* hits) {
  RobotTotals totals;
  totals.states = states.count;
  const std::vector<LinkPair> named = named_pairs(links.robot, options);
  for (const LinkPair& pair : named) totals.distances.push_back({pair});
  const std::size_t rows = links.robot.links.size();
  std::vector<std::uint64_t> touching(rows * links.count()), first_states(touching.size());
  ProgressBar bar("states", states.count);
  totals.stats = session.run(states, named, [&](const scenes::StateChunk& chunk) {
    count_hits(totals, session, links, chunk, touching, first_states);
    add_distances(totals, chunk);
    if (hits != nullptr) write_hits(*hits, session, links, chunk);
    bar.advance(chunk.count);
  });
  for (std::size_t pair = 0; pair < touching.size(); ++pair)
    if (touching[pair] > 0)
      totals.pairs.push_back({links.name(static_cast<std::uint32_t>(pair / links.count())),
                              links.name(static_cast<std::uint32_t>(pair % links.count())), touching[pair],
                              first_states[pair]});
  std::stable_sort(totals.pairs.begin(), totals.pairs.end(),
                   [](const TouchingPair& l, const TouchingPair& r) { return l.states > r.states; });
  return totals;
}

std::size_t count_pairs(const scenes::Robot& robot) {
  const std::size_t shaped = scenes::count_shaped(robot);
  return shaped * (shaped - 1) / 2;
}

std::uint64_t count_reason(const std::vector<scenes::DisabledPair>& matrix, scenes::DisabledReason reason) {
  return static_cast<std::uint64_t>(std::count_if(
      matrix.begin(), matrix.end(), [&](const scenes::DisabledPair& pair) { return pair.reason == reason; }));
}

double share_of(std::uint64_t part, std::uint64_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(whole, 1));
}

std::string percent(std::uint64_t part, std::uint64_t whole) { return fixed(100 * share_of(part, whole), 1) + " %"; }

// What the samples say of a pair that touched in none of them. Two digits, rounded up.
std::string never_text(std::uint32_t samples) {
  if (samples == 0) return {};
  const double bound = 100 * scenes::never_bound(samples);
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(bound)));
  const double unit = std::pow(10, -decimals);
  std::string text = fixed(std::ceil(bound / unit) * unit, std::max(decimals, 0));
  if (text.find('.') != std::string::npos) text.erase(text.find_last_not_of("0.") + 1);
  return "each in at most " + text + " % of states (95 % confidence)";
}

// The pairs that touch at rest and are tested, in one line.
void print_rest_pairs(const scenes::Robot& robot, const scenes::Matrix& matrix) {
  if (matrix.rest_pairs.empty()) return;
  std::vector<std::string> names;
  for (const scenes::RestPair& pair : matrix.rest_pairs)
    names.push_back(name_of(robot, pair.links.a) + " - " + name_of(robot, pair.links.b) +
                    (matrix.samples > 0 ? " (" + percent(pair.touching_samples, matrix.samples) + ")" : ""));
  std::cout << "\npairs that touch at rest, " << (matrix.samples > 0 ? "but in less than 95 % of the samples, " : "")
            << "and are tested: " << names.size() << ": " << scenes::listed(names) << '\n';
}

// The pairs that touch by the robot's build, and in which share of the samples.
void print_always_masked(const scenes::Robot& robot, const scenes::Matrix& matrix) {
  TextTable table;
  table.add_row({"link", "link", "masked", "share of the samples"});
  std::size_t count = 0;
  for (const scenes::DisabledPair& pair : matrix.masked) {
    if (pair.reason != scenes::DisabledReason::kDefault && pair.reason != scenes::DisabledReason::kAlways) continue;
    if (++count > kPrintedPairs) continue;
    table.add_row({name_of(robot, pair.links.a), name_of(robot, pair.links.b), to_string(pair.reason),
                   percent(pair.touching_samples, matrix.samples)});
  }
  if (count == 0) return;
  std::cout << "\npairs that are masked since they touch in at least 95 % of the samples: " << count;
  if (count > kPrintedPairs) std::cout << ", of which " << kPrintedPairs << " follow (--json has all)";
  std::cout << '\n';
  table.print(std::cout);
}

void print_table(const RobotCommandOptions& options, const scenes::Robot& robot, const scenes::RobotSession& session,
                 const scenes::Matrix& matrix, const RobotTotals& totals) {
  const std::vector<scenes::DisabledPair>& masked = matrix.masked;
  TextTable table;
  table.add_row({"robot", robot.body.name});
  table.add_row({"links", std::to_string(robot.links.size())});
  table.add_row({"links with shapes", std::to_string(scenes::count_shaped(robot))});
  table.add_row(
      {options.import.surface ? "leaves of shapes and triangles" : "shapes", std::to_string(robot.body.leaves.size())});
  table.add_row({"shapes left out", std::to_string(robot.left_out.shapes)});
  table.add_row({"joint variables", std::to_string(robot.variables.size())});
  table.add_row({"joints held still", std::to_string(robot.left_out.joints)});
  table.add_row({"guesses", std::to_string(robot.left_out.guesses)});
  table.add_row({"pairs of links", std::to_string(count_pairs(robot))});
  std::string bound, masked_text = "without " + std::to_string(masked.size()) + " masked pairs";
  if (count_reason(masked, scenes::DisabledReason::kNever) > 0) bound = never_text(matrix.samples);
  masked_text.resize(std::max(masked_text.size(), bound.size()), ' ');  // the two begin in one column
  for (std::uint32_t r = 0; r < scenes::kDisabledReasonCount; ++r) {
    const auto reason = static_cast<scenes::DisabledReason>(r);
    const std::uint64_t count = count_reason(masked, reason);
    table.add_row({std::string("masked: ") + to_string(reason), std::to_string(count),
                   reason == scenes::DisabledReason::kNever ? bound : ""});
  }
  table.add_row({"tested pairs", std::to_string(count_pairs(robot) - masked.size())});
  table.add_row({"of them touch at rest", std::to_string(matrix.rest_pairs.size())});
  table.add_row({"states", std::to_string(totals.states)});
  table.add_row({options.around.empty() ? "states in self-collision" : "states in collision",
                 std::to_string(totals.colliding_states), masked_text});
  table.add_row({"hits", std::to_string(totals.hits)});
  table.add_row({"t[total]", fixed(totals.stats.seconds_total, 5) + " s"});
  table.add_row({"exact test", policy_value(options.policies, "exact")});
  table.add_row({"ISA", to_string(session.isa())});
  table.add_row({"threads", std::to_string(session.thread_count())});
  table.print(std::cout);
  print_always_masked(robot, matrix);
  print_rest_pairs(robot, matrix);

  if (!totals.pairs.empty()) {
    std::cout << "\npairs that touch: " << totals.pairs.size();
    if (totals.pairs.size() > kPrintedPairs)
      std::cout << ", of which the " << kPrintedPairs << " most frequent follow (--json has all)";
    std::cout << '\n';
    TextTable pairs;
    pairs.add_row({"link", "link", "states", "share", "first state"});
    for (std::size_t p = 0; p < std::min(totals.pairs.size(), kPrintedPairs); ++p) {
      const TouchingPair& pair = totals.pairs[p];
      pairs.add_row({pair.link_a, pair.link_b, std::to_string(pair.states), percent(pair.states, totals.states),
                     std::to_string(pair.first_state)});
    }
    pairs.print(std::cout);
  }
  if (!totals.distances.empty()) {
    std::cout << "\ndistances in metres, below 0 where the links touch\n";
    TextTable distances;
    distances.add_row({"link", "link", "least", "in state", "greatest", "in state"});
    for (const DistanceRange& range : totals.distances)
      distances.add_row({name_of(robot, range.links.a), name_of(robot, range.links.b), fixed(range.least, 5),
                         std::to_string(range.least_state), fixed(range.greatest, 5),
                         std::to_string(range.greatest_state)});
    distances.print(std::cout);
  }
}

Json variables_json(const scenes::Robot& robot) {
  Json variables = Json::array();
  for (const scenes::RobotVariable& variable : robot.variables)
    variables.push_back(
        {{"name", variable.name}, {"lower", variable.lower}, {"upper", variable.upper}, {"rest", variable.rest}});
  return variables;
}

// Counts of what was masked, left out, held still and guessed.
Json summary_json(const scenes::Robot& robot, const scenes::Matrix& matrix) {
  Json summary;
  for (std::uint32_t r = 0; r < scenes::kDisabledReasonCount; ++r) {
    const auto reason = static_cast<scenes::DisabledReason>(r);
    summary["masked"][to_string(reason)] = count_reason(matrix.masked, reason);
  }
  if (matrix.samples > 0) summary["never_at_most"] = scenes::never_bound(matrix.samples);
  summary["tested_pairs"] = count_pairs(robot) - matrix.masked.size();
  summary["touch_at_rest_and_tested"] = matrix.rest_pairs.size();
  summary["shapes_left_out"] = robot.left_out.shapes;
  summary["joints_held_still"] = robot.left_out.joints;
  summary["guesses"] = robot.left_out.guesses;
  return summary;
}

Json to_json(const RobotCommandOptions& options, const scenes::Robot& robot, const scenes::RobotSession& session,
             const scenes::Matrix& matrix, const RobotTotals& totals) {
  const auto pair_json = [&](const LinkPair& pair) {
    return Json{{"link_a", name_of(robot, pair.a)}, {"link_b", name_of(robot, pair.b)}};
  };
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["file"] = options.file;
  json["robot"] = robot.body.name;
  json["links"] = robot.body.link_names;
  json[options.import.surface ? "leaf_count" : "shape_count"] = robot.body.leaves.size();
  json["variables"] = variables_json(robot);
  json["pair_count"] = count_pairs(robot);
  json["samples"] = options.srdf_path.empty() ? options.samples : 0;
  json["seed"] = options.seed;
  json["masked"] = Json::array();
  for (const scenes::DisabledPair& pair : matrix.masked) {
    json["masked"].push_back(pair_json(pair.links));
    Json& entry = json["masked"].back();
    entry["reason"] = to_string(pair.reason);
    if (pair.reason >= scenes::DisabledReason::kDefault)  // what samples mask
      entry["share"] = share_of(pair.touching_samples, matrix.samples);
  }
  json["touch_at_rest_and_tested"] = Json::array();
  for (const scenes::RestPair& pair : matrix.rest_pairs) {
    json["touch_at_rest_and_tested"].push_back(pair_json(pair.links));
    if (matrix.samples > 0)
      json["touch_at_rest_and_tested"].back()["share"] = share_of(pair.touching_samples, matrix.samples);
  }
  json["summary"] = summary_json(robot, matrix);
  for (std::uint32_t f = 0; f < policy_table().size; ++f)
    json["policies"][policy_table()[f].name] = policy_table()[f].values[policy_get(options.policies, f)].name;
  json["states"] = totals.states;
  json[options.around.empty() ? "states_in_self_collision" : "states_in_collision"] = totals.colliding_states;
  json["hits"] = totals.hits;
  json["box_tests"] = totals.stats.box_tests;
  json["exact_tests"] = totals.stats.exact_tests;
  json["pairs"] = Json::array();
  for (const TouchingPair& pair : totals.pairs) {
    json["pairs"].push_back(
        {{"link_a", pair.link_a}, {"link_b", pair.link_b}, {"states", pair.states}, {"first_state", pair.first_state}});
  }
  json["distances"] = Json::array();
  for (const DistanceRange& range : totals.distances) {
    json["distances"].push_back(pair_json(range.links));
    Json& entry = json["distances"].back();
    entry["least_metres"] = range.least;
    entry["least_state"] = range.least_state;
    entry["greatest_metres"] = range.greatest;
    entry["greatest_state"] = range.greatest_state;
  }
  json["total_wall_seconds"] = totals.stats.seconds_total;
  json["isa"] = to_string(session.isa());
  json["threads"] = session.thread_count();
  json["notes"] = robot.notes;
  return json;
}

// Writes the checked states as frames. All their poses are in memory. With padding the grown robot is a character of
// its own, which is tested against what stands around.
void write_recording(const RobotCommandOptions& options, const scenes::Robot& robot, std::vector<LinkPair> masked,
                     const scenes::RobotSessionOptions& session, const scenes::StateSource& states) {
  scenes::Scene scene;
  scene.name = robot.body.name;
  scene.frame_count = static_cast<std::uint32_t>(states.count);
  scene.characters.reserve(2 + session.around.size);
  scenes::Character& body = scene.characters.emplace_back(robot.body);
  body.ignored_pairs = std::move(masked);
  const scenes::Kinematics kinematics(robot);
  body.poses.resize(states.count * kinematics.pose_floats());
  std::vector<double> values(states.count * robot.variables.size());
  for (std::uint64_t s = 0; s < states.count; ++s) states.fill(s, values.data() + s * robot.variables.size());
  kinematics.write_poses(values, body.poses, options.isa);
  if (!session.padding.empty()) {
    scenes::Character grown = body;
    const scenes::ArticulationStorage storage(body);
    PaddedLeaves padded;
    if (padded.set(storage.desc().leaves, session.padding) != Status::kOk) throw std::bad_alloc();
    grown.name += ", padded";
    grown.leaves = scenes::copied(padded.leaves());
    grown.ignored_hops = kMaxLinks;
    scene.characters.push_back(std::move(grown));
    for (std::uint32_t b = 0; b < session.around.size; ++b) scene.pairs.push_back({1, 2 + b});
  }
  for (const scenes::Robot& around : session.around) {
    scenes::Character& fixed = scene.characters.emplace_back(around.body);
    const scenes::Kinematics joints(around);
    fixed.poses.resize(joints.pose_floats());
    joints.write_poses(scenes::rest_state(around), fixed.poses, options.isa);
    fixed.is_static = true;
  }
  RecordSettings settings;
  settings.path = options.recording.path;
  settings.title = robot.body.name;
  settings.policies = options.policies;
  settings.margin = session.margin;
  settings.isa = options.isa;
  settings.thread_count = options.thread_count;
  settings.metres_per_unit = 1;
  settings.up = 'z';
  settings.compress = options.recording.compress;
  settings.pose_step = options.recording.pose_step;
  RecordTotals totals;
  {
    ProgressBar bar("recording", states.count);
    totals = record_scene(scene, {0, scene.frame_count}, true, settings, [&bar] { bar.advance(1); });
  }
  if (options.recording.is_aside) return;
  std::cout << "recording: " << scenes::printable(settings.path) << ", " << totals.bytes << " bytes\n";
}

// Whether states have a value beyond a limit.
bool has_beyond(const scenes::Robot& robot, const std::vector<double>& states) {
  for (std::size_t i = 0; i < states.size(); ++i)
    if (is_beyond_limits(robot.variables[i % robot.variables.size()], states[i])) return true;
  return false;
}

// Beyond limits links may touch that touch in no sample.
void test_never(scenes::Matrix& matrix) {
  const auto is_never = [](const scenes::DisabledPair& pair) { return pair.reason == scenes::DisabledReason::kNever; };
  const auto kept = std::remove_if(matrix.masked.begin(), matrix.masked.end(), is_never);
  if (kept == matrix.masked.end()) return;
  tell("note", "pairs that touch in no sample are tested, since states are beyond limits");
  matrix.masked.erase(kept, matrix.masked.end());
}

}  // namespace

int robot_command(const RobotCommandOptions& options) {
  std::vector<std::string> inputs = {options.file};
  for (const std::string& path : {options.srdf_path, options.states_path})
    if (!path.empty()) inputs.push_back(path);
  inputs.insert(inputs.end(), options.around.begin(), options.around.end());
  check_outputs({{"--hits", options.hits_path}, {"--json", options.json_path}, {"--record", options.recording.path}},
                inputs, [&options](const std::string& file) { return scenes::companion_files(file, options.import); });
  OutputFile hits(options.hits_path), json(options.json_path);
  scenes::Robot robot = scenes::import_robot(options.file, options.import);
  named_pairs(robot, options);  // a wrong name ends the command before the work
  const std::vector<float> padding = padding_of(robot, options);
  set_rest(robot, options);
  const std::optional<scenes::SandboxLimits>& sandbox = options.import.sandbox;
  scenes::DisabledPairs disabled;
  if (!options.srdf_path.empty()) disabled = scenes::read_disabled_pairs(options.srdf_path, robot, sandbox);
  scenes::JointStates given;
  if (!options.states_path.empty()) given = scenes::read_joint_states(options.states_path, robot, sandbox);
  for (const std::vector<std::string>* notes : {&disabled.notes, &given.notes})
    robot.notes.insert(robot.notes.end(), notes->begin(), notes->end());
  for (const std::string& note : robot.notes) tell("note", note);
  std::vector<scenes::Robot> around;
  for (const std::string& file : options.around) {
    around.push_back(scenes::import_robot(file, options.import));
    for (const std::string& note : around.back().notes) tell("note", note);
  }

  scenes::StateSource states = {options.random_count, [&](std::uint64_t index, double* state) {
                                  scenes::random_state(robot, options.seed, index, state);
                                }};
  if (!options.states_path.empty())
    states = {given.count, [&](std::uint64_t index, double* state) {
                std::copy_n(given.values.data() + index * robot.variables.size(), robot.variables.size(), state);
              }};
  if (!options.recording.path.empty() && states.count > kMostRecordedStates)
    throw UsageError("--record: " + std::to_string(states.count) + " states are too many; at most " +
                     std::to_string(kMostRecordedStates) + " are recorded");
  if (hits) hits.stream() << "state,link_a,link_b\n";
  scenes::RobotSessionOptions settings = {options.isa, options.thread_count, options.policies, 0, {}, {}};
  scenes::Matrix matrix = choose_matrix(options, robot, disabled.pairs, settings);
  if (has_beyond(robot, given.values)) test_never(matrix);
  std::vector<LinkPair> masked;
  for (const scenes::DisabledPair& pair : matrix.masked) masked.push_back(pair.links);
  settings.margin = static_cast<float>(options.margin);
  settings.around = around;
  settings.padding = padding;
  scenes::RobotSession session(robot, masked, settings);
  const RobotTotals totals =
      check_states(session, Links(robot, around), states, options, hits ? &hits.stream() : nullptr);
  if (hits) hits.close();
  print_table(options, robot, session, matrix, totals);
  if (json) write_json(json, to_json(options, robot, session, matrix, totals));
  if (!options.recording.path.empty()) write_recording(options, robot, std::move(masked), settings, states);
  return 0;
}

}  // namespace cab::perf
