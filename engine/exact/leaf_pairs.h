// The leaf pairs of two links.
#pragma once

#include "engine/exact/convex_pair.h"
#include "engine/exact/exact.h"

namespace cab {

// Whether the pose of a link and the orientation of its instance are finite, in range and rigid.
inline bool is_valid_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  return is_valid(stored_pose(batch, instance, link));
}

// Calls visit(a, b) for each leaf on the first link of a hit with each leaf on the second: a ascending, then b.
template <class Visit>
void for_each_leaf_pair(const FrameContext& frame, const Hit& hit, Visit&& visit) {
  const std::uint32_t batch_a = hit.batch_a.value - 1, batch_b = hit.batch_b.value - 1;
  const Span<const std::uint16_t> leaves_a = leaves_of(*frame.batch(batch_a).articulation, hit.link_a),
                                  leaves_b = leaves_of(*frame.batch(batch_b).articulation, hit.link_b);
  for (const std::uint16_t a : leaves_a)
    for (const std::uint16_t b : leaves_b)
      visit(exact_leaf(frame, batch_a, hit.instance_a, a), exact_leaf(frame, batch_b, hit.instance_b, b));
}

}  // namespace cab
