// The partial update that the paper argues against (Larsson and Akenine-Moller): axis-aligned trees whose upper levels
// are refitted in every frame and whose deeper nodes are refitted when a descent first visits them. For comparison only,
// below the public API, with frames as lanes and one thread.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <functional>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/scene.h"

namespace cab::perf {

// Counts and seconds of all frames of a scene. Update is posing, the bounds of the leaves, and all refits, those on
// demand too; test is the descent without them. on_touches gets the overlapping leaf pairs of 16 frames at a time, in the
// order of EngineSession. Throws std::runtime_error for a scene that names no pairs or has origins or several leaves a
// link.
FrameStats run_partial_update(const scenes::Scene& scene, Isa isa,
                              const std::function<void(const std::vector<Touch>&)>& on_touches);

}  // namespace cab::perf
