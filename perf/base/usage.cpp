#include "perf/base/usage.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "perf/base/output_file.h"
#include "scenes/import/import.h"

namespace cab::perf {
namespace {

namespace fs = std::filesystem;

// A device, such as a terminal, may be written under several names. A file that is not there yet is where it will be.
bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  if (a == b) return true;
  if (is_device(a) || is_device(b)) return false;
  return place_of(a) == place_of(b) || fs::equivalent(a, b, ignored);
}

}  // namespace

void check_given(const std::string& option, std::size_t given, std::size_t count, const std::string& noun) {
  if (given > 1 && given != count)
    throw UsageError(option + ": given " + std::to_string(given) + " times for " + std::to_string(count) + " " + noun +
                     "s; give one for all " + noun + "s or one per " + noun + ", in their order");
}

void check_outputs(const std::vector<OutputOption>& outputs, const std::vector<std::string>& inputs,
                   const std::function<std::vector<std::string>(const std::string& input)>& companions) {
  for (const OutputOption& output : outputs)
    if (output.path == "-")
      throw UsageError(std::string(output.option) + ": '-' names no file; give /dev/stdout for standard output");
  for (std::size_t b = 1; b < outputs.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      if (!outputs[a].path.empty() && !outputs[b].path.empty() && is_same_file(outputs[a].path, outputs[b].path))
        throw UsageError(std::string(outputs[a].option) + " and " + outputs[b].option +
                         " name the same file; give two");
  const bool may_overwrite = std::any_of(outputs.begin(), outputs.end(), [](const OutputOption& output) {
    std::error_code ignored;
    return fs::is_regular_file(output.path, ignored);
  });
  std::vector<std::string> read;
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    read.push_back(input);
    if (!companions || !may_overwrite) continue;
    try {  // whatever reads the input says what is wrong with it
      const std::vector<std::string> more = companions(input);
      read.insert(read.end(), more.begin(), more.end());
    } catch (const scenes::MachineError&) { throw; } catch (const scenes::ImportError&) {
    }
  }
  for (const OutputOption& output : outputs)
    for (const std::string& input : read)
      if (!output.path.empty() && is_same_file(input, output.path))
        throw UsageError(std::string(output.option) + ": " + output.path +
                         " is an input; write the output to another file");
}

}  // namespace cab::perf
