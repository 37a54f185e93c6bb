// Which links of an articulation touch in its rest pose.
#pragma once

#include "kernels/kernel_table.h"
#include "layout/arena.h"

namespace cab {

// The pairs of links whose leaf boxes pass the leaf predicate in one pose without orientation, whatever the articulation
// ignores; a pair once for each two leaves. The span is of scratch, which serves for the working memory too. kBadRestPose,
// with *out untouched, for a pose that would be refused or masked in a frame. Throws std::bad_alloc.
Status links_that_touch(const kernel::KernelTable& kernels, const Articulation& articulation, const PoseView& pose,
                        Arena& scratch, Span<const LinkPair>* out);

}  // namespace cab
