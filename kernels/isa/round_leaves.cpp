// Sequences of balls and capsules.
#include "kernels/round_leaves.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template bool pose_round<IsaVector>(const RoundPoses&);
template void test_round_body<IsaVector>(RoundTest&);

}  // namespace cab::kernel
