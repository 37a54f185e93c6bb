// Comparisons of leaf bounds of two instances.
#include "kernels/filter_rows.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template void bounds_to_soa<IsaVector>(const AabbTile*, std::uint32_t, std::uint32_t, float*);
template void filter_rows<IsaVector>(const RowFilter&);

}  // namespace cab::kernel
