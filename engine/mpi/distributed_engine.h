// What a DistributedEngine holds on one rank.
#pragma once

#include "engine/mpi/reach.h"
#include "engine/mpi/regions.h"

#include <cab/cab.h>
#include <cab/mpi.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace cab::mpi {

struct EngineDeleter {
  void operator()(Engine* engine) const { destroy_engine(engine); }
};
using EnginePtr = std::unique_ptr<Engine, EngineDeleter>;

// A batch of all ranks.
struct Batch {
  ArticulationId articulation;  // 0: static bodies
  std::uint32_t instance_count = 0;
  std::uint32_t link_count = 0;
  std::uint32_t own_room = 0;     // instances of the batch in DistributedEngine::own
  std::uint32_t border_room = 0;  // and in DistributedEngine::border
  bool is_static() const { return articulation.value == 0; }
};

// Three engines, whose articulations and batches have the slots that the caller knows.
struct DistributedEngine {
  MPI_Comm comm = MPI_COMM_NULL;
  std::int32_t rank = 0;
  std::int32_t rank_count = 1;
  EnginePtr own;     // this rank's characters, and static bodies
  EnginePtr border;  // characters near those of other ranks, and those
  EnginePtr bounds;  // one batch per articulation, of slices[slot - 1] instances, for bounds
  std::vector<std::uint32_t> slices;
  std::vector<std::vector<LinkReach>> reaches;  // by articulation's slot - 1
  std::vector<Batch> batches;                   // by slot - 1
  RegionTable reached, near;                    // of all characters by their reach; of those that may meet others'
  Bytes spare;                                  // of Mail
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
};

// One of the engines that hold instances, and what Batch knows of them.
struct Rooms {
  Engine& engine;
  std::vector<Batch>& batches;
  std::uint32_t Batch::*room;
};
inline Rooms own_rooms(DistributedEngine& engine) { return {*engine.own, engine.batches, &Batch::own_room}; }
inline Rooms border_rooms(DistributedEngine& engine) { return {*engine.border, engine.batches, &Batch::border_room}; }

// Fills the slots that make_room has left empty. To be called before make_room in each frame.
Status refill_slots(const Rooms& rooms);

// Makes room for `needed` instances of a batch. If there is no memory, the batch has as much room as before, or its
// slot is empty and the room 0.
Status make_room(const Rooms& rooms, std::uint32_t slot, std::uint32_t needed);

}  // namespace cab::mpi
