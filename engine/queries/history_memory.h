// The memory for queries at times of their own: the instances that are posed as they were.
#pragma once

#include "engine/queries/history.h"
#include "engine/session/engine.h"
#include "layout/tile.h"

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
};

struct HistoryMemory {
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
