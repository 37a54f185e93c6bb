// The contacts of pairs of convex shapes.
#include "kernels/convex/contact_pairs.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template void contact_pairs<IsaVector>(const ConvexBlock&, ConvexContacts&);

}  // namespace cab::kernel
