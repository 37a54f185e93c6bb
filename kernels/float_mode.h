// The floating-point control word. The library computes with rounding to nearest, denormals kept and exceptions masked,
// whatever mode the caller runs with, so that results have the same bits.
#pragma once

#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace cab::kernel {

// Sets the library's mode for a scope, and restores the caller's mode afterwards. On x86 that includes the sticky
// exception flags.
class FloatMode {
 public:
  FloatMode() noexcept : saved_(read()) { write(kOurs); }
  ~FloatMode() { write(saved_); }
  FloatMode(const FloatMode&) = delete;
  FloatMode& operator=(const FloatMode&) = delete;

 private:
#if defined(__x86_64__)
  using Word = std::uint32_t;
  static constexpr Word kOurs = 0x1f80;  // nearest, no FTZ, no DAZ, all exceptions masked
  static Word read() noexcept { return _mm_getcsr(); }
  static void write(Word word) noexcept { _mm_setcsr(word); }
#elif defined(__aarch64__)
  using Word = std::uint64_t;
  static constexpr Word kOurs = 0;
  static Word read() noexcept {
    Word word;
    __asm__ volatile("mrs %0, fpcr" : "=r"(word));
    return word;
  }
  static void write(Word word) noexcept { __asm__ volatile("msr fpcr, %0" : : "r"(word)); }
#else
  using Word = std::uint32_t;
  static constexpr Word kOurs = 0;
  static Word read() noexcept { return 0; }
  static void write(Word) noexcept {}
#endif
  Word saved_;
};

}  // namespace cab::kernel
