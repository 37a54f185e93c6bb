// Guesses bodies between the joints of a skeleton.
#include "scenes/rig/skeleton_bodies.h"

#include <algorithm>
#include <map>
#include <set>

namespace cab::scenes {
namespace {

// An ellipsoid reaches past its joints by half of its radius, but at most by this share of its length. So neighbours,
// which taper to a point at the joint, overlap and cover it.
constexpr double kOverlapOverLength = .1;
// Bones that reach less far from a head or a wrist than this share of the part do not stand for it: they lead to eyes,
// or to the base of a thumb.
constexpr double kCoveredShare = .75;
// An end whose part is unknown is as long as this share of the bone before it.
constexpr double kUnknownCapOverBone = .5;
constexpr std::size_t kPhalanges = 3;  // of a finger; the joint after these is its tip
// Vectors shorter than this share of what they were added from have no direction.
constexpr double kNoDirection = 1e-3;

// The mean length of some bones.
struct Mean {
  double sum = 0;
  std::size_t count = 0;
  void add(double length) { sum += length, ++count; }
  double value() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

// A skeleton with what its names and bones say.
struct Figure {
  const SkeletonView& skeleton;
  Segments segments;
  std::vector<BodyPart> part;                   // [joint] of the bone that ends there
  std::vector<std::vector<std::size_t>> bones;  // [joint] the far ends of its bones
  std::vector<bool> is_end;                     // [joint] no segment leaves its point below it, bone or not
  std::vector<double> reach;                    // [joint] how far bones lead from it
  std::vector<std::uint32_t> parts_below;       // [joint] bits of the whole heads and hands that are ends below it
  std::map<std::size_t, Mean> last_bones;       // by the joint two above their ends
  Mean last_phalanges;
  double stature = 0;

  std::size_t joint_count() const { return part.size(); }
  bool is_bone(std::size_t end) const { return segments.kind[end] == SegmentKind::kBone; }
  double bone_length(std::size_t end) const { return length(segments.offset[end]); }
  std::size_t above(std::size_t joint) const { return parent_of(skeleton, joint); }
  const std::string& name(std::size_t joint) const { return skeleton.names[joint]; }

  // The bone that ends at a joint's point, by its far end; 0 if there is none.
  std::size_t bone_to(std::size_t joint) const {
    const std::size_t point = segments.point[joint];
    return is_bone(point) ? point : 0;
  }
  // True for the first bone of a limb, such as the upper one of two halves of a thigh.
  bool begins_part(std::size_t end) const {
    const std::size_t before = bone_to(above(end));
    return before == 0 || part[before] != part[end];
  }
};

std::uint32_t bit_of(BodyPart part) { return std::uint32_t{1} << static_cast<unsigned>(part); }

// The bit of the head or hand that a joint's name means as a whole; 0 if it means none.
std::uint32_t whole_part(const std::string& name) {
  const std::optional<Cap> cap = cap_of(name);
  return cap && cap->stands_out && !cap->is_tip ? bit_of(cap->part) : 0;
}

Figure read_figure(const SkeletonView& skeleton) {
  Figure figure = {skeleton, measure_segments(skeleton), {}, {}, {}, {}, {}, {}, {}, 0};
  const std::size_t count = skeleton.parents.size();
  figure.part.assign(count, BodyPart::kUnknown);
  figure.bones.resize(count);
  figure.is_end.assign(count, true);
  figure.reach.assign(count, 0);
  figure.parts_below.assign(count, 0);
  // Each joint tells the one above what is below it, so that none has to look for it among all others.
  for (std::size_t j = count; j-- > 1;) {
    const SegmentKind kind = figure.segments.kind[j];
    const std::size_t parent = figure.above(j);
    if (kind != SegmentKind::kZero || !figure.is_end[j]) figure.is_end[parent] = false;
    if (kind == SegmentKind::kBone || kind == SegmentKind::kZero)
      figure.reach[parent] = std::max(figure.reach[parent], figure.bone_length(j) + figure.reach[j]);
    const bool ends_figure = figure.is_end[j] && !skeleton.is_end_site[j];
    figure.parts_below[parent] |= figure.parts_below[j] | (ends_figure ? whole_part(skeleton.names[j]) : 0);
  }
  for (std::size_t j = 1; j < count; ++j) {
    if (!figure.is_bone(j)) continue;
    const std::size_t parent = figure.above(j);
    figure.bones[parent].push_back(j);
    figure.part[j] = body_part(skeleton.names[parent], skeleton.names[j]);
    const std::optional<Cap> cap = cap_of(skeleton.names[j]);
    if (!figure.is_end[j] || (!skeleton.is_end_site[j] && cap && !cap->is_tip)) continue;
    figure.last_bones[figure.above(parent)].add(figure.bone_length(j));
    if (figure.part[j] == BodyPart::kFinger) figure.last_phalanges.add(figure.bone_length(j));
  }
  return figure;
}

// The mean distance over all frames from the middle of the joints at which thighs begin to a joint. Skeletons place the
// root at many heights between the two. Empty without thighs.
std::optional<double> hips_to(const Figure& figure, std::size_t joint) {
  std::vector<std::size_t> hips;
  for (std::size_t j = 1; j < figure.joint_count(); ++j)
    if (figure.is_bone(j) && figure.part[j] == BodyPart::kThigh && figure.begins_part(j))
      hips.push_back(figure.above(j));
  if (hips.empty()) return std::nullopt;
  Mean distance;
  for (std::size_t f = 0; f < figure.skeleton.frame_count; ++f) {
    Vec3 sum = {0, 0, 0};
    for (const std::size_t hip : hips) sum = sum + position(figure.skeleton, f, hip);
    const Vec3 middle = (1 / static_cast<double>(hips.size())) * sum;
    distance.add(length(position(figure.skeleton, f, joint) - middle));
  }
  return distance.value();
}

StatureLengths stature_lengths(const Figure& figure) {
  const std::size_t count = figure.joint_count();
  // Sums along each limb, as means over the limbs.
  const auto limb = [&](BodyPart part) {
    double sum = 0;
    std::size_t limbs = 0;
    for (std::size_t j = 1; j < count; ++j) {
      if (!figure.is_bone(j) || figure.part[j] != part) continue;
      sum += figure.bone_length(j);
      limbs += figure.begins_part(j) ? 1 : 0;
    }
    return limbs > 0 ? sum / static_cast<double>(limbs) : 0;
  };
  // The far end of the longest chain of bones of some parts, and its length.
  const auto chain = [&](std::initializer_list<BodyPart> parts) {
    std::vector<double> sum(count, 0);
    for (std::size_t j = 1; j < count; ++j) {
      const bool is_joined = figure.segments.kind[j] == SegmentKind::kZero;
      const bool is_part = figure.is_bone(j) && std::find(parts.begin(), parts.end(), figure.part[j]) != parts.end();
      if (is_joined || is_part) sum[j] = sum[figure.above(j)] + (is_part ? figure.bone_length(j) : 0);
    }
    const auto longest = std::max_element(sum.begin(), sum.end());
    return std::pair(static_cast<std::size_t>(longest - sum.begin()), *longest);
  };
  StatureLengths lengths;
  lengths.thigh = limb(BodyPart::kThigh);
  lengths.shank = limb(BodyPart::kShank);
  const auto [neck, trunk] = chain({BodyPart::kTrunk});
  lengths.spine = trunk > 0 ? hips_to(figure, neck).value_or(trunk) : 0;
  lengths.upper_arm = limb(BodyPart::kUpperArm);
  lengths.forearm = limb(BodyPart::kForearm);
  lengths.hand = chain({BodyPart::kHand, BodyPart::kFinger}).second;
  // A hand whose joints all hang from a node outside it has no chains.
  const auto is_finger = [](const std::string& name) {
    const std::optional<Cap> cap = cap_of(name);
    return cap && cap->part == BodyPart::kFinger;
  };
  const std::vector<std::string>& names = figure.skeleton.names;
  if (lengths.hand == 0 &&
      2 * std::count_if(names.begin(), names.end(), is_finger) > static_cast<std::ptrdiff_t>(count))
    lengths.hand = figure.segments.height;
  return lengths;
}

// Where a figure looks in each frame, by the joints at which its thighs begin and the bones of its trunk; 0 if it has
// none. The model is right-handed.
std::vector<Vec3> forward(const Figure& figure) {
  std::vector<Vec3> directions;
  for (std::size_t f = 0; f < figure.skeleton.frame_count; ++f) {
    Vec3 left = {0, 0, 0}, up = {0, 0, 0};
    for (std::size_t j = 1; j < figure.joint_count(); ++j) {
      const BodyPart part = figure.is_bone(j) ? figure.part[j] : BodyPart::kUnknown;
      if (part != BodyPart::kThigh && part != BodyPart::kTrunk) continue;
      const std::size_t parent = figure.above(j);
      const Vec3 start = position(figure.skeleton, f, parent);
      if (part == BodyPart::kTrunk) up = up + position(figure.skeleton, f, j) - start;
      if (part == BodyPart::kThigh && figure.begins_part(j)) left = left + side_of(figure.name(parent)) * start;
    }
    directions.push_back(cross(left, up));
  }
  return directions;
}

// The direction of a cap in its joint's frame. A foot below a shank points ahead, in the mean over all frames. A head
// with an end site points there. Everything else points as the bone before it does in its own frame: so a cap continues
// the bone in skeletons whose frames all are those of the model at rest, and in those whose bones lie along one axis.
// `looks` is empty until a foot needs forward().
Vec3 cap_direction(const Figure& figure, std::size_t joint, std::size_t bone, BodyPart part, std::vector<Vec3>& looks) {
  const SkeletonView& s = figure.skeleton;
  if (part == BodyPart::kFoot && figure.part[bone] != BodyPart::kFoot) {
    if (looks.empty()) looks = forward(figure);
    Vec3 sum = {0, 0, 0};
    for (std::size_t f = 0; f < s.frame_count; ++f) {
      const Vec3 ahead = rotate(conjugate(rotation(s, f, joint)), looks[f]);
      if (length(ahead) > 0) sum = sum + (1 / length(ahead)) * ahead;
    }
    if (length(sum) > kNoDirection * s.frame_count) return (1 / length(sum)) * sum;
  }
  for (const std::size_t end : figure.bones[joint])
    if (s.is_end_site[end]) return (1 / figure.bone_length(end)) * figure.segments.offset[end];
  return (1 / figure.bone_length(bone)) * figure.segments.offset[bone];
}

// True if the figure needs a cap at a joint: where it ends, and where the bones that begin at a head or a wrist are too
// short to stand for it.
bool needs_cap(const Figure& figure, std::size_t joint, const Cap& cap) {
  const bool begins_point = figure.segments.point[joint] == joint;
  const std::size_t bone = figure.bone_to(joint);
  if (cap.is_tip) return bone == 0 && figure.is_end[joint] && begins_point;
  // The spokes of a flat skeleton are no limbs.
  if (bone > 0 && figure.above(bone) == 0 && figure.part[bone] == BodyPart::kUnknown && figure.bones[0].size() > 2)
    return false;
  if (!figure.is_end[joint])
    return cap.stands_out && begins_point && bone > 0 &&
           whole_part(figure.name(figure.above(bone))) != bit_of(cap.part) &&
           figure.reach[joint] < kCoveredShare * cap.length_over_stature * figure.stature &&
           (figure.parts_below[joint] & bit_of(cap.part)) == 0;
  // The first joint of an end bears its cap. A head or a hand may end where other bones begin.
  return begins_point || (cap.stands_out && !figure.is_end[figure.above(joint)]);
}

// The number of phalanges up to the end of a bone.
std::size_t phalanges_before(const Figure& figure, std::size_t bone) {
  std::size_t count = 0;
  for (; bone > 0 && figure.part[bone] == BodyPart::kFinger; bone = figure.bone_to(figure.above(bone))) {
    const std::string& start = figure.name(figure.above(bone));
    if (start.find("etacarp") == std::string::npos && start.find("InHand") == std::string::npos) ++count;
  }
  return count;
}

// The length of the cap past a bone, or 0 for none.
double cap_length(const Figure& figure, std::size_t bone, const Cap& cap) {
  const std::size_t start = figure.above(bone);
  if (cap.part == BodyPart::kFinger) {
    if (phalanges_before(figure, bone) >= kPhalanges) return 0;
    if (figure.last_phalanges.count > 0) return figure.last_phalanges.value();
  }
  if (cap.length_over_stature > 0) return cap.length_over_stature * figure.stature;
  const auto siblings = figure.last_bones.find(start);
  return siblings != figure.last_bones.end() ? siblings->second.value()
                                             : kUnknownCapOverBone * figure.bone_length(bone);
}

// Adds bodies joint by joint.
class BodyList {
 public:
  BodyList(const Figure& figure, double thickness) : figure_(figure), thickness_(thickness) {}

  void add_bone(std::size_t end) {
    SkeletonBody body = begin(figure_.above(end), static_cast<std::int32_t>(end), BodyReason::kBone);
    const double segment = figure_.bone_length(end);
    body.part = figure_.part[end];
    body.direction = (1 / segment) * figure_.segments.offset[end];
    add_along(body, segment, figure_.bones[body.joint].size());
  }

  void add_nothing(std::size_t end, BodyReason reason) {
    SkeletonBody body = begin(figure_.above(end), static_cast<std::int32_t>(end), reason);
    body.is_solid = false;
    bodies.push_back(body);
  }

  void add_cap(std::size_t joint) {
    const std::optional<Cap> cap = cap_of(figure_.name(joint));
    if (!cap || figure_.skeleton.is_end_site[joint] || !needs_cap(figure_, joint, *cap)) return;
    SkeletonBody body = begin(joint, -1, BodyReason::kCap);
    body.part = cap->part;
    const std::size_t bone = figure_.bone_to(joint);
    if (bone > 0) {
      const double segment = cap_length(figure_, bone, *cap);
      if (!(segment > 0)) return;
      body.direction = cap_direction(figure_, joint, bone, cap->part, looks_);
      add_along(body, segment, 1);
    } else if (cap->part != BodyPart::kUnknown && figure_.segments.kind[joint] != SegmentKind::kZero && joint > 0) {
      // A foot or a hand that its own track moves. No bone tells its direction.
      const double segment = cap->length_over_stature * figure_.stature;
      const double radius = thickness_ * segment_radius(cap->part, segment, figure_.stature, 1);
      if (!(radius > 0)) return;
      body.half = {radius, radius, radius};
      bodies.push_back(body);
    }
  }

  std::vector<SkeletonBody> bodies;

 private:
  SkeletonBody begin(std::size_t joint, std::int32_t end, BodyReason reason) const {
    SkeletonBody body;
    body.joint = joint;
    body.end = end;
    body.reason = reason;
    if (end >= 0) body.strays = figure_.segments.strays[static_cast<std::size_t>(end)];
    return body;
  }

  // Adds a body along its direction. `rays` is the number of bones that share the cross-section of a hand.
  void add_along(SkeletonBody body, double segment, std::size_t rays) {
    const double radius = thickness_ * segment_radius(body.part, segment, figure_.stature, rays);
    body.center = (.5 * segment) * body.direction;
    body.half = {.5 * segment + std::min(.5 * radius, kOverlapOverLength * segment), radius, radius};
    bodies.push_back(body);
  }

  const Figure& figure_;
  double thickness_;
  std::vector<Vec3> looks_;
};

// The joints with solid bodies that have none above them.
std::vector<std::size_t> top_joints(const SkeletonView& skeleton, const std::vector<SkeletonBody>& bodies) {
  std::vector<bool> has_body(skeleton.parents.size(), false), below(skeleton.parents.size(), false);
  for (const SkeletonBody& body : bodies)
    if (body.is_solid) has_body[body.joint] = true;
  std::vector<std::size_t> tops;
  for (std::size_t j = 0; j < has_body.size(); ++j) {
    if (j > 0) below[j] = below[parent_of(skeleton, j)] || has_body[parent_of(skeleton, j)];
    if (has_body[j] && !below[j]) tops.push_back(j);
  }
  return tops;
}

// The last joint at or above all of these.
std::size_t common_joint(const SkeletonView& skeleton, const std::vector<std::size_t>& joints) {
  std::size_t common = joints.front();
  for (std::size_t other : joints) {
    while (common != other) (common > other ? common : other) = parent_of(skeleton, std::max(common, other));
  }
  return common;
}

// If several links without a link above them meet at one point, a ball fills the place. It is as thick as the thickest
// of the bodies that begin there.
void add_ball(const Figure& figure, std::vector<SkeletonBody>& bodies) {
  const std::vector<std::size_t> tops = top_joints(figure.skeleton, bodies);
  if (tops.size() < 2) return;
  const std::vector<std::size_t>& point_of = figure.segments.point;
  const std::size_t point = point_of[common_joint(figure.skeleton, tops)];
  if (std::count_if(tops.begin(), tops.end(), [&](std::size_t top) { return point_of[top] == point; }) < 2) return;
  double radius = 0;
  for (const SkeletonBody& body : bodies)
    if (body.is_solid && point_of[body.joint] == point) radius = std::max(radius, body.half[1]);
  SkeletonBody ball;
  ball.joint = point;
  ball.reason = BodyReason::kBall;
  ball.half = {radius, radius, radius};
  const auto is_after = [point](const SkeletonBody& body) { return body.joint > point; };
  bodies.insert(std::find_if(bodies.begin(), bodies.end(), is_after), ball);
}

// The smallest rotation that takes +x, or +z, to a unit direction.
Quat from_x_to(const Vec3& direction) {
  if (direction[0] < -1 + 1e-12) return {0, 0, 1, 0};
  return normalized({0, -direction[2], direction[1], 1 + direction[0]});
}
Quat from_z_to(const Vec3& direction) {
  if (direction[2] < -1 + 1e-12) return {1, 0, 0, 0};
  return normalized({-direction[1], direction[0], 0, 1 + direction[2]});
}

}  // namespace

SkeletonBodies guess_bodies(const SkeletonView& skeleton, const BodyOptions& options) {
  Figure figure = read_figure(skeleton);
  const Stature stature = options.stature > 0 ? Stature{options.stature, StatureSource::kGiven}
                                              : stature_of(stature_lengths(figure), figure.segments.height);
  figure.stature = stature.value;
  BodyList list(figure, options.thickness);
  // By joint: the segments that end at its children, then its own cap.
  std::vector<std::vector<std::size_t>> children(figure.joint_count());
  for (std::size_t j = 1; j < children.size(); ++j) children[figure.above(j)].push_back(j);
  for (std::size_t j = 0; j < children.size(); ++j) {
    for (const std::size_t child : children[j]) {
      switch (figure.segments.kind[child]) {
        case SegmentKind::kBone: list.add_bone(child); break;
        case SegmentKind::kTravels: list.add_nothing(child, BodyReason::kTravels); break;
        case SegmentKind::kOutside: list.add_nothing(child, BodyReason::kOutside); break;
        case SegmentKind::kZero:
        case SegmentKind::kOtherRoot: break;
      }
    }
    list.add_cap(j);
  }
  add_ball(figure, list.bodies);
  return {std::move(list.bodies), std::move(figure.segments), stature};
}

std::vector<std::size_t> link_joints(const SkeletonView& skeleton, const SkeletonBodies& bodies) {
  std::set<std::size_t> links;
  for (const SkeletonBody& body : bodies.bodies)
    if (body.is_solid) links.insert(body.joint);
  const std::vector<std::size_t> tops = top_joints(skeleton, bodies.bodies);
  if (tops.size() > 1) links.insert(bodies.segments.point[common_joint(skeleton, tops)]);
  return {links.begin(), links.end()};
}

ConvexPart convex_part(const SkeletonBody& body) {
  const bool is_along_z = body.kind == ShapeKind::kCapsule || body.kind == ShapeKind::kCylinder;
  const Quat rotation = is_along_z ? from_z_to(body.direction) : from_x_to(body.direction);
  std::array<double, 3> size = body.half;
  if (body.kind == ShapeKind::kCapsule) size = {body.half[1], body.half[0] - body.half[1], 0};
  if (body.kind == ShapeKind::kCylinder) size = {body.half[1], body.half[0], 0};
  if (body.kind == ShapeKind::kSphere) size = {body.half[1], 0, 0};
  ConvexPart part;
  part.kind = body.kind;
  // A capsule as short as it is thick is a sphere.
  if (body.kind == ShapeKind::kCapsule && !(size[1] > 0)) part.kind = ShapeKind::kSphere;
  for (std::size_t k = 0; k < 3; ++k) {
    part.position[k] = static_cast<float>(body.center[k]);
    part.size[k] = static_cast<float>(size[k]);
  }
  for (std::size_t k = 0; k < 4; ++k) part.rotation[k] = static_cast<float>(rotation[k]);
  return part;
}

std::vector<LinkPair> adjacent_joints(const SkeletonBodies& bodies) {
  std::map<std::size_t, std::set<std::uint32_t>> meeting;  // joints with a body at each point
  for (const SkeletonBody& body : bodies.bodies) {
    if (!body.is_solid) continue;
    const auto joint = static_cast<std::uint32_t>(body.joint);
    meeting[bodies.segments.point[body.joint]].insert(joint);
    if (body.end >= 0) meeting[static_cast<std::size_t>(body.end)].insert(joint);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const auto& [point, joints] : meeting) {
    for (auto a = joints.begin(); a != joints.end(); ++a)
      for (auto b = std::next(a); b != joints.end(); ++b) pairs.emplace(*a, *b);
  }
  std::vector<LinkPair> out;
  for (const auto& [a, b] : pairs) out.push_back({a, b});
  return out;
}

}  // namespace cab::scenes
