// Lists of pairs in fixed memory: what traversals push and what they find.
#pragma once

#include <cab/types.h>

#include <cassert>

namespace cab {

// Two nodes whose boxes are to be tested, of one candidate pair of the current chunk.
struct NodePair {
  std::uint32_t candidate;
  std::uint16_t a;
  std::uint16_t b;
};

// Two leaves whose boxes overlap. candidate: for characters a candidate pair of the chunk, for sequences the lane of
// the tile.
struct LeafPair {
  std::uint32_t candidate;
  std::uint16_t a;
  std::uint16_t b;
};

// Two leaves of two tiles, and the lanes in which their boxes overlap.
struct TilePair {
  std::uint16_t a;
  std::uint16_t b;
  std::uint32_t lanes;
};

// A list of fixed capacity. Whoever makes it sizes it for the worst case, so push never fails.
template <class T>
struct FixedList {
  T* data = nullptr;
  std::uint32_t capacity = 0;
  std::uint32_t size = 0;

  void clear() { size = 0; }
  // Always inlined, because kernels of every instruction set use it.
  __attribute__((always_inline)) void push(const T& value) {
    assert(size < capacity);
    data[size++] = value;
  }
  __attribute__((always_inline)) T pop() { return data[--size]; }
  bool empty() const { return size == 0; }
  T* begin() const { return data; }
  T* end() const { return data + size; }
};

}  // namespace cab
