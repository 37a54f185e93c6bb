#include "perf/continuity/options.h"

#include <CLI/CLI.hpp>
#include <memory>

namespace cab::perf {
namespace {

// A run keeps the boxes of all its steps: this many take about 1 GB.
constexpr std::uint32_t kMaxSteps = 500000;

}  // namespace

Command add_continuity(CLI::App& app) {
  auto options = std::make_shared<ContinuityOptions>();
  ContinuityOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("continuity", "how far inner boxes jump when a pose moves a little, by refit and extents");
  add_number(command, "--steps", o.step_count,
             "steps of each figure through its range (default 20000); more steps, less motion in each", 1, kMaxSteps);
  add_isa(command, o.isa);
  add_json(command, o.json_path, "write the figures as JSON");
  add_csv(command, o.csv_path, "write the figures as CSV");
  return {&command, [options] { return continuity_command(*options); }};
}

}  // namespace cab::perf
