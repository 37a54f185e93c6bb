// The thickness of a body between two joints.
//
// Source: the segment masses and densities of D. A. Winter, "Biomechanics and Motor Control of Human Movement" (table
// 4.1, after Dempster 1955), and the segment lengths of R. Drillis and R. Contini, "Body Segment Parameters" (1966),
// both as shares of body mass and stature. The radius of a part is that of an ellipsoid of revolution with the part's
// length, mass and density, for a person of body mass index 22 at 1.75 m. It does not depend on the number of segments
// into which a skeleton splits the part: the volumes of the pieces add up to the volume of the part.
#pragma once

#include <cstddef>
#include <optional>
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

// A word for a part, such as "upper arm".
const char* to_string(BodyPart part);

// The body that belongs to a joint at the end of a skeleton, where no segment begins.
struct Cap {
  BodyPart part = BodyPart::kUnknown;
  double length_over_stature = 0;  // 0: no table tells it
  bool stands_out = false;         // a head or a hand: it is there even if bones to eyes or a thumb begin at the joint
  bool is_tip = false;             // the name means the tip of the bone before, as "LeftHand_End" does
};

// By the joint's name. Empty if there is none: for targets of inverse kinematics, eyes and jaws, trunk and girdle. The
// part is unknown if no name is recognised.
std::optional<Cap> cap_of(const std::string& joint);

// A segment near the top of a skeleton, with no bone above it.
struct TopSegment {
  const std::string& start;
  const std::string& end;
  double length_over_height = 0;
  bool leads_on = true;  // segments begin below its end
};

// True if the segment is no part of a body: it begins at a node outside the figure ("Armature"), leads from a node
// without a known part to the pelvis, far up the trunk, or straight to a hand or a foot, or ends at a target of inverse
// kinematics.
bool is_outside_body(const TopSegment& segment);

// True for a node that steers or marks a figure and is no part of it, by its name: a target of inverse kinematics, a
// control, a socket.
bool is_helper(const std::string& node);

// True for a node that only holds figures, by its name, such as "Armature".
bool is_container(const std::string& node);

// True if the name of a joint is that of a part of a body.
bool is_body_part(const std::string& joint);

// 1 for a joint of the left side, -1 for the right, 0 if its name does not say.
int side_of(const std::string& joint);

// The sums of lengths that tell a figure's stature. 0: the figure has none.
struct StatureLengths {
  double thigh = 0, shank = 0;        // of one leg
  double spine = 0;                   // from the hips to the neck
  double upper_arm = 0, forearm = 0;  // of one arm
  double hand = 0;                    // from the wrist to the farthest fingertip
};

// What a figure's stature was taken from.
enum class StatureSource { kGiven, kLegsAndSpine, kLegs, kArms, kSpine, kHand, kHeight };
const char* to_string(StatureSource source);

struct Stature {
  double value = 0;
  StatureSource source = StatureSource::kHeight;
};

// The stature of a person with these lengths: by legs and spine, or legs; without thighs and shanks, by arms, spine or
// hand. `height` is that of the figure, for figures that have none of these, or half of a leg.
Stature stature_of(const StatureLengths& lengths, double height);

}  // namespace cab::scenes
