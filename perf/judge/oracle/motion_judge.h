// The judge of a motion of a robot, in long double: when its boxes come near each other while every variable goes
// linearly. It advances from moment to moment by the distance divided by the largest speed, so that between two moments
// nothing is overlooked (conservative advancement).
#pragma once

#include "perf/harness/random_joints.h"
#include "perf/judge/oracle/exact_pose.h"

#include <vector>

namespace cab::oracle {

// What a search has found.
struct Approach {
  enum Kind { kFound, kNever, kUnknown };  // kUnknown: it has taken too many steps
  Kind kind;
  Real moment;  // of kFound: there two boxes are so near; before it there are none, to the judge's slack
};

class MotionJudge {
 public:
  // robot: its leaves are boxes; borrowed. fixed: boxes that stand still in the robot's frame. from, to: a number for
  // each variable.
  MotionJudge(const JointedRig& robot, const std::vector<Leaf>& fixed, const std::vector<double>& from,
              const std::vector<double>& to);

  // 1e-6 of the robot's size: the largest distance of a point of it from the origin that its joints might allow. It is
  // above the rounding of poses to float.
  Real slack() const { return slack_; }

  // The least separation of two tested boxes at a moment: their distance or less their depth.
  Real separation(Real moment) const;

  // The first moment from `begin` to 1 at which two tested boxes are at most `level` apart or, below 0, at least
  // -level deep. kNever is a proof that they are farther apart than level - slack() at all these moments.
  Approach first_within(Real level, Real begin) const;

 private:
  struct Pair {
    std::size_t a, b;  // leaves; those that are fixed come after the robot's
    std::int32_t top;  // the lowest link that moves both, or -1
    Real speed;        // no point of a moves faster against a point of b, in lengths per motion
  };
  // How far from the frame of `top` a leaf reaches at most, and how fast it moves in that frame at most.
  struct Sweep {
    Real reach, speed;
  };
  Sweep sweep_of(std::size_t leaf, std::int32_t top) const;
  std::int32_t top_of(std::int32_t a, std::int32_t b) const;
  std::int32_t link_of(std::size_t leaf) const;
  Real value(const JointDesc& joint, std::uint32_t k, Real moment) const;
  ExactPose joint_pose(const JointDesc& joint, Real moment) const;
  ExactBox box_at(std::size_t leaf, std::int32_t top, Real moment) const;
  Real separation_of(const Pair& pair, Real moment, Real exact_below) const;

  const JointedRig& robot_;
  const std::vector<Leaf>& fixed_;
  const std::vector<double>&from_, &to_;
  std::vector<std::size_t> first_joint_;  // of each link
  std::vector<ExactPose> places_;         // of each link
  std::vector<Pair> pairs_;
  Real slack_ = 0;
};

}  // namespace cab::oracle
