// This rank's characters in a frame: checked, bounded, and sorted into regions.
#pragma once

#include "engine/mpi/bounds.h"
#include "engine/mpi/distributed_engine.h"
#include "engine/mpi/regions.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cab::mpi {

// One batch of this rank's characters. At first bounds are those of reach_of, and later those of compute_boxes, of
// characters near other ranks alone.
struct OwnBatch {
  const RankInput* given = nullptr;  // null: the batch has no input in this frame
  std::uint32_t count = 0;
  std::vector<RelativeBounds> bounds;

  const double* origin(std::size_t i) const;
  WorldBounds world(std::size_t i, float margin) const { return in_world(origin(i), bounds[i], margin); }
};

struct OwnPart {
  std::vector<OwnBatch> batches;   // by slot - 1
  std::vector<BatchInput> inputs;  // of the engine `own`
  std::vector<Region> regions;
  std::vector<const Region*> first_regions;  // of all ranks, by slot - 1: room for comparing them
  Partners partners;
};

// The job of the engine `own`.
FrameJob own_job(const DistributedJob& job, const OwnPart& part);

// Fills `part`, makes room for the characters, and checks all that run_frame would refuse. Regions are those of all
// characters, by their reach. Statuses: as mpi::run_frame.
Status make_own_part(DistributedEngine& engine, const DistributedJob& job, OwnPart& part);

// Bounds those that may meet somebody in the regions of other ranks, and forgets the bounds of all others. Regions are
// then those of these alone. Statuses: as compute_boxes.
Status bound_near(DistributedEngine& engine, const DistributedJob& job, const RegionTable& table, OwnPart& part);

// A number that is the same on all ranks that were given the same rules, policies and batches.
std::uint64_t digest_of(const DistributedJob& job);

}  // namespace cab::mpi
