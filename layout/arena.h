// An arena owns every block that one object (an articulation, a batch, a worker) takes from the engine's allocator. It
// gives all blocks back at once.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <new>
#include <type_traits>

namespace cab {

// The built-in allocator: aligned operator new and delete. On Linux it asks for huge pages for large blocks.
Allocator default_allocator() noexcept;

class Arena {
 public:
  explicit Arena(const Allocator& allocator) noexcept : allocator_(allocator) {}
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;
  ~Arena() { release(); }

  // Returns `count` zeroed values of T, aligned to 64 bytes or to T's own alignment, whichever is larger. Returns an
  // empty span for a count of 0. Throws std::bad_alloc.
  template <class T>
  Span<T> allocate(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T> && std::is_trivially_copyable_v<T>);
    if (count == 0) return {};
    if (count > static_cast<std::size_t>(-1) / 2 / sizeof(T)) throw std::bad_alloc();
    return {static_cast<T*>(allocate_bytes(count * sizeof(T), alignof(T) > 64 ? alignof(T) : 64)), count};
  }

  // The same for `count` times `each` values, whose number may exceed std::size_t.
  template <class T>
  Span<T> allocate(std::size_t count, std::size_t each) {
    if (each > 0 && count > static_cast<std::size_t>(-1) / each) throw std::bad_alloc();
    return allocate<T>(count * each);
  }

  // Returns a copy of a span. Throws std::bad_alloc.
  template <class T>
  Span<std::remove_const_t<T>> copy(Span<T> source) {
    auto out = allocate<std::remove_const_t<T>>(source.size);
    for (std::size_t i = 0; i < source.size; ++i) out[i] = source[i];
    return out;
  }

  // Gives every block back. Earlier spans of this arena must not be used any more.
  void release() noexcept;

  std::size_t bytes() const noexcept { return bytes_; }

 private:
  void* allocate_bytes(std::size_t bytes, std::size_t alignment);

  struct Block;
  Allocator allocator_;
  Block* blocks_ = nullptr;
  std::size_t bytes_ = 0;
};

// A read-only span of the same values.
template <class T>
Span<const T> constant(Span<T> span) {
  return {span.data, span.size};
}

}  // namespace cab
