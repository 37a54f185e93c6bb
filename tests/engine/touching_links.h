// The judge of which links of one instance touch.
#pragma once

#include "perf/judge/oracle/exact_pose.h"

#include <algorithm>
#include <set>
#include <utility>

namespace cab::oracle {

// Two different links, the lower one first.
using Links = std::pair<std::uint32_t, std::uint32_t>;

// Links with leaf boxes that touch in the pose of one instance, by brute force in long double. grow: how much wider
// each half extent is made, as a fraction of the box's size and of its distance from the origin.
inline std::set<Links> links_exactly_touching(const Rig& rig, const Poses& poses, std::uint32_t instance, double grow) {
  std::vector<ExactBox> boxes = exact_leaf_boxes(rig, poses, instance);
  for (ExactBox& box : boxes) {
    const Real by = static_cast<Real>(grow) * (half_sum(box) + norm_1(center_of(box)));
    for (Real& half : box.half) half += by;
  }
  std::set<Links> out;
  for (std::size_t a = 0; a < boxes.size(); ++a)
    for (std::size_t b = a + 1; b < boxes.size(); ++b) {
      const std::uint32_t link_a = rig.leaves[a].link, link_b = rig.leaves[b].link;
      if (link_a != link_b && exactly_overlap(boxes[a], boxes[b], center_of(boxes[b]) - center_of(boxes[a])))
        out.emplace(std::min(link_a, link_b), std::max(link_a, link_b));
    }
  return out;
}

}  // namespace cab::oracle
