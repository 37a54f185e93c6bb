// Axis-aligned bounds: of boxes, of other bounds, of vertices, and their refit.
#include "kernels/isa_vector.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {

template void refit_aabb<IsaVector>(const MergeProgram&, AabbTile*);
template void refit_aabb_leaves<IsaVector>(const MergeProgram&, AabbTile*);
template void fit_vertices<IsaVector>(const VertexTile&);
template void bound_boxes<IsaVector>(const BoxTile*, std::uint32_t, AabbTile*);
template void bound_together<IsaVector>(const AabbTile*, std::uint32_t, AabbTile*);

}  // namespace cab::kernel
