#include "engine/queries/query_indexes.h"

#include "engine/session/engine.h"
#include "engine/session/make_list.h"

#include <algorithm>

namespace cab {
namespace {

// Counts what some queries gain by an index whose instances are halved, and returns the arrangement that pays for all
// that were counted. To halve instances takes as long as half as many rays save by it. A point saves as much as three
// rays.
Arrangement arrangement_for(const IndexWanted& wanted, std::size_t& gain) {
  const std::size_t price = std::max<std::size_t>(256, wanted.instances / 2);
  for (std::size_t i = 0; i < wanted.queries.size && gain <= price; ++i)
    gain += wanted.queries[i].kind == QueryKind::kPoint ? 3 : 1;
  return gain <= price ? Arrangement::kOnCurve : Arrangement::kHalved;
}

// How many instances of a batch are given.
std::uint32_t given_of(const InstanceBatch& batch) { return batch.input ? active_count(batch) : 0; }

// Whether an index holds, or will hold, the instances that are wanted.
bool is_of(const StoredIndex& stored, const IndexWanted& wanted) {
  if (stored.users == 0 && !stored.is_made) return false;
  if (wanted.of_frame == 0 || stored.index.of_frame != wanted.of_frame) return false;
  for (std::uint32_t slot = 0; slot < wanted.batches.size; ++slot)
    if (stored.index.given[slot] != given_of(wanted.batches[slot]->batch)) return false;
  return true;
}

}  // namespace

void add_query_index(QueryIndexes& indexes, const MemoryNeeds& needs, const Allocator& allocator) {
  auto stored = std::make_unique<StoredIndex>(allocator);
  Arena& arena = stored->arena;
  QueryIndex& index = stored->index;
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
  const std::lock_guard lock(indexes.mutex);
  indexes.all.push_back(std::move(stored));
}

IndexLease::IndexLease(QueryIndexes& indexes, const IndexWanted& wanted) : indexes_(indexes) {
  const std::lock_guard lock(indexes.mutex);
  std::size_t gain_alone = 0;
  if (wanted.of_frame && indexes.of_frame != wanted.of_frame) {
    indexes.of_frame = wanted.of_frame;
    indexes.gain = 0;
  }
  Arrangement arrangement = arrangement_for(wanted, wanted.of_frame ? indexes.gain : gain_alone);
  bool is_being_made = false;  // one that is arranged as wanted
  for (const auto& stored : indexes.all) {
    if (!is_of(*stored, wanted)) continue;
    if (!stored->is_made)
      is_being_made = is_being_made || stored->index.arrangement >= arrangement;
    else if (!stored_ || stored->index.arrangement > stored_->index.arrangement)
      stored_ = stored.get();
  }
  if (stored_ && (is_being_made || stored_->index.arrangement >= arrangement)) {
    ++stored_->users;
    return;
  }
  // Of those that nobody has the oldest, but one of the last frame only if there is no other. This call has none yet,
  // so there is one.
  const auto is_needed = [&](const StoredIndex& stored) {
    return stored.is_made && stored.index.of_frame != 0 && stored.index.of_frame == indexes.of_frame;
  };
  const auto goes_before = [&](const StoredIndex& a, const StoredIndex& b) {
    return is_needed(a) != is_needed(b) ? is_needed(b) : a.serial < b.serial;
  };
  stored_ = nullptr;
  for (const auto& stored : indexes.all)
    if (stored->users == 0 && (!stored_ || goes_before(*stored, *stored_))) stored_ = stored.get();
  if (is_being_made) arrangement = Arrangement::kOnCurve;
  is_to_make_ = true;
  stored_->users = 1;
  stored_->is_made = false;
  stored_->serial = ++indexes.serial;
  stored_->index.of_frame = wanted.of_frame;
  stored_->index.arrangement = arrangement;
  for (std::uint32_t slot = 0; slot < wanted.batches.size; ++slot)
    stored_->index.given[slot] = given_of(wanted.batches[slot]->batch);
}

IndexLease::~IndexLease() {
  const std::lock_guard lock(indexes_.mutex);
  --stored_->users;
}

void IndexLease::finish() {
  const std::lock_guard lock(indexes_.mutex);
  stored_->is_made = true;
}

}  // namespace cab
