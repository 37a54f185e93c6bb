// What a frame's inputs must be, checked before anything is touched.
#pragma once

#include "engine/engine.h"

namespace cab {

Status validate_input(const Engine& engine, const BatchInput& input);
Status validate_job(const Engine& engine, const FrameJob& job);

}  // namespace cab
