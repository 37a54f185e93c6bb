// Which links hits name, whatever their batches.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

namespace cab::tests {

// Two instances, then a link of each.
using HitLinks = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;

inline std::set<HitLinks> links_of(const std::vector<Hit>& hits) {
  std::set<HitLinks> out;
  for (const Hit& hit : hits) out.insert({hit.instance_a, hit.instance_b, hit.link_a, hit.link_b});
  return out;
}

}  // namespace cab::tests
