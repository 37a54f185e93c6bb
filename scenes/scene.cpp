// Descriptions of a scene's characters for the engine, and hashes of a scene.
#include "scenes/scene.h"

#include "layout/bit_hash.h"

namespace cab::scenes {

ArticulationStorage::ArticulationStorage(const Character& character)
    : parts_(character.leaves.size()), leaves_(character.leaves.size()) {
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    const BodyLeaf& body = character.leaves[l];
    parts_[l].reserve(body.parts.size());
    for (const ShapePart& part : body.parts) {
      parts_[l].push_back(part.shape);
      parts_[l].back().vertices = part.vertices;
    }
    leaves_[l].link = body.link;
    leaves_[l].box = body.box;
    leaves_[l].parts = parts_[l];
    leaves_[l].triangles = body.triangles;
  }
  const BodySkin& skin = character.skin;
  desc_.skin = {skin.vertices, skin.influence_count, skin.influence_links, skin.influence_weights, skin.inverse_bind};
  desc_.link_parents = character.link_parents;
  desc_.link_joints = character.link_joints;
  desc_.leaves = leaves_;
  desc_.ignored_pairs = character.ignored_pairs;
  desc_.ignored_hops = character.ignored_hops;
  if (character.rest_frame)
    desc_.rest_pose = {character.pose_format,
                       character.poses.data() + std::size_t{*character.rest_frame} * character.link_parents.size() *
                                                    pose_floats(character.pose_format),
                       0, 0};
}

std::vector<BodyLeaf> copied(Span<const Leaf> leaves) {
  std::vector<BodyLeaf> bodies;
  for (const Leaf& leaf : leaves) {
    bodies.push_back({leaf.link, leaf.box, {}, {leaf.triangles.begin(), leaf.triangles.end()}});
    for (const ConvexPart& part : leaf.parts) {
      bodies.back().parts.push_back({part, {part.vertices.begin(), part.vertices.end()}});
      bodies.back().parts.back().shape.vertices = {};
    }
  }
  return bodies;
}

BodySkin copied(const SkinDesc& skin) {
  return {{skin.vertices.begin(), skin.vertices.end()},
          skin.influence_count,
          {skin.influence_links.begin(), skin.influence_links.end()},
          {skin.influence_weights.begin(), skin.influence_weights.end()},
          {skin.inverse_bind.begin(), skin.inverse_bind.end()}};
}

std::uint64_t pose_hash(const Scene& scene) {
  BitHash hash;
  for (const Character& character : scene.characters) {
    for (const float value : character.poses) hash.add(value);
    for (const double value : character.origins) hash.add(value);
  }
  return hash.value();
}

std::uint64_t shape_hash(const Scene& scene) {
  BitHash hash;
  for (const Character& character : scene.characters) {
    for (const float value : character.link_joints) hash.add(value);
    for (const BodyLeaf& leaf : character.leaves) {
      hash.add(leaf.link);
      hash.add(leaf.box);
      for (const ShapePart& part : leaf.parts)
        for (const float value : part.vertices) hash.add(value);
      for (const std::uint32_t vertex : leaf.triangles) hash.add(vertex);
    }
    for (const float value : character.skin.vertices) hash.add(value);
    for (const std::uint32_t link : character.skin.influence_links) hash.add(link);
    for (const float value : character.skin.influence_weights) hash.add(value);
    for (const float value : character.skin.inverse_bind) hash.add(value);
  }
  return hash.value();
}

}  // namespace cab::scenes
