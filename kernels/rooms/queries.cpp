// Comparisons of queries with sixteen bounds.
#include "kernels/isa_vector.h"
#include "kernels/query_bounds.h"

namespace cab::kernel {

template std::uint32_t ray_bounds<IsaVector>(const BoundsRow&, const RayLanes&, float*);
template std::uint32_t point_bounds<IsaVector>(const BoundsRow&, const PointLanes&, float*);
template std::uint32_t overlap_bounds<IsaVector>(const BoundsRow&, const float (&)[3], const float (&)[3]);
template std::uint32_t plane_bounds<IsaVector>(const BoundsRow&, const float (&)[3], float);

}  // namespace cab::kernel
