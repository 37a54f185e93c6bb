// How the runs of `cab sweep` are printed and written.
#pragma once

#include <string>
#include <vector>

#include "perf/sweep/cells.h"

namespace cab::perf {

// The strategy, and the values of other fields (but the exact test) that are not the defaults: "tree cab_sum leaves".
std::string short_name(const Policies& policies);

// The statements that make these policies of default ones: "policies.refit = cab::Refit::kCabSum;". All fields.
std::string code_line(const Policies& policies);

// The cells, the fastest first, and what is recommended.
void print_sweep(const SweepRun& run);

void write_sweep_json(const std::string& path, const std::vector<SweepRun>& runs);
void write_sweep_csv(const std::string& path, const std::vector<SweepRun>& runs);

}  // namespace cab::perf
