// The arena: the memory that it gives, and that all of it is released.
#include "layout/arena.h"
#include "tests/aligned_memory.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <utility>

namespace {

using namespace cab;

// An allocator that records its open allocations, fills them with a pattern, and fails on demand.
struct Ledger {
  std::map<void*, std::pair<std::size_t, std::size_t>> out;  // bytes and alignment
  int calls_left = -1;                                       // -1: no limit
  int wrong_releases = 0;

  Allocator allocator() { return {this, allocate, release}; }

  static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
    Ledger& ledger = *static_cast<Ledger*>(user);
    if (ledger.calls_left == 0) return nullptr;
    if (ledger.calls_left > 0) --ledger.calls_left;
    void* const memory = tests::allocate_aligned(bytes, alignment);
    std::memset(memory, 0xa5, bytes);
    ledger.out[memory] = {bytes, alignment};
    return memory;
  }

  static void release(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
    Ledger& ledger = *static_cast<Ledger*>(user);
    const auto found = ledger.out.find(memory);
    if (found == ledger.out.end() || found->second != std::pair(bytes, alignment)) {
      ++ledger.wrong_releases;
      return;
    }
    ledger.out.erase(found);
    tests::free_aligned(memory);
  }
};

struct alignas(256) Wide {
  std::uint32_t values[64];
};

template <class T>
bool all_zero(Span<T> span) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(span.data);
  for (std::size_t i = 0; i < span.size * sizeof(T); ++i)
    if (bytes[i] != 0) return false;
  return true;
}

template <class T>
bool aligned(const T* pointer, std::size_t alignment) {
  return reinterpret_cast<std::uintptr_t>(pointer) % alignment == 0;
}

}  // namespace

TEST_CASE("an arena gives zeroed values, aligned to a cache line or wider where the type asks for it") {
  Ledger ledger;
  Arena arena(ledger.allocator());
  const auto bytes = arena.allocate<std::uint8_t>(3);
  const auto doubles = arena.allocate<double>(1000);
  const auto wide = arena.allocate<Wide>(5);
  CHECK(bytes.size == 3);
  CHECK(doubles.size == 1000);
  CHECK(wide.size == 5);
  CHECK(aligned(bytes.data, 64));
  CHECK(aligned(doubles.data, 64));
  CHECK(aligned(wide.data, 256));
  CHECK(all_zero(bytes));
  CHECK(all_zero(doubles));
  CHECK(all_zero(wide));
}

TEST_CASE("blocks of an arena do not overlap") {
  Ledger ledger;
  Arena arena(ledger.allocator());
  Span<std::uint32_t> blocks[20];
  for (std::uint32_t b = 0; b < 20; ++b) {
    blocks[b] = arena.allocate<std::uint32_t>(b + 1);
    for (std::uint32_t& value : blocks[b]) value = b;
  }
  for (std::uint32_t b = 0; b < 20; ++b)
    for (const std::uint32_t value : blocks[b]) CHECK(value == b);
}

TEST_CASE("an arena refuses a product that std::size_t does not hold, and gives one that it does") {
  Arena arena(default_allocator());
  constexpr std::size_t kMost = static_cast<std::size_t>(-1);
  CHECK_THROWS_AS(arena.allocate<std::uint8_t>(kMost / 2, 3), std::bad_alloc);
  CHECK_THROWS_AS(arena.allocate<std::uint8_t>(3, kMost / 2), std::bad_alloc);
  CHECK(arena.bytes() == 0);
  CHECK(arena.allocate<float>(7, 6).size == 42);
  CHECK(arena.allocate<float>(7, 0).empty());
}

TEST_CASE("an arena asks for no memory when nothing is asked of it") {
  Ledger ledger;
  Arena arena(ledger.allocator());
  CHECK(arena.allocate<double>(0).empty());
  CHECK(arena.copy(Span<const double>{}).empty());
  CHECK(ledger.out.empty());
  CHECK(arena.bytes() == 0);
}

TEST_CASE("a copy in an arena is equal and apart") {
  Arena arena(default_allocator());
  int source[4] = {3, 1, 4, 1};
  const auto copied = arena.copy(Span<const int>{source, 4});
  source[2] = 0;
  REQUIRE(copied.size == 4);
  CHECK(copied[0] == 3);
  CHECK(copied[2] == 4);
}

TEST_CASE("an arena gives every block back, with the size and alignment that it was taken with") {
  Ledger ledger;
  {
    Arena arena(ledger.allocator());
    for (std::size_t n = 1; n < 40; ++n) {
      CHECK(arena.allocate<float>(n).size == n);
      CHECK(arena.allocate<Wide>(n).size == n);
    }
    std::size_t bytes_out = 0;
    for (const auto& block : ledger.out) bytes_out += block.second.first;
    CHECK(arena.bytes() == bytes_out);
    arena.release();
    CHECK(ledger.out.empty());
    CHECK(arena.bytes() == 0);
    CHECK(arena.allocate<float>(7).size == 7);  // usable again
    CHECK(ledger.out.size() == 1);
  }
  CHECK(ledger.out.empty());
  CHECK(ledger.wrong_releases == 0);
}

TEST_CASE("an arena that gets no memory throws and keeps what it has") {
  Ledger ledger;
  {
    Arena arena(ledger.allocator());
    ledger.calls_left = 2;
    const auto first = arena.allocate<int>(8);
    CHECK(arena.allocate<int>(8).size == 8);
    const std::size_t bytes = arena.bytes();
    CHECK_THROWS_AS((void)arena.allocate<int>(8), std::bad_alloc);
    CHECK(arena.bytes() == bytes);
    CHECK(ledger.out.size() == 2);
    CHECK(all_zero(first));
  }
  CHECK(ledger.out.empty());
}

TEST_CASE("a count whose bytes would wrap around throws before the allocator is asked") {
  Ledger ledger;
  Arena arena(ledger.allocator());
  CHECK_THROWS_AS((void)arena.allocate<double>(static_cast<std::size_t>(-1) / 4), std::bad_alloc);
  CHECK_THROWS_AS((void)arena.allocate<Wide>(static_cast<std::size_t>(-1)), std::bad_alloc);
  CHECK(ledger.out.empty());
}
