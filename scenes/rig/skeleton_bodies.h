// Bodies between the joints of a skeleton: which segments are solid, how thick they are, and what covers the ends.
#pragma once

#include "scenes/rig/body_parts.h"
#include "scenes/rig/skeleton_segments.h"

#include <cab/types.h>

namespace cab::scenes {

struct BodyOptions {
  double stature = 0;    // of the person, for thickness and caps; 0: from the figure's own lengths
  double thickness = 1;  // factor of all radii
};

// Why a body is there, or not.
enum class BodyReason {
  kBone,     // a segment between two joints
  kCap,      // the end of the figure, where no bone begins
  kBall,     // the joint where several links without a link above them meet
  kTravels,  // none, for the reason of SegmentKind
  kOutside,  // none, likewise
};

// The body of a bone, cap or ball, in the frame of its joint.
struct SkeletonBody {
  std::size_t joint = 0;  // the body is rigid with it
  std::int32_t end = -1;  // the joint at the other end; -1: cap or ball
  BodyReason reason = BodyReason::kBone;
  BodyPart part = BodyPart::kUnknown;
  double strays = 0;  // how far the far end moves from its mean place in the joint's frame

  bool is_solid = true;  // false: no body
  ShapeKind kind = ShapeKind::kEllipsoid;
  Vec3 center = {0, 0, 0};
  Vec3 direction = {1, 0, 0};              // unit vector along the bone
  std::array<double, 3> half = {0, 0, 0};  // half extents along the bone, rounded ends included, and across it
};

struct SkeletonBodies {
  std::vector<SkeletonBody> bodies;  // by joint
  Segments segments;
  Stature stature;
};

// The bodies that cab guesses for a skeleton. docs/import.md has the rules.
SkeletonBodies guess_bodies(const SkeletonView& skeleton, const BodyOptions& options);

// The joints that are links, in order: those with a solid body, and if several of them have none above them, also the
// last joint above all of these.
std::vector<std::size_t> link_joints(const SkeletonView& skeleton, const SkeletonBodies& bodies);

// A solid body as a convex part.
ConvexPart convex_part(const SkeletonBody& body);

// Every two joints with solid bodies that share a point: parent and child, and siblings that begin at the same place.
// Each pair is there once and in order, the lower joint first.
std::vector<LinkPair> adjacent_joints(const SkeletonBodies& bodies);

}  // namespace cab::scenes
