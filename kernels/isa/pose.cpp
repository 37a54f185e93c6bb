// Posing: link poses to leaf boxes, for a tile or for one link.
#include "kernels/between_moments.h"
#include "kernels/isa_vector.h"
#include "kernels/pose_leaves.h"
#include "kernels/pose_link.h"

namespace cab::kernel {

template void pose_leaves<IsaVector>(const PoseTile&);
template void pose_link_leaves<IsaVector>(const PoseLink&);
template void bound_bulge<IsaVector>(BulgeTile&);

}  // namespace cab::kernel
