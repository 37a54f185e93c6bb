// Refit along the principal axes of the children's corners.
#include "kernels/isa_vector.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {

template void refit_boxes<IsaVector, CovarianceRule, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CovarianceRule, LeavesExtents>(const RefitTile&);

}  // namespace cab::kernel
