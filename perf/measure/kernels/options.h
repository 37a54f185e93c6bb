// What `cab kernels` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct KernelsOptions {
  std::vector<Isa> isas;  // each one available; empty: every available one
  std::uint32_t rounds = 21;
};
Command add_kernels(CLI::App& app);
int kernels_command(const KernelsOptions& options);

}  // namespace cab::perf
