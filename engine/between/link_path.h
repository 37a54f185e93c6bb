// Where a link is between two frames.
#pragma once

#include "engine/exact/convex_pair.h"
#include "engine/step/instance_batch.h"

namespace cab {

// The way of one link from an earlier frame to the current one, and where it is at any moment of it. Origins move along
// straight lines, the rotation is about one axis, by at most half a turn, and the scale goes over evenly.
class LinkPath {
 public:
  // Both batches are the same, bound to an input each. The link stays where it is now if it is not given or not valid
  // in the earlier frame, or mirrored in only one of them.
  LinkPath(const InstanceBatch& last, const InstanceBatch& now, std::uint32_t instance, std::uint32_t link);

  // Writes the pose at t, 0 to 1, relative to the origin of its instance: PoseFormat::kMatrix3x4Rows, which holds the
  // scale.
  void pose_at(double t, float (&matrix)[12]) const;

  double scale_at(double t) const { return pose_[0].scale + t * (pose_[1].scale - pose_[0].scale); }

  // How far the link's origin moves from t = 0 to 1, in the world's axes, and where it is at t.
  Double3 drift() const { return place_at(1) - place_at(0); }
  Double3 place_at(double t) const {
    return Double3{origin_at(t, 0), origin_at(t, 1), origin_at(t, 2)} + pose_[0].translation +
           t * (pose_[1].translation - pose_[0].translation);
  }

  // The sums of the components of its translations, without signs, in both frames together.
  double translations() const {
    return kernel::sum(kernel::abs(pose_[0].translation)) + kernel::sum(kernel::abs(pose_[1].translation));
  }

  // The greatest speed with which the link turns, in radians per unit of t.
  double most_turn() const;

  // One component of the origin of its instance at t.
  double origin_at(double t, std::uint32_t component) const {
    return origin_[0][component] + t * (origin_[1][component] - origin_[0][component]);
  }

 private:
  kernel::RigidLanes<double> pose_[2];  // in the earlier frame and now
  double origin_[2][3];
  double axis_[3], cosine_;  // of half the rotation from the earlier frame to now: its axis times the sine, its cosine
};

}  // namespace cab
