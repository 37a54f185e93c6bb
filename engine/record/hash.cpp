#include <cab/replay.h>

#include <cstring>

#include "layout/bit_hash.h"

namespace cab::record {
namespace {

template <class Words>
void add_words(cab::BitHash& hash, Span<const Words> structs) {
  for (const Words& entry : structs) {
    std::uint32_t words[sizeof(Words) / 4];
    std::memcpy(words, &entry, sizeof words);
    for (const std::uint32_t word : words) hash.add(word);
  }
}

}  // namespace

std::uint64_t hash_hits(Span<const Hit> hits, Span<const Contact> contacts) noexcept {
  cab::BitHash hash;
  add_words(hash, hits);
  add_words(hash, contacts);
  return hash.value();
}

}  // namespace cab::record
