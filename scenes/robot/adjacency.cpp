#include "scenes/robot/adjacency.h"

#include <cstdint>

namespace cab::scenes {
namespace {

std::uint32_t parent_of(const Robot& robot, std::uint32_t link) {
  return static_cast<std::uint32_t>(robot.body.link_parents[link]);
}

// The first link of each link's rigid body.
std::vector<std::uint32_t> rigid_bodies(const Robot& robot) {
  std::vector<std::uint32_t> first(robot.links.size());
  for (std::uint32_t l = 0; l < first.size(); ++l)  // parents come before their children
    first[l] = robot.links[l].welded ? first[parent_of(robot, l)] : l;
  return first;
}

// Whether joints connect two links directly, or over links without shapes with one joint that moves at most.
bool connected(const Robot& robot, const std::vector<bool>& shaped, std::uint32_t a, std::uint32_t b) {
  std::uint32_t at[2] = {a, b}, moving = 0;
  while (at[0] != at[1]) {
    std::uint32_t& later = at[0] > at[1] ? at[0] : at[1];  // it is not above the other
    if (robot.links[later].floats) return false;
    if (!robot.links[later].welded && ++moving > 1) return false;
    later = parent_of(robot, later);
    const bool is_between = later != a && later != b;
    if (is_between && (shaped[later] || later == 0)) return false;
  }
  return true;
}

}  // namespace

std::vector<bool> shaped_links(const Robot& robot) {
  std::vector<bool> shaped(robot.links.size());
  for (const BodyLeaf& leaf : robot.body.leaves) shaped[leaf.link] = true;
  return shaped;
}

std::vector<LinkPair> adjacent_pairs(const Robot& robot) {
  const std::vector<bool> shaped = shaped_links(robot);
  const std::vector<std::uint32_t> rigid = rigid_bodies(robot);
  std::vector<LinkPair> pairs;
  for (std::uint32_t a = 0; a < rigid.size(); ++a)
    for (std::uint32_t b = a + 1; b < rigid.size(); ++b)
      if (shaped[a] && shaped[b] && (rigid[a] == rigid[b] || connected(robot, shaped, a, b))) pairs.push_back({a, b});
  return pairs;
}

}  // namespace cab::scenes
