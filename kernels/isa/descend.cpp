// Overlapping leaf pairs of two tiles: by descent of both hierarchies, and by all leaf pairs.
#include "kernels/descend_tiles.h"
#include "kernels/isa_vector.h"

namespace cab::kernel {

template void descend_tiles<IsaVector, BoxTile, Sat::kAll15>(TileDescent<BoxTile>&);
template void descend_tiles<IsaVector, BoxTile, Sat::kFaces6>(TileDescent<BoxTile>&);
template void descend_tiles<IsaVector, AabbTile, Sat::kAll15>(TileDescent<AabbTile>&);
template void brute_tiles<IsaVector, BoxTile, Sat::kAll15>(TileDescent<BoxTile>&);
template void brute_tiles<IsaVector, BoxTile, Sat::kFaces6>(TileDescent<BoxTile>&);
template void brute_tiles<IsaVector, AabbTile, Sat::kAll15>(TileDescent<AabbTile>&);

}  // namespace cab::kernel
