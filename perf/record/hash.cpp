#include <cab/replay.h>

namespace cab::record {
namespace {

std::uint64_t add_bytes(std::uint64_t hash, const void* data, std::size_t size) {
  const auto* const bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3u;
  return hash;
}

}  // namespace

// The structs have no padding (words.h), and the machines that the library runs on are little-endian.
std::uint64_t hash_hits(Span<const Hit> hits, Span<const Contact> contacts) noexcept {
  constexpr std::uint64_t kStart = 0xcbf29ce484222325u;
  return add_bytes(add_bytes(kStart, hits.data, hits.size * sizeof(Hit)), contacts.data,
                   contacts.size * sizeof(Contact));
}

}  // namespace cab::record
