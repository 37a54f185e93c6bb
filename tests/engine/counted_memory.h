// An allocator that counts its bytes, the most that it has held, and its calls.
#pragma once

#include <cab/cab.h>

#include <algorithm>
#include <cstddef>
#include <new>

namespace cab::tests {

struct CountedMemory {
  std::size_t bytes = 0, most = 0, calls = 0;
  Allocator allocator() {
    return {this,
            [](void* user, std::size_t size, std::size_t alignment) -> void* {
              auto& self = *static_cast<CountedMemory*>(user);
              self.bytes += size;
              self.most = std::max(self.most, self.bytes);
              ++self.calls;
              return ::operator new(size, std::align_val_t(alignment));
            },
            [](void* user, void* memory, std::size_t size, std::size_t alignment) {
              static_cast<CountedMemory*>(user)->bytes -= size;
              ::operator delete(memory, std::align_val_t(alignment));
            }};
  }
};

}  // namespace cab::tests
