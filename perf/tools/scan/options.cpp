#include "perf/tools/scan/options.h"

#include <CLI/CLI.hpp>

namespace cab::perf {

Command add_scan(CLI::App& app) {
  CLI::App& command =
      *app.add_subcommand("scan", "scan a corpus of clips, robots or recordings into one table, by the Python package");
  // Whatever follows is for the package, --help too.
  command.set_help_flag();
  command.prefix_command();
  return {&command, [&command] { return scan_command({command.remaining()}); }};
}

}  // namespace cab::perf
