// AttachedObject: a robot with something in its hand. Of a robot and an object that one of its links holds it makes a
// robot with one link more.
//
//   cab::AttachedDesc box;
//   box.link = hand, box.leaves = leaves, box.touch_links = fingers;
//   cab::AttachedObject held;
//   status = held.set(robot.desc(), robot.kinematics(), box);
//   status = checker.set_robot(held.desc(), held.kinematics());  // cab::CollisionChecker
#pragma once

#include <cab/kinematics.h>
#include <cab/types.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>

namespace cab {

// A rigid object and the link that holds it.
struct AttachedDesc {
  std::uint32_t link = 0;                 // index of the link that holds it
  double rotation[4] = {0, 0, 0, 1};      // quaternion x y z w from the object's frame to that link's, of any length
  double translation[3] = {0, 0, 0};      // x y z in that link's frame
  Span<const Leaf> leaves;                // its shapes, in its own frame; their `link` is 0
  Span<const std::uint32_t> touch_links;  // links that it may touch, beside the one that holds it
};

// A robot with an object. Set once more, with desc() and kinematics() of another or of itself, it has one object more.
class AttachedObject {
 public:
  // Makes the robot. Its last link is the object: it moves with object.link, is never tested against that one and
  // object.touch_links, and is tested against all other links. All is copied but kinematics.joints, the parts and
  // triangles of leaves, and the robot's skin, which stay the caller's, as they are, as long as this object is used. If
  // the status is not kOk this object stays as it was. Whether leaves are right is for set_robot to say: its *bad_leaf
  // counts the object's after the robot's.
  // Statuses: kNoLinks, kTooManyLinks, kBadParent (link_parents of the robot, or object.link, is wrong), kBadJoint
  // (kinematics has other links than the robot, or arrays do not fit), kNoLeaves (the object has none), kTooManyLeaves,
  // kBadLeafLink (a leaf of the robot is on no link, or one of the object not on 0), kBadIgnoredPair (ignored_pairs or
  // touch_links names no link; or ignored_hops is above 1, which would reach the object), kBadRestPose (the robot has a
  // rest pose, where the object is in none: list the pairs that cab::ignored_pairs tells instead), kBadPoses (rotation
  // or translation is not finite, or rotation is 0), kSkinNotTaken (a leaf of the object has triangles), kBadSkin
  // (inverse_bind of the robot's skin is not one matrix for each link), kOutOfMemory.
  [[nodiscard]] Status set(const ArticulationDesc& robot, const KinematicsDesc& kinematics,
                           const AttachedDesc& object) noexcept;

  // The robot with the object. Empty before set. They point into this object.
  const ArticulationDesc& desc() const noexcept { return desc_; }
  const KinematicsDesc& kinematics() const noexcept { return kinematics_; }

 private:
  static Status validate(const ArticulationDesc& robot, const KinematicsDesc& kinematics,
                         const AttachedDesc& object) noexcept;
  static bool place(const AttachedDesc& object, LinkPlaceDesc& to) noexcept;

  ArticulationDesc desc_;
  KinematicsDesc kinematics_;
  std::unique_ptr<std::int32_t[]> parents_;
  std::unique_ptr<LinkPlaceDesc[]> places_;
  std::unique_ptr<float[]> joints_;
  std::unique_ptr<Leaf[]> leaves_;
  std::unique_ptr<LinkPair[]> pairs_;
  std::unique_ptr<float[]> binds_;  // of the robot's skin, if it has some
};

// Refuses what would read beyond an array, or become right, or mean something else, by the link more.
inline Status AttachedObject::validate(const ArticulationDesc& robot, const KinematicsDesc& kinematics,
                                       const AttachedDesc& object) noexcept {
  const std::size_t links = robot.link_parents.size;
  if (links == 0) return Status::kNoLinks;
  if (links >= kMaxLinks) return Status::kTooManyLinks;
  if (!robot.link_parents.data || object.link >= links) return Status::kBadParent;
  for (std::size_t l = 0; l < links; ++l)
    if (robot.link_parents[l] < -1 || robot.link_parents[l] >= static_cast<std::int32_t>(l)) return Status::kBadParent;
  const auto fits = [](const auto& span, std::size_t size) { return span.size == size && span.data; };
  if (!fits(kinematics.link_parents, links) || !fits(kinematics.links, links) ||
      !std::equal(robot.link_parents.begin(), robot.link_parents.end(), kinematics.link_parents.begin()) ||
      !(robot.link_joints.empty() || fits(robot.link_joints, 3 * links)))
    return Status::kBadJoint;
  if (object.leaves.empty() || !object.leaves.data || (robot.leaves.size && !robot.leaves.data))
    return Status::kNoLeaves;
  if (robot.leaves.size > kMaxLeaves || object.leaves.size > kMaxLeaves - robot.leaves.size)
    return Status::kTooManyLeaves;
  for (const Leaf& leaf : robot.leaves)
    if (leaf.link >= links) return Status::kBadLeafLink;
  if (!robot.skin.inverse_bind.empty() && !fits(robot.skin.inverse_bind, 16 * links)) return Status::kBadSkin;
  for (const Leaf& leaf : object.leaves) {
    if (leaf.link != 0) return Status::kBadLeafLink;
    if (leaf.triangles.size) return Status::kSkinNotTaken;
  }
  if ((robot.ignored_pairs.size && !robot.ignored_pairs.data) ||
      (object.touch_links.size && !object.touch_links.data) || robot.ignored_hops > 1)
    return Status::kBadIgnoredPair;
  for (const LinkPair& pair : robot.ignored_pairs)
    if (pair.a >= links || pair.b >= links) return Status::kBadIgnoredPair;
  for (const std::uint32_t link : object.touch_links)
    if (link >= links) return Status::kBadIgnoredPair;
  return robot.rest_pose.data ? Status::kBadRestPose : Status::kOk;
}

// Writes where the object is in the frame of its link. Returns whether that is a place.
inline bool AttachedObject::place(const AttachedDesc& object, LinkPlaceDesc& to) noexcept {
  double largest = 0, square = 0;
  for (const double x : object.rotation) {
    if (!std::isfinite(x)) return false;
    largest = std::max(largest, std::fabs(x));
  }
  if (!(largest > 0)) return false;
  for (int c = 0; c < 4; ++c) {
    to.rotation[c] = object.rotation[c] / largest;
    square += to.rotation[c] * to.rotation[c];
  }
  for (double& x : to.rotation) x /= std::sqrt(square);
  for (int c = 0; c < 3; ++c) {
    if (!std::isfinite(object.translation[c])) return false;
    to.translation[c] = object.translation[c];
  }
  return true;
}

inline Status AttachedObject::set(const ArticulationDesc& robot, const KinematicsDesc& kinematics,
                                  const AttachedDesc& object) noexcept {
  if (const Status status = validate(robot, kinematics, object); status != Status::kOk) return status;
  LinkPlaceDesc held;
  if (!place(object, held)) return Status::kBadPoses;
  const std::size_t links = robot.link_parents.size;
  const auto number = static_cast<std::uint32_t>(links);
  ArticulationDesc desc = robot;
  KinematicsDesc moved = kinematics;
  desc.leaves.size += object.leaves.size;
  desc.ignored_pairs.size += 1 + object.touch_links.size;
  // What is read may be this object's own, so that it stays until all is written.
  std::unique_ptr<std::int32_t[]> parents(new (std::nothrow) std::int32_t[links + 1]);
  std::unique_ptr<LinkPlaceDesc[]> places(new (std::nothrow) LinkPlaceDesc[links + 1]);
  std::unique_ptr<float[]> joints(new (std::nothrow) float[3 * (links + 1)]);
  std::unique_ptr<Leaf[]> leaves(new (std::nothrow) Leaf[desc.leaves.size]);
  std::unique_ptr<LinkPair[]> pairs(new (std::nothrow) LinkPair[desc.ignored_pairs.size]);
  std::unique_ptr<float[]> binds(new (std::nothrow) float[16 * (links + 1)]());
  if (!parents || !places || !joints || !leaves || !pairs || !binds) return Status::kOutOfMemory;

  // After all others it is after its parent.
  *std::copy(robot.link_parents.begin(), robot.link_parents.end(), parents.get()) =
      static_cast<std::int32_t>(object.link);
  *std::copy(kinematics.links.begin(), kinematics.links.end(), places.get()) = held;
  std::fill_n(std::copy(robot.link_joints.begin(), robot.link_joints.end(), joints.get()), 3, 0.0f);
  Leaf* leaf = std::copy(robot.leaves.begin(), robot.leaves.end(), leaves.get());
  for (const Leaf& of : object.leaves) {
    *leaf = of;
    leaf++->link = number;
  }
  LinkPair* pair = std::copy(robot.ignored_pairs.begin(), robot.ignored_pairs.end(), pairs.get());
  *pair++ = {object.link, number};
  for (const std::uint32_t link : object.touch_links) *pair++ = {link, number};

  desc.link_parents = moved.link_parents = {parents.get(), links + 1};
  if (!robot.link_joints.empty()) desc.link_joints = {joints.get(), 3 * (links + 1)};
  if (!robot.skin.inverse_bind.empty()) {
    // No vertex is of the object, so its matrix is any with an inverse.
    float* const last = std::copy(robot.skin.inverse_bind.begin(), robot.skin.inverse_bind.end(), binds.get());
    for (int i = 0; i < 16; i += 5) last[i] = 1;
    desc.skin.inverse_bind = {binds.get(), 16 * (links + 1)};
  }
  desc.leaves.data = leaves.get();
  desc.ignored_pairs.data = pairs.get();
  moved.links = {places.get(), links + 1};
  desc_ = desc;
  kinematics_ = moved;
  parents_ = std::move(parents);
  places_ = std::move(places);
  joints_ = std::move(joints);
  leaves_ = std::move(leaves);
  pairs_ = std::move(pairs);
  binds_ = std::move(binds);
  return Status::kOk;
}

}  // namespace cab
