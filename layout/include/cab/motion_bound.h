// MotionBound: how much nearer two links can come to each other, or a link to what stands still, while the joints of a
// robot go in straight lines from one state to another. CollisionChecker::check_motions proves motions free with it. No
// part of the API: it may change in any version.
//
// A turn by an angle moves no point farther than the angle times its distance from the axis, and that is at most the
// length of the chain from the joint's anchor to the point, whatever the other joints do. A joint above both links of a
// pair moves them alike. So the sum over the joints between the two is a bound (docs/proof.md, part 17).
#pragma once

#include <cab/cab.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace cab::detail {

// A robot whose motions are bounded: set once, then length() for each motion. One call at a time.
class MotionBound {
 public:
  // Reads the links of a robot: its joints, the boxes or triangles of its leaves, and the pairs that are not tested.
  // `desc` is one that add_articulation takes. `kinematics` points into arrays that stay. ignored: sorted, as
  // cab::ignored_pairs writes them. Statuses: kBadShape (a half space, which has points anywhere), kSkinNotTaken (other
  // links than that of their leaf move triangles), kOutOfMemory.
  [[nodiscard]] Status set(const ArticulationDesc& desc, const KinematicsDesc& kinematics,
                           Span<const IgnoredPair> ignored) noexcept;

  // A length in the robot's unit: no distance of two tested links, and with `fixed` none of a link and a body that
  // stands still, shrinks or grows by more while every variable goes linearly from `from` to `to`, or back. from, to:
  // variable_count numbers each. In part of the motion it is that part of the length. Infinite or NaN if a number is.
  double length(const double* from, const double* to, bool fixed) noexcept;

  // How far two points may be moved against each other, in a state of such a motion, by the rounding of its poses to
  // floats and of its numbers in double, more than enough. Of the last `length`.
  double rounding() const noexcept { return rounding_; }

 private:
  // What is summed along the chain of a link, from the root to it.
  struct Chain {
    double turns = 0;   // angles
    double moves = 0;   // of slides, and of turns the angle times what must be added to the link's own `reach`
    double extent = 0;  // the length of the chain, in the motion's longest state
    double inexact_turns = 0, inexact_moves = 0;  // how far values in states are off, in double
    double reach = 0;  // the farthest point of the link's leaves from its origin; below 0 without leaves
  };
  struct Pair {
    std::uint16_t a, b;
    std::int16_t above;  // the last link that both chains have, or -1
  };
  static double reach_of(const Leaf& leaf) noexcept;
  static double reach_of(const SkinDesc& skin, const Leaf& leaf) noexcept;
  void add_joint(const JointDesc& joint, const double* from, const double* to, Chain& chain) const noexcept;
  static double moved(const Chain& chain, const Chain& above) noexcept {
    return (chain.moves - above.moves) + (chain.extent + chain.reach) * (chain.turns - above.turns);
  }

  KinematicsDesc kinematics_;
  std::unique_ptr<Chain[]> chains_;  // by link
  std::unique_ptr<Pair[]> pairs_;
  std::size_t pair_count_ = 0;
  double rounding_ = 0;
};

inline Status MotionBound::set(const ArticulationDesc& desc, const KinematicsDesc& kinematics,
                               Span<const IgnoredPair> ignored) noexcept {
  const std::size_t links = kinematics.link_parents.size;
  chains_.reset(new (std::nothrow) Chain[links]);
  pairs_.reset(new (std::nothrow) Pair[links * (links - 1) / 2 + 1]);
  if (!chains_ || !pairs_) return Status::kOutOfMemory;
  kinematics_ = kinematics;
  pair_count_ = 0;
  for (std::size_t l = 0; l < links; ++l) chains_[l].reach = -1;
  for (const Leaf& leaf : desc.leaves) {
    for (const ConvexPart& part : leaf.parts)
      if (part.kind == ShapeKind::kHalfSpace) return Status::kBadShape;
    const double of_leaf = leaf.triangles.empty() ? reach_of(leaf) : reach_of(desc.skin, leaf);
    if (of_leaf < 0) return Status::kSkinNotTaken;
    chains_[leaf.link].reach = std::max(chains_[leaf.link].reach, of_leaf);
  }
  for (std::size_t a = 0; a < links; ++a)
    for (std::size_t b = a + 1; b < links; ++b) {
      if (chains_[a].reach < 0 || chains_[b].reach < 0) continue;
      const auto before = [](const IgnoredPair& x, const IgnoredPair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; };
      const IgnoredPair sought = {static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), {}};
      if (std::binary_search(ignored.begin(), ignored.end(), sought, before)) continue;
      // Parents come first, so the later link of two is not above the other.
      auto x = static_cast<std::int32_t>(a), y = static_cast<std::int32_t>(b);
      while (x != y) (x > y ? x : y) = kinematics.link_parents[static_cast<std::size_t>(std::max(x, y))];
      pairs_[pair_count_++] = {static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b),
                               static_cast<std::int16_t>(x)};
    }
  return Status::kOk;
}

// The farthest that a leaf's box reaches from the origin of its link.
inline double MotionBound::reach_of(const Leaf& leaf) noexcept {
  double center = 0, half = 0;
  for (int c = 0; c < 3; ++c) {
    center += static_cast<double>(leaf.box.center[c]) * static_cast<double>(leaf.box.center[c]);
    half += static_cast<double>(leaf.box.half[c]) * static_cast<double>(leaf.box.half[c]);
  }
  return (std::sqrt(center) + std::sqrt(half)) * (1 + 1e-4);  // axes are orthonormal to 1e-5
}

// The same of a leaf's triangles; below 0 if another link moves them.
inline double MotionBound::reach_of(const SkinDesc& skin, const Leaf& leaf) noexcept {
  double farthest = 0;
  for (const std::uint32_t v : leaf.triangles) {
    for (std::size_t i = v * std::size_t{skin.influence_count}; i < (v + std::size_t{1}) * skin.influence_count; ++i)
      if (skin.influence_weights[i] > 0 && skin.influence_links[i] != leaf.link) return -1;
    const float* const at = skin.vertices.data + 3 * std::size_t{v};
    const float* const bind =
        skin.inverse_bind.empty() ? nullptr : skin.inverse_bind.data + 16 * std::size_t{leaf.link};
    double square = 0, sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      double x = static_cast<double>(bind ? bind[12 + c] : at[c]);
      sum += std::fabs(x);
      for (std::size_t k = 0; bind && k < 3; ++k) {
        const double term = static_cast<double>(bind[4 * k + c]) * static_cast<double>(at[k]);
        x += term;
        sum += std::fabs(term);
      }
      square += x * x;
    }
    farthest = std::max(farthest, std::sqrt(square) + 1e-14 * sum);
  }
  return farthest;
}

// Adds a joint to the chain that leads to it.
inline void MotionBound::add_joint(const JointDesc& joint, const double* from, const double* to,
                                   Chain& chain) const noexcept {
  const auto norm = [](const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
  const double *const a = from + joint.variable, *const b = to + joint.variable;
  const double by = std::fabs(joint.multiplier);
  // A state between is off by two roundings, and a value by two more.
  const auto inexact = [&](std::uint32_t k) {
    return (by * std::max(std::fabs(a[k]), std::fabs(b[k])) + std::fabs(joint.offset)) * 4.5e-16;
  };
  if (joint.kind == JointKind::kPrismatic) {
    const double axis = norm(joint.axis);
    const auto value = [&](double x) { return std::fabs(joint.multiplier * x + joint.offset); };
    chain.moves += axis * by * std::fabs(b[0] - a[0]);
    chain.extent += axis * std::max(value(a[0]), value(b[0]));
    chain.inexact_moves += axis * inexact(0);
    return;
  }
  double angle = std::fabs(b[0] - a[0]);
  if (joint.kind == JointKind::kBall) {
    const double difference[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    angle = norm(difference);
  }
  chain.inexact_turns += joint.kind == JointKind::kBall ? inexact(0) + inexact(1) + inexact(2) : inexact(0);
  const double anchor = norm(joint.anchor);
  chain.turns += by * angle;
  chain.extent += 2 * anchor;
  chain.moves += by * angle * (anchor - chain.extent);  // `moved` adds the whole chain's extent
}

inline double MotionBound::length(const double* from, const double* to, bool fixed) noexcept {
  const std::size_t links = kinematics_.link_parents.size;
  const JointDesc* joint = kinematics_.joints.data;
  double farthest = 0, longest = 0, inexact = 0;
  const auto enlarge = [](double& largest, double x) {
    if (!(x <= largest) && !std::isnan(largest)) largest = x;  // NaN stays
  };
  for (std::size_t l = 0; l < links; ++l) {
    Chain& chain = chains_[l];
    const std::int32_t parent = kinematics_.link_parents[l];
    const double reach = chain.reach;
    chain = parent < 0 ? Chain() : chains_[static_cast<std::size_t>(parent)];
    chain.reach = reach;
    const LinkPlaceDesc& place = kinematics_.links[l];
    const double* const t = place.translation;
    chain.extent += std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (std::uint32_t j = 0; j < place.joint_count; ++j) add_joint(*joint++, from, to, chain);
    enlarge(farthest, chain.extent + std::max(reach, 0.0));
    enlarge(inexact, chain.inexact_moves + (chain.extent + std::max(reach, 0.0)) * chain.inexact_turns);
    if (fixed && reach >= 0) enlarge(longest, moved(chain, Chain()));
  }
  for (std::size_t p = 0; p < pair_count_; ++p) {
    const Pair& pair = pairs_[p];
    const Chain above = pair.above < 0 ? Chain() : chains_[static_cast<std::size_t>(pair.above)];
    enlarge(longest, moved(chains_[pair.a], above) + moved(chains_[pair.b], above));
  }
  rounding_ = 1e-6 * farthest + 2 * inexact;
  return longest * (1 + 1e-9);
}

}  // namespace cab::detail
