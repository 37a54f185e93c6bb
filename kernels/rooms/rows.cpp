// Comparisons of bounds one after the other: leaf bounds of two instances, and grid entries.
#include "kernels/filter_rows.h"
#include "kernels/isa_vector.h"
#include "kernels/overlapping_entries.h"

namespace cab::kernel {

template void bounds_to_soa<IsaVector>(const AabbTile*, std::uint32_t, std::uint32_t, float*);
template void filter_rows<IsaVector>(const RowFilter&);
template std::uint32_t overlapping_entries<IsaVector>(const GridEntry*, std::uint32_t, std::uint32_t, const GridEntry&,
                                                      std::uint32_t*);

}  // namespace cab::kernel
