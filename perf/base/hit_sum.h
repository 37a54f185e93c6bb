// A sum over hits that does not depend on their order, so that lists need not be merged to be compared.
#pragma once

#include <cab/types.h>

#include <cstdint>

namespace cab::perf {

// A number of all bits of a hit and its frame.
inline std::uint64_t hit_number(std::uint32_t frame, const Hit& hit) {
  std::uint64_t out = 0;
  const auto add = [&out](std::uint64_t word) {
    // The finish of MurmurHash3 in 64 bits: each bit of the input changes about half of the bits.
    out = (out ^ word) + 0x9e3779b97f4a7c15u;
    out = (out ^ (out >> 33)) * 0xff51afd7ed558ccdu;
    out = (out ^ (out >> 33)) * 0xc4ceb9fe1a85ec53u;
    out ^= out >> 33;
  };
  add(std::uint64_t{frame} << 32 | hit.batch_a.value);
  add(std::uint64_t{hit.instance_a} << 32 | hit.batch_b.value);
  add(std::uint64_t{hit.instance_b} << 32 | std::uint32_t{hit.link_a} << 16 | hit.link_b);
  add(std::uint32_t{hit.leaf_a} << 16 | hit.leaf_b);
  return out;
}

inline std::uint64_t hits_sum(std::uint32_t frame, Span<const Hit> hits) {
  std::uint64_t sum = 0;
  for (const Hit& hit : hits) sum += hit_number(frame, hit);
  return sum;
}

}  // namespace cab::perf
