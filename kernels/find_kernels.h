// Which instruction sets this build holds and this CPU can run, and the table of kernels of one.
#pragma once

#include "kernels/kernel_table.h"

namespace cab::kernel {

// The table of an instruction set, or null when the build lacks it or the CPU or operating system cannot run it.
// kAuto gives the widest that runs.
const KernelTable* find_kernels(Isa isa);

}  // namespace cab::kernel
