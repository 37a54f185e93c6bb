// Disjoint sets of indices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace cab::scenes {

// Sets of indices below a count, at first each alone. The lowest index of a set stands for it.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : first_(count) { std::iota(first_.begin(), first_.end(), 0u); }

  std::uint32_t find(std::uint32_t i) {
    while (first_[i] != i) i = first_[i] = first_[first_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    first_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> first_;
};

}  // namespace cab::scenes
