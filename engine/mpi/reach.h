// How far characters reach from their origins: bounds that cost little, for most characters are far from other ranks.
#pragma once

#include "engine/mpi/bounds.h"

#include <cab/types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::mpi {

// A link that moves leaves, how far from its origin it has their boxes, and how much farther these may reach from the
// instance's origin than that puts them: 1 if the link alone moves them.
struct LinkReach {
  std::uint32_t link;
  double radius;
  double factor;
};
// desc: as add_articulation has taken it. Throws std::bad_alloc.
std::vector<LinkReach> link_reaches(const ArticulationDesc& desc);

// A cube about the origin of character i that holds its leaf boxes, widened by its own margin. None, if a number is not
// finite, so that the character is masked.
RelativeBounds reach_of(const std::vector<LinkReach>& links, std::uint32_t link_count, const BatchInput& input,
                        std::size_t i);

}  // namespace cab::mpi
