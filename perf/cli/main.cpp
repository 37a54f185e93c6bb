// The `cab` command: its sub-commands, and how their outcome becomes an exit code (0 success, 1 bad data or a failed
// check, 2 wrong use).
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "perf/base/option_values.h"
#include "perf/base/options.h"
#include "perf/base/out_of_memory.h"
#include "perf/base/signals.h"
#include "perf/base/usage.h"
#include "perf/judge/verify/options.h"
#include "perf/measure/crowd/options.h"
#include "perf/measure/kernels/options.h"
#include "perf/measure/paper/options.h"
#include "perf/measure/peers/options.h"
#include "perf/measure/sweep/options.h"
#include "perf/tools/query/options.h"
#include "perf/tools/replay/options.h"
#include "perf/tools/report/options.h"
#include "perf/tools/robot/options.h"
#include "perf/tools/run/options.h"
#include "perf/tools/scan/options.h"
#include "perf/view/options.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

constexpr int kBadData = 1;
constexpr int kWrongUse = 2;

// Every command, in the order and the groups of `cab --help`.
using AddCommand = Command (*)(CLI::App& app);
constexpr AddCommand kYourMotion[] = {add_run,    add_inspect, add_robot, add_query, add_scan,
                                      add_record, add_replay,  add_view,  add_report};
constexpr AddCommand kAboutCab[] = {add_crowd, add_paper, add_peers, add_sweep, add_kernels, add_verify};

// The text of an error as one line, which may have names of files and words of the command line.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return scenes::printable(text);
}

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

// How many letters of a word must be changed, added, left out or swapped with the next to get another word (optimal
// string alignment distance).
std::size_t distance(const std::string& a, const std::string& b) {
  // rows[i][j]: of the first i letters of a and the first j of b
  std::vector<std::vector<std::size_t>> rows(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        rows[i][j] = i + j;
        continue;
      }
      const std::size_t changed = rows[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      rows[i][j] = std::min({changed, rows[i - 1][j] + 1, rows[i][j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        rows[i][j] = std::min(rows[i][j], rows[i - 2][j - 2] + 1);
    }
  return rows[a.size()][b.size()];
}

// "; did you mean X?" with the name that is nearest to a word, or nothing if all are far.
std::string suggestion(const std::string& word, const std::vector<std::string>& names) {
  constexpr std::size_t kFar = 3;
  std::string nearest;
  std::size_t least = std::min(kFar, word.size());
  for (const std::string& name : names) {
    const std::size_t found = word.size() > 2 * name.size() ? kFar : distance(word, name);
    if (found >= least) continue;
    least = found;
    nearest = name;
  }
  return nearest.empty() ? nearest : "; did you mean " + nearest + "?";
}

// What is wrong with words that no command or option takes.
std::string unexpected(const CLI::App& app, const std::string& first_word, const std::string& what) {
  const auto given = app.get_subcommands();
  if (given.empty() && first_word.rfind("-", 0) == 0) return what;
  if (given.empty()) {
    const std::string nearest = suggestion(first_word, names_of_commands(app));
    return "there is no command '" + scenes::printable(first_word) + "'" +
           (nearest.empty() ? "; choose " + joined(names_of_commands(app), ", ", " or ") : nearest);
  }
  std::vector<std::string> options;
  for (const CLI::Option* option : given.front()->get_options()) options.push_back(option->get_name());
  for (const std::string& word : app.remaining(true))
    if (word.rfind("--", 0) == 0) return what + suggestion(word.substr(0, word.find('=')), options);
  return what;
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
  const auto add = [&](AddCommand add_command, const char* group) {
    commands.push_back(add_command(app));
    commands.back().app->group(group);
  };
  for (const AddCommand add_command : kYourMotion) add(add_command, "Your motion");
  for (const AddCommand add_command : kAboutCab) add(add_command, "About cab");
  try {
    app.parse(argc, argv);
    for (const Command& command : commands)
      if (command.app->parsed()) return command.run();
  } catch (const CLI::Success& help) { return app.exit(help); } catch (const CLI::ExtrasError& error) {
    return wrong_use(app, unexpected(app, argv[1], error.what()));
  } catch (const CLI::ParseError& error) { return wrong_use(app, error.what()); } catch (const UsageError& error) {
    return wrong_use(app, error.what());
  } catch (const std::ios_base::failure&) {
    throw;  // of standard output: main says so
  } catch (const std::bad_alloc&) {
    std::cerr << "cab: " << out_of_memory() << '\n';
    return kBadData;
  } catch (const std::exception& error) {
    std::cerr << "cab: " << one_line(error.what()) << '\n';
    return kBadData;
  }
  return wrong_use(app, "no sub-command; choose " + joined(names_of_commands(app), ", ", " or "));
}

}  // namespace
}  // namespace cab::perf

int main(int argc, char** argv) {
  cab::perf::clean_up_at_signals();
  std::cout.exceptions(std::ios::badbit);  // so that errno is that of the write that failed
  try {
    const int exit_code = cab::perf::main_command(argc, argv);
    std::cout.flush();
    return exit_code;
  } catch (const std::ios_base::failure&) {
    const int reason = errno;
    std::cout.exceptions(std::ios::goodbit);  // it is flushed once more at the end
    std::cerr << "cab: cannot write to standard output: " << std::strerror(reason) << '\n';
    return cab::perf::kBadData;
  }
}
