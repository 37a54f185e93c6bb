#include "engine/session/slots.h"

#include "layout/round_body.h"

#include <atomic>

namespace cab {

std::uint32_t next_serial() {
  static std::atomic<std::uint32_t> given{0};
  const std::uint32_t serial = given.fetch_add(1, std::memory_order_relaxed) + 1;
  return serial ? serial : next_serial();  // an id with 0 would be a bare slot
}

const StoredArticulation* find_stored(const Engine& engine, ArticulationId id) {
  const std::size_t index = index_of(id.value, engine.articulations);
  return index < engine.articulations.size() ? engine.articulations[index].get() : nullptr;
}

const Articulation* find_articulation(const Engine& engine, ArticulationId id) {
  const StoredArticulation* const stored = find_stored(engine, id);
  return stored ? &stored->articulation : nullptr;
}

void store_articulation(std::unique_ptr<StoredArticulation> made, Engine& engine, ArticulationId* out) {
  if (made->articulation.lod.posed) {
    made->link_bounds.links.leaf_count = made->articulation.leaf_count;
  } else {
    made->fcl_shapes = make_fcl_shapes(made->articulation);
    build_link_bounds(made->articulation, made->arena, &made->link_bounds);
    made->convex_shapes = make_convex_shapes(made->articulation, made->arena);
    made->convex_shapes.round = make_round_body(made->articulation, made->convex_shapes, made->arena);
  }
  made->articulation.leaf_pairs_within = count_leaf_pairs_within(made->articulation);
  const std::size_t index = free_slot(engine.allocator, engine.articulations);
  fill_slot(std::move(made), engine.articulations[index]);
  out->value = id_of(index, engine.articulations);
}

}  // namespace cab
