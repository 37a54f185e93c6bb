// `cab kernels`: the exact test of pairs of convex shapes.
#pragma once

#include "kernels/kernel_table.h"
#include "perf/measure/kernels/race.h"

namespace cab::perf {

// How many pairs of kinds are measured. Each has two tables: of yes or no, and of contacts.
inline constexpr std::uint32_t kExactRows = 23, kExactTables = 2 * kExactRows;

// Times the exact test and the contacts of every table beside FCL's. Prints which of their answers differ, and how many
// depths are above the least one.
void measure_exact(const std::vector<const kernel::KernelTable*>& tables, std::uint32_t rounds, ProgressBar& bar);

}  // namespace cab::perf
