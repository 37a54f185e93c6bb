// What differs between compilers and between processors. No other file of layout, kernels and engine has any of it,
// besides layout/atomic_words.h and the public header cab/api.h; .ci/check_compilers holds that.
// docs/platforms.md says which compilers were tried.
#pragma once

#include <cstddef>
#include <cstdint>

// Whether the target is one of these processors, as 1 or 0.
#if defined(__x86_64__) || defined(_M_X64)
#define CAB_X86_64 1
#else
#define CAB_X86_64 0
#endif
#if defined(__aarch64__) || defined(_M_ARM64)
#define CAB_AARCH64 1
#else
#define CAB_AARCH64 0
#endif

// Microsoft's own compiler; clang-cl defines _MSC_VER too, and has what clang has.
#if defined(_MSC_VER) && !defined(__clang__)
#define CAB_MSVC 1
#else
#define CAB_MSVC 0
#endif

#ifdef _MSC_VER
#include <intrin.h>
#endif
#if CAB_X86_64
#include <xmmintrin.h>
#endif

// CAB_INLINE is for every function that files of several instruction sets include: a copy that is not inlined would be
// shared by all of them. CAB_NOINLINE is for large functions with several callers: inlined everywhere they take minutes
// to compile.
//
// CAB_PRINTF(format, values) is for functions that format text: the numbers of these two parameters, from 1 (2 after
// `this`). The compiler then checks the calls.
#if CAB_MSVC
#define CAB_INLINE __forceinline
#define CAB_NOINLINE __declspec(noinline)
#define CAB_PRINTF(format, values)
#else
#define CAB_INLINE inline __attribute__((always_inline))
#define CAB_NOINLINE __attribute__((noinline))
#if defined(__MINGW32__) && !defined(__clang__)
#define CAB_PRINTF(format, values) __attribute__((__format__(gnu_printf, format, values)))
#else
#define CAB_PRINTF(format, values) __attribute__((__format__(__printf__, format, values)))
#endif
#endif

namespace cab {

// The number of the lowest bit that is set. bits must not be 0.
CAB_INLINE std::uint32_t lowest_bit(std::uint32_t bits) {
#if CAB_MSVC
  unsigned long number;
  _BitScanForward(&number, bits);
  return number;
#else
  return static_cast<std::uint32_t>(__builtin_ctz(bits));
#endif
}

// How many bits are set. The instruction for it is younger than SSE2, and Microsoft's intrinsic does not ask.
CAB_INLINE std::uint32_t count_bits(std::uint32_t bits) {
#if CAB_MSVC
  bits -= (bits >> 1) & 0x55555555u;
  bits = (bits & 0x33333333u) + ((bits >> 2) & 0x33333333u);
  return (((bits + (bits >> 4)) & 0x0f0f0f0fu) * 0x01010101u) >> 24;
#else
  return static_cast<std::uint32_t>(__builtin_popcount(bits));
#endif
}

// Makes the compiler read an object in memory again. GCC otherwise takes addresses that were computed as lanes out of
// the vector one by one, which is slower than to load them.
template <class T>
CAB_INLINE void reload([[maybe_unused]] T& object) {
#if !CAB_MSVC
  __asm__("" : "+m"(object));
#endif
}

// Returns an address, of which the compiler does not know how it came about: GCC would compute sixteen of them as
// lanes, and then take them out of the vector.
template <class T>
CAB_INLINE const T* scalar_address(const T* at) {
#if !CAB_MSVC
  __asm__("" : "+r"(at));
#endif
  return at;
}

#if CAB_X86_64 && !CAB_MSVC
// Reads seven floats into the places 8 to 14 of a register of 512 bits, and no byte beyond them: a broadcast reads what
// its mask says, but no intrinsic has the mask cover what it reads.
template <class Register, class Mask>
CAB_INLINE void load_upper_seven(const float* from, Mask places, Register& to) {
  using Seven = const float[7];
  __asm__("vbroadcastf32x8 %1, %0%{%2%}" : "+v"(to) : "m"(*reinterpret_cast<Seven*>(from)), "Yk"(places));
}
#define CAB_HAS_MASKED_BROADCAST 1
#else
#define CAB_HAS_MASKED_BROADCAST 0
#endif

// Whether numbers begin with their lowest byte.
#if defined(__BYTE_ORDER__)
inline constexpr bool kLittleEndian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
#else
inline constexpr bool kLittleEndian = true;
#endif

// Asks for the cache line at an address, which need not be mapped. GCC drops calls of functions that do only this, so
// those are CAB_INLINE too.
CAB_INLINE void prefetch_line(const void* at) {
#if CAB_MSVC && CAB_X86_64
  _mm_prefetch(static_cast<const char*>(at), _MM_HINT_T0);
#elif CAB_MSVC && CAB_AARCH64
  __prefetch(at);
#elif CAB_MSVC
  static_cast<void>(at);
#else
  __builtin_prefetch(at);
#endif
}

// The same for all lines that some bytes are in.
CAB_INLINE void prefetch_bytes(const void* at, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  const char* const from = static_cast<const char*>(at);
  for (std::size_t i = 0; i < bytes; i += kLine) prefetch_line(from + i);
  prefetch_line(from + bytes - 1);
}

// ---------------------------------------------------------------------------------------------------- the running CPU

#if CAB_X86_64

// Whether the CPU has an instruction set, and the operating system saves its registers. Kernels of AVX2 use FMA too.
#ifdef _MSC_VER

// Bits `mask` of register `number` (eax, ebx, ecx, edx) of a leaf of cpuid are all set.
CAB_INLINE bool cpuid_has(int leaf, int number, std::uint32_t mask) {
  int registers[4];
  __cpuid(registers, 0);
  if (registers[0] < leaf) return false;
  __cpuidex(registers, leaf, 0);
  return (static_cast<std::uint32_t>(registers[number]) & mask) == mask;
}

// XCR0: which registers the operating system saves. Only where cpuid has OSXSAVE.
CAB_INLINE std::uint32_t saved_registers() {
#if CAB_MSVC
  return static_cast<std::uint32_t>(_xgetbv(0));
#else
  std::uint32_t low, high;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
#endif
}

CAB_INLINE bool cpu_runs_avx2() {
  constexpr std::uint32_t kFmaOsxsaveAvx = 1u << 12 | 1u << 27 | 1u << 28, kAvx2 = 1u << 5, kXmmYmm = 0x6;
  return cpuid_has(1, 2, kFmaOsxsaveAvx) && (saved_registers() & kXmmYmm) == kXmmYmm && cpuid_has(7, 1, kAvx2);
}

CAB_INLINE bool cpu_runs_avx512() {
  constexpr std::uint32_t kXmmYmmZmmMasks = 0xe6, kFDqCdBwVl = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;
  return cpu_runs_avx2() && (saved_registers() & kXmmYmmZmmMasks) == kXmmYmmZmmMasks && cpuid_has(7, 1, kFDqCdBwVl);
}

#else

// __builtin_cpu_supports reads the operating system's support for the wide registers (XCR0) as well.
CAB_INLINE bool cpu_runs_avx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}

CAB_INLINE bool cpu_runs_avx512() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

#endif

#endif  // CAB_X86_64

// ------------------------------------------------------------------------------------- the floating-point control word

// kPlainFloatControl: rounding to nearest, denormals kept, all exceptions masked. A processor without a control word
// has this mode always.
#if CAB_X86_64
using FloatControl = std::uint32_t;
inline constexpr FloatControl kPlainFloatControl = 0x1f80;
CAB_INLINE FloatControl read_float_control() { return _mm_getcsr(); }
CAB_INLINE void write_float_control(FloatControl word) { _mm_setcsr(word); }
#elif CAB_AARCH64
using FloatControl = std::uint64_t;
inline constexpr FloatControl kPlainFloatControl = 0;
#if CAB_MSVC
inline constexpr int kFpcr = 0x5a20;  // op0 3, op1 3, CRn 4, CRm 4, op2 0
CAB_INLINE FloatControl read_float_control() { return static_cast<FloatControl>(_ReadStatusReg(kFpcr)); }
CAB_INLINE void write_float_control(FloatControl word) { _WriteStatusReg(kFpcr, static_cast<__int64>(word)); }
#else
CAB_INLINE FloatControl read_float_control() {
  FloatControl word;
  __asm__ volatile("mrs %0, fpcr" : "=r"(word));
  return word;
}
CAB_INLINE void write_float_control(FloatControl word) { __asm__ volatile("msr fpcr, %0" : : "r"(word)); }
#endif
#else
using FloatControl = std::uint32_t;
inline constexpr FloatControl kPlainFloatControl = 0;
CAB_INLINE FloatControl read_float_control() { return 0; }
CAB_INLINE void write_float_control(FloatControl) {}
#endif

}  // namespace cab
