// Makes links from a skeleton: ellipsoids between joints, and poses relative to the root joint.
#include "scenes/import/import.h"
#include "scenes/import/leaf_box.h"
#include "scenes/import/printable.h"
#include "scenes/import/skin_clip.h"
#include "scenes/rig/body_parts.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cmath>

namespace cab::scenes {
namespace {

// Share of the figure's height. Segments no longer than this count as zero. It is below 1 / kMaxLinks, so that a rope
// of equal links keeps its links.
constexpr double kZeroSegment = 1e-4;
// Share of the figure's height. The notes name a joint that moves farther than this in its parent's frame.
constexpr double kMovingJoint = 1e-3;
// Share of the figure's height. A joint that stays this close to its rest offset has that offset.
constexpr double kRestTolerance = 1e-5;
// An ellipsoid reaches past its joints by half of its radius, but at most by this share of its length. So neighbours,
// which taper to a point at the joint, overlap and cover it.
constexpr double kOverlapOverLength = .1;
constexpr double kLeastHeight = .5, kGreatestHeight = 3;  // metres, for the check of the unit
constexpr std::size_t kNamesInNote = 6;

struct Motion {
  explicit Motion(const Skeleton& s) : skeleton(s), joint_count(s.joint_names.size()) {}

  Vec3 position(std::size_t frame, std::size_t joint) const {
    const double* const p = skeleton.positions.data() + 3 * (frame * joint_count + joint);
    return {p[0], p[1], p[2]};
  }
  Quat rotation(std::size_t frame, std::size_t joint) const {
    const double* const q = skeleton.rotations.data() + 4 * (frame * joint_count + joint);
    return {q[0], q[1], q[2], q[3]};
  }

  const Skeleton& skeleton;
  std::size_t joint_count;
};

void check_skeleton(const Skeleton& s, const std::string& name) {
  const std::size_t joints = s.joint_names.size();
  const auto fail = [&name](const char* reason) { throw ImportError(name + ": " + reason); };
  if (joints == 0) fail("no skeleton: it has no joints");
  if (s.joint_parents.size() != joints || s.is_end_site.size() != joints || s.rest_offsets.size() != 3 * joints)
    fail("a skeleton's arrays must be one entry a joint");
  if (s.frame_count == 0 || s.rotations.size() != 4 * joints * s.frame_count ||
      s.positions.size() != 3 * joints * s.frame_count)
    fail("a skeleton's motion must be one pose a joint and frame, of at least one frame");
  if (!(s.frame_seconds > 0) || !std::isfinite(s.frame_seconds)) fail("the frame time must be finite and above 0");
  for (std::size_t j = 0; j < joints; ++j) {
    if (j == 0 ? s.joint_parents[j] != -1 : s.joint_parents[j] < 0 || static_cast<std::size_t>(s.joint_parents[j]) >= j)
      fail("joints must come after their parents, the one root first");
  }
  const auto is_finite = [](double value) { return std::isfinite(value); };
  for (const std::vector<double>* values : {&s.rest_offsets, &s.rotations, &s.positions}) {
    if (!std::all_of(values->begin(), values->end(), is_finite))
      fail("a skeleton's offsets, rotations and positions must be finite");
  }
}

// The median over all frames of the figure's extent along each axis.
std::array<double, 3> median_extents(const Motion& motion) {
  std::array<double, 3> medians = {};
  const std::size_t frame_count = motion.skeleton.frame_count;
  std::vector<double> extents(frame_count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t f = 0; f < frame_count; ++f) {
      double low = motion.position(f, 0)[axis], high = low;
      for (std::size_t j = 1; j < motion.joint_count; ++j) {
        const double value = motion.position(f, j)[axis];
        low = std::min(low, value);
        high = std::max(high, value);
      }
      extents[f] = high - low;
    }
    const auto middle = extents.begin() + static_cast<std::ptrdiff_t>(frame_count / 2);
    std::nth_element(extents.begin(), middle, extents.end());
    medians[axis] = *middle;
  }
  return medians;
}

// Adds a note such as "2 joints <what>: a, b". Without names it adds no note.
void note_joints(std::vector<std::string>& notes, const std::vector<std::string>& names, const std::string& what) {
  if (names.empty()) return;
  std::string text = std::to_string(names.size()) + (names.size() == 1 ? " joint " : " joints ") + what + ": ";
  for (std::size_t n = 0; n < std::min(names.size(), kNamesInNote); ++n) text += (n > 0 ? ", " : "") + names[n];
  if (names.size() > kNamesInNote) text += " and " + std::to_string(names.size() - kNamesInNote) + " more";
  notes.push_back(text);
}

// The place of each joint in its parent's frame. It is the rest offset, or the mean place where position channels
// replace the offset. The notes name joints that are not rigid with their parent.
std::vector<Vec3> joint_offsets(const Motion& motion, double height, std::vector<std::string>& notes) {
  const Skeleton& s = motion.skeleton;
  std::vector<Vec3> offsets(motion.joint_count, Vec3{0, 0, 0});
  std::vector<std::string> moving;
  for (std::size_t j = 1; j < motion.joint_count; ++j) {
    const auto parent = static_cast<std::size_t>(s.joint_parents[j]);
    const Vec3 rest = {s.rest_offsets[3 * j], s.rest_offsets[3 * j + 1], s.rest_offsets[3 * j + 2]};
    const auto local = [&](std::size_t f) {
      return rotate(conjugate(motion.rotation(f, parent)), motion.position(f, j) - motion.position(f, parent));
    };
    Vec3 mean = {0, 0, 0};
    double from_rest = 0;
    for (std::size_t f = 0; f < s.frame_count; ++f) {
      const Vec3 place = local(f);
      mean = mean + place;
      from_rest = std::max(from_rest, length(place - rest));
    }
    offsets[j] = rest;
    if (from_rest <= kRestTolerance * height) continue;
    offsets[j] = (1.0 / s.frame_count) * mean;
    double from_mean = 0;
    for (std::size_t f = 0; f < s.frame_count; ++f) from_mean = std::max(from_mean, length(local(f) - offsets[j]));
    if (from_mean > kMovingJoint * height) moving.push_back(s.joint_names[j]);
  }
  note_joints(notes, moving, "moving in the parent's frame, their segments fixed at the mean");
  return offsets;
}

// The smallest rotation that takes +x to a unit direction.
Quat from_x_to(const Vec3& direction) {
  if (direction[0] < -1 + 1e-12) return {0, 0, 1, 0};
  return normalized({0, -direction[2], direction[1], 1 + direction[0]});
}

// An ellipsoid about `center` in the link's frame, its first axis along `direction`.
ShapePart ellipsoid(const Vec3& center, const Vec3& direction, double half_length, double radius) {
  ShapePart part;
  part.shape.kind = ShapeKind::kEllipsoid;
  const Quat rotation = from_x_to(direction);
  for (std::size_t k = 0; k < 3; ++k) {
    part.shape.position[k] = static_cast<float>(center[k]);
    part.shape.size[k] = static_cast<float>(k == 0 ? half_length : radius);
  }
  for (std::size_t k = 0; k < 4; ++k) part.shape.rotation[k] = static_cast<float>(rotation[k]);
  return part;
}

// Which joints make links. A point is a set of joints that are connected by zero segments. They have the same place in
// every frame.
struct LinkPlan {
  std::vector<std::vector<std::size_t>> segments;  // [joint] children at the end of a segment of non-zero length
  std::vector<std::size_t> point;                  // [joint] the first joint of its point
  std::vector<std::size_t> link_joints;            // [link]
  std::vector<std::int32_t> link_of;               // [joint] or -1
  bool root_is_ball = false;                       // the root joint has a link without segments
};

LinkPlan plan_links(const Skeleton& s, const std::vector<Vec3>& offsets, double height, const std::string& name) {
  LinkPlan plan;
  const std::size_t joint_count = offsets.size();
  plan.segments.resize(joint_count);
  plan.point.resize(joint_count);
  for (std::size_t j = 1; j < joint_count; ++j) {
    const auto parent = static_cast<std::size_t>(s.joint_parents[j]);
    const bool is_zero = length(offsets[j]) <= kZeroSegment * height;
    plan.point[j] = is_zero ? plan.point[parent] : j;
    if (!is_zero) plan.segments[parent].push_back(j);
  }
  // A joint has a link above it if any of its ancestors has a segment.
  std::vector<bool> below_link(joint_count, false);
  std::size_t top_count = 0;
  for (std::size_t j = 0; j < joint_count; ++j) {
    if (j > 0) {
      const auto parent = static_cast<std::size_t>(s.joint_parents[j]);
      below_link[j] = below_link[parent] || !plan.segments[parent].empty();
    }
    top_count += !plan.segments[j].empty() && !below_link[j] ? 1 : 0;
  }
  if (top_count == 0) throw ImportError(name + ": no two joints are apart: nothing to make links of");
  plan.root_is_ball = top_count > 1;
  plan.link_of.resize(joint_count, -1);
  for (std::size_t j = 0; j < joint_count; ++j) {
    if (plan.segments[j].empty() && !(j == 0 && plan.root_is_ball)) continue;
    plan.link_of[j] = static_cast<std::int32_t>(plan.link_joints.size());
    plan.link_joints.push_back(j);
  }
  if (plan.link_joints.size() > kMaxLinks) {
    throw ImportError(name + ": " + std::to_string(plan.link_joints.size()) + " links, at most " +
                      std::to_string(kMaxLinks) + " are possible");
  }
  return plan;
}

void note_plan(const Skeleton& s, const LinkPlan& plan, std::vector<std::string>& notes) {
  std::vector<std::string> merged, without_link;
  std::size_t dropped_end_sites = 0;
  for (std::size_t j = 0; j < s.joint_names.size(); ++j) {
    const bool is_zero = j > 0 && plan.point[j] != j;
    if (s.is_end_site[j]) {
      dropped_end_sites += is_zero ? 1 : 0;
    } else {
      if (is_zero) merged.push_back(s.joint_names[j]);
      if (plan.link_of[j] < 0) without_link.push_back(s.joint_names[j]);
    }
  }
  note_joints(notes, merged, "merged with the place of the parent (no segment between them)");
  note_joints(notes, without_link, "dropped (no segment begins there)");
  if (dropped_end_sites > 0)
    notes.push_back(std::to_string(dropped_end_sites) + (dropped_end_sites == 1 ? " end site" : " end sites") +
                    " of zero length dropped");
  if (plan.root_is_ball)
    notes.push_back("the root " + s.joint_names[0] +
                    " has no segment of its own and several links below it: its link is a ball");
}

// Adds the parts of every link. Returns the number of segments without a recognised name.
std::size_t add_parts(const Skeleton& s, const LinkPlan& plan, const std::vector<Vec3>& offsets, double stature,
                      std::vector<BodyLeaf>& leaves) {
  std::size_t unknown_count = 0;
  double ball_radius = 0;
  for (std::size_t l = 0; l < leaves.size(); ++l) {
    const std::size_t joint = plan.link_joints[l];
    for (const std::size_t end : plan.segments[joint]) {
      const double segment = length(offsets[end]);
      const BodyPart body = body_part(s.joint_names[joint], s.joint_names[end]);
      unknown_count += body == BodyPart::kUnknown ? 1 : 0;
      const double radius = segment_radius(body, segment, stature, plan.segments[joint].size());
      const double half_length = .5 * segment + std::min(.5 * radius, kOverlapOverLength * segment);
      leaves[l].parts.push_back(ellipsoid(.5 * offsets[end], (1 / segment) * offsets[end], half_length, radius));
      if (plan.point[joint] == 0) ball_radius = std::max(ball_radius, radius);
    }
  }
  // The ball fills the place where the links below it join. It is as thick as the thickest of them.
  if (plan.root_is_ball) leaves[0].parts.push_back(ellipsoid({0, 0, 0}, {1, 0, 0}, ball_radius, ball_radius));
  return unknown_count;
}

// Every two links that share a point: parent and child, and siblings that begin at the same place.
std::vector<LinkPair> adjacent_links(const LinkPlan& plan) {
  std::vector<std::vector<std::uint32_t>> meeting(plan.point.size());
  for (std::uint32_t l = 0; l < plan.link_joints.size(); ++l) {
    const std::size_t joint = plan.link_joints[l];
    meeting[plan.point[joint]].push_back(l);
    for (const std::size_t end : plan.segments[joint]) meeting[end].push_back(l);
  }
  std::vector<LinkPair> pairs;
  for (const std::vector<std::uint32_t>& links : meeting) {
    for (std::size_t i = 0; i < links.size(); ++i) {
      for (std::size_t k = i + 1; k < links.size(); ++k)
        pairs.push_back({std::min(links[i], links[k]), std::max(links[i], links[k])});
    }
  }
  const auto key = [](const LinkPair& pair) { return std::pair(pair.a, pair.b); };
  std::sort(pairs.begin(), pairs.end(), [key](const LinkPair& a, const LinkPair& b) { return key(a) < key(b); });
  return pairs;
}

void add_poses(const Motion& motion, const LinkPlan& plan, const ImportOptions& options, Character& character) {
  const std::size_t frame_count = motion.skeleton.frame_count;
  character.poses.reserve(frame_count * plan.link_joints.size() * pose_floats(character.pose_format));
  character.origins.reserve(frame_count * 3);
  for (std::size_t f = 0; f < frame_count; ++f) {
    const Vec3 root = motion.position(f, 0);
    for (std::size_t k = 0; k < 3; ++k) character.origins.push_back(root[k] + options.offset[k]);
    for (const std::size_t joint : plan.link_joints) {
      for (const double component : motion.rotation(f, joint)) character.poses.push_back(static_cast<float>(component));
      for (const double component : motion.position(f, joint) - root)
        character.poses.push_back(static_cast<float>(component));
    }
  }
}

void check_height(const std::array<double, 3>& extents, char up, std::vector<std::string>& notes) {
  const double height =
      up == 0 ? *std::max_element(extents.begin(), extents.end()) : extents[static_cast<std::size_t>(up - 'x')];
  if (height >= kLeastHeight && height <= kGreatestHeight) return;
  std::string metres = std::to_string(height);
  notes.push_back("warning: the figure is " + metres + " m tall, a person is 0.5 to 3 m: is the unit right?");
}

}  // namespace

Clip make_clip(const Skeleton& skeleton, const std::string& name, const ImportOptions& options) {
  check_skeleton(skeleton, name);
  if (options.up != 0 && (options.up < 'x' || options.up > 'z')) throw ImportError(name + ": up must be x, y or z");
  for (const double component : options.offset) {
    if (!std::isfinite(component)) throw ImportError(name + ": the offset must be finite");
  }
  const Motion motion(skeleton);
  Clip clip;
  clip.frame_seconds = skeleton.frame_seconds;
  clip.frame_count = skeleton.frame_count;
  clip.notes = skeleton.notes;

  const std::array<double, 3> extents = median_extents(motion);
  check_height(extents, options.up, clip.notes);
  if (options.skin) {
    add_skin_bodies(skeleton, name, options, clip);
    return clip;
  }
  // The tallest axis, whichever axis is up, so that a lying figure is as thick as a standing one.
  const double stature = *std::max_element(extents.begin(), extents.end());
  const std::vector<Vec3> offsets = joint_offsets(motion, stature, clip.notes);
  const LinkPlan plan = plan_links(skeleton, offsets, stature, name);
  note_plan(skeleton, plan, clip.notes);

  Character& character = clip.character;
  character.name = name;
  character.is_static = skeleton.is_static;
  character.leaves.resize(plan.link_joints.size());
  for (std::size_t l = 0; l < plan.link_joints.size(); ++l) {
    const std::size_t joint = plan.link_joints[l];
    character.link_names.push_back(skeleton.joint_names[joint]);
    // The nearest ancestor with a link. Only the first link has no such ancestor.
    std::int32_t above = skeleton.joint_parents[joint];
    while (above >= 0 && plan.link_of[static_cast<std::size_t>(above)] < 0)
      above = skeleton.joint_parents[static_cast<std::size_t>(above)];
    character.link_parents.push_back(above < 0 ? -1 : plan.link_of[static_cast<std::size_t>(above)]);
    character.leaves[l].link = static_cast<std::uint32_t>(l);
  }
  const std::size_t unknown_count = add_parts(skeleton, plan, offsets, stature, character.leaves);
  if (unknown_count > 0)
    clip.notes.push_back(std::to_string(unknown_count) + (unknown_count == 1 ? " segment has" : " segments have") +
                         " no known body part: thickness by length");
  for (BodyLeaf& leaf : character.leaves) leaf.box = leaf_box(leaf.parts);
  character.ignored_pairs = adjacent_links(plan);
  add_poses(motion, plan, options, character);
  return clip;
}

Clip import_clip(const std::string& path, const ImportOptions& options) {
  const std::string name = printable(path);
  Clip clip = make_clip(import_skeleton(path, options), name, options);
  const std::size_t slash = name.find_last_of('/');
  clip.character.name = slash == std::string::npos ? name : name.substr(slash + 1);
  return clip;
}

}  // namespace cab::scenes
