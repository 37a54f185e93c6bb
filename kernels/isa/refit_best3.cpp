// Refit along the best of three sets of axes.
#include "kernels/isa_vector.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {

template void refit_boxes<IsaVector, Best3Rule, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, Best3Rule, LeavesExtents>(const RefitTile&);

}  // namespace cab::kernel
