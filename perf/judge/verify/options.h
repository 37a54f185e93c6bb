// What `cab verify` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct VerifyOptions {
  double minutes = 1;                   // how long, unless rounds or round is given
  std::optional<std::uint64_t> rounds;  // how many rounds
  std::optional<std::uint64_t> round;   // the number of the only round
  std::vector<std::string> parts;       // by name; empty: all
  std::uint64_t seed = 1;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 0;  // 0: every core
  std::string resume_path;         // empty: no file
  std::string json_path;           // empty: no file
};
Command add_verify(CLI::App& app);
int verify_command(const VerifyOptions& options);

}  // namespace cab::perf
