#include "kernels/find_kernels.h"

#include <initializer_list>

namespace cab::kernel {

extern const KernelTable kScalarTable;
#if defined(__x86_64__)
extern const KernelTable kSse2Table;
extern const KernelTable kAvx2Table;
extern const KernelTable kAvx512Table;
#elif defined(__aarch64__)
extern const KernelTable kNeon64Table;
#endif

namespace {

// __builtin_cpu_supports reads the operating system's support for the wide registers (XCR0) as well.
bool cpu_runs(Isa isa) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  switch (isa) {
    case Isa::kScalar:
    case Isa::kSse2: return true;
    case Isa::kAvx2: return __builtin_cpu_supports("avx2");
    case Isa::kAvx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512vl");
    default: return false;
  }
#elif defined(__aarch64__)
  return isa == Isa::kScalar || isa == Isa::kNeon64;
#else
  return isa == Isa::kScalar;
#endif
}

const KernelTable* table_of(Isa isa) {
  switch (isa) {
#if defined(__x86_64__)
    case Isa::kSse2: return &kSse2Table;
    case Isa::kAvx2: return &kAvx2Table;
    case Isa::kAvx512: return &kAvx512Table;
#elif defined(__aarch64__)
    case Isa::kNeon64: return &kNeon64Table;
#endif
    case Isa::kScalar: return &kScalarTable;
    default: return nullptr;
  }
}

}  // namespace

const KernelTable* find_kernels(Isa isa) {
  if (isa != Isa::kAuto) return cpu_runs(isa) ? table_of(isa) : nullptr;
  for (const Isa candidate : {Isa::kAvx512, Isa::kAvx2, Isa::kNeon64, Isa::kSse2})
    if (const KernelTable* table = find_kernels(candidate)) return table;
  return &kScalarTable;
}

}  // namespace cab::kernel
