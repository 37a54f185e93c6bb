#include "perf/base/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>

#include "scenes/import/import.h"

namespace cab::perf {
namespace {

// The most rounds of a measurement. They take days.
constexpr std::uint32_t kMaxRounds = 100000;

}  // namespace

CLI::Option* add_text(CLI::App& command, const std::string& option, const std::string& type, const std::string& meaning,
                      std::function<void(const std::string&)> take) {
  return command.add_option_function<std::string>(option, std::move(take), meaning)->type_name(type);
}

CLI::Option* add_texts(CLI::App& command, const std::string& option, const std::string& type,
                       const std::string& meaning, std::function<void(const std::string&)> take) {
  const auto take_all = [take = std::move(take)](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) take(text);
  };
  return command.add_option_function<std::vector<std::string>>(option, take_all, meaning)
      ->type_name(type)
      ->allow_extra_args(false);
}

void add_isa(CLI::App& command, Isa& isa) {
  add_read(command, "--isa", "auto|" + isa_names("|", false), isa,
           "instruction set (default auto); this machine has " + isa_names(", ", true), read_isa);
}

void add_isas(CLI::App& command, std::vector<Isa>& isas, const std::string& by_default) {
  add_text(
      command, "--isa", "LIST",
      "instruction sets, separated by commas (default " + by_default + "); this machine has " + isa_names(", ", true),
      [&isas](const std::string& text) {
        isas.clear();
        for (const std::string& name : split_commas(text)) isas.push_back(read_isa("--isa", name));
      });
}

void add_threads(CLI::App& command, std::uint32_t& thread_count) {
  const std::string by_default = thread_count == 0 ? "every core" : std::to_string(thread_count);
  add_number(command, "--threads", thread_count, "number of threads (default " + by_default + "); 0: every core", 0,
             kMaxThreads);
}

void add_policy(CLI::App& command, std::uint32_t field, Policies& policies) {
  add_text(command, std::string("--") + policy_table()[field].name, policy_names(field, "|"),
           policy_help(policies, field),
           [&policies, field](const std::string& text) { set_policy(policies, field, text); });
}

void add_policies(CLI::App& command, Policies& policies) {
  add_text(command, "--preset", preset_names("|"), preset_help(),
           [&policies](const std::string& text) { set_preset(policies, text); });
  for (std::uint32_t field = 0; field < policy_table().size; ++field) add_policy(command, field, policies);
}

void add_up(CLI::App& command, char& up, const std::string& meaning) {
  add_text(command, "--up", "x|y|z", meaning, [&up](const std::string& text) {
    if (text != "x" && text != "y" && text != "z") reject("--up", text, "x, y or z");
    up = text[0];
  });
}

void add_no_sandbox(CLI::App& command, std::optional<scenes::SandboxLimits>& sandbox) {
  command.add_flag_callback(
      "--no-sandbox", [&sandbox] { sandbox.reset(); },
      "read files in this process, not in a child with limits (to debug a reader)");
}

double read_unit(const std::string& option, const std::string& text) {
  return text == "auto" ? kAutoUnit : read_metres_per_unit(option, text);
}

void set_unit(const std::optional<double>& unit, scenes::ImportOptions& import) {
  import.guesses_unit = unit == kAutoUnit;
  import.metres_per_unit = import.guesses_unit ? std::nullopt : unit;
}

void add_units(CLI::App& command, const std::string& what, std::vector<double>& metres_per_unit) {
  add_texts(command, "--units", "METRES_PER_UNIT",
            kUnitMeaning + ("; give it once for all " + what + "s or once per " + what),
            [&metres_per_unit](const std::string& text) { metres_per_unit.push_back(read_unit("--units", text)); });
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

std::vector<const CLI::Option*> own_options(const CLI::App& command) {
  std::vector<const CLI::Option*> own;
  for (const CLI::Option* option : command.get_options())
    if (option != command.get_help_ptr()) own.push_back(option);
  return own;
}

void add_rounds(CLI::App& command, std::uint32_t& rounds, const std::string& meaning) {
  add_number(command, "--rounds", rounds, meaning, 1, kMaxRounds);
}

}  // namespace cab::perf
