// How far characters reach from their origins: bounds that cost little, for most characters are far from other ranks.
#pragma once

#include "engine/mpi/bounds.h"

#include <cab/types.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::mpi {

// A link with leaves, and how far they reach from the link's origin.
struct LinkReach {
  std::uint32_t link;
  double radius;
};
std::vector<LinkReach> link_reaches(Span<const Leaf> leaves);

// A cube about the origin of character i that holds its leaf boxes, widened by its own margin. None, if a number is not
// finite, so that the character is masked.
RelativeBounds reach_of(const std::vector<LinkReach>& links, std::uint32_t link_count, const BatchInput& input,
                        std::size_t i);

}  // namespace cab::mpi
