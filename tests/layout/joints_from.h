// The judge of the number of joints between links.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

namespace cab::oracle {

// The number of joints from one link to every link, by breadth-first search over joints in both directions.
inline std::vector<std::uint32_t> joints_from(const std::vector<std::int32_t>& parents, std::uint32_t from) {
  std::vector<std::vector<std::uint32_t>> beside(parents.size());
  for (std::uint32_t link = 1; link < parents.size(); ++link) {
    beside[link].push_back(static_cast<std::uint32_t>(parents[link]));
    beside[static_cast<std::uint32_t>(parents[link])].push_back(link);
  }
  constexpr std::uint32_t kUnseen = 0xffffffffu;
  std::vector<std::uint32_t> joints(parents.size(), kUnseen);
  joints[from] = 0;
  for (std::deque<std::uint32_t> front = {from}; !front.empty(); front.pop_front())
    for (const std::uint32_t next : beside[front.front()])
      if (joints[next] == kUnseen) {
        joints[next] = joints[front.front()] + 1;
        front.push_back(next);
      }
  return joints;
}

}  // namespace cab::oracle
