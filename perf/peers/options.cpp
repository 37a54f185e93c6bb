#include "perf/peers/options.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "perf/base/option_values.h"
#include "scenes/scene_list.h"

namespace cab::perf {

Command add_peers(CLI::App& app) {
  auto options = std::make_shared<PeersOptions>();
  PeersOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("peers", "the same crowds through other libraries, verified, and timed in turns");
  command
      .add_option_function<std::string>(
          "--scene", [&o](const std::string& text) { o.scenes = split_commas(text); },
          "crowds, separated by commas (default uniform,jitter)")
      ->type_name(scenes::scene_names(scenes::kPeersCommand, "|"));
  command
      .add_option_function<std::string>(
          "--characters",
          [&o](const std::string& text) { o.character_counts = read_number_list("--characters", text); },
          "numbers of characters, separated by commas (default 1000,10000, and 100000 of uniform)")
      ->type_name("LIST");
  add_rounds(command, o.rounds,
             "rounds, in each of which every set-up has one turn; times are their medians (default 9). Beyond 10000"
             " characters: fewer rounds, at least 3, of the best set-ups of each library");
  command
      .add_option_function<std::string>(
          "--peers", [&o](const std::string& text) { o.peers = split_commas(text); },
          "libraries, separated by commas, of fcl, bullet, embree, ode (default: all in this build)")
      ->type_name("LIST");
  add_isa(command, o.isa);
  add_json(command, o.json_path, "write the tables as JSON");
  add_csv(command, o.csv_path, "write the tables as CSV");
  return {&command, [options] { return peers_command(*options); }};
}

}  // namespace cab::perf
