// The thickness of a body between two joints.
//
// Source: the segment masses and densities of D. A. Winter, "Biomechanics and Motor Control of Human Movement" (table
// 4.1, after Dempster 1955), and the segment lengths of R. Drillis and R. Contini, "Body Segment Parameters" (1966),
// both as shares of body mass and stature. The radius of a part is that of an ellipsoid of revolution with the part's
// length, mass and density, for a person of body mass index 22 at 1.75 m. It does not depend on the number of segments
// into which a skeleton splits the part: the volumes of the pieces add up to the volume of the part.
#pragma once

#include <string>

namespace cab::scenes {

enum class BodyPart {
  kUnknown,  // no name is recognised: the thickness follows from the segment's length
  kTrunk,
  kPelvis,  // from the middle of the hips to a hip joint
  kGirdle,  // from the trunk to a shoulder joint
  kHead,    // the neck included
  kUpperArm,
  kForearm,
  kHand,
  kFinger,
  kThigh,
  kShank,
  kFoot,  // toes included
};

// The part that a segment runs through, by the names of the joints at its two ends. Case, side and namespace of the
// names do not matter. Both ends decide, because "LeftShoulder" begins a collar bone in one file and an upper arm in
// another.
BodyPart body_part(const std::string& start, const std::string& end);

// The radius across a segment of the given length in a figure of the given stature. ray_count is the number of segments
// that share the cross-section of a hand, and 1 elsewhere. The radius is at least 0.08 of the length. It is at most
// half of the length, or 1.5 lengths in the trunk, pelvis and girdle, whose bones are shorter than the body is thick.
double segment_radius(BodyPart part, double length, double stature, std::size_t ray_count);

}  // namespace cab::scenes
