// Span: how the public API passes sequences.
#pragma once

#include <cstddef>

namespace cab {

// A borrowed, contiguous sequence. Empty when size is 0; data may then be null.
template <class T>
struct Span {
  T* data = nullptr;
  std::size_t size = 0;

  constexpr T* begin() const noexcept { return data; }
  constexpr T* end() const noexcept { return data + size; }
  constexpr T& operator[](std::size_t i) const noexcept { return data[i]; }
  constexpr bool empty() const noexcept { return size == 0; }
};

}  // namespace cab
