// A frame without boxes, for those who judge the frames of run_frame: the exact test alone decides.
#pragma once

#include <cab/cab.h>

namespace cab {

// Tests every leaf pair of the instances that the rules pair by the job's exact test. Without one (Exact::kNone) every
// leaf pair touches. Reads and writes what run_frame does: flags, in_contact, sorted hits, hits_needed, contacts and
// stats; the hits of two links name their lowest leaf pair that touches. The strategy is ignored, and nothing rests:
// the next frame takes all instances for moved, and queries have no bounds to reuse.
// Cost: serial, and quadratic in instances and in leaves. Allocates a byte per instance and 24 per hit from operator
// new while it runs. Statuses: those of run_frame but kMovedAtRest. Thread: any, alone on its engine.
[[nodiscard]] Status run_all_pairs(Engine& engine, FrameJob& job) noexcept;

}  // namespace cab
