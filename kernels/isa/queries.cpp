// Queries: their way through an index, and comparisons with sixteen bounds or boxes.
#include "kernels/isa_vector.h"
#include "kernels/query_bounds.h"
#include "kernels/query_boxes.h"
#include "kernels/walk_index.h"

namespace cab::kernel {

template void boxes_by_leaf<IsaVector>(const BoxTile*, std::uint32_t, std::uint32_t, BoxTile*);
template std::uint32_t ray_boxes<IsaVector>(const BoxTile&, const BoxRay&, float*);
template void point_boxes<IsaVector>(const BoxTile&, const float (&)[3], float*);
template bool walk_ray<IsaVector>(const IndexNodes&, const RayLanes&, IndexWalk&, MetBounds*);
template bool walk_point<IsaVector>(const IndexNodes&, const PointLanes&, IndexWalk&, MetBounds*);
template std::uint32_t overlap_bounds<IsaVector>(const BoundsRow&, const float (&)[3], const float (&)[3]);
template std::uint32_t plane_bounds<IsaVector>(const BoundsRow&, const float (&)[3], float);

}  // namespace cab::kernel
