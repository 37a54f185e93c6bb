// Lists of pairs in fixed memory: the pairs that traversals push, and the pairs that they find.
#pragma once

#include "layout/compiler.h"

#include <cab/types.h>

#include <cassert>

namespace cab {

// Two nodes whose boxes are to be tested. candidate: the candidate of the current chunk to which they belong.
struct NodePair {
  std::uint32_t candidate;
  std::uint16_t a;
  std::uint16_t b;
};

// Two leaves whose boxes overlap. candidate: for characters the candidate of the chunk, for sequences the lane of the
// tile.
struct LeafPair {
  std::uint32_t candidate;
  std::uint16_t a;
  std::uint16_t b;
};

// Two nodes of two tiles, and lanes: on the stack those in which they are to be tested, in the result those in which
// two leaves overlap.
struct TilePair {
  std::uint16_t a;
  std::uint16_t b;
  std::uint32_t lanes;
};

// A list of fixed capacity in memory that it does not own. Its creator sizes it for the worst case, so push never
// fails.
template <class T>
struct FixedList {
  T* data = nullptr;
  std::uint32_t capacity = 0;
  std::uint32_t size = 0;

  void clear() { size = 0; }
  // Always inlined, because kernels of every instruction set use it.
  CAB_INLINE void push(const T& value) {
    assert(size < capacity);
    data[size++] = value;
  }
  CAB_INLINE T pop() { return data[--size]; }
  bool empty() const { return size == 0; }
  T* begin() const { return data; }
  T* end() const { return data + size; }
};

}  // namespace cab
