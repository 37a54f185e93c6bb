// The `cab` command: what each sub-command accepts, and how its outcome becomes an exit code (0 success, 1 bad data or
// a failed check, 2 wrong use).
#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "perf/cli/option_values.h"
#include "perf/commands.h"

namespace cab::perf {
namespace {

constexpr int kBadData = 1;
constexpr int kWrongUse = 2;

// More threads than this are a slip of the keyboard.
constexpr std::uint32_t kMaxThreads = 1024;

// A paper run keeps the poses of all its frames: this many take about 800 MB.
constexpr std::uint32_t kMaxPaperFrames = 1000000;

// A crowd of this many takes some 4 GB; a run of this many frames goes on for hours.
constexpr std::uint32_t kMaxCrowd = 4000000;
constexpr std::uint32_t kMaxCrowdFrames = 1000000;

// A sweep keeps the boxes of all its steps: this many take about 1 GB.
constexpr std::uint32_t kMaxSweepSteps = 500000;

void add_isa(CLI::App& command, Isa& isa) {
  command
      .add_option_function<std::string>(
          "--isa", [&isa](const std::string& text) { isa = read_isa("--isa", text); },
          "instruction set (default auto); this machine has " + isa_names(", ", true))
      ->type_name("auto|" + isa_names("|", false));
}

void add_threads(CLI::App& command, std::uint32_t& thread_count) {
  const std::string by_default = thread_count == 0 ? "every core" : std::to_string(thread_count);
  command.add_option("--threads", thread_count, "threads that work (default " + by_default + "); 0: every core")
      ->type_name("N")
      ->check(CLI::Range(0u, kMaxThreads).description(""));
}

constexpr const char* kUpForHeight = "axis for the height check; without it the one along which the figure is tallest";

// One option a row of the table of policies.
void add_policy(CLI::App& command, std::uint32_t field, Policies& policies) {
  const PolicyField& row = policy_table()[field];
  command
      .add_option_function<std::string>(
          std::string("--") + row.name,
          [&policies, field](const std::string& text) { set_policy(policies, field, text); },
          policy_help(policies, field))
      ->type_name(policy_names(field, "|"));
}

// --preset and every policy. CLI11 reads options in the order in which they are added here, so that a preset comes first
// wherever it stands on the command line.
void add_policies(CLI::App& command, Policies& policies) {
  command
      .add_option_function<std::string>(
          "--preset", [&policies](const std::string& text) { set_preset(policies, text); }, preset_help())
      ->type_name(preset_names("|"));
  for (std::uint32_t field = 0; field < policy_table().size; ++field) add_policy(command, field, policies);
}

void add_up(CLI::App& command, char& up, const char* meaning = kUpForHeight) {
  command
      .add_option_function<std::string>(
          "--up",
          [&up](const std::string& text) {
            if (text != "x" && text != "y" && text != "z") throw UsageError("--up: '" + text + "' is not x, y or z");
            up = text[0];
          },
          meaning)
      ->type_name("x|y|z");
}

// For commands that take several files, each of which is a `what`.
void add_units(CLI::App& command, const std::string& what, std::vector<double>& metres_per_unit) {
  command
      .add_option_function<std::vector<std::string>>(
          "--units",
          [&metres_per_unit](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) metres_per_unit.push_back(read_positive("--units", text));
          },
          "a " + what + "'s length unit in metres (default 1); once for all " + what + "s or once a " + what)
      ->type_name("METRES_PER_UNIT")
      ->allow_extra_args(false);
}

void add_json(CLI::App& command, std::string& path, const char* meaning) {
  command.add_option("--json", path, meaning)->type_name("OUT");
}

CLI::App& add_run(CLI::App& app, RunOptions& o) {
  CLI::App& command = *app.add_subcommand("run", "motion files in one world: which links touch in which frame");
  command.add_option("FILE", o.files, "motion files, one character each")->required()->type_name("");
  command
      .add_option_function<std::vector<std::string>>(
          "--offset",
          [&o](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) o.offsets.push_back(read_offset("--offset", text));
          },
          "metres to move a character; give it again for the next file")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false);
  add_units(command, "file", o.metres_per_unit);
  add_up(command, o.up);
  command
      .add_option_function<std::string>(
          "--frames", [&o](const std::string& text) { o.frames = read_frame_range("--frames", text); },
          "only frames A to B - 1, counted from 0")
      ->type_name("A:B");
  add_policies(command, o.policies);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  CLI::Option* self = command.add_flag(
      "--self", o.within, "also test the links of each character against each other, and list which pairs are masked");
  command.add_option("--hops", o.ignored_hops, "mask links that are at most N joints apart")
      ->type_name("N")
      ->check(CLI::Range(1u, kMaxLinks).description(""))
      ->needs(self);
  command.add_option("--rest-frame", o.rest_frame, "mask links whose boxes touch in frame F, counted from 0")
      ->type_name("F")
      ->needs(self);
  command.add_flag("--contacts", o.contacts, "also normal and depth of each hit; needs --exact fcl");
  add_json(command, o.json_path, "write the table as JSON");
  command.add_option("--hits", o.hits_path, "write every hit as CSV")->type_name("OUT.csv");
  return command;
}

CLI::App& add_inspect(CLI::App& app, InspectOptions& o) {
  CLI::App& command =
      *app.add_subcommand("inspect", "one frame of one file: joints, links, leaf boxes, merges, inner boxes, as JSON");
  command.add_option("FILE", o.file, "motion file")->required()->type_name("");
  command.add_option("--frame", o.frame, "frame, counted from 0 (default 0)")->type_name("K");
  add_json(command, o.json_path, "where to write; without it to standard output");
  command
      .add_option_function<std::string>(
          "--offset", [&o](const std::string& text) { o.offset = read_offset("--offset", text); },
          "metres to move the character")
      ->type_name("X,Y,Z");
  command
      .add_option_function<std::string>(
          "--units", [&o](const std::string& text) { o.metres_per_unit = read_positive("--units", text); },
          "the file's length unit in metres (default 1)")
      ->type_name("METRES_PER_UNIT");
  add_up(command, o.up);
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    if (std::string(policy_table()[field].name) == "refit") add_policy(command, field, o.policies);
  add_isa(command, o.isa);
  return command;
}

CLI::App& add_paper(CLI::App& app, PaperOptions& o) {
  CLI::App& command = *app.add_subcommand("paper", "the paper's scenes and tables, ours beside the paper's");
  o.tables = {1, 2, 3, 4, 5};
  command
      .add_option_function<std::string>(
          "--tables", [&o](const std::string& text) { o.tables = read_number_list("--tables", text); },
          "which tables, separated by commas (default 1,2,3,4,5)")
      ->type_name("LIST");
  command
      .add_option("--frames", o.frame_count,
                  "frames a table (default: as many as the paper, 10000, and 4001 of table 5)")
      ->type_name("N")
      ->check(CLI::Range(1u, kMaxPaperFrames).description(""));
  command
      .add_option_function<std::string>(
          "--lanes", [&o](const std::string& text) { o.lanes = read_lanes("--lanes", text); },
          "what the lanes of a SIMD register hold (default frames); same counts"
          "\n  frames: 16 frames of one node\n  pairs: one frame at a time, 16 pairs of boxes")
      ->type_name("frames|pairs");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_json(command, o.json_path, "write the tables as JSON");
  command.add_option("--csv", o.csv_path, "write the tables as CSV")->type_name("OUT.csv");
  return command;
}

// What only the crowd scenes `detailed` and `ropes` have.
void add_detail_and_ropes(CLI::App& command, CrowdOptions& o) {
  command
      .add_option_function<std::string>(
          "--boxes-per-link",
          [&o](const std::string& text) { o.boxes_per_link = read_boxes_per_link("--boxes-per-link", text); },
          "detailed: boxes of each link (default 16)")
      ->type_name(boxes_per_link_names("|"));
  command.add_option("--links", o.rope_links, "ropes: links of each, 2 to 1024 (default 64)")
      ->type_name("N")
      ->check(CLI::Range(scenes::kLeastRopeLinks, kMaxLinks).description(""));
  command
      .add_option_function<std::string>(
          "--shape", [&o](const std::string& text) { o.rope_shape = read_rope_shape("--shape", text); },
          "ropes: how they lie (default straight)")
      ->type_name(rope_shape_names("|"));
  command
      .add_option("--spacing", o.rope_spacing,
                  "ropes: from neighbour to neighbour where they come closest, in thicknesses, .1 to 10; below 1 they"
                  " touch (default 1.5)")
      ->type_name("X")
      ->check(CLI::Range(scenes::kLeastSpacing, scenes::kMostSpacing).description(""));
}

CLI::App& add_crowd(CLI::App& app, CrowdOptions& o) {
  CLI::App& command = *app.add_subcommand("crowd", "many characters at once: times, memory and counts of a frame");
  command
      .add_option_function<std::string>(
          "--scene", [&o](const std::string& text) { o.scene = read_crowd_scene("--scene", text); }, crowd_scene_help())
      ->type_name(crowd_scene_names("|"))
      ->required();
  o.character_count = 10000;
  command.add_option("--characters", o.character_count, "characters at once (default 10000)")
      ->type_name("N")
      ->check(CLI::Range(1u, kMaxCrowd).description(""));
  o.frame_count = 8;
  command.add_option("--frames", o.frame_count, "different frames a round, 1/30 s apart (default 8)")
      ->type_name("F")
      ->check(CLI::Range(1u, kMaxCrowdFrames).description(""));
  o.rounds = 7;
  command.add_option("--rounds", o.rounds, "rounds of which the median is taken, after one for warming up (default 7)")
      ->type_name("R")
      ->check(CLI::Range(1u, 100000u).description(""));
  command.add_option("--clip", o.clips, "motion file that characters play; give it again for more")
      ->type_name("FILE")
      ->allow_extra_args(false);
  add_units(command, "clip", o.metres_per_unit);
  add_up(command, o.up, "axis that points up in the clips; without it the one along which each figure is tallest");
  command.add_option("--trajectories", o.trajectories_path, "where people walk: person, frame, x, y in metres a line")
      ->type_name("FILE");
  add_detail_and_ropes(command, o);
  add_policies(command, o.policies);
  command.add_flag("--in-contact", o.in_contact, "find out only which characters touch anything, and no hits");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_json(command, o.json_path, "write the table as JSON");
  command.add_option("--csv", o.csv_path, "write the table as one line of CSV under a header")->type_name("OUT.csv");
  return command;
}

CLI::App& add_peers(CLI::App& app, PeersOptions& o) {
  CLI::App& command =
      *app.add_subcommand("peers", "crowds through other libraries, verified, timed in turns with ours");
  o.scenes = {"uniform", "jitter"};
  command
      .add_option_function<std::string>(
          "--scene", [&o](const std::string& text) { o.scenes = split_commas(text); },
          "crowds, separated by commas (default uniform,jitter)")
      ->type_name("uniform|jitter");
  command
      .add_option_function<std::string>(
          "--characters",
          [&o](const std::string& text) { o.character_counts = read_number_list("--characters", text); },
          "characters at once, separated by commas (default 1000,10000, and 100000 of uniform)")
      ->type_name("LIST");
  o.rounds = 9;
  command
      .add_option("--rounds", o.rounds,
                  "rounds of which the median is taken, each a turn of every set-up (default 9; beyond 10000 characters"
                  " fewer, but 3, of the best set-ups of each library)")
      ->type_name("R")
      ->check(CLI::Range(1u, 100000u).description(""));
  command
      .add_option_function<std::string>(
          "--peers", [&o](const std::string& text) { o.peers = split_commas(text); },
          "libraries, separated by commas, of fcl, bullet, embree, ode (default: all in this build)")
      ->type_name("LIST");
  add_isa(command, o.isa);
  add_json(command, o.json_path, "write the tables as JSON");
  command.add_option("--csv", o.csv_path, "write the tables as CSV")->type_name("OUT.csv");
  return command;
}

CLI::App& add_sweep(CLI::App& app, SweepOptions& o) {
  CLI::App& command =
      *app.add_subcommand("sweep", "what every policy costs and brings, on many scenes or on one's own files");
  command.add_option("FILE", o.world.files, "motion files, one character each; without them the scenes below")
      ->type_name("");
  command
      .add_option_function<std::vector<std::string>>(
          "--offset",
          [&o](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) o.world.offsets.push_back(read_offset("--offset", text));
          },
          "metres to move a character; give it again for the next file")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false);
  add_units(command, "file", o.world.metres_per_unit);
  add_up(command, o.world.up);
  command
      .add_option_function<std::string>(
          "--scene", [&o](const std::string& text) { o.scenes = read_sweep_scenes("--scene", text); },
          sweep_scene_help())
      ->type_name("LIST");
  command
      .add_option("--characters", o.character_count, "characters of detailed and of rope scenes (default 100 and 16)")
      ->type_name("N")
      ->check(CLI::Range(1u, kMaxCrowd).description(""));
  o.values.resize(policy_table().size);
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    command
        .add_option_function<std::string>(
            std::string("--") + policy_table()[field].name,
            [&o, field](const std::string& text) { o.values[field] = read_policy_values(field, text); },
            policy_list_help(field))
        ->type_name("LIST");
  command
      .add_option_function<std::string>(
          "--isa",
          [&o](const std::string& text) {
            o.isas.clear();
            for (const std::string& name : split_commas(text)) o.isas.push_back(read_isa("--isa", name));
          },
          "instruction sets, separated by commas (default auto); this machine has " + isa_names(", ", true))
      ->type_name("LIST");
  command
      .add_option_function<std::string>(
          "--threads",
          [&o](const std::string& text) {
            o.thread_counts = read_number_list("--threads", text);
            for (const std::uint32_t count : o.thread_counts)
              if (count > kMaxThreads)
                throw UsageError("--threads: " + std::to_string(count) + " is not within 0 to " +
                                 std::to_string(kMaxThreads));
          },
          "threads that work, separated by commas (default 1); 0: every core")
      ->type_name("LIST");
  o.rounds = 7;
  command.add_option("--rounds", o.rounds, "rounds of which the median is taken, every cell in turns (default 7)")
      ->type_name("R")
      ->check(CLI::Range(1u, 100000u).description(""));
  add_json(command, o.json_path, "write a row a cell as JSON");
  command.add_option("--csv", o.csv_path, "write a row a cell as CSV")->type_name("OUT.csv");
  command
      .add_option(
          "--plot", o.plot_folder,
          "draw pictures as SVG into a folder (needs gnuplot); without FILE and --scene also strategies by number"
          " of boxes and times by size of the crowd")
      ->type_name("DIR");
  return command;
}

CLI::App& add_kernels(CLI::App& app, KernelsOptions& o) {
  CLI::App& command = *app.add_subcommand("kernels", "times of the merge and the overlap test beside FCL's");
  command
      .add_option_function<std::string>(
          "--isa",
          [&o](const std::string& text) {
            for (const std::string& name : split_commas(text)) read_isa("--isa", name);
            o.isas = text;
          },
          "instruction sets, separated by commas; without it all of this machine: " + isa_names(", ", true))
      ->type_name("LIST");
  o.rounds = 21;
  command.add_option("--rounds", o.rounds, "rounds of which the median is taken (default 21)")
      ->type_name("N")
      ->check(CLI::Range(1u, 100000u).description(""));
  return command;
}

CLI::App& add_continuity(CLI::App& app, ContinuityOptions& o) {
  CLI::App& command =
      *app.add_subcommand("continuity", "how far inner boxes jump when a pose moves a little, by refit and extents");
  command
      .add_option("--steps", o.step_count,
                  "steps of each figure through its range (default 20000); more steps, less motion in each")
      ->type_name("N")
      ->check(CLI::Range(1u, kMaxSweepSteps).description(""));
  add_isa(command, o.isa);
  add_json(command, o.json_path, "write the figures as JSON");
  command.add_option("--csv", o.csv_path, "write the figures as CSV")->type_name("OUT.csv");
  return command;
}

CLI::App& add_verify(CLI::App& app, VerifyOptions& o) {
  CLI::App& command = *app.add_subcommand(
      "verify", "long, seeded verification of merges, overlap tests, hierarchies and frames by exact judges");
  command
      .add_option_function<std::string>(
          "--minutes", [&o](const std::string& text) { o.minutes = read_positive("--minutes", text); },
          "how long to run (default 1); a round that was begun is finished")
      ->type_name("N");
  CLI::Option* rounds =
      command.add_option("--rounds", o.rounds, "run this many rounds instead; the counts follow from it and the seed")
          ->type_name("N")
          ->excludes("--minutes");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  command.add_option("--seed", o.seed, "of all inputs (default 1)")->type_name("S");
  CLI::Option* resume =
      command.add_option("--resume", o.resume_path, "file to go on from where it exists, and to write the state to")
          ->type_name("FILE");
  command.add_option("--round", o.round, "run round K alone, to replay a violation")
      ->type_name("K")
      ->excludes("--minutes")
      ->excludes(rounds)
      ->excludes(resume);
  add_json(command, o.json_path, "write all counts, a row a regime and method, as JSON");
  return command;
}

// Text of an error as one line.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

std::string joined(const std::vector<std::string>& words, const std::string& between, const std::string& before_last) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i)
    out += (i == 0 ? "" : i + 1 == words.size() ? before_last : between) + words[i];
  return out;
}

int wrong_use(const CLI::App& app, const std::string& what) {
  std::string name = "cab", usage = "cab " + joined(names_of_commands(app), "|", "|") + " [OPTION...]";
  if (const auto given = app.get_subcommands(); !given.empty()) {
    name += " " + given.front()->get_name();
    const std::string command = given.front()->get_name();
    const bool many = command == "run", file = many || command == "inspect";
    usage = name + (file ? " FILE" : "") + (many || command == "sweep" ? " [FILE...]" : "") + " [OPTION...]";
  }
  std::cerr << name << ": " << one_line(what) << "\nusage: " << usage << "; `" << name
            << " --help` lists the options\n";
  return kWrongUse;
}

int main_command(int argc, char** argv) {
  CLI::App app("cab: which links of articulated characters touch", "cab");
  app.set_version_flag("--version", "cab " CAB_VERSION_STRING);
  app.require_subcommand(0, 1);  // none is told apart below, with the names to choose from
  app.get_formatter()->column_width(38);

  RunOptions run_options;
  InspectOptions inspect_options;
  PaperOptions paper_options;
  CrowdOptions crowd_options;
  PeersOptions peers_options;
  SweepOptions sweep_options;
  KernelsOptions kernels_options;
  ContinuityOptions continuity_options;
  VerifyOptions verify_options;
  const CLI::App& run = add_run(app, run_options);
  const CLI::App& inspect = add_inspect(app, inspect_options);
  const CLI::App& paper = add_paper(app, paper_options);
  const CLI::App& crowd = add_crowd(app, crowd_options);
  const CLI::App& peers = add_peers(app, peers_options);
  const CLI::App& sweep = add_sweep(app, sweep_options);
  const CLI::App& kernels = add_kernels(app, kernels_options);
  const CLI::App& continuity = add_continuity(app, continuity_options);
  const CLI::App& verify = add_verify(app, verify_options);
  try {
    app.parse(argc, argv);
    if (run.parsed()) return run_command(run_options);
    if (inspect.parsed()) return inspect_command(inspect_options);
    if (paper.parsed()) return paper_command(paper_options);
    if (crowd.parsed()) return crowd_command(crowd_options);
    if (peers.parsed()) return peers_command(peers_options);
    if (sweep.parsed()) return sweep_command(sweep_options);
    if (kernels.parsed()) return kernels_command(kernels_options);
    if (continuity.parsed()) return continuity_command(continuity_options);
    if (verify.parsed()) return verify_command(verify_options);
  } catch (const CLI::Success& help) { return app.exit(help); } catch (const CLI::ParseError& error) {
    return wrong_use(app, error.what());
  } catch (const UsageError& error) { return wrong_use(app, error.what()); } catch (const std::exception& error) {
    std::cerr << "cab: " << one_line(error.what()) << '\n';
    return kBadData;
  }
  return wrong_use(app, "no sub-command; choose " + joined(names_of_commands(app), ", ", " or "));
}

}  // namespace
}  // namespace cab::perf

int main(int argc, char** argv) {
  const int exit_code = cab::perf::main_command(argc, argv);
  if (!std::cout.flush()) {
    std::cerr << "cab: cannot write to standard output\n";
    return cab::perf::kBadData;
  }
  return exit_code;
}
