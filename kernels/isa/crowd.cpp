// Crowds: bounds of leaves from poses, their compact words, strips, and the box test that poses its leaves itself.
#include "kernels/isa_vector.h"
#include "kernels/leaf_words.h"
#include "kernels/search_strip.h"

namespace cab::kernel {

template void bound_rigid_leaves<IsaVector>(RigidTile&);
template void make_leaf_words<IsaVector>(const RigidTile&, LeafWords* const (&)[kLanes]);
template void place_tile<IsaVector>(const PlaceTile&, CrowdSurvey&);
template bool search_strip<IsaVector>(StripSearch&);
template std::uint32_t overlapping_words<IsaVector>(const WordEntries&, PairSlots&, std::uint32_t*, std::uint32_t*);
template std::uint32_t overlap_rigid_leaves<IsaVector>(const RigidPairs&);

}  // namespace cab::kernel
