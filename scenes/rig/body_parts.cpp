// The thickness of a body between two joints.
#include "scenes/rig/body_parts.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Body mass over stature cubed, kg/m^3: body mass index 22 (the middle of the normal range) at 1.75 m.
constexpr double kMassOverStatureCubed = 22 / 1.75;
constexpr double kLeastRadiusOverLength = .08;
constexpr double kLimbRadiusOverLength = .5;
constexpr double kTrunkRadiusOverLength = 1.5;
// Half the mean of thickness over length of the limbs below, for segments without a known name.
constexpr double kUnknownRadiusOverLength = .16;
// An assumption, because the tables have no fingers: 9 mm at 1.75 m.
constexpr double kFingerRadius = .005;
// An assumption, because the tables count hips and shoulders as trunk. Both are thinner than the trunk (.100), so that
// only the spine makes the trunk's outline.
constexpr double kPelvisRadius = .065;
constexpr double kGirdleRadius = .04;

// Radius over stature of an ellipsoid of revolution: mass share m, density d (kg/m^3) and length share l give
// (4/3) pi (l/2) r^2 = m M / d.
double radius_over_stature(double mass_share, double density, double length_share) {
  return std::sqrt(1.5 * mass_share * kMassOverStatureCubed / (density * kPi * length_share));
}

// The place in the body that a joint's name means. Ambiguous words have their own values; for them the other end of the
// segment decides.
enum class Landmark {
  kNone,
  kFinger,
  kHand,
  kForearm,
  kGirdle,
  kShoulder,
  kArm,
  kToe,
  kFoot,
  kShank,
  kLeg,
  kThigh,
  kHip,
  kPelvis,
  kNeck,
  kHead,
  kTrunk
};

Landmark landmark(const std::string& name) {
  std::string word;
  for (const char c : name.substr(name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1)) {
    if (c != '_' && c != '-' && c != '.' && c != ' ')
      word += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  const auto has = [&word](std::initializer_list<const char*> parts) {
    return std::any_of(parts.begin(), parts.end(),
                       [&word](const char* part) { return word.find(part) != std::string::npos; });
  };
  // Specific words come first: "forearm" contains "arm", "upleg" contains "leg", "lefthandindex1" contains "hand".
  if (has({"fingerbase", "fingers"})) return Landmark::kHand;
  if (has({"thumb", "index", "middle", "ring", "pinky", "little", "finger", "phalan", "metacarp", "mid1", "mid2",
           "mid3"}))
    return Landmark::kFinger;
  if (has({"toe", "forefoot"})) return Landmark::kToe;
  if (has({"hand", "wrist", "palm"})) return Landmark::kHand;
  if (has({"forearm", "elbow", "lowerarm", "lowarm", "loarm", "radius"})) return Landmark::kForearm;
  if (has({"collar", "clavicle", "scapula"})) return Landmark::kGirdle;
  if (has({"upperarm", "uparm", "humerus"})) return Landmark::kArm;
  if (has({"shoulder", "shldr"})) return Landmark::kShoulder;
  if (has({"arm"}) && !has({"armature"})) return Landmark::kArm;
  if (has({"foot", "ankle", "heel"})) return Landmark::kFoot;
  if (has({"shin", "calf", "knee", "lowerleg", "lowleg", "loleg", "tibia"})) return Landmark::kShank;
  if (has({"thigh", "upleg", "upperleg", "femur"})) return Landmark::kThigh;
  if (has({"buttock", "pelvis", "hips", "hipjoint"})) return Landmark::kPelvis;
  if (has({"hip"})) return Landmark::kHip;
  if (has({"leg"})) return Landmark::kLeg;
  if (has({"neck"})) return Landmark::kNeck;
  if (has({"head", "skull", "jaw", "eye"})) return Landmark::kHead;
  if (has({"spine", "chest", "torso", "thorax", "abdomen", "back", "waist", "belly", "body", "rib"}) || word == "ab")
    return Landmark::kTrunk;
  return Landmark::kNone;
}

bool is_one_of(Landmark value, std::initializer_list<Landmark> set) {
  return std::find(set.begin(), set.end(), value) != set.end();
}

}  // namespace

BodyPart body_part(const std::string& start_name, const std::string& end_name) {
  using L = Landmark;
  const L start = landmark(start_name);
  const L end = end_name == start_name + "/End" ? L::kNone : landmark(end_name);
  const bool from_trunk = is_one_of(start, {L::kTrunk, L::kPelvis, L::kNeck, L::kNone});
  switch (start) {
    case L::kFinger: return BodyPart::kFinger;
    case L::kHand: return BodyPart::kHand;
    case L::kForearm: return BodyPart::kForearm;
    case L::kShoulder: return is_one_of(end, {L::kArm, L::kShoulder}) ? BodyPart::kGirdle : BodyPart::kUpperArm;
    case L::kArm: return end == L::kHand ? BodyPart::kForearm : BodyPart::kUpperArm;
    case L::kGirdle: return end == L::kForearm ? BodyPart::kUpperArm : BodyPart::kGirdle;
    case L::kToe:
    case L::kFoot: return BodyPart::kFoot;
    case L::kShank: return BodyPart::kShank;
    case L::kLeg: return is_one_of(end, {L::kShank, L::kLeg}) ? BodyPart::kThigh : BodyPart::kShank;
    case L::kThigh: return BodyPart::kThigh;
    case L::kHead: return BodyPart::kHead;
    // "hip" is the root in some skeletons and the top of a thigh in others.
    case L::kHip:
      if (is_one_of(end, {L::kShank, L::kLeg})) return BodyPart::kThigh;
      return is_one_of(end, {L::kTrunk, L::kNeck}) ? BodyPart::kTrunk : BodyPart::kPelvis;
    default: break;
  }
  if (from_trunk && is_one_of(end, {L::kGirdle, L::kShoulder, L::kArm})) return BodyPart::kGirdle;
  if (from_trunk && is_one_of(end, {L::kThigh, L::kHip})) return BodyPart::kPelvis;
  if (start == L::kPelvis)
    return is_one_of(end, {L::kTrunk, L::kNeck, L::kHead}) ? BodyPart::kTrunk : BodyPart::kPelvis;
  if (start == L::kNeck) return BodyPart::kHead;
  if (start == L::kTrunk) return BodyPart::kTrunk;
  return BodyPart::kUnknown;
}

double segment_radius(BodyPart part, double length, double stature, std::size_t ray_count) {
  double radius = 0;
  double cap = kLimbRadiusOverLength;
  // Shares of mass, densities and shares of length: see body_parts.h.
  switch (part) {
    case BodyPart::kUnknown: radius = kUnknownRadiusOverLength * length; break;
    case BodyPart::kTrunk: radius = stature * radius_over_stature(.497, 1030, .288); break;
    case BodyPart::kPelvis: radius = stature * kPelvisRadius; break;
    case BodyPart::kGirdle: radius = stature * kGirdleRadius; break;
    case BodyPart::kHead: radius = stature * radius_over_stature(.081, 1110, .182); break;
    case BodyPart::kUpperArm: radius = stature * radius_over_stature(.028, 1070, .186); break;
    case BodyPart::kForearm: radius = stature * radius_over_stature(.016, 1130, .146); break;
    case BodyPart::kHand:
      radius = stature * radius_over_stature(.006, 1160, .108) / std::sqrt(static_cast<double>(ray_count));
      break;
    case BodyPart::kFinger: radius = stature * kFingerRadius; break;
    case BodyPart::kThigh: radius = stature * radius_over_stature(.100, 1050, .245); break;
    case BodyPart::kShank: radius = stature * radius_over_stature(.0465, 1090, .246); break;
    case BodyPart::kFoot: radius = stature * radius_over_stature(.0145, 1100, .152); break;
  }
  if (part == BodyPart::kTrunk || part == BodyPart::kPelvis || part == BodyPart::kGirdle) cap = kTrunkRadiusOverLength;
  return std::clamp(radius, kLeastRadiusOverLength * length, cap * length);
}

}  // namespace cab::scenes
