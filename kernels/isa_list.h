// The list of instruction sets, one line each. No other C++ file lists them. kernels/CMakeLists.txt has one line of
// compiler flags for each. Code that leaves an instruction set out fails to compile or to link.
#pragma once

#include <cab/types.h>

// Each line is X(enumerator of Isa, name, vector type V of kernels/simd.h, whether this CPU runs it). Lines are in the
// order of Isa. Those of one processor go from the narrowest vectors to the widest, because kAuto takes the last one
// that runs.
// __builtin_cpu_supports reads the operating system's support for the wide registers (XCR0) as well.
// clang-format off
#define CAB_SCALAR_ISA(X) \
  X(kScalar, scalar, float, true)
#define CAB_X86_64_ISAS(X)                                                                            \
  X(kSse2, sse2, Batch<xsimd::sse2>, true)                                                            \
  X(kAvx2, avx2, Batch<xsimd::avx2>, __builtin_cpu_supports("avx2"))                                  \
  X(kAvx512, avx512, Batch<xsimd::avx512bw>,                                                          \
    __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&                        \
    __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&                       \
    __builtin_cpu_supports("avx512vl"))
#define CAB_AARCH64_ISAS(X) \
  X(kNeon64, neon64, Batch<xsimd::neon64>, true)
// Emscripten translates SSE2's operations. A module that holds SIMD loads only where it runs.
#define CAB_WASM_ISAS(X) \
  X(kWasm128, wasm128, Batch<xsimd::sse2>, true)
// clang-format on

#define CAB_ALL_ISAS(X) CAB_SCALAR_ISA(X) CAB_X86_64_ISAS(X) CAB_AARCH64_ISAS(X) CAB_WASM_ISAS(X)

// The instruction sets for which a build for this processor has kernels.
#if defined(__x86_64__)
#define CAB_BUILT_ISAS(X) CAB_SCALAR_ISA(X) CAB_X86_64_ISAS(X)
#elif defined(__aarch64__)
#define CAB_BUILT_ISAS(X) CAB_SCALAR_ISA(X) CAB_AARCH64_ISAS(X)
#elif defined(__wasm__)
#define CAB_BUILT_ISAS(X) CAB_SCALAR_ISA(X) CAB_WASM_ISAS(X)
#else
#define CAB_BUILT_ISAS(X) CAB_SCALAR_ISA(X)
#endif

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
