#include "perf/measure/kernels/options.h"

#include <CLI/CLI.hpp>
#include <memory>

namespace cab::perf {

Command add_kernels(CLI::App& app) {
  auto options = std::make_shared<KernelsOptions>();
  KernelsOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("kernels", "time the merge, the overlap test and the exact test, beside FCL's");
  add_isas(command, o.isas, "all");
  add_rounds(command, o.rounds, "rounds; times are their medians (default 21)");
  return {&command, [options] { return kernels_command(*options); }};
}

}  // namespace cab::perf
