// Random bodies of balls and capsules.
#pragma once

#include "perf/judge/oracle/random.h"

#include <cab/types.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace cab::oracle {

// An articulation each of whose leaves is a ball or a capsule. part_count: 1, or 0 for a leaf that is its box.
struct RoundRig {
  std::vector<std::int32_t> parents;
  std::vector<std::uint32_t> links;  // by leaf
  std::vector<Box> boxes;
  std::vector<ConvexPart> parts;
  std::vector<std::size_t> part_count;
  std::vector<LinkPair> ignored;
  mutable std::vector<Leaf> leaves;

  ArticulationDesc desc() const {
    leaves.clear();
    for (std::size_t l = 0; l < links.size(); ++l) leaves.push_back({links[l], boxes[l], {&parts[l], part_count[l]}});
    return {parents, {}, leaves, ignored};
  }
};

inline RoundRig random_round_rig(Random& random, unsigned link_count, unsigned most_leaves) {
  RoundRig rig;
  for (unsigned link = 0; link < link_count; ++link) {
    rig.parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(link)));
    if (link > 0 && random.chance(0.5)) rig.ignored.push_back({static_cast<std::uint32_t>(rig.parents.back()), link});
    if (link > 0 && random.chance(0.1)) continue;
    for (unsigned leaf = 1 + random.index(most_leaves); leaf > 0; --leaf) {
      rig.links.push_back(link);
      ConvexPart& part = rig.parts.emplace_back();
      rig.part_count.push_back(1);
      double length = 0, q[4];
      for (double& x : q) x = random.uniform(-1, 1), length += x * x;
      for (int c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c] / std::sqrt(length));
      const bool is_ball = random.chance(0.5);
      part.kind = is_ball ? ShapeKind::kSphere : ShapeKind::kCapsule;
      part.size[0] = static_cast<float>(random.log_uniform(0.02, 0.15));
      part.size[1] = is_ball ? 0 : static_cast<float>(random.log_uniform(0.02, 0.3));
      const auto at = random.uniform(0, 0.3) * random.unit_vector();
      Box box;
      for (std::size_t c = 0; c < 3; ++c) {
        part.position[c] = box.center[c] = static_cast<float>(at[c]);
        box.half[c] = 1.001f * (part.size[0] + part.size[1]);
      }
      rig.boxes.push_back(box);
    }
  }
  // Leaves need not be in the order of links.
  for (std::size_t i = rig.links.size(); i > 1; --i) {
    const std::size_t j = random.index(static_cast<unsigned>(i));
    std::swap(rig.links[i - 1], rig.links[j]);
    std::swap(rig.boxes[i - 1], rig.boxes[j]);
    std::swap(rig.parts[i - 1], rig.parts[j]);
  }
  return rig;
}

}  // namespace cab::oracle
