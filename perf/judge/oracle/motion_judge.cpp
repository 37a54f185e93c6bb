#include "perf/judge/oracle/motion_judge.h"

#include "perf/judge/oracle/box_distance.h"

#include <algorithm>
#include <limits>

namespace cab::oracle {
namespace {

// The steps of a pair after which a search is given up. The motions of 2500 rounds of `cab verify` took at most 5051.
constexpr int kMostSteps = 100000;

Real length(const Point& p) { return std::sqrt(dot(p, p)); }

// The product of two poses as 3x4 matrices: first b, then a.
ExactPose operator*(const ExactPose& a, const ExactPose& b) {
  ExactPose out{};
  for (std::size_t k = 0; k < 3; ++k) store(rotated(a.column, to_vec3(b.column[k])), out.column[k]);
  out.at = a.at + rotated(a.column, b.at);
  return out;
}

// The turn by the length of a vector about it (Rodrigues' formula).
ExactPose turn_by(const Point& vector) {
  ExactPose out{};
  const Real angle = length(vector), sine = std::sin(angle), rest = 1 - std::cos(angle);
  const Point n = angle > 0 ? (1 / angle) * vector : Point{};
  for (std::size_t k = 0; k < 3; ++k) {
    Point unit{};
    unit[k] = 1;
    store(unit + sine * cross(n, unit) + rest * cross(n, cross(n, unit)), out.column[k]);
  }
  return out;
}

// The largest gap of two boxes along the normals of their faces and the products of their edges: at most the distance
// of boxes that are apart, and less the depth of boxes that overlap.
Real gap(const ExactBox& a, const ExactBox& b) {
  // Shorter products are of edges that are parallel but for 1e-8: no other axis shows a gap that is smaller by more.
  constexpr Real kParallelSq = 1e-16L;
  const Point between = center_of(b) - center_of(a);
  Real most = -std::numeric_limits<Real>::infinity();
  const auto try_axis = [&](const Point& axis) {
    const Real length_sq = dot(axis, axis);
    if (length_sq < kParallelSq) return;
    Real apart = std::fabs(dot(between, axis));
    for (std::size_t k = 0; k < 3; ++k)
      apart -= a.half[k] * std::fabs(dot(axis_of(a, k), axis)) + b.half[k] * std::fabs(dot(axis_of(b, k), axis));
    most = std::max(most, apart / std::sqrt(length_sq));
  };
  for (std::size_t i = 0; i < 3; ++i) {
    try_axis(cross(axis_of(a, i), axis_of(a, (i + 1) % 3)));
    try_axis(cross(axis_of(b, i), axis_of(b, (i + 1) % 3)));
    for (std::size_t j = 0; j < 3; ++j) try_axis(cross(axis_of(a, i), axis_of(b, j)));
  }
  return most;
}

bool is_ignored(const Rig& rig, std::uint32_t a, std::uint32_t b) {
  return a == b || std::any_of(rig.ignored.begin(), rig.ignored.end(), [&](const LinkPair& pair) {
           return (pair.a == a && pair.b == b) || (pair.a == b && pair.b == a);
         });
}

}  // namespace

MotionJudge::MotionJudge(const JointedRig& robot, const std::vector<Leaf>& fixed, const std::vector<double>& from,
                         const std::vector<double>& to)
    : robot_(robot), fixed_(fixed), from_(from), to_(to) {
  std::size_t joints = 0;
  for (const LinkPlaceDesc& link : robot.body.links) {
    first_joint_.push_back(joints);
    joints += link.joint_count;
    ExactPose& place = places_.emplace_back();
    const Real q[4] = {link.rotation[0], link.rotation[1], link.rotation[2], link.rotation[3]};
    quaternion_matrix(q, place.column);
    place.at = convert<Real>(to_vec3(link.translation));
  }
  const std::vector<Leaf>& leaves = robot.rig.leaves;
  for (std::size_t a = 0; a < leaves.size(); ++a) {
    slack_ = std::max(slack_, 1e-6L * sweep_of(a, -1).reach);
    for (std::size_t b = a + 1; b < leaves.size() + fixed.size(); ++b) {
      if (b < leaves.size() && is_ignored(robot.rig, leaves[a].link, leaves[b].link)) continue;
      const std::int32_t top = top_of(link_of(a), link_of(b));
      pairs_.push_back({a, b, top, sweep_of(a, top).speed + sweep_of(b, top).speed});
    }
  }
}

std::int32_t MotionJudge::link_of(std::size_t leaf) const {
  const std::vector<Leaf>& leaves = robot_.rig.leaves;
  return leaf < leaves.size() ? static_cast<std::int32_t>(leaves[leaf].link) : -1;
}

// The lowest link from which both come. Parents have lower numbers than their children.
std::int32_t MotionJudge::top_of(std::int32_t a, std::int32_t b) const {
  while (a != b) {
    std::int32_t& lower = a > b ? a : b;
    lower = robot_.body.parents[static_cast<std::size_t>(lower)];
  }
  return a;
}

Real MotionJudge::value(const JointDesc& joint, std::uint32_t k, Real moment) const {
  const std::size_t v = joint.variable + k;
  return joint.multiplier * (from_[v] + moment * (Real{to_[v]} - from_[v])) + joint.offset;
}

// From the leaf outwards: each joint and each place adds to the reach, and each joint to the speed what it moves the
// points within reach by. A rotation vector that changes linearly turns no faster than it changes.
MotionJudge::Sweep MotionJudge::sweep_of(std::size_t leaf, std::int32_t top) const {
  const std::size_t own = robot_.rig.leaves.size();
  const Box& box = leaf < own ? robot_.rig.leaves[leaf].box : fixed_[leaf - own].box;
  Sweep out = {length(convert<Real>(to_vec3(box.center))) + length(convert<Real>(to_vec3(box.half))), 0};
  for (std::int32_t link = link_of(leaf); link != top; link = robot_.body.parents[static_cast<std::size_t>(link)]) {
    const auto l = static_cast<std::size_t>(link);
    for (std::size_t j = robot_.body.links[l].joint_count; j-- > 0;) {
      const JointDesc& joint = robot_.body.joints[first_joint_[l] + j];
      Point first{}, last{};
      for (std::uint32_t k = 0; k < (joint.kind == JointKind::kBall ? 3 : 1); ++k)
        first[k] = value(joint, k, 0), last[k] = value(joint, k, 1);
      const Real rate = length(last - first), anchor = length(convert<Real>(to_vec3(joint.anchor)));
      if (joint.kind == JointKind::kPrismatic) {
        out.speed += rate;
        out.reach += std::max(length(first), length(last));
      } else {
        out.speed += rate * (out.reach + anchor);
        out.reach += 2 * anchor;
      }
    }
    out.reach += length(places_[l].at);
  }
  return out;
}

ExactPose MotionJudge::joint_pose(const JointDesc& joint, Real moment) const {
  const Point axis = convert<Real>(to_vec3(joint.axis)), anchor = convert<Real>(to_vec3(joint.anchor));
  if (joint.kind == JointKind::kPrismatic) {
    ExactPose out = turn_by({});
    out.at = value(joint, 0, moment) * axis;
    return out;
  }
  const Point vector = joint.kind == JointKind::kRevolute
                           ? value(joint, 0, moment) * axis
                           : Point{{value(joint, 0, moment), value(joint, 1, moment), value(joint, 2, moment)}};
  ExactPose out = turn_by(vector);
  out.at = anchor - rotated(out.column, anchor);
  return out;
}

// A leaf's box in the frame of `top`, or in the robot's for -1.
ExactBox MotionJudge::box_at(std::size_t leaf, std::int32_t top, Real moment) const {
  const std::size_t own = robot_.rig.leaves.size();
  const Box& box = leaf < own ? robot_.rig.leaves[leaf].box : fixed_[leaf - own].box;
  ExactPose pose{};
  for (std::size_t k = 0; k < 3; ++k) store(convert<Real>(to_vec3(box.axis[k])), pose.column[k]);
  pose.at = convert<Real>(to_vec3(box.center));
  for (std::int32_t link = link_of(leaf); link != top; link = robot_.body.parents[static_cast<std::size_t>(link)]) {
    const auto l = static_cast<std::size_t>(link);
    for (std::size_t j = robot_.body.links[l].joint_count; j-- > 0;)
      pose = joint_pose(robot_.body.joints[first_joint_[l] + j], moment) * pose;
    pose = places_[l] * pose;
  }
  ExactBox out{};
  store(pose.at, out.center);
  for (std::size_t k = 0; k < 3; ++k) {
    store(to_vec3(pose.column[k]), out.axis[k]);
    out.half[k] = box.half[k];
  }
  return out;
}

// At most the separation, and the separation itself where boxes overlap or the gap is below `exact_below`.
Real MotionJudge::separation_of(const Pair& pair, Real moment, Real exact_below) const {
  const ExactBox a = box_at(pair.a, pair.top, moment), b = box_at(pair.b, pair.top, moment);
  const Real out = gap(a, b);
  return out <= 0 || out >= exact_below ? out : box_distance(a, b, center_of(b) - center_of(a));
}

Real MotionJudge::separation(Real moment) const {
  Real least = std::numeric_limits<Real>::infinity();
  for (const Pair& pair : pairs_) least = std::min(least, separation_of(pair, moment, least));
  return least;
}

Approach MotionJudge::first_within(Real level, Real begin) const {
  Approach out = {Approach::kNever, 1};
  for (const Pair& pair : pairs_) {
    int steps = 0;
    for (Real moment = begin; moment <= out.moment;) {
      const Real separation = separation_of(pair, moment, level + slack_);
      if (separation <= level) {
        out = {Approach::kFound, moment};
        break;
      }
      if (pair.speed == 0) break;
      if (++steps > kMostSteps) return {Approach::kUnknown, moment};
      moment += std::max(separation - level, slack_) / pair.speed;
    }
  }
  return out;
}

}  // namespace cab::oracle
