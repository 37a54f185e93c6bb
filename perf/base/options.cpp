#include "perf/base/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>

#include "perf/base/option_values.h"
#include "scenes/import/import.h"

namespace cab::perf {
namespace {

// The most rounds of a measurement. They take days.
constexpr std::uint32_t kMaxRounds = 100000;

}  // namespace

void add_isa(CLI::App& command, Isa& isa) {
  command
      .add_option_function<std::string>(
          "--isa", [&isa](const std::string& text) { isa = read_isa("--isa", text); },
          "instruction set (default auto); this machine has " + isa_names(", ", true))
      ->type_name("auto|" + isa_names("|", false));
}

void add_isas(CLI::App& command, std::vector<Isa>& isas, const std::string& by_default) {
  command
      .add_option_function<std::string>(
          "--isa",
          [&isas](const std::string& text) {
            isas.clear();
            for (const std::string& name : split_commas(text)) isas.push_back(read_isa("--isa", name));
          },
          "instruction sets, separated by commas (default " + by_default + "); this machine has " +
              isa_names(", ", true))
      ->type_name("LIST");
}

void add_threads(CLI::App& command, std::uint32_t& thread_count) {
  const std::string by_default = thread_count == 0 ? "every core" : std::to_string(thread_count);
  add_number(command, "--threads", thread_count, "number of threads (default " + by_default + "); 0: every core", 0,
             kMaxThreads);
}

void add_policy(CLI::App& command, std::uint32_t field, Policies& policies) {
  const PolicyField& row = policy_table()[field];
  command
      .add_option_function<std::string>(
          std::string("--") + row.name,
          [&policies, field](const std::string& text) { set_policy(policies, field, text); },
          policy_help(policies, field))
      ->type_name(policy_names(field, "|"));
}

void add_policies(CLI::App& command, Policies& policies) {
  command
      .add_option_function<std::string>(
          "--preset", [&policies](const std::string& text) { set_preset(policies, text); }, preset_help())
      ->type_name(preset_names("|"));
  for (std::uint32_t field = 0; field < policy_table().size; ++field) add_policy(command, field, policies);
}

void add_up(CLI::App& command, char& up, const std::string& meaning) {
  command
      .add_option_function<std::string>(
          "--up",
          [&up](const std::string& text) {
            if (text != "x" && text != "y" && text != "z") reject("--up", text, "x, y or z");
            up = text[0];
          },
          meaning)
      ->type_name("x|y|z");
}

void add_no_sandbox(CLI::App& command, std::optional<scenes::SandboxLimits>& sandbox) {
  command.add_flag_callback(
      "--no-sandbox", [&sandbox] { sandbox.reset(); },
      "read files in this process, not in a child with limits (to debug a reader)");
}

double read_unit(const std::string& option, const std::string& text) {
  return text == "auto" ? kAutoUnit : read_positive(option, text, kUnitExample);
}

void set_unit(const std::optional<double>& unit, scenes::ImportOptions& import) {
  import.guesses_unit = unit == kAutoUnit;
  import.metres_per_unit = import.guesses_unit ? std::nullopt : unit;
}

void add_units(CLI::App& command, const std::string& what, std::vector<double>& metres_per_unit) {
  command
      .add_option_function<std::vector<std::string>>(
          "--units",
          [&metres_per_unit](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) metres_per_unit.push_back(read_unit("--units", text));
          },
          kUnitMeaning + ("; give it once for all " + what + "s or once per " + what))
      ->type_name("METRES_PER_UNIT")
      ->allow_extra_args(false);
}

void refuse_empty(CLI::Option& option) {
  option.check([](const std::string& text) { return text.empty() ? "'' names no file; give a path" : ""; }, "");
}

CLI::Option* add_path(CLI::App& command, const std::string& option, std::string& path, const std::string& meaning) {
  CLI::Option* added = command.add_option(option, path, meaning);
  refuse_empty(*added);
  return added;
}

void add_json(CLI::App& command, std::string& path, const std::string& meaning) {
  add_path(command, "--json", path, meaning)->type_name("OUT");
}

void add_csv(CLI::App& command, std::string& path, const std::string& meaning) {
  add_path(command, "--csv", path, meaning)->type_name("OUT.csv");
}

void add_rounds(CLI::App& command, std::uint32_t& rounds, const std::string& meaning) {
  add_number(command, "--rounds", rounds, meaning, 1, kMaxRounds);
}

CLI::Option* add_number(CLI::App& command, const std::string& option, std::uint32_t& number, const std::string& meaning,
                        std::uint32_t least, std::uint32_t most) {
  return command.add_option(option, number, meaning)->type_name("N")->check(CLI::Range(least, most).description(""));
}

}  // namespace cab::perf
