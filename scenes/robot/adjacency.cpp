#include "scenes/robot/adjacency.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace cab::scenes {

std::vector<bool> shaped_links(const Robot& robot) {
  std::vector<bool> shaped(robot.links.size());
  for (const BodyLeaf& leaf : robot.body.leaves) shaped[leaf.link] = true;
  return shaped;
}

std::vector<LinkPair> adjacent_pairs(const Robot& robot) {
  const std::vector<bool> shaped = shaped_links(robot);
  const std::size_t count = robot.links.size();
  // Links without shapes that are connected have one group, which is named after the first of them.
  std::vector<std::uint32_t> group(count);
  std::iota(group.begin(), group.end(), 0);
  std::vector<std::vector<std::uint32_t>> around(count);  // of each group: the links with shapes about it
  std::vector<LinkPair> pairs;
  for (std::uint32_t l = 1; l < count; ++l) {
    if (robot.links[l].floats) continue;
    const auto parent = static_cast<std::uint32_t>(robot.body.link_parents[l]);
    if (shaped[l] && shaped[parent]) {
      pairs.push_back({parent, l});
    } else if (!shaped[l] && !shaped[parent]) {
      group[l] = group[parent];  // the parent comes first, so its group is known
    } else {
      // Of a child without shapes the group is its own so far.
      around[shaped[l] ? group[parent] : group[l]].push_back(shaped[l] ? l : parent);
    }
  }
  for (const std::vector<std::uint32_t>& links : around)
    for (std::size_t k = 0; k < links.size(); ++k)
      for (std::size_t n = 0; n < k; ++n) pairs.push_back({std::min(links[n], links[k]), std::max(links[n], links[k])});
  return pairs;
}

}  // namespace cab::scenes
