// The list of instruction sets, one line each. No other C++ file lists them. kernels/CMakeLists.txt has one line of
// compiler flags for each. Code that leaves an instruction set out fails to compile or to link.
#pragma once

#include "layout/compiler.h"

#include <cab/types.h>

// Each line is PICK(X, enumerator of Isa, name, vector type V of kernels/simd.h, whether this CPU runs it), and PICK
// decides whether X is given the line. Lines are in the order of Isa. Those of one processor go from the narrowest
// vectors to the widest, because kAuto takes the last one that runs.
// Emscripten translates the operations of SSE2 to WebAssembly's SIMD, which is what the vector type of kWasm128 is.
// clang-format off
#define CAB_ISA_LIST(PICK, X)                                              \
  PICK(X, kScalar, scalar, float, true)                                    \
  PICK(X, kSse2, sse2, Batch<xsimd::sse2>, true)                           \
  PICK(X, kAvx2, avx2, Batch<xsimd::avx2>, cpu_runs_avx2())                \
  PICK(X, kAvx512, avx512, Batch<xsimd::avx512bw>, cpu_runs_avx512())      \
  PICK(X, kNeon64, neon64, Batch<xsimd::neon64>, true)                     \
  PICK(X, kWasm128, wasm128, Batch<xsimd::sse2>, true)
// clang-format on
// kWasm128 asks no CPU whether it runs: a WebAssembly module that holds SIMD loads only where SIMD runs. One without
// SIMD is beside it.

// X(enumerator, name, V, runs) for every instruction set.
#define CAB_ALL_ISAS(X) CAB_ISA_LIST(CAB_PICK_ALL, X)
#define CAB_PICK_ALL(X, enumerator, name, V, runs) X(enumerator, name, V, runs)

// The same for those that this build has kernels for: CMake defines CAB_BUILT_name as 1 or 0 for every name, by the
// processor and by its option CAB_ISAS.
#define CAB_BUILT_ISAS(X) CAB_ISA_LIST(CAB_PICK_BUILT, X)
#define CAB_PICK_BUILT(X, enumerator, name, V, runs) CAB_PICK_IF(CAB_BUILT_##name)(X, enumerator, name, V, runs)
#define CAB_PICK_IF(built) CAB_PICK_IF_(built)
#define CAB_PICK_IF_(built) CAB_PICK_IF_##built
#define CAB_PICK_IF_1(X, enumerator, name, V, runs) X(enumerator, name, V, runs)
#define CAB_PICK_IF_0(X, enumerator, name, V, runs)

namespace cab::kernel {

// Every instruction set, in the order of Isa without kAuto.
#define CAB_ENUMERATOR(enumerator, name, V, runs) Isa::enumerator,
inline constexpr Isa kAllIsas[] = {CAB_ALL_ISAS(CAB_ENUMERATOR)};
#undef CAB_ENUMERATOR

constexpr bool is_in_order_of_isa() {
  std::uint32_t next = 1;
  for (const Isa isa : kAllIsas)
    if (static_cast<std::uint32_t>(isa) != next++) return false;
  return next == kIsaCount;
}
static_assert(is_in_order_of_isa(), "the list has a line for each value of Isa but kAuto, in order");

// The name of an instruction set, or null for a value that is not an enumerator. The compiler warns if an enumerator
// has no line.
constexpr const char* isa_name(Isa isa) {
  switch (isa) {
    case Isa::kAuto: return "auto";
#define CAB_CASE(enumerator, name, V, runs) \
  case Isa::enumerator: return #name;
      CAB_ALL_ISAS(CAB_CASE)
#undef CAB_CASE
  }
  return nullptr;
}

}  // namespace cab::kernel
