// The exact test of pairs of convex shapes.
#include "kernels/convex/test_pairs.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template ConvexAnswer test_convex_pairs<IsaVector>(const ConvexBlock&);

}  // namespace cab::kernel
