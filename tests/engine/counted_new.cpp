#include "tests/engine/counted_new.h"

#include "tests/aligned_memory.h"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace cab::tests {

std::atomic<std::uint64_t> new_calls{0}, malloc_calls{0};
std::atomic<std::int64_t> news_held{0};
std::atomic<bool> all_news_fail{false};

std::int64_t& news_until_failure() {
  thread_local std::int64_t calls = -1;
  return calls;
}

}  // namespace cab::tests

namespace {

using namespace cab::tests;

void* counted_new(std::size_t bytes, std::size_t alignment) noexcept {
  new_calls.fetch_add(1, std::memory_order_relaxed);
  if (all_news_fail.load(std::memory_order_relaxed) || news_until_failure() == 0) return nullptr;
  if (news_until_failure() > 0) --news_until_failure();
  void* const memory = alignment <= alignof(std::max_align_t) ? std::malloc(bytes ? bytes : 1)
                                                              : cab::tests::allocate_aligned(bytes, alignment);
  if (memory) news_held.fetch_add(1, std::memory_order_relaxed);
  return memory;
}

void* counted_new_or_throw(std::size_t bytes, std::size_t alignment) {
  void* const memory = counted_new(bytes, alignment);
  if (!memory) throw std::bad_alloc();
  return memory;
}

// Not inlined: GCC 12 would take an inlined free for a mismatch with new.
[[gnu::noinline]] void give_back(void* memory) noexcept {
  if (memory) news_held.fetch_sub(1, std::memory_order_relaxed);
  std::free(memory);
}
[[gnu::noinline]] void give_back_aligned(void* memory, std::align_val_t alignment) noexcept {
  if (static_cast<std::size_t>(alignment) <= alignof(std::max_align_t)) return give_back(memory);
  if (memory) news_held.fetch_sub(1, std::memory_order_relaxed);
  cab::tests::free_aligned(memory);
}

}  // namespace

void* operator new(std::size_t bytes) { return counted_new_or_throw(bytes, 1); }
void* operator new[](std::size_t bytes) { return counted_new_or_throw(bytes, 1); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return counted_new_or_throw(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return counted_new_or_throw(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return counted_new(bytes, 1); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return counted_new(bytes, 1); }
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return counted_new(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return counted_new(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { give_back(memory); }
void operator delete[](void* memory) noexcept { give_back(memory); }
void operator delete(void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete[](void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete(void* memory, std::align_val_t to) noexcept { give_back_aligned(memory, to); }
void operator delete[](void* memory, std::align_val_t to) noexcept { give_back_aligned(memory, to); }
void operator delete(void* memory, std::size_t, std::align_val_t to) noexcept { give_back_aligned(memory, to); }
void operator delete[](void* memory, std::size_t, std::align_val_t to) noexcept { give_back_aligned(memory, to); }

#if CAB_TEST_COUNTS_MALLOC
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* memory, std::size_t bytes);

void* malloc(std::size_t bytes) {
  malloc_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  malloc_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  malloc_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(memory, bytes);
}
}
#endif
