#include "scenes/crowd/rigs.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

// The i-th of `count` slices of a box across its longest axis.
Box slice(Box box, std::uint32_t i, std::uint32_t count) {
  const auto longest = static_cast<std::size_t>(std::max_element(box.half, box.half + 3) - box.half);
  const float at = (2 * static_cast<float>(i) + 1) / static_cast<float>(count) - 1;  // of the half extent
  for (std::size_t c = 0; c < 3; ++c) box.center[c] += at * box.half[longest] * box.axis[longest][c];
  box.half[longest] /= static_cast<float>(count);
  return box;
}

}  // namespace

CrowdGroup with_links(CrowdGroup group, std::uint32_t link_count) {
  const Character& body = group.figure;
  const auto links = static_cast<std::uint32_t>(body.link_parents.size());
  if (link_count < links || link_count > kMaxLinks)
    throw std::invalid_argument("with_links: no body of " + std::to_string(links) + " links becomes one of " +
                                std::to_string(link_count));
  std::vector<std::uint32_t> pieces;  // by link
  for (std::uint32_t l = 0; l < links; ++l) pieces.push_back(link_count / links + (l < link_count % links ? 1 : 0));
  Character rig;
  rig.name = body.name;
  std::vector<std::int32_t> last;  // by link: its last piece
  for (std::uint32_t l = 0; l < links; ++l) {
    std::int32_t parent = body.link_parents[l] < 0 ? -1 : last[static_cast<std::size_t>(body.link_parents[l])];
    for (std::uint32_t i = 0; i < pieces[l]; ++i) {
      const auto link = static_cast<std::uint32_t>(rig.link_parents.size());
      BodyLeaf leaf;
      leaf.link = link;
      leaf.box = slice(body.leaves[l].box, i, pieces[l]);
      rig.leaves.push_back(leaf);
      rig.link_names.push_back(body.link_names[l] + " " + std::to_string(i + 1));
      rig.link_parents.push_back(parent);
      parent = static_cast<std::int32_t>(link);
    }
    last.push_back(parent);
  }
  group.figure = std::move(rig);
  group.pose = [links, pieces = std::move(pieces), pose = std::move(group.pose)](double seconds, const Chosen& chosen,
                                                                                 PosedGroup& posed) {
    pose(seconds, chosen, posed);
    std::vector<float> poses;
    poses.reserve(posed.poses.size() / links * pieces.size());
    const std::size_t floats = pieces.size() * 7;
    for (std::size_t at = 0; at < posed.poses.size(); at += floats)
      for (std::size_t l = 0; l < pieces.size(); ++l) {
        const float* const one = posed.poses.data() + at + l * 7;
        for (std::uint32_t i = 0; i < pieces[l]; ++i) poses.insert(poses.end(), one, one + 7);
      }
    posed.poses = std::move(poses);
  };
  return group;
}

CrowdGroup enlarged(CrowdGroup group, float factor) {
  for (float& coordinate : group.figure.link_joints) coordinate *= factor;
  for (BodyLeaf& leaf : group.figure.leaves)
    for (std::size_t c = 0; c < 3; ++c) {
      leaf.box.center[c] *= factor;
      leaf.box.half[c] *= factor;
    }
  group.pose = [factor, pose = std::move(group.pose)](double seconds, const Chosen& chosen, PosedGroup& posed) {
    pose(seconds, chosen, posed);
    for (std::size_t link = 0; link < posed.poses.size(); link += 7)
      for (std::size_t f = 4; f < 7; ++f) posed.poses[link + f] *= factor;
  };
  return group;
}

}  // namespace cab::scenes
