// Queries: their way through an index, and comparisons with sixteen bounds or boxes.
#include "kernels/cast_box.h"
#include "kernels/enter_rays.h"
#include "kernels/isa_vector.h"
#include "kernels/past_leaves.h"
#include "kernels/query_bounds.h"
#include "kernels/query_boxes.h"
#include "kernels/search_by_turns.h"
#include "kernels/walk_index.h"

namespace cab::kernel {

template void boxes_by_leaf<IsaVector>(const BoxTile*, std::uint32_t, std::uint32_t, BoxTile*);
template std::uint32_t ray_boxes<IsaVector>(const BoxTile&, const BoxRay&, float*);
template std::uint32_t ray_in_boxes<IsaVector>(const BoxTile&, const BoxRay&, float*);
template std::uint32_t near_leaves<IsaVector>(const NearLeaves&, std::uint16_t*);
template void meet_past_leaves<IsaVector>(PastLeaves&);
template void point_boxes<IsaVector>(const BoxTile&, const float (&)[3], float*);
template bool walk_ray<IsaVector>(const IndexNodes&, const RayLanes&, IndexWalk&, MetBounds*);
template void enter_rays<IsaVector>(RayTile&);
template void cast_boxes<IsaVector>(CastTile&);
template void search_rays<IsaVector>(const SearchedIndex&, RaySearch* const*, std::uint32_t);
template void search_points<IsaVector>(const SearchedIndex&, PointSearch* const*, std::uint32_t);
template std::uint32_t meet_nodes<IsaVector>(const IndexNodes&, const PointLanes&, MetNode*, std::uint64_t&);
template SearchStop search_sphere<IsaVector>(const SearchedIndex&, SphereSearch&);
template bool walk_point<IsaVector>(const IndexNodes&, const PointLanes&, IndexWalk&, MetBounds*);
template std::uint32_t overlap_bounds<IsaVector>(const BoundsRow&, const float (&)[3], const float (&)[3]);
template std::uint32_t plane_bounds<IsaVector>(const BoundsRow&, const float (&)[3], float);

}  // namespace cab::kernel
