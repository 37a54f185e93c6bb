// The rest pose of an articulation: finds the links that touch in it, which are then ignored.
#pragma once

#include "kernels/kernel_table.h"
#include "layout/arena.h"
#include "layout/articulation.h"

namespace cab {

// Lists the link pairs whose leaf boxes pass the leaf predicate in `pose`, the pose of one instance without
// orientation. A link pair is listed once per such leaf pair, even if the articulation ignores it. *out and the working
// memory are taken from `scratch`. Returns kBadRestPose, and leaves *out untouched, if a frame would refuse the pose or
// mask the instance. Throws std::bad_alloc.
Status links_that_touch(const kernel::KernelTable& kernels, const Articulation& articulation, const PoseView& pose,
                        Arena& scratch, Span<const LinkPair>* out);

}  // namespace cab
