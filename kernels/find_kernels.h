// Chooses the table of kernels: which instruction sets this build holds and this CPU can run.
#pragma once

#include "kernels/kernel_table.h"

namespace cab::kernel {

// Returns the table of an instruction set, or null when the build lacks it or the CPU or operating system cannot run
// it. kAuto gives the widest one that runs.
const KernelTable* find_kernels(Isa isa);

}  // namespace cab::kernel
