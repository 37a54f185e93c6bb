// Calls of the engine whose failure ends a command.
#pragma once

#include <cab/cab.h>

#include "perf/base/out_of_memory.h"
#include "perf/harness/engine_ptr.h"

#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace cab::perf {

// run_frame, or a function that does what it does, such as run_all_pairs (engine/frame/all_pairs.h).
using RunFrame = decltype(&run_frame);

// Throws std::runtime_error with `what` and the status in words, unless that is kOk.
inline void require(Status status, const std::string& what) {
  if (status == Status::kOutOfMemory) throw std::runtime_error(what + ": " + out_of_memory());
  if (status != Status::kOk) throw std::runtime_error(what + ": " + to_string(status));
}

// Runs a frame or queries, and once more with larger buffers if its hits do not fit: run() does it, and returns a
// status. hits: those of queries in full, or as a short list. contacts: those of a frame that asks for them, else null.
// Returns the status of the last run.
template <class Job, class Found, class Run>
Status run_with_room(Job& job, std::vector<Found>& hits, std::vector<Contact>* contacts, const Run& run) {
  const auto run_once = [&] {
    if constexpr (std::is_same_v<Found, QueryLink>)
      job.links = hits;
    else
      job.hits = hits;
    if constexpr (std::is_same_v<Job, FrameJob>)
      if (contacts) {
        contacts->resize(hits.size());
        job.contacts = *contacts;
      }
    return run();
  };
  Status status = run_once();
  while (status == Status::kHitsOverflow) {
    hits.resize(job.hits_needed + job.hits_needed / 4);
    status = run_once();
  }
  return status;
}

inline oracle::EnginePtr make_engine(const EngineDesc& desc) {
  Engine* engine = nullptr;
  require(create_engine(desc, &engine), "engine");
  return oracle::EnginePtr(engine);
}

}  // namespace cab::perf
