// The clusters that a worker has posed: the leaf boxes of sixteen instances that are near each other.
#include "engine/queries/search.h"
#include "engine/step/generation.h"
#include "engine/step/update.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// Poses the leaf boxes of a cluster into the worker's lists, which have room.
void pose(const QueryRun& run, const QueryCluster& cluster, kernel::PosedCluster& out) {
  const kernel::KernelTable& kernels = run.frame.kernels;
  const InstanceBatch& batch = run.frame.batch(cluster.batch);
  const std::uint32_t leaves = batch.active->leaf_count;
  PoseScratch& posing = run.pose;
  PosedClusters& posed = run.own.posed;
  const TileInstances instances = run.index.instances_of(cluster);
  out.generation = posed.generation;
  out.live = update_tile(
      run.frame,
      {&batch, instances, refit_scope(Strategy::kRows, *batch.active), posing.boxes.data, posing.bounds.data}, posing);
  out.boxes = posed.boxes.end();
  out.batch = cluster.batch;
  out.is_static = is_static(batch);
  out.leaves = leaves;
  float reach[kLanes];
  take_posed(kernels, posing, leaves, instances.count, {posed.boxes.end(), reach});
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
    const std::uint32_t i = instances.instance[lane];
    out.lanes[lane] = {{origin_of(batch, i, 0), origin_of(batch, i, 1), origin_of(batch, i, 2)}, reach[lane], i};
  }
  posed.boxes.size += instances.count * tile_count(leaves);
  run.own.stats.instances_posed += instances.count;
}

}  // namespace

void take_posed(const kernel::KernelTable& kernels, PoseScratch& posing, std::uint32_t leaves, std::uint32_t count,
                const PosedLanes& to) {
  kernels.boxes_by_leaf(posing.boxes.data, leaves, count, to.boxes);
  kernels.bound_boxes(posing.boxes.data, leaves, posing.bounds.data);
  AabbTile all;
  kernels.bound_together(posing.bounds.data, leaves, &all);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    to.reach[lane] = 0;
    for (int c = 0; c < 3; ++c)
      to.reach[lane] = std::max(to.reach[lane], std::max(std::fabs(all.lo[c][lane]), std::fabs(all.hi[c][lane])));
  }
}

const kernel::PosedCluster& pose_cluster(const QueryRun& run, std::uint32_t cluster) {
  PosedClusters& posed = run.own.posed;
  kernel::PosedCluster& out = posed.clusters[cluster];
  const QueryCluster& of = run.index.clusters.data[cluster];
  const std::uint32_t leaves = run.frame.batch(of.batch).active->leaf_count;
  if (posed.boxes.size + of.count * tile_count(leaves) > posed.boxes.capacity) forget_clusters(posed);
  pose(run, of, out);
  return out;
}

void forget_clusters(PosedClusters& posed) {
  posed.boxes.clear();
  begin_generation(posed.generation, posed.clusters);
}

}  // namespace cab
