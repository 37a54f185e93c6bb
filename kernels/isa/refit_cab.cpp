// Refit by the paper's merge and by its footnote's variant.
#include "kernels/isa_vector.h"
#include "kernels/refit_tree.h"

namespace cab::kernel {

template void refit_boxes<IsaVector, CabRule<false>, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CabRule<false>, LeavesExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CabRule<true>, ChildrenExtents>(const RefitTile&);
template void refit_boxes<IsaVector, CabRule<true>, LeavesExtents>(const RefitTile&);

}  // namespace cab::kernel
