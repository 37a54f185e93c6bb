#include "perf/base/usage.h"

#include <filesystem>
#include <system_error>

namespace cab::perf {

void check_strategy(const Policies& policies) {
  if (policies.strategy == Strategy::kExactAll && policies.exact == Exact::kNone)
    throw UsageError("--strategy: exact_all without an exact test reports every pair; add --exact convex");
}

void check_given(const std::string& option, std::size_t given, std::size_t count, const std::string& noun) {
  if (given > 1 && given != count)
    throw UsageError(option + ": given " + std::to_string(given) + " times for " + std::to_string(count) + " " + noun +
                     "s; give one for all " + noun + "s or one per " + noun + ", in their order");
}

void check_outputs(const std::vector<OutputOption>& outputs, const std::vector<std::string>& inputs) {
  for (std::size_t b = 1; b < outputs.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      if (!outputs[a].path.empty() && outputs[a].path == outputs[b].path)
        throw UsageError(std::string(outputs[a].option) + " and " + outputs[b].option +
                         " name the same file; give two");
  for (const OutputOption& output : outputs)
    for (const std::string& input : inputs) {
      std::error_code ignored;  // a file that does not exist yet cannot be an input
      if (!output.path.empty() && std::filesystem::equivalent(input, output.path, ignored))
        throw UsageError(std::string(output.option) + ": " + output.path +
                         " is an input; write the output to another file");
    }
}

}  // namespace cab::perf
