// Sizes the memory of run_queries.
#include "engine/queries/query_memory.h"

#include "engine/session/engine.h"
#include "engine/session/make_list.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab {
namespace {

// A worker keeps so many clusters of instances with sixteen leaves, and at least one of the largest articulation.
constexpr std::size_t kPosedClusters = 1024;

}  // namespace

QueryMemoryPtr make_query_memory(const MemoryNeeds& needs, std::size_t workers, const Allocator& allocator) {
  QueryMemoryPtr memory(new QueryMemory(allocator));
  Arena& arena = memory->arena;
  memory->queries = needs.queries;
  memory->order = arena.allocate<KeyedNumber>(needs.queries);
  memory->other_order = arena.allocate<KeyedNumber>(needs.queries);
  memory->results = arena.allocate<QueryResult>(needs.queries);
  memory->hit_begin = arena.allocate<std::size_t>(needs.queries);
  memory->layers = arena.allocate<const std::uint32_t*>(needs.batch_slots);
  QueryIndex& index = memory->index;
  const std::size_t clusters = needs.character_tiles, instances = needs.character_instances;
  index.clusters = make_list<QueryCluster>(arena, clusters);
  index.nodes = make_list<AabbTile>(arena, most_nodes(clusters));
  index.used = arena.allocate<std::uint16_t>(most_nodes(clusters));
  index.order = arena.allocate<IndexedPoint>(instances);
  index.keys = arena.allocate<KeyedNumber>(instances);
  index.other_keys = arena.allocate<KeyedNumber>(instances);
  index.cluster_order = arena.allocate<IndexedPoint>(clusters);
  index.unordered = make_list<QueryCluster>(arena, clusters);
  index.bounds = arena.allocate<InstanceBounds>(instances);
  index.batch_begin = arena.allocate<std::uint32_t>(needs.batch_slots);
  index.given = arena.allocate<std::uint32_t>(needs.batch_slots);
  const std::size_t leaf_tiles = needs.leaf_bounds_floats / leaf_bounds_floats(kLanes);
  for (std::size_t w = 0; w < workers; ++w) {
    auto worker = std::make_unique<QueryWorker>(allocator);
    Arena& own = worker->arena;
    const std::size_t posed = std::min(kPosedClusters, clusters) * kLanes;
    worker->posed.clusters = own.allocate<kernel::PosedCluster>(clusters);
    worker->posed.boxes = make_list<BoxTile>(own, std::max(posed, kLanes * leaf_tiles));
    worker->met = make_list<MetInstance>(own, instances);
    worker->met_nodes = make_list<kernel::MetNode>(own, clusters);
    worker->met_leaves = make_list<kernel::MetLeaves>(own, instances * std::max<std::size_t>(leaf_tiles, 1));
    worker->overlapped = make_list<kernel::MetLeaves>(own, 2 * needs.queries + kSpareHits);
    worker->hits = make_list<QueryHit>(own, 2 * needs.queries + kSpareHits);
    worker->of_instance = make_list<QueryHit>(own, needs.joints);
    worker->at_link = own.allocate<std::uint32_t>(needs.joints);
    memory->workers.push_back(std::move(worker));
  }
  return memory;
}

void QueryMemoryDelete::operator()(QueryMemory* memory) const { delete memory; }

std::size_t query_bytes(const Engine& engine) {
  std::size_t out = 0;
  for (const auto& reader : engine.readers) {
    if (!reader->queries) continue;
    out += reader->queries->arena.bytes();
    for (const auto& worker : reader->queries->workers) out += worker->arena.bytes();
  }
  return out;
}

}  // namespace cab
