// The memory for queries at times of their own: the instances that are posed as they were.
#pragma once

#include "engine/queries/history.h"
#include "engine/session/engine.h"
#include "kernels/search_ray.h"

namespace cab {

// An instance whose bounds a query met, as it was at the query's time.
struct PastCandidate {
  std::uint32_t query;    // index of the query in the job
  std::uint32_t history;  // index of the history in the job
  std::uint32_t instance;
  float entry;  // when the query enters its bounds, or less
  HistoryMoment moment;

  // Set when it is posed.
  const BoxTile* boxes;  // leaves as lanes
  float reach;           // the largest coordinate of any leaf's bounds
  bool is_live;
};

// A leaf whose box a ray may meet first, as it was at the ray's time.
struct PastLeaf {
  float entry;         // at which distance, or less
  std::uint32_t slot;  // index of the batch
  std::uint32_t instance, leaf;
  double apart[3];  // the instance's origin less where the ray begins
  BoxAos box;
};

// A ray about the past, and how far its search has come.
struct PastRay {
  static constexpr std::uint32_t kMostMet = 8;

  kernel::RaySearch search;  // in the index of one history
  HistoryMoment moment;
  std::uint32_t query;    // index of the query in the job
  std::uint32_t clamped;  // how many histories have no such time
  std::uint32_t met_count;
  PastLeaf met[kMostMet];
  bool is_known;  // whether all leaves that it may meet first are in `met`, which may have no room for them
};

// What one worker keeps.
struct PastWorker {
  explicit PastWorker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  FixedList<PastCandidate> candidates;
  Span<std::uint32_t> order;  // scratch: of the candidates, by what is posed together
  FixedList<BoxTile> boxes;   // of the candidates, leaves as lanes
  // The poses of the instance that is tested, where its exact shapes have been asked for: by link, kTickFloats each.
  Span<float> poses;
  Span<std::uint32_t> posed_for;  // by link: the test that its pose was made for
  std::uint32_t test = 0;         // number of the test
  Span<PastRay> rays;             // of one task: by place
  Span<std::uint16_t> near;       // scratch: leaves that a ray comes near
};

struct HistoryMemory {
  static constexpr std::uint32_t kMostRays = 64;  // that are searched for together

  std::size_t links = 0, leaves = 0;  // of the largest articulation that there is room for
  std::vector<std::unique_ptr<PastWorker>> workers;
  std::vector<const StoredHistory*> asked;  // the histories of the job; has room for all of the engine
};

// Makes memory for histories of articulations of this size. Throws std::bad_alloc.
HistoryMemoryPtr make_history_memory(std::size_t links, std::size_t leaves, std::size_t workers,
                                     const Allocator& allocator);

// How many bytes it takes.
std::size_t bytes_of(const HistoryMemory& memory);

}  // namespace cab
