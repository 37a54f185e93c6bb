// Lists of fixed capacity in an arena.
#pragma once

#include "layout/arena.h"
#include "layout/pair_list.h"

namespace cab {

// An empty list with room for `capacity` values. Throws std::bad_alloc.
template <class T>
FixedList<T> make_list(Arena& arena, std::size_t capacity) {
  return {arena.allocate<T>(capacity).data, static_cast<std::uint32_t>(capacity), 0};
}

}  // namespace cab
