// How thick a body is between two joints.
//
// Source: the segment masses and densities of D. A. Winter, "Biomechanics and Motor Control of Human Movement"
// (table 4.1, after Dempster 1955), and the segment lengths of R. Drillis and R. Contini, "Body Segment Parameters"
// (1966), both as shares of body mass and stature. The radius of a part is that of an ellipsoid of revolution with
// the part's length, mass and density, for a person of body mass index 22 at 1.75 m. It does not depend on how many
// segments a skeleton splits the part into: the volumes of the pieces add up to the part's.
#pragma once

#include <string>

namespace cab::scenes {

enum class BodyPart {
  kUnknown,  // no name recognised: thickness goes by the segment's length
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

// The part that a segment runs through, from the names of the joints at its two ends, in whatever case and with
// whatever side or namespace. Both ends decide: "LeftShoulder" begins a collar bone in one file and an upper arm in
// another.
BodyPart body_part(const std::string& start, const std::string& end);

// The radius across a segment of the given length in a figure of the given stature. ray_count is the number of
// segments that share a hand (1 elsewhere): they share its cross-section. At least 0.08 of the length, and at most
// half of it, or 1.5 lengths in the trunk, pelvis and girdle, whose bones are shorter than the body is thick.
double segment_radius(BodyPart part, double length, double stature, std::size_t ray_count);

}  // namespace cab::scenes
