// Sizes the memory of run_queries.
#include "engine/queries/query_memory.h"

#include "engine/queries/query_indexes.h"
#include "engine/session/make_list.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab {
namespace {

// A worker keeps so many tiles of sixteen posed leaves, and at least those of a cluster of the largest articulation.
constexpr std::size_t kKeptTiles = 16384;

// How many clusters of the largest articulation there is room for per query that is searched for with others.
constexpr std::size_t kPerSearch = 4;

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
  const std::size_t clusters = needs.character_tiles, instances = needs.character_instances;
  const std::size_t tiles_of_one = needs.leaf_bounds_floats / leaf_bounds_floats(kLanes);
  const std::size_t cluster = std::max<std::size_t>(kLanes * tiles_of_one, 1);
  const std::size_t posed = std::max(std::min(kKeptTiles, needs.leaf_tiles), cluster);
  memory->together = static_cast<std::uint32_t>(std::clamp<std::size_t>(posed / (kPerSearch * cluster), 1, kLanes));
  if (posed >= needs.leaf_tiles) memory->together = kLanes;
  for (std::size_t w = 0; w < workers; ++w) {
    auto worker = std::make_unique<QueryWorker>(allocator);
    Arena& own = worker->arena;
    worker->posed.clusters = own.allocate<kernel::PosedCluster>(clusters);
    worker->posed.boxes = make_list<BoxTile>(own, posed);
    worker->met = make_list<MetInstance>(own, instances);
    worker->met_nodes = make_list<kernel::MetNode>(own, clusters);
    worker->met_leaves = make_list<kernel::MetLeaves>(own, needs.leaf_tiles);
    worker->overlapped = make_list<kernel::MetLeaves>(own, 2 * needs.queries + kSpareHits);
    worker->hits = make_list<QueryHit>(own, 2 * needs.queries + kSpareHits);
    worker->of_instance = make_list<QueryHit>(own, needs.joints);
    worker->at_link = own.allocate<std::uint32_t>(needs.joints);
    size_skin_cache({needs.surface_blocks, needs.surface_patches, needs.surface_bones}, own, worker->skins);
    worker->met_triangles = own.allocate<kernel::MetTriangle>(kLanes, needs.surface_patches);
    memory->workers.push_back(std::move(worker));
  }
  return memory;
}

void QueryMemoryDelete::operator()(QueryMemory* memory) const { delete memory; }

QueryIndexesPtr make_query_indexes() { return QueryIndexesPtr(new QueryIndexes); }

void QueryIndexesDelete::operator()(QueryIndexes* indexes) const { delete indexes; }

std::size_t query_bytes(const Engine& engine) {
  std::size_t out = 0;
  for (const auto& reader : engine.readers) {
    if (!reader->queries) continue;
    out += reader->queries->arena.bytes();
    for (const auto& worker : reader->queries->workers) out += worker->arena.bytes();
  }
  if (!engine.query_indexes) return out;
  const std::lock_guard lock(engine.query_indexes->mutex);
  for (const auto& stored : engine.query_indexes->all) out += stored->arena.bytes();
  return out;
}

}  // namespace cab
