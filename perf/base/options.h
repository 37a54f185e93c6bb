// The options that several commands share, and the struct that makes a command part of `cab`.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/option_values.h"
#include "scenes/sandbox/sandbox.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cab::scenes {
struct ImportOptions;
}

namespace cab::perf {

// A sub-command of `cab`. The function add_NAME of its folder adds it to the app, and keeps the options that the
// command line fills.
struct Command {
  CLI::App* app;
  std::function<int()>
      run;  // the exit code: 0, or 1 if the command's own checks fail; throws for wrong use and bad data
};

// The most threads that an option accepts.
inline constexpr std::uint32_t kMaxThreads = 1024;

// The most characters of a crowd, which take some 4 GB.
inline constexpr std::uint32_t kMaxCrowd = 4000000;

// Adds an option that takes one text, and hands it to `take`. type: what --help calls the text.
CLI::Option* add_text(CLI::App& command, const std::string& option, const std::string& type, const std::string& meaning,
                      std::function<void(const std::string& text)> take);

// The same for an option that may be given several times: `take` gets one text after the other.
CLI::Option* add_texts(CLI::App& command, const std::string& option, const std::string& type,
                       const std::string& meaning, std::function<void(const std::string& text)> take);

// The same for an option whose text becomes a value. read(option, text) returns it, and throws UsageError for a text
// that the option does not accept.
template <class T, class Read>
CLI::Option* add_read(CLI::App& command, const std::string& option, const std::string& type, T& value,
                      const std::string& meaning, Read read) {
  return add_text(command, option, type, meaning,
                  [&value, option, read](const std::string& text) { value = static_cast<T>(read(option, text)); });
}

// The options that a command has so far, but for --help.
std::vector<const CLI::Option*> own_options(const CLI::App& command);

// Adds an option that takes a number from least to most; add_number a whole one, in decimal digits.
template <class T>
CLI::Option* add_within(CLI::App& command, const std::string& option, const std::string& type, T& number,
                        const std::string& meaning, double least, double most) {
  return add_read(
      command, option, type, number, meaning,
      [least, most](const std::string& name, const std::string& text) { return read_within(name, text, least, most); });
}
template <class T>
CLI::Option* add_number(CLI::App& command, const std::string& option, T& number, const std::string& meaning,
                        std::uint64_t least, std::uint64_t most) {
  return add_read(
      command, option, "N", number, meaning,
      [least, most](const std::string& name, const std::string& text) { return read_number(name, text, least, most); });
}

// Adds an option that takes one of the names of an enumeration, in its order, which begins with 0. wanted: what the
// names are, for the text of an error.
template <class Enum, class T, class Names>
CLI::Option* add_choice(CLI::App& command, const std::string& option, const Names& all, T& value,
                        const std::string& wanted, const std::string& meaning) {
  const std::vector<std::string> names(std::begin(all), std::end(all));
  return add_read(command, option, joined(names, "|"), value, meaning,
                  [names, wanted](const std::string& name, const std::string& text) {
                    return static_cast<Enum>(read_choice(name, text, names, wanted));
                  });
}

// Each function adds to a command the option, or the options, that its name says. The variable that an option fills
// must outlive the parsing.
void add_isa(CLI::App& command, Isa& isa);
void add_isas(CLI::App& command, std::vector<Isa>& isas, const std::string& by_default);
void add_threads(CLI::App& command, std::uint32_t& thread_count);
void add_policy(CLI::App& command, std::uint32_t field, Policies& policies);

// Adds an option that takes the path of a file or folder. An empty path is refused.
CLI::Option* add_path(CLI::App& command, const std::string& option, std::string& path, const std::string& meaning);
void refuse_empty(CLI::Option& option);
void add_json(CLI::App& command, std::string& path, const std::string& meaning);
void add_csv(CLI::App& command, std::string& path, const std::string& meaning);
void add_rounds(CLI::App& command, std::uint32_t& rounds, const std::string& meaning);

// Adds --preset and every policy. CLI11 applies options in the order in which they are added, so a preset is applied
// first wherever it is on the command line.
void add_policies(CLI::App& command, Policies& policies);

// Adds --up: the axis that points up.
void add_up(CLI::App& command, char& up, const std::string& meaning);

// Adds --no-sandbox, which empties `sandbox`.
void add_no_sandbox(CLI::App& command, std::optional<scenes::SandboxLimits>& sandbox);

// Adds --units: metres per unit, once for all files or once per file. `what` says what a file is.
void add_units(CLI::App& command, const std::string& what, std::vector<double>& metres_per_unit);

// In the place of a length unit: one that makes a person of the figure.
inline constexpr double kAutoUnit = 0;

// What --units does, for --help.
inline constexpr const char* kUnitMeaning =
    "length unit of the file in metres, or auto: one in which the figure is as tall as a person, if it is not (default "
    "as the file says, or 1)";

// A number above 0, or kAutoUnit for the word auto. Throws UsageError.
double read_unit(const std::string& option, const std::string& text);

// Hands a unit that was read to an import; empty: none was given.
void set_unit(const std::optional<double>& unit, scenes::ImportOptions& import);

}  // namespace cab::perf
