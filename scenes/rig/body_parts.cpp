// The thickness of a body between two joints.
#include "scenes/rig/body_parts.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

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
// Lengths of caps over stature. Head alone: from chin to vertex, of Drillis and Contini. A foot reaches three quarters
// of its length ahead of the ankle. Toes and fingertips are assumptions: 7 cm and 2.5 cm at 1.75 m.
constexpr double kHeadLength = .130;
constexpr double kHeadAndNeckLength = .182;
constexpr double kUpperArmLength = .186;
constexpr double kForearmLength = .146;
constexpr double kHandLength = .108;
constexpr double kTrunkLength = .288;
constexpr double kNeckHeight = .844;  // between the shoulders (.818) and the chin (.870)
constexpr double kHipHeight = .530;
constexpr double kThighLength = .245;
constexpr double kShankLength = .246;
constexpr double kFootLength = .152;
constexpr double kFootAheadOfAnkle = .75 * kFootLength;
constexpr double kToeLength = .04;
constexpr double kFingertipLength = .014;
// Share of a figure's height. No bone from a pelvis to a spine is as long.
constexpr double kLongForTrunk = .25;

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

bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

// The words of a name without its namespace, in lower case: "rig:LHipJoint_end" has the words l, hip, joint, end.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  const std::size_t begin = name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1;
  for (std::size_t i = begin; i < name.size(); ++i) {
    const char c = name[i];
    const bool is_gap = c == '_' || c == '-' || c == '.' || c == ' ';
    const bool begins =
        is_upper(c) && i > begin && (!is_upper(name[i - 1]) || (i + 1 < name.size() && is_lower(name[i + 1])));
    if ((is_gap || begins) && !words.back().empty()) words.emplace_back();
    if (!is_gap) words.back() += is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return words;
}

bool ends_with(const std::string& word, const std::string& end) {
  return word.size() >= end.size() && word.compare(word.size() - end.size(), end.size(), end) == 0;
}

bool has_word(const std::string& name, std::initializer_list<const char*> set) {
  const std::vector<std::string> words = words_of(name);
  return std::any_of(set.begin(), set.end(),
                     [&words](const char* one) { return std::find(words.begin(), words.end(), one) != words.end(); });
}

Landmark landmark(const std::string& name) {
  std::string word;
  for (const std::string& part : words_of(name)) word += part;
  const auto has = [&word](std::initializer_list<const char*> parts) {
    return std::any_of(parts.begin(), parts.end(),
                       [&word](const char* part) { return word.find(part) != std::string::npos; });
  };
  // Specific words come first: "forearm" contains "arm", "upleg" contains "leg", "lefthandindex1" contains "hand",
  // "spinemiddle" and "spineshoulder" contain a finger's and an arm's words.
  if (has({"spine"})) return Landmark::kTrunk;
  if (has({"fingerbase", "fingers"})) return Landmark::kHand;
  const bool is_in_trunk = has({"chest", "torso", "thorax", "abdomen", "waist", "belly", "middleback"});
  if (has({"thumb", "index", "pinky", "finger", "phalan", "metacarp", "mid1", "mid2", "mid3"}) ||
      (has({"middle", "little"}) && !is_in_trunk) || (has({"ring"}) && !has({"spring", "string", "earring"})))
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
  if (is_in_trunk || has({"back", "body", "rib"}) || word == "ab") return Landmark::kTrunk;
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
  if (start == L::kTrunk)
    return is_one_of(end, {L::kForearm, L::kHand, L::kFinger, L::kFoot, L::kToe}) ? BodyPart::kUnknown
                                                                                  : BodyPart::kTrunk;
  return BodyPart::kUnknown;
}

const char* to_string(BodyPart part) {
  switch (part) {
    case BodyPart::kUnknown: break;
    case BodyPart::kTrunk: return "trunk";
    case BodyPart::kPelvis: return "pelvis";
    case BodyPart::kGirdle: return "shoulder girdle";
    case BodyPart::kHead: return "head";
    case BodyPart::kUpperArm: return "upper arm";
    case BodyPart::kForearm: return "forearm";
    case BodyPart::kHand: return "hand";
    case BodyPart::kFinger: return "finger";
    case BodyPart::kThigh: return "thigh";
    case BodyPart::kShank: return "shank";
    case BodyPart::kFoot: return "foot";
  }
  return "unknown";
}

namespace {

std::optional<Cap> cap_of_landmark(Landmark joint) {
  switch (joint) {
    case Landmark::kNone: return Cap{};
    case Landmark::kHead: return Cap{BodyPart::kHead, kHeadLength, true};
    case Landmark::kNeck: return Cap{BodyPart::kHead, kHeadAndNeckLength};
    case Landmark::kArm: return Cap{BodyPart::kUpperArm, kUpperArmLength};
    case Landmark::kForearm: return Cap{BodyPart::kForearm, kForearmLength};
    case Landmark::kHand: return Cap{BodyPart::kHand, kHandLength, true};
    case Landmark::kFinger: return Cap{BodyPart::kFinger, kFingertipLength};
    case Landmark::kThigh: return Cap{BodyPart::kThigh, kThighLength};
    case Landmark::kLeg:
    case Landmark::kShank: return Cap{BodyPart::kShank, kShankLength};
    case Landmark::kFoot: return Cap{BodyPart::kFoot, kFootAheadOfAnkle};
    case Landmark::kToe: return Cap{BodyPart::kFoot, kToeLength};
    case Landmark::kGirdle:
    case Landmark::kShoulder:
    case Landmark::kHip:
    case Landmark::kPelvis:
    case Landmark::kTrunk: break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Cap> cap_of(const std::string& joint) {
  if (has_word(joint, {"effector", "ik", "target", "socket"})) return std::nullopt;
  bool is_tip = has_word(joint, {"end", "top", "site"});
  for (const std::string& word : words_of(joint)) {
    if (word.compare(0, 3, "eye") == 0 || word.compare(0, 3, "jaw") == 0) return std::nullopt;
    is_tip = is_tip || ends_with(word, "tip") || ends_with(word, "nub");
  }
  std::optional<Cap> cap = cap_of_landmark(landmark(joint));
  if (cap) cap->is_tip = is_tip;
  return cap;
}

bool is_helper(const std::string& node) {
  return has_word(node, {"ik", "target", "effector", "socket", "locator", "pole", "ctrl", "control", "mch", "helper"});
}

bool is_container(const std::string& node) {
  return has_word(node, {"armature", "scene", "world", "origin", "reference"});
}

bool is_body_part(const std::string& joint) { return landmark(joint) != Landmark::kNone; }

bool is_outside_body(const TopSegment& segment) {
  const Landmark end = landmark(segment.end);
  if (!segment.leads_on && has_word(segment.end, {"ik", "target", "effector"})) return true;
  if (landmark(segment.start) != Landmark::kNone) return false;
  if (is_one_of(end, {Landmark::kHand, Landmark::kFoot, Landmark::kToe})) return true;
  if (is_container(segment.start)) return segment.leads_on || end != Landmark::kNone;
  if (!segment.leads_on || side_of(segment.end) != 0) return false;
  return is_one_of(end, {Landmark::kPelvis, Landmark::kHip}) ||
         (end == Landmark::kTrunk && segment.length_over_height > kLongForTrunk);
}

int side_of(const std::string& joint) {
  for (const std::string& word : words_of(joint)) {
    if (word == "l" || word.compare(0, 4, "left") == 0) return 1;
    if (word == "r" || word.compare(0, 5, "right") == 0) return -1;
  }
  return 0;
}

const char* to_string(StatureSource source) {
  switch (source) {
    case StatureSource::kGiven: return "given";
    case StatureSource::kLegsAndSpine: return "from legs and spine";
    case StatureSource::kLegs: return "from legs";
    case StatureSource::kArms: return "from arms";
    case StatureSource::kSpine: return "from the spine";
    case StatureSource::kHand: return "from a hand";
    case StatureSource::kHeight: break;
  }
  return "from the figure's height";
}

Stature stature_of(const StatureLengths& lengths, double height) {
  const double leg = lengths.thigh > 0 && lengths.shank > 0 ? lengths.thigh + lengths.shank : 0;
  const double arm = lengths.upper_arm > 0 && lengths.forearm > 0 ? lengths.upper_arm + lengths.forearm : 0;
  constexpr double kSpineLength = kNeckHeight - kHipHeight;
  if (leg > 0 && lengths.spine > 0)
    return {(leg + lengths.spine) / (kThighLength + kShankLength + kSpineLength), StatureSource::kLegsAndSpine};
  if (leg > 0) return {leg / (kThighLength + kShankLength), StatureSource::kLegs};
  if (lengths.thigh > 0 || lengths.shank > 0) return {height, StatureSource::kHeight};
  if (arm > 0) return {arm / (kUpperArmLength + kForearmLength), StatureSource::kArms};
  if (lengths.spine > 0) return {lengths.spine / kSpineLength, StatureSource::kSpine};
  if (lengths.hand > 0) return {lengths.hand / kHandLength, StatureSource::kHand};
  return {height, StatureSource::kHeight};
}

double segment_radius(BodyPart part, double length, double stature, std::size_t ray_count) {
  double radius = 0;
  double cap = kLimbRadiusOverLength;
  // Shares of mass, densities and shares of length: see body_parts.h.
  switch (part) {
    case BodyPart::kUnknown: radius = kUnknownRadiusOverLength * length; break;
    case BodyPart::kTrunk: radius = stature * radius_over_stature(.497, 1030, kTrunkLength); break;
    case BodyPart::kPelvis: radius = stature * kPelvisRadius; break;
    case BodyPart::kGirdle: radius = stature * kGirdleRadius; break;
    case BodyPart::kHead: radius = stature * radius_over_stature(.081, 1110, kHeadAndNeckLength); break;
    case BodyPart::kUpperArm: radius = stature * radius_over_stature(.028, 1070, kUpperArmLength); break;
    case BodyPart::kForearm: radius = stature * radius_over_stature(.016, 1130, kForearmLength); break;
    case BodyPart::kHand:
      radius = stature * radius_over_stature(.006, 1160, kHandLength) / std::sqrt(static_cast<double>(ray_count));
      break;
    case BodyPart::kFinger: radius = stature * kFingerRadius; break;
    case BodyPart::kThigh: radius = stature * radius_over_stature(.100, 1050, kThighLength); break;
    case BodyPart::kShank: radius = stature * radius_over_stature(.0465, 1090, kShankLength); break;
    case BodyPart::kFoot: radius = stature * radius_over_stature(.0145, 1100, kFootLength); break;
  }
  if (part == BodyPart::kTrunk || part == BodyPart::kPelvis || part == BodyPart::kGirdle) cap = kTrunkRadiusOverLength;
  return std::clamp(radius, kLeastRadiusOverLength * length, cap * length);
}

}  // namespace cab::scenes
