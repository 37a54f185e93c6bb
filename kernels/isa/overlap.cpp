// Boxes as records, and the overlap test of their pairs as lanes.
#include "kernels/gather_pairs.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template void boxes_to_aos<IsaVector>(const BoxTile*, std::uint32_t, std::uint32_t, BoxAos*, std::size_t);
template void aabbs_to_aos<IsaVector>(const AabbTile*, std::uint32_t, std::uint32_t, AabbAos*, std::size_t);
template std::uint32_t overlap_boxes<IsaVector, Sat::kAll15>(const BoxPairs<BoxAos>&);
template std::uint32_t overlap_boxes<IsaVector, Sat::kFaces6>(const BoxPairs<BoxAos>&);
template std::uint32_t overlap_aabbs<IsaVector>(const BoxPairs<AabbAos>&);

}  // namespace cab::kernel
