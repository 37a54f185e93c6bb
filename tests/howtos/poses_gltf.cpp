// Nodes as glTF has them, handed over as in docs/poses.md, against points that are posed one by one.
#include "tests/howtos/poses_gltf.h"

#include "tests/howtos/poses_check.h"

using namespace poses_check;

int main() {
  const Crowd crowd = crowd_of(1, true);
  const Places places(crowd);
  // The skin lists children before their parents. Nodes 0 and 5 are no joints: one above the skeleton, as exporters
  // write it for a unit and an up axis, and one between link 0 and link 3.
  const Transform above = {{.1, .2, .3}, unit({-1, 0, 0, 1}), 1.5};
  const Transform between = {{.1, 0, -.1}, unit({.2, .4, .6, 1}), 1.25};
  const std::uint32_t node_of_link[kLinks] = {4, 2, 1, 3};
  const std::int32_t parent_of_node[] = {-1, 2, 4, 5, 0, 4};
  const auto node = [&](std::uint32_t n, const Transform& t) {
    as_in_gltf::Node out = {parent_of_node[n], {}, {}, {}};
    for (std::size_t k = 0; k < 4; ++k) out.rotation[k] = static_cast<float>(t.rotation[k]);
    for (std::size_t k = 0; k < 3; ++k) out.translation[k] = static_cast<float>(t.translation[k]);
    for (float& s : out.scale) s = static_cast<float>(t.scale);
    return out;
  };
  as_in_gltf::Links links;
  std::vector<float> matrices(16 * kLinks * kCharacters);
  for (std::uint32_t i = 0; i < kCharacters; ++i) {
    std::vector<as_in_gltf::Node> nodes(6);
    nodes[0] = node(0, above);
    nodes[5] = node(5, between);
    for (std::uint32_t l = 0; l < kLinks; ++l) nodes[node_of_link[l]] = node(node_of_link[l], crowd.links[i][l]);
    links = as_in_gltf::links_of(nodes, {1, 2, 3, 4});
    for (std::uint32_t l = 0; l < kLinks; ++l)
      as_in_gltf::set_pose(nodes, links.nodes[l], matrices.data() + 16 * (kLinks * i + l));
  }
  // Which link of the crowd in double each link of the articulation is.
  std::array<std::uint32_t, kLinks> link_of{};
  for (std::uint32_t l = 0; l < kLinks; ++l)
    for (std::uint32_t k = 0; k < kLinks; ++k)
      if (node_of_link[k] == links.nodes[l]) link_of[l] = k;
  bool right = links.parents == std::vector<std::int32_t>{-1, 0, 1, 0} || links.parents == std::vector{-1, 0, 0, 1};
  if (!right) std::printf("the parents are wrong\n");

  World world(links.parents, leaves_of(1));
  const cab::BatchInput input = input_of(world.batch(), as_in_gltf::poses_of(matrices), places);
  const auto posed = [&](std::uint32_t i, std::uint32_t link, Point p) {
    for (std::int32_t l = static_cast<std::int32_t>(link_of[link]); l >= 0; l = kParents[static_cast<std::size_t>(l)]) {
      p = moved(crowd.links[i][static_cast<std::size_t>(l)], p);
      if (l == 3) p = moved(between, p);
    }
    return rotated(crowd.places[i].rotation, moved(above, p));
  };
  right &= line("nodes", world.error(input, posed), world.hits(input).size(), true);
  return right ? 0 : 1;
}
