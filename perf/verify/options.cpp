#include "perf/verify/options.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "perf/base/option_values.h"

namespace cab::perf {

Command add_verify(CLI::App& app) {
  auto options = std::make_shared<VerifyOptions>();
  VerifyOptions& o = *options;
  CLI::App& command = *app.add_subcommand(
      "verify", "long, seeded verification of merges, overlap tests, hierarchies and frames by exact judges");
  command
      .add_option_function<std::string>(
          "--minutes", [&o](const std::string& text) { o.minutes = read_positive("--minutes", text); },
          "how long to run (default 1); a round that has begun is finished")
      ->type_name("N");
  CLI::Option* rounds =
      command.add_option("--rounds", o.rounds, "run this many rounds instead; the counts follow from it and the seed")
          ->type_name("N")
          ->excludes("--minutes");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  command.add_option("--seed", o.seed, "seed of all inputs (default 1)")->type_name("S");
  CLI::Option* resume =
      command.add_option("--resume", o.resume_path, "file that keeps the state; the run goes on from it if it exists")
          ->type_name("FILE");
  command.add_option("--round", o.round, "run round K alone, to replay a violation")
      ->type_name("K")
      ->excludes("--minutes")
      ->excludes(rounds)
      ->excludes(resume);
  add_json(command, o.json_path, "write all counts as JSON, one row per regime and method");
  return {&command, [options] { return verify_command(*options); }};
}

}  // namespace cab::perf
