#include "engine/queries/history_memory.h"

#include "engine/session/make_list.h"

#include <algorithm>

namespace cab {
namespace {

// A worker poses at most so many candidates together, and so many leaves but at least one tile.
constexpr std::size_t kMostCandidates = 256, kMostLeaves = 4096;

}  // namespace

HistoryMemoryPtr make_history_memory(std::size_t links, std::size_t leaves, std::size_t workers,
                                     const Allocator& allocator) {
  HistoryMemoryPtr memory(new HistoryMemory);
  memory->links = links;
  memory->leaves = leaves;
  const std::size_t most = std::clamp<std::size_t>(kMostLeaves / leaves, kLanes, kMostCandidates);
  for (std::size_t w = 0; w < workers; ++w) {
    auto worker = std::make_unique<PastWorker>(allocator);
    Arena& own = worker->arena;
    worker->candidates = make_list<PastCandidate>(own, most);
    worker->order = own.allocate<std::uint32_t>(most);
    worker->boxes = make_list<BoxTile>(own, most * tile_count(static_cast<std::uint32_t>(leaves)));
    worker->poses = own.allocate<float>(links * kTickFloats);
    worker->posed_for = own.allocate<std::uint32_t>(links);
    worker->rays = own.allocate<PastRay>(HistoryMemory::kMostRays);
    worker->near = own.allocate<std::uint16_t>(leaves);
    memory->workers.push_back(std::move(worker));
  }
  return memory;
}

HistoryMemoryPtr make_history_memory(const HistoryMemory& like, std::size_t histories, const Allocator& allocator) {
  HistoryMemoryPtr memory = make_history_memory(like.links, like.leaves, 1, allocator);
  memory->asked.reserve(histories);
  return memory;
}

void HistoryMemoryDelete::operator()(HistoryMemory* memory) const { delete memory; }

std::size_t bytes_of(const HistoryMemory& memory) {
  std::size_t out = 0;
  for (const auto& worker : memory.workers) out += worker->arena.bytes();
  return out;
}

}  // namespace cab
