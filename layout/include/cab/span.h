// Span: how the public API passes arrays.
#pragma once

// Every header of the C++ API includes this one before it says anything itself. The C API needs no C++17.
#if defined(_MSVC_LANG) ? _MSVC_LANG < 201703L : __cplusplus < 201703L
#error "cab needs C++17: compile with -std=c++17 or later (/std:c++17), or link CMake's target cab::cab, which sets it"
#endif

#include <cstddef>
#include <type_traits>

namespace cab {

// A borrowed array: `size` values of T, one after the other, from `data` on. A span owns nothing: the array must live
// as long as the span is used, and stay where it is. A span of const values may also be made of a temporary, for the
// length of one call.
template <class T>
struct Span {
  // The first value. May be null if size is 0.
  T* data = nullptr;

  // How many values there are, not bytes. 0 (default): empty.
  std::size_t size = 0;

  // Empty.
  constexpr Span() noexcept = default;

  // `count` values from `first` on.
  constexpr Span(T* first, std::size_t count) noexcept : data(first), size(count) {}

  // All values of an array.
  template <std::size_t kCount>
  constexpr Span(T (&array)[kCount]) noexcept : data(array), size(kCount) {}

  // All values of what has data() and size(), such as a std::vector or a std::array of T. Of a constant one, or of a
  // temporary, only if T is const.
  template <class Container, class U = std::remove_pointer_t<decltype(static_cast<Container*>(nullptr)->data())>,
            std::enable_if_t<std::is_convertible_v<U (*)[], T (*)[]>, int> = 0>
  constexpr Span(Container& container) noexcept : data(container.data()), size(container.size()) {}
  template <class Container, class U = std::remove_pointer_t<decltype(static_cast<const Container*>(nullptr)->data())>,
            std::enable_if_t<std::is_const_v<T> && std::is_convertible_v<U (*)[], T (*)[]>, int> = 0>
  constexpr Span(const Container& container) noexcept : data(container.data()), size(container.size()) {}

  // The values of another span, as constants.
  template <class U, std::enable_if_t<!std::is_same_v<U, T> && std::is_convertible_v<U (*)[], T (*)[]>, int> = 0>
  constexpr Span(const Span<U>& other) noexcept : data(other.data), size(other.size) {}

  // The first value, and one past the last, for range-based loops.
  constexpr T* begin() const noexcept { return data; }
  constexpr T* end() const noexcept { return data + size; }

  // Value i, which must be below size. Not checked.
  constexpr T& operator[](std::size_t i) const noexcept { return data[i]; }

  // Whether size is 0.
  constexpr bool empty() const noexcept { return size == 0; }
};

}  // namespace cab
