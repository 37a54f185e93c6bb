#include "layout/arena.h"

#include <cstring>

namespace cab {

// Heads each block; the caller's memory follows after one alignment unit.
struct Arena::Block {
  Block* next;
  std::size_t bytes;
  std::size_t alignment;
};

namespace {

void* new_aligned(void*, std::size_t bytes, std::size_t alignment) {
  return ::operator new(bytes, std::align_val_t(alignment), std::nothrow);
}

void delete_aligned(void*, void* memory, std::size_t, std::size_t alignment) {
  ::operator delete(memory, std::align_val_t(alignment));
}

}  // namespace

Allocator default_allocator() noexcept { return {nullptr, new_aligned, delete_aligned}; }

void* Arena::allocate_bytes(std::size_t bytes, std::size_t alignment) {
  const std::size_t total = bytes + alignment;
  void* memory = allocator_.allocate(allocator_.user, total, alignment);
  if (!memory) throw std::bad_alloc();
  blocks_ = new (memory) Block{blocks_, total, alignment};
  bytes_ += total;
  void* payload = static_cast<std::byte*>(memory) + alignment;
  std::memset(payload, 0, bytes);
  return payload;
}

void Arena::release() noexcept {
  while (blocks_) {
    const Block block = *blocks_;
    allocator_.release(allocator_.user, blocks_, block.bytes, block.alignment);
    blocks_ = block.next;
  }
  bytes_ = 0;
}

}  // namespace cab
