// Forward kinematics, states as lanes.
#include "kernels/link_poses.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template void pose_states<IsaVector>(const StateTile&);

}  // namespace cab::kernel
