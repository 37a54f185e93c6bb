// Refit along principal axes: of the children's corners, and of the corners of all leaf boxes below.
#include "kernels/isa_vector.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {

template void refit_boxes<IsaVector, CovarianceRule, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CovarianceRule, LeavesExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CovarianceLeavesRule, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CovarianceLeavesRule, LeavesExtents>(const RefitTile&);

}  // namespace cab::kernel
