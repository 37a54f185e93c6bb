// The surveys of all workers: what the first pass has found out of the rows.
#pragma once

#include "engine/broad_phase/strips.h"
#include "engine/session/worker.h"
#include "engine/session/worker_pool.h"

namespace cab {

// Makes the surveys of all workers know of no row.
inline void clear_surveys(const WorkerPool& pool) {
  for (const auto& worker : pool.workers)
    if (!worker->crowd.empty()) clear_survey(worker->crowd[0]);
}

// What they say after the first pass over a crowd with rows.
inline CrowdRanges ranges_of(const WorkerPool& pool) {
  CrowdRanges out = kNoRanges;
  for (const auto& worker : pool.workers) add_survey(worker->crowd[0].survey, out);
  return out;
}

}  // namespace cab
