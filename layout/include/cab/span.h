// Span: how the public API passes arrays.
#pragma once

#include <cstddef>

namespace cab {

// A borrowed array: `size` values of T, one after the other, from `data` on. A span owns nothing: the array must live
// as long as the span is used.
template <class T>
struct Span {
  // The first value. May be null if size is 0.
  T* data = nullptr;

  // How many values there are, not bytes. 0 (default): empty.
  std::size_t size = 0;

  // The first value, and one past the last, for range-based loops.
  constexpr T* begin() const noexcept { return data; }
  constexpr T* end() const noexcept { return data + size; }

  // Value i, which must be below size. Not checked.
  constexpr T& operator[](std::size_t i) const noexcept { return data[i]; }

  // Whether size is 0.
  constexpr bool empty() const noexcept { return size == 0; }
};

}  // namespace cab
