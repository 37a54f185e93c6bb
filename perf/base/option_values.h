// From the text of an option to its value. Each reader throws UsageError with the option's name and what to write.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"

namespace cab::perf {

// Throws UsageError, which says the option, the text given to it, and the text that it accepts (`wanted`).
[[noreturn]] void reject(const std::string& option, const std::string& text, const std::string& wanted);

// Words joined by a separator; the second function has another separator before the last word.
std::string joined(const std::vector<std::string>& words, const std::string& between);
std::string joined(const std::vector<std::string>& words, const std::string& between, const std::string& before_last);

// X,Y,Z: three finite numbers.
std::array<double, 3> read_offset(const std::string& option, const std::string& text);

// The place of a name among names. wanted: what the names are.
std::size_t read_choice(const std::string& option, const std::string& text, const std::vector<std::string>& names,
                        const std::string& wanted);

// A finite number above zero; the second function names a unit as its example.
double read_positive(const std::string& option, const std::string& text);
double read_metres_per_unit(const std::string& option, const std::string& text);

// A finite number that is 0 or above.
double read_not_negative(const std::string& option, const std::string& text);

// A number, and a whole number in decimal digits, from least to most.
double read_within(const std::string& option, const std::string& text, double least, double most);
std::uint64_t read_number(const std::string& option, const std::string& text, std::uint64_t least, std::uint64_t most);

// A:B with A < B, or N for 0:N.
FrameRange read_frame_range(const std::string& option, const std::string& text);

// A frame counted from 0, or the word last, for which the result is empty.
std::optional<std::uint32_t> read_frame(const std::string& option, const std::string& text);

// An instruction set that this CPU and build can run, or auto.
Isa read_isa(const std::string& option, const std::string& text);

// Different whole numbers, separated by commas.
std::vector<std::uint32_t> read_number_list(const std::string& option, const std::string& text);

// The texts between commas.
std::vector<std::string> split_commas(const std::string& text);

// The names of all instruction sets except auto, or only of those that run here, joined by a separator.
std::string isa_names(const char* separator, bool available_only);

// The names of kinds of levels of detail, in the order of LodKind.
inline constexpr const char* kLodKindNames[] = {"reach", "nodes"};

// About one row of policy_table(): the names of its values, joined by a separator; a help text with its meaning, its
// default and one line per value.
std::string policy_names(std::uint32_t field, const char* separator);
std::string policy_help(const Policies& defaults, std::uint32_t field);

// The row of policy_table() with a name that is there.
std::uint32_t policy_row(const std::string& name);

// The name of the value that a field of policy_table() has, by the field's row or name.
const char* policy_value(const Policies& policies, std::uint32_t field);
std::string policy_value(const Policies& policies, const char* field_name);

// Different values of a field by their names, separated by commas; the help text for such a list.
std::vector<std::uint32_t> read_policy_values(std::uint32_t field, const std::string& text);
std::string policy_list_help(std::uint32_t field);

// Sets a field of policies by the name of a value.
void set_policy(Policies& policies, std::uint32_t field, const std::string& text);

// About preset_table(): the names of all presets, joined by a separator; a help text with one line per preset.
std::string preset_names(const char* separator);
std::string preset_help();

// Sets all policies by the name of a preset.
void set_preset(Policies& policies, const std::string& text);

}  // namespace cab::perf
