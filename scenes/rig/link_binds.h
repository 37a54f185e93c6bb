// One inverse bind matrix per link, for a skin whose meshes may each have their own.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scenes/rig/skin_links.h"

namespace cab::scenes {

// A vertex v that a bone moves is at the pose of the bone's link * of_link of that link * moves[move_of_bone] * v, in
// the rest pose and wherever the joint does not change its scale.
struct LinkBinds {
  std::vector<Affine> of_link;
  std::vector<std::uint32_t> move_of_bone;   // the same for all bones of a vertex
  std::vector<std::optional<Affine>> moves;  // empty: the identity
};

// Makes them from the bones that move triangles. Bones that have a vertex in common form a group. The largest group
// keeps its own space. Another that has joints in common with it is moved to where its bones have the same matrices.
// Writes the bone at fault. Statuses: kNoInverse, kBindsDiffer.
rig::SkinStatus make_link_binds(const CheckedSkin& skin, const LinkMap& map, const std::vector<Affine>& rest,
                                LinkBinds& out, std::uint32_t& bad_bone);

}  // namespace cab::scenes
