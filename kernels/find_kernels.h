// Chooses the table of kernels: which instruction sets this build holds and this CPU can run.
#pragma once

#include "kernels/kernel_table.h"

namespace cab::kernel {

// Returns the table of an instruction set, or null if the build lacks it, or if the CPU or operating system cannot run
// it. kAuto gives the one with the widest vectors that runs.
const KernelTable* find_kernels(Isa isa);

}  // namespace cab::kernel
