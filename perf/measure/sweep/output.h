// Prints and writes the runs of `cab sweep`.
#pragma once

#include <string>
#include <vector>

#include "perf/base/output_file.h"
#include "perf/measure/sweep/cells.h"

namespace cab::perf {

// The strategy, and all values that are not the defaults, except the exact test: "tree cab_sum leaves".
std::string short_name(const Policies& policies);

// The statements that turn default policies into these: "policies.refit = cab::Refit::kCabSum;".
std::string code_line(const Policies& policies);

// Prints the cells, the fastest first, and a recommendation.
void print_sweep(const SweepRun& run);

// Each writes and closes a file, and does nothing if the file is none.
void write_sweep_json(OutputFile& file, const std::vector<SweepRun>& runs);
void write_sweep_csv(OutputFile& file, const std::vector<SweepRun>& runs);

}  // namespace cab::perf
