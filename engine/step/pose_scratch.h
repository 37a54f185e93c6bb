// What a worker needs to pose and refit one tile.
#pragma once

#include "kernels/grow_leaves.h"
#include "kernels/pose_between.h"
#include "layout/round_leaf.h"

#include <cab/span.h>

namespace cab {

struct PoseScratch {
  Span<BoxTile> boxes;            // by node: one tile of every sequence, or one tile of characters
  Span<AabbTile> bounds;          // the same, axis-aligned
  Span<RoundTile> round;          // likewise, of sequences whose leaves are balls and capsules
  Span<double> states;            // of a tile of joint states whose poses are made
  Span<float> state_poses;        // likewise
  Span<kernel::RawPoses> links;   // by link: these poses
  Span<PointTile> joints;         // by link: the joints of the tile that is updated
  Span<MotionTile> motions;       // by link: the poses of that tile, for Refit::kAabbVertices and sweep_margins
  Span<MotionTile> last_motions;  // by link: the poses of a tile in the frame before, for sweep_margins
  Span<MotionTile> skin;          // PoseTile::skin
  Span<float> skin_rows;          // PoseTile::skin_rows
  Span<kernel::GrownTile> grown;  // PoseTile::grown
};

}  // namespace cab
