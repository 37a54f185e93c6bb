#include "perf/base/option_values.h"

#include <cab/cab.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "perf/base/usage.h"
#include "scenes/import/printable.h"

namespace cab::perf {
namespace {

// Reads one number, which must be the whole text. Returns false if it is not.
template <class T>
bool read_whole(const std::string& text, T& value) {
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && rest == end && !text.empty();
}

bool read_finite(const std::string& text, double& value) { return read_whole(text, value) && std::isfinite(value); }

// The shortest text that reads back as a number.
std::string in_words(double number) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof(text), number).ptr);
}

double read_positive(const std::string& option, const std::string& text, const char* example) {
  double value = 0;
  if (!read_finite(text, value) || !(value > 0))
    reject(option, text, std::string("a number above 0, for example ") + example);
  return value;
}

}  // namespace

void reject(const std::string& option, const std::string& text, const std::string& wanted) {
  throw UsageError(option + ": '" + scenes::printable(text) + "' is not " + wanted);
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  return joined(words, between, between);
}

std::string joined(const std::vector<std::string>& words, const std::string& between, const std::string& before_last) {
  std::string out;
  for (std::size_t i = 0; i < words.size(); ++i)
    out += (i == 0 ? "" : i + 1 == words.size() ? before_last : between) + words[i];
  return out;
}

std::vector<std::string> split_commas(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t comma; (comma = text.find(',', begin)) != std::string::npos; begin = comma + 1)
    parts.push_back(text.substr(begin, comma - begin));
  parts.push_back(text.substr(begin));
  return parts;
}

std::array<double, 3> read_offset(const std::string& option, const std::string& text) {
  const std::vector<std::string> parts = split_commas(text);
  std::array<double, 3> offset = {};
  bool good = parts.size() == offset.size();
  for (std::size_t k = 0; good && k < offset.size(); ++k) good = read_finite(parts[k], offset[k]);
  if (!good) reject(option, text, "X,Y,Z: write three numbers in metres without spaces, for example 0.5,0,-1");
  return offset;
}

std::size_t read_choice(const std::string& option, const std::string& text, const std::vector<std::string>& names,
                        const std::string& wanted) {
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) reject(option, text, wanted + "; choose " + joined(names, ", "));
  return static_cast<std::size_t>(found - names.begin());
}

double read_positive(const std::string& option, const std::string& text) { return read_positive(option, text, "0.5"); }
double read_metres_per_unit(const std::string& option, const std::string& text) {
  return read_positive(option, text, "0.0254 for inches");
}

double read_not_negative(const std::string& option, const std::string& text) {
  double value = 0;
  if (!read_finite(text, value) || value < 0) reject(option, text, "a number that is 0 or above, for example 0.01");
  return value;
}

double read_within(const std::string& option, const std::string& text, double least, double most) {
  double value = 0;
  if (!read_whole(text, value) || !(value >= least && value <= most))
    reject(option, text, "a number from " + in_words(least) + " to " + in_words(most));
  return value;
}

std::uint64_t read_number(const std::string& option, const std::string& text, std::uint64_t least, std::uint64_t most) {
  std::uint64_t number = 0;
  if (!read_whole(text, number) || number < least || number > most)
    reject(option, text, "a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  return number;
}

FrameRange read_frame_range(const std::string& option, const std::string& text) {
  const std::size_t colon = text.find(':');
  FrameRange range;
  const bool is_first_whole = colon == std::string::npos || read_whole(text.substr(0, colon), range.first);
  const std::string end = colon == std::string::npos ? text : text.substr(colon + 1);
  if (!is_first_whole || !read_whole(end, range.end) || range.first >= range.end)
    reject(option, text, "N, the first N frames, or A:B with A below B: frames A to B - 1, for example 100:200");
  return range;
}

std::optional<std::uint32_t> read_frame(const std::string& option, const std::string& text) {
  if (text == "last") return {};
  std::uint32_t frame = 0;
  if (!read_whole(text, frame) || frame == std::numeric_limits<std::uint32_t>::max())  // one more ends a range
    reject(option, text, "a frame, counted from 0, or the word last");
  return frame;
}

std::string isa_names(const char* separator, bool available_only) {
  std::vector<std::string> names;
  for (std::uint8_t i = 0; i < kIsaCount; ++i) {
    const Isa isa = static_cast<Isa>(i);
    if (isa != Isa::kAuto && (!available_only || isa_available(isa))) names.emplace_back(to_string(isa));
  }
  return joined(names, separator);
}

Isa read_isa(const std::string& option, const std::string& text) {
  for (std::uint8_t i = 0; i < kIsaCount; ++i) {
    const Isa isa = static_cast<Isa>(i);
    if (text != to_string(isa)) continue;
    if (isa != Isa::kAuto && !isa_available(isa))
      throw UsageError(option + ": this CPU or this build cannot run " + text + "; choose auto, " +
                       isa_names(", ", true));
    return isa;
  }
  reject(option, text, "an instruction set; choose auto, " + isa_names(", ", true));
}

std::vector<std::uint32_t> read_number_list(const std::string& option, const std::string& text) {
  std::vector<std::uint32_t> numbers;
  for (const std::string& part : split_commas(text)) {
    std::uint32_t number = 0;
    if (!read_whole(part, number) || std::find(numbers.begin(), numbers.end(), number) != numbers.end())
      reject(option, text, "a list of different whole numbers, for example 1,2");
    numbers.push_back(number);
  }
  return numbers;
}

std::string policy_names(std::uint32_t field, const char* separator) {
  const PolicyField& row = policy_table()[field];
  std::vector<std::string> names;
  for (std::uint32_t v = 0; v < row.value_count; ++v) names.emplace_back(row.values[v].name);
  return joined(names, separator);
}

std::uint32_t policy_row(const std::string& name) {
  std::uint32_t row = 0;
  while (policy_table()[row].name != name) ++row;
  return row;
}

const char* policy_value(const Policies& policies, std::uint32_t field) {
  return policy_table()[field].values[policy_get(policies, field)].name;
}

std::string policy_value(const Policies& policies, const char* field_name) {
  return policy_value(policies, policy_row(field_name));
}

std::string policy_help(const Policies& defaults, std::uint32_t field) {
  const PolicyField& row = policy_table()[field];
  std::string help = std::string(row.meaning) + " (default " + policy_value(defaults, field) + ")";
  for (std::uint32_t v = 0; v < row.value_count; ++v)
    help += std::string("\n  ") + row.values[v].name + ": " + (v < row.use_count ? "" : "for comparison, ") +
            row.values[v].meaning;
  return help;
}

std::vector<std::uint32_t> read_policy_values(std::uint32_t field, const std::string& text) {
  std::vector<std::uint32_t> values;
  for (const std::string& name : split_commas(text)) {
    Policies policies;
    set_policy(policies, field, name);
    values.push_back(policy_get(policies, field));
    if (std::count(values.begin(), values.end(), values.back()) > 1)
      reject(std::string("--") + policy_table()[field].name, text, "a list of different values");
  }
  return values;
}

std::string policy_list_help(std::uint32_t field) {
  const PolicyField& row = policy_table()[field];
  const bool exact = std::string(row.name) == "exact";
  return std::string(row.meaning) + ", separated by commas (default " + (exact ? "none" : "all") +
         "): " + policy_names(field, ", ");
}

void set_policy(Policies& policies, std::uint32_t field, const std::string& text) {
  const PolicyField& row = policy_table()[field];
  if (!policy_set(policies, field, text.c_str()))
    reject(std::string("--") + row.name, text, "one of its values; choose " + policy_names(field, ", "));
}

std::string preset_names(const char* separator) {
  std::vector<std::string> names;
  for (const PolicyPreset& preset : preset_table()) names.emplace_back(preset.name);
  return joined(names, separator);
}

std::string preset_help() {
  std::string help = "policies to start from; the options below change single ones";
  for (const PolicyPreset& preset : preset_table()) {
    help += std::string("\n  ") + preset.name + ": " + preset.meaning + "\n   ";
    for (std::uint32_t f = 0; f < policy_table().size; ++f)
      help += std::string(" --") + policy_table()[f].name + " " + policy_value(preset.policies, f);
  }
  return help;
}

void set_preset(Policies& policies, const std::string& text) {
  if (!preset_set(policies, text.c_str())) reject("--preset", text, "a preset; choose " + preset_names(", "));
}

}  // namespace cab::perf
