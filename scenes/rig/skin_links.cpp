// The joints of a skin that get links, and how the skin's triangles are shared among these.
#include "scenes/rig/skin_links.h"

#include <algorithm>
#include <set>

namespace cab::scenes {
namespace {

// How far each joint reaches in a pose: to its children, and to the vertices that it moves most. -1 if it moves no
// vertex.
std::vector<double> joint_reaches(const CheckedSkin& skin, Span<const std::int32_t> parents,
                                  const std::vector<Affine>& pose) {
  std::vector<double> reaches(skin.joint_count(), -1);
  const std::vector<Vec3> vertices = skin.vertices(pose);
  for (const Triangle& triangle : skin.triangles()) {
    for (const std::uint32_t v : triangle) {
      const auto& influences = skin.influences(v);
      const auto strongest = std::max_element(influences.begin(), influences.end(),
                                              [](const auto& a, const auto& b) { return a.weight < b.weight; });
      for (const auto& influence : influences) {
        double& reach = reaches[skin.joint_of(influence.bone)];
        reach = std::max(reach, 0.0);
      }
      const std::uint32_t joint = skin.joint_of(strongest->bone);
      reaches[joint] = std::max(reaches[joint], length(vertices[v] - pose[joint].translation));
    }
  }
  for (std::size_t j = 0; j < reaches.size(); ++j) {
    if (parents[j] < 0) continue;
    const auto parent = static_cast<std::size_t>(parents[j]);
    if (reaches[parent] >= 0)
      reaches[parent] = std::max(reaches[parent], length(pose[j].translation - pose[parent].translation));
  }
  return reaches;
}

}  // namespace

LinkMap map_links(const CheckedSkin& skin, Span<const std::int32_t> parents, const rig::BodyRules& rules,
                  const std::vector<Affine>& pose) {
  LinkMap map;
  std::vector<bool> kept(skin.joint_count(), false);
  for (const std::uint32_t joint : rules.kept_joints) kept[joint] = true;
  if (rules.kept_joints.empty()) {
    const std::vector<double> reaches = joint_reaches(skin, parents, pose);
    for (std::size_t j = 0; j < kept.size(); ++j) kept[j] = reaches[j] >= static_cast<double>(rules.least_reach);
  }
  std::vector<std::int32_t> above(kept.size());  // the link at or above each joint, or -1
  for (std::uint32_t j = 0; j < kept.size(); ++j) {
    above[j] = parents[j] < 0 ? -1 : above[static_cast<std::size_t>(parents[j])];
    if (!kept[j]) continue;
    // Links without a link above them hang from the first one, since there is one root.
    map.parents.push_back(map.joints.empty() ? -1 : std::max(above[j], 0));
    above[j] = static_cast<std::int32_t>(map.joints.size());
    map.joints.push_back(j);
  }
  for (const std::int32_t link : above) map.link_of_joint.push_back(static_cast<std::uint32_t>(std::max(link, 0)));
  return map;
}

std::map<std::uint32_t, double> link_weights(const CheckedSkin& skin, const LinkMap& map, const Triangle& triangle) {
  std::map<std::uint32_t, double> weights;
  for (const std::uint32_t v : triangle)
    for (const auto& [bone, weight] : skin.influences(v)) weights[map.link_of_joint[skin.joint_of(bone)]] += weight / 3;
  return weights;
}

std::uint32_t owner_of(const std::map<std::uint32_t, double>& weights) {
  return std::max_element(weights.begin(), weights.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

std::vector<LinkPair> neighbour_links(const CheckedSkin& skin, const LinkMap& map, double shared_weight) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t l = 1; l < map.parents.size(); ++l) pairs.insert({static_cast<std::uint32_t>(map.parents[l]), l});
  for (const Triangle& triangle : skin.triangles()) {
    const std::map<std::uint32_t, double> weights = link_weights(skin, map, triangle);
    const std::uint32_t owner = owner_of(weights);
    for (const auto& [link, weight] : weights)
      if (link != owner && weight >= shared_weight) pairs.insert({std::min(link, owner), std::max(link, owner)});
  }
  std::vector<LinkPair> neighbours;
  for (const auto& [a, b] : pairs) neighbours.push_back({a, b});
  return neighbours;
}

}  // namespace cab::scenes
