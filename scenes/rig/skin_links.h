// The joints of a skin that get links, and how the skin's triangles are shared among these.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "scenes/rig/posed_skin.h"

namespace cab::scenes {

struct LinkMap {
  std::vector<std::uint32_t> joints;         // of each link
  std::vector<std::int32_t> parents;         // of each link
  std::vector<std::uint32_t> link_of_joint;  // the link that stands for each joint
};

// Chooses the joints that get links, by rules.kept_joints and rules.least_reach. Without links if no joint qualifies.
LinkMap map_links(const CheckedSkin& skin, Span<const std::int32_t> parents, const rig::BodyRules& rules,
                  const std::vector<Affine>& pose);

// The share of a triangle's weight that each link has.
std::map<std::uint32_t, double> link_weights(const CheckedSkin& skin, const LinkMap& map, const Triangle& triangle);

// The link with the largest share.
std::uint32_t owner_of(const std::map<std::uint32_t, double>& weights);

// Parents with their children, and the owner of each triangle with the links that have at least a share of it.
std::vector<LinkPair> neighbour_links(const CheckedSkin& skin, const LinkMap& map, double shared_weight);

}  // namespace cab::scenes
