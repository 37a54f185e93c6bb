// Atomic operations on plain numbers that the tasks of a frame share. They are relaxed: no other memory is ordered by
// them. C++17 has none on numbers that are not std::atomic, so each compiler has its own.
#pragma once

#include "layout/compiler.h"

#include <cstdint>

namespace cab {

CAB_INLINE std::uint8_t relaxed_load(const std::uint8_t& byte) {
#if CAB_MSVC
  return *static_cast<const volatile std::uint8_t*>(&byte);
#else
  return __atomic_load_n(&byte, __ATOMIC_RELAXED);
#endif
}

CAB_INLINE void relaxed_store(std::uint8_t& byte, std::uint8_t value) {
#if CAB_MSVC
  *static_cast<volatile std::uint8_t*>(&byte) = value;
#else
  __atomic_store_n(&byte, value, __ATOMIC_RELAXED);
#endif
}

// word &= mask
CAB_INLINE void relaxed_and(std::uint16_t& word, std::uint16_t mask) {
#if CAB_MSVC
  _InterlockedAnd16(reinterpret_cast<volatile short*>(&word), static_cast<short>(mask));
#else
  __atomic_fetch_and(&word, mask, __ATOMIC_RELAXED);
#endif
}

// word |= mask
CAB_INLINE void relaxed_or(std::uint16_t& word, std::uint16_t mask) {
#if CAB_MSVC
  _InterlockedOr16(reinterpret_cast<volatile short*>(&word), static_cast<short>(mask));
#else
  __atomic_fetch_or(&word, mask, __ATOMIC_RELAXED);
#endif
}

// word += amount; returns the value before.
CAB_INLINE std::uint32_t relaxed_add(std::uint32_t& word, std::uint32_t amount) {
#if CAB_MSVC
  return static_cast<std::uint32_t>(
      _InterlockedExchangeAdd(reinterpret_cast<volatile long*>(&word), static_cast<long>(amount)));
#else
  return __atomic_fetch_add(&word, amount, __ATOMIC_RELAXED);
#endif
}

// word = value; returns the value before.
CAB_INLINE std::uint32_t relaxed_exchange(std::uint32_t& word, std::uint32_t value) {
#if CAB_MSVC
  return static_cast<std::uint32_t>(
      _InterlockedExchange(reinterpret_cast<volatile long*>(&word), static_cast<long>(value)));
#else
  return __atomic_exchange_n(&word, value, __ATOMIC_RELAXED);
#endif
}

}  // namespace cab
