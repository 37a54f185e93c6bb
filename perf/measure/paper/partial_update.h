// The partial update that the paper argues against (Larsson and Akenine-Moller): axis-aligned trees. The upper levels
// are refitted in every frame; a deeper node is refitted when a descent first visits it. For comparison only, below the
// public API, with frames as lanes and one thread.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <functional>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/scene.h"

namespace cab::perf {

// Counts and seconds of all frames of a scene. Update is posing, the bounds of the leaves, and all refits, including
// those on demand; test is the descent without refits. on_touches receives the overlapping leaf pairs of 16 frames at a
// time, in the order of EngineSession. Throws std::runtime_error if the scene names no pairs, has origins, or has
// several leaves per link.
FrameStats run_partial_update(const scenes::Scene& scene, Isa isa,
                              const std::function<void(const std::vector<Touch>&)>& on_touches);

}  // namespace cab::perf
