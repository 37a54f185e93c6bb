// The `cab` command: its sub-commands, and how their outcome becomes an exit code (0 success, 1 bad data or a failed
// check, 2 wrong use).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "perf/base/option_values.h"
#include "perf/base/options.h"
#include "perf/base/usage.h"
#include "perf/continuity/options.h"
#include "perf/crowd/options.h"
#include "perf/kernels/options.h"
#include "perf/paper/options.h"
#include "perf/peers/options.h"
#include "perf/robot/options.h"
#include "perf/run/options.h"
#include "perf/sweep/options.h"
#include "perf/verify/options.h"

namespace cab::perf {
namespace {

constexpr int kBadData = 1;
constexpr int kWrongUse = 2;

// Every command, in the order of `cab --help`.
constexpr Command (*kAddCommand[])(CLI::App& app) = {
    add_run,   add_inspect, add_robot,   add_paper,      add_crowd,
    add_peers, add_sweep,   add_kernels, add_continuity, add_verify,
};

// The text of an error as one line.
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

// The files in a usage line: FILE for a file that the command needs, [FILE...] if it accepts any number of files.
std::string usage_of_files(const CLI::App& command) {
  std::string usage;
  for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string name = option->get_name();
    if (option->get_required()) usage += " " + name;
    if (option->get_items_expected_max() > 1) usage += " [" + name + "...]";
  }
  return usage;
}

int wrong_use(const CLI::App& app, const std::string& what) {
  std::string name = "cab", usage = "cab " + joined(names_of_commands(app), "|");
  if (const auto given = app.get_subcommands(); !given.empty()) {
    name += " " + given.front()->get_name();
    usage = name + usage_of_files(*given.front());
  }
  std::cerr << name << ": " << one_line(what) << "\nusage: " << usage << " [OPTION...]; `" << name
            << " --help` lists the options\n";
  return kWrongUse;
}

int main_command(int argc, char** argv) {
  CLI::App app("cab: which links of articulated characters touch", "cab");
  app.set_version_flag("--version", "cab " CAB_VERSION_STRING);
  app.require_subcommand(0, 1);  // a missing command is reported below, with the names to choose from
  app.get_formatter()->column_width(38);
  std::vector<Command> commands;
  for (const auto add_command : kAddCommand) commands.push_back(add_command(app));
  try {
    app.parse(argc, argv);
    for (const Command& command : commands)
      if (command.app->parsed()) return command.run();
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
