// Exact::kFcl in a library without FCL.
#include "engine/exact/fcl.h"

namespace cab {

void FclShapesDelete::operator()(FclShapes*) const {}

std::unique_ptr<FclShapes, FclShapesDelete> make_fcl_shapes(const Articulation&) { return nullptr; }

const ExactTest* fcl_test() { return nullptr; }

}  // namespace cab
