// The leaf boxes of instances that are near each other, as queries test them.
#pragma once

#include "layout/tile.h"

#include <cab/query.h>

#include <cstddef>
#include <cstdint>

namespace cab::kernel {

// A cluster of an index (IndexNodes) whose leaf boxes are posed, leaves as lanes: those of lane i begin at boxes[i *
// tile_count(leaves)].
struct PosedCluster {
  struct Lane {
    double origin[3];  // of the instance, in the world
    float reach;       // the largest coordinate of any leaf's bounds
    std::uint32_t instance;
  };

  std::uint32_t generation;  // of the set that it is in; any other: not posed
  std::uint32_t live;        // bits of the lanes whose pose is valid
  std::uint32_t batch;       // index of the batch
  bool is_static;            // whether that is one of static bodies
  std::uint32_t leaves;      // of each instance
  const BoxTile* boxes;
  Lane lanes[kLanes];

  const BoxTile* boxes_of(std::uint32_t lane) const { return boxes + std::size_t{lane} * tile_count(leaves); }
};

}  // namespace cab::kernel
