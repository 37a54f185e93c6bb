// Calls of the engine whose failure ends a command.
#pragma once

#include <cab/cab.h>

#include "perf/base/out_of_memory.h"
#include "perf/harness/engine_ptr.h"

#include <stdexcept>
#include <string>

namespace cab::perf {

// run_frame, or a function that does what it does, such as run_all_pairs (engine/frame/all_pairs.h).
using RunFrame = decltype(&run_frame);

// Throws std::runtime_error with `what` and the status in words, unless that is kOk.
inline void require(Status status, const std::string& what) {
  if (status == Status::kOutOfMemory) throw std::runtime_error(what + ": " + out_of_memory());
  if (status != Status::kOk) throw std::runtime_error(what + ": " + to_string(status));
}

inline oracle::EnginePtr make_engine(const EngineDesc& desc) {
  Engine* engine = nullptr;
  require(create_engine(desc, &engine), "engine");
  return oracle::EnginePtr(engine);
}

}  // namespace cab::perf
