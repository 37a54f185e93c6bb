#include "layout/arena.h"

#include <cstring>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace cab {

// The head of each block. The caller's memory follows after one alignment unit.
struct Arena::Block {
  Block* next;
  std::size_t bytes;
  std::size_t alignment;
};

namespace {

// On Linux blocks of at least two huge pages are aligned to huge pages and ask for them. A frame with many instances
// reads such blocks in an order that would otherwise miss the TLB at almost every instance.
[[maybe_unused]] constexpr std::size_t kHugePage = std::size_t{1} << 21;

std::align_val_t block_alignment([[maybe_unused]] std::size_t bytes, std::size_t alignment) {
#ifdef MADV_HUGEPAGE
  if (bytes >= 2 * kHugePage && alignment < kHugePage) return std::align_val_t(kHugePage);
#endif
  return std::align_val_t(alignment);
}

void* new_aligned(void*, std::size_t bytes, std::size_t alignment) {
  const std::align_val_t to = block_alignment(bytes, alignment);
  void* memory = ::operator new(bytes, to, std::nothrow);
#ifdef MADV_HUGEPAGE
  if (memory && to == std::align_val_t(kHugePage))
    madvise(memory, bytes, MADV_HUGEPAGE);  // a hint: failure is not an error
#endif
  return memory;
}

void delete_aligned(void*, void* memory, std::size_t bytes, std::size_t alignment) {
  ::operator delete(memory, block_alignment(bytes, alignment));
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
