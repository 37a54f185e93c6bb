#include "perf/judge/verify/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <memory>

#include "perf/base/option_values.h"
#include "perf/judge/verify/parts.h"

namespace cab::perf {

Command add_verify(CLI::App& app) {
  auto options = std::make_shared<VerifyOptions>();
  VerifyOptions& o = *options;
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  CLI::App& command = *app.add_subcommand(
      "verify",
      "verify merges, overlap tests, hierarchies, frames, exact tests and depths, queries and motions against judges");
  add_read(command, "--minutes", "N", o.minutes, "how long to run (default 1); a round that has begun is finished",
           read_positive);
  CLI::Option* rounds = add_number(command, "--rounds", o.rounds,
                                   "run this many rounds instead; the counts follow from it and the seed", 0, kMost)
                            ->excludes("--minutes");
  std::vector<std::string> names;
  for (const VerifyPart& part : verify_parts()) names.push_back(part.name);
  command
      .add_option_function<std::vector<std::string>>(
          "--part",
          [&o, names](const std::vector<std::string>& given) {
            for (const std::string& name : given)
              if (std::find(names.begin(), names.end(), name) == names.end())
                reject("--part", name, joined(names, ", ", " or "));
            o.parts = given;
          },
          "only this part: " + joined(names, ", ", " or ") + "; give it again for another (default: all)")
      ->type_name("NAME");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_number(command, "--seed", o.seed, "seed of all inputs (default 1)", 0, kMost)->type_name("S");
  CLI::Option* resume =
      add_path(command, "--resume", o.resume_path, "file that keeps the state; the run goes on from it if it exists")
          ->type_name("FILE");
  add_number(command, "--round", o.round, "run round K alone, to replay a violation", 0, kMost)
      ->type_name("K")
      ->excludes("--minutes")
      ->excludes(rounds)
      ->excludes(resume);
  add_json(command, o.json_path, "write all counts as JSON, one row per regime and method");
  return {&command, [options] { return verify_command(*options); }};
}

}  // namespace cab::perf
