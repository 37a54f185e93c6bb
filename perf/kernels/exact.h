// `cab kernels`: the exact test of pairs of convex shapes.
#pragma once

#include "kernels/kernel_table.h"
#include "perf/kernels/race.h"

namespace cab::perf {

// How many pairs of kinds are measured, each a table of its own.
inline constexpr std::uint32_t kExactRows = 21;

// Times the exact test of every table beside FCL's, and prints which of their answers differ.
void measure_exact(const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar);

}  // namespace cab::perf
