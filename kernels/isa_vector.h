// The vector type of the instruction set that a file of kernels/isa is compiled for. CAB_ISA is the set's name in
// kernels/isa_list.h; kernels/CMakeLists.txt defines it.
#pragma once

#include "kernels/isa_list.h"
#include "kernels/simd.h"

namespace cab::kernel {

namespace isa_vector {
#define CAB_ALIAS(enumerator, name, V, runs) using name = V;
CAB_ALL_ISAS(CAB_ALIAS)
#undef CAB_ALIAS
}  // namespace isa_vector

using IsaVector = isa_vector::CAB_ISA;

}  // namespace cab::kernel
