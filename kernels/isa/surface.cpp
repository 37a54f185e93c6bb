// The triangles of leaves.
#include "kernels/isa_vector.h"
#include "kernels/surface/part_triangles.h"
#include "kernels/surface/ray_triangles.h"
#include "kernels/surface/test_surfaces.h"

namespace cab::kernel {

template void skin_leaf<IsaVector>(const SkinLeaf&);
template std::uint32_t near_triangles<IsaVector>(const SkinnedLeaf&, std::uint32_t, const float (&)[3],
                                                 const float (&)[3], std::uint32_t*);
template std::uint32_t ray_triangles<IsaVector>(const SurfaceRay&, MetTriangle*);
template bool test_part<IsaVector>(const SurfacePart&, std::uint32_t*, std::uint32_t*);
template bool test_surfaces<IsaVector>(const SurfacePair&, void*, TakeTriangles);

}  // namespace cab::kernel
