// Step 2 of a frame: which instances of character batches come near each other, by the bounds of their leaf boxes. A
// hashed grid without limits: an instance is kept in the one cell where its bounds begin, on the level whose cells are
// no smaller than it.
#pragma once

#include "engine/engine.h"

namespace cab {

// Notes which batches the rules pair. Instances are bounded next.
void begin_grid(Engine& engine, const FrameJob& job);

// Bounds of a tile's instances in the world from bounds of their leaves, widened by what forming them in double rounds;
// what the grid must know of all of them is gathered in the worker. Who is masked is known.
void bound_instances(const Engine& engine, InstanceBatch& batch, std::uint32_t tile, const AabbTile* leaves,
                     Worker& worker);

// Puts every instance that the rules test against others into the grid.
void build_grid(Engine& engine);

// The key of an instance. Hits are sorted by the keys of their instances.
inline std::uint64_t instance_key(std::uint32_t batch, std::uint32_t instance) {
  return std::uint64_t{batch} << 32 | instance;
}

// Lists in worker.partners the instances above `after` whose bounds overlap the given ones (all of them where `all` asks for
// tests without boxes) and with which a rule pairs the batch, ascending. False when the list is full and there may be
// more above its last.
bool find_partners(const Engine& engine, std::uint32_t batch, const InstanceBounds& bounds, std::uint64_t after,
                   bool all, Worker& worker);

}  // namespace cab
