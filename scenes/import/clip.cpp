// Makes links from a skeleton: a body for each bone and end, and poses relative to the first link.
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/import/skin_clip.h"
#include "scenes/import/unit.h"
#include "scenes/rig/leaf_box.h"
#include "scenes/vec3d.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cab::scenes {
namespace {

// Share of the figure's height. The notes name a joint that moves farther than this in its parent's frame.
constexpr double kMovingJoint = 1e-3;

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

// What a note says of one thing and of several, and what a summary calls it.
struct Wording {
  const char* one;
  const char* several;
  AlterationKind kind;
  const char* what;
};

// Adds a note such as "2 joints dropped", with their names if there are any.
void note_count(Clip& clip, std::size_t count, const Wording& wording, const std::string& names = {}) {
  if (count == 0) return;
  clip.notes.push_back(std::to_string(count) + " " + (count == 1 ? wording.one : wording.several) +
                       (names.empty() ? "" : ": " + names));
  clip.alterations.push_back({wording.kind, wording.what, count, clip.notes.back()});
}

void note_names(Clip& clip, const std::vector<std::string>& names, const Wording& wording) {
  note_count(clip, names.size(), wording, listed(names));
}

// [joint] the index of its link, or -1.
std::vector<std::int32_t> links_of(const std::vector<std::size_t>& joints, std::size_t joint_count) {
  std::vector<std::int32_t> link_of(joint_count, -1);
  for (std::size_t l = 0; l < joints.size(); ++l) link_of[joints[l]] = static_cast<std::int32_t>(l);
  return link_of;
}

void note_joints_without_link(const Skeleton& s, const std::vector<std::int32_t>& link_of, Clip& clip) {
  std::vector<std::string> merged, without_link;
  std::size_t dropped_end_sites = 0;
  for (std::size_t j = 0; j < s.joint_names.size(); ++j) {
    const bool is_zero = clip.bodies.segments.kind[j] == SegmentKind::kZero;
    if (s.is_end_site[j]) {
      dropped_end_sites += is_zero ? 1 : 0;
    } else {
      if (is_zero) merged.push_back(s.joint_names[j]);
      if (link_of[j] < 0) without_link.push_back(s.joint_names[j]);
    }
  }
  note_names(clip, merged,
             {"joint merged with the place of the parent (no segment between them)",
              "joints merged with the place of the parent (no segment between them)", AlterationKind::kMerged,
              "joints at the place of their parents"});
  note_names(clip, without_link,
             {"joint dropped (no body moves with it)", "joints dropped (no body moves with them)",
              AlterationKind::kDropped, "joints without a body"});
  note_count(clip, dropped_end_sites,
             {"end site of zero length dropped", "end sites of zero length dropped", AlterationKind::kDropped,
              "end sites of zero length"});
}

std::string metres(double value) {
  std::array<char, 32> text = {};
  std::snprintf(text.data(), text.size(), "%.2f m", value);
  return text.data();
}

void note_bodies(const Skeleton& s, Clip& clip) {
  const SkeletonBodies& bodies = clip.bodies;
  std::vector<std::string> moving, caps, travels, outside;
  std::size_t unknown_count = 0;
  for (const SkeletonBody& body : bodies.bodies) {
    const std::string& name = s.joint_names[body.joint];
    const std::string& end = s.joint_names[body.end < 0 ? body.joint : static_cast<std::size_t>(body.end)];
    switch (body.reason) {
      case BodyReason::kBone:
        unknown_count += body.part == BodyPart::kUnknown ? 1 : 0;
        if (body.strays > kMovingJoint * bodies.segments.height) moving.push_back(end);
        break;
      case BodyReason::kCap: caps.push_back(name); break;
      case BodyReason::kBall:
        clip.notes.push_back("several links and none above them meet at " + name + ": its link is a ball");
        clip.alterations.push_back({AlterationKind::kGuessed, "balls where links meet", 1, clip.notes.back()});
        break;
      case BodyReason::kTravels: travels.push_back(name + " to " + end + " (" + metres(body.strays) + ")"); break;
      case BodyReason::kOutside: {
        const double segment = length(bodies.segments.offset[static_cast<std::size_t>(body.end)]);
        outside.push_back(name + " to " + end + " (" + metres(segment) + ")");
        break;
      }
    }
  }
  note_names(clip, travels,
             {"segment is no bone, since its far end moves", "segments are no bones, since their far ends move",
              AlterationKind::kDropped, "segments whose far ends move"});
  note_names(clip, outside,
             {"segment is no bone of the body", "segments are no bones of the body", AlterationKind::kDropped,
              "segments that are no bones"});
  note_names(clip, moving,
             {"joint moving in the parent's frame, its segment fixed at the mean",
              "joints moving in the parent's frame, their segments fixed at the mean", AlterationKind::kMerged,
              "places of moving joints, to their means"});
  note_names(clip, caps,
             {"joint at an end has a cap of the usual size", "joints at ends have caps of the usual size",
              AlterationKind::kGuessed, "caps at ends"});
  note_count(
      clip, unknown_count,
      {"segment has no known body part: thickness by length", "segments have no known body part: thickness by length",
       AlterationKind::kGuessed, "thicknesses by length"});
}

void add_leaves(const SkeletonBodies& bodies, const std::vector<std::int32_t>& link_of, Character& character) {
  std::vector<ConvexPart> parts;
  for (std::size_t b = 0; b < bodies.bodies.size();) {
    const std::size_t joint = bodies.bodies[b].joint;
    BodyLeaf leaf;
    parts.clear();
    for (; b < bodies.bodies.size() && bodies.bodies[b].joint == joint; ++b)
      if (bodies.bodies[b].is_solid) parts.push_back(convex_part(bodies.bodies[b]));
    if (parts.empty()) continue;
    leaf.link = static_cast<std::uint32_t>(link_of[joint]);
    leaf.box = leaf_box(parts);
    for (const ConvexPart& part : parts) leaf.parts.push_back({part, {}});
    character.leaves.push_back(std::move(leaf));
  }
}

void add_poses(const Skeleton& s, const std::vector<std::size_t>& joints, const ImportOptions& options,
               Character& character) {
  const std::size_t joint_count = s.joint_names.size();
  character.poses.reserve(s.frame_count * joints.size() * pose_floats(character.pose_format));
  character.origins.reserve(s.frame_count * std::size_t{3});
  for (std::size_t f = 0; f < s.frame_count; ++f) {
    const double* const places = s.positions.data() + 3 * f * joint_count;
    const double* const root = places + 3 * joints.front();
    for (std::size_t k = 0; k < 3; ++k) character.origins.push_back(root[k] + options.offset[k]);
    for (const std::size_t joint : joints) {
      const double* const rotation = s.rotations.data() + 4 * (f * joint_count + joint);
      for (std::size_t k = 0; k < 4; ++k) character.poses.push_back(static_cast<float>(rotation[k]));
      for (std::size_t k = 0; k < 3; ++k)
        character.poses.push_back(static_cast<float>(places[3 * joint + k] - root[k]));
    }
  }
}

char tallest_axis(const std::array<double, 3>& extents) {
  return static_cast<char>('x' + (std::max_element(extents.begin(), extents.end()) - extents.begin()));
}

// Less than this, and the axis may be that of outstretched arms.
constexpr double kUprightRatio = 1.5;

bool is_upright(const SkeletonBodies& bodies) {
  if (bodies.stature.source == StatureSource::kHeight || bodies.stature.source == StatureSource::kHand) return false;
  std::array<double, 3> extents = bodies.segments.extents;
  std::sort(extents.begin(), extents.end());
  return extents[2] > kUprightRatio * extents[1];
}

void check_height(const Skeleton& skeleton, const SkeletonBodies& bodies, Clip& clip) {
  const double height = height_of(bodies, clip.up);
  clip.size_doubt = doubt_of_height(height, skeleton.unit.metres, bodies.stature.source != StatureSource::kHeight);
  if (!clip.size_doubt.empty()) clip.notes.push_back("warning: " + clip.size_doubt);
}

}  // namespace

Clip make_clip(const Skeleton& skeleton, const std::string& name, const ImportOptions& options) {
  check_skeleton(skeleton, name);
  if (options.up != 0 && (options.up < 'x' || options.up > 'z')) throw ImportError(name + ": up must be x, y or z");
  for (const double component : options.offset) {
    if (!std::isfinite(component)) throw ImportError(name + ": the offset must be finite");
  }
  const SkeletonView view = {skeleton.joint_names, skeleton.joint_parents, skeleton.is_end_site, skeleton.rest_offsets,
                             skeleton.rotations,   skeleton.positions,     skeleton.frame_count};
  Clip clip;
  clip.frame_seconds = skeleton.frame_seconds;
  clip.frame_count = skeleton.frame_count;
  clip.notes = skeleton.notes;
  clip.alterations = skeleton.alterations;
  clip.unit = skeleton.unit;
  SkeletonBodies guessed = guess_bodies(view, options.bodies);
  clip.up = options.up == 0 ? tallest_axis(guessed.segments.extents) : options.up;
  clip.is_upright = options.up == 0 && is_upright(guessed);
  check_height(skeleton, guessed, clip);
  if (options.skin) {
    add_skin_bodies(skeleton, name, options, clip);
    return clip;
  }
  clip.bodies = std::move(guessed);
  const std::optional<std::size_t> bad = change_bodies(skeleton.joint_names, options.body_changes, clip.bodies);
  if (bad) {
    const BodyChange& change = options.body_changes[*bad];
    throw ImportError(name + ": a body from " + printable(change.link) + " to " + printable(change.to) +
                      " is asked for, which it does not have, or which has no size");
  }
  const std::vector<std::size_t> joints = link_joints(view, clip.bodies);
  if (joints.empty()) throw ImportError(name + ": no two joints are apart: nothing to make links of");
  if (joints.size() > kMaxLinks)
    throw ImportError(name + ": " + std::to_string(joints.size()) + " links, at most " + std::to_string(kMaxLinks) +
                      " are possible");
  const std::vector<std::int32_t> link_of = links_of(joints, skeleton.joint_names.size());
  note_joints_without_link(skeleton, link_of, clip);
  note_bodies(skeleton, clip);

  Character& character = clip.character;
  character.name = name;
  character.is_static = skeleton.is_static;
  for (const std::size_t joint : joints) {
    character.link_names.push_back(skeleton.joint_names[joint]);
    // The nearest ancestor with a link. Only the first link has no such ancestor.
    std::int32_t above = skeleton.joint_parents[joint];
    while (above >= 0 && link_of[static_cast<std::size_t>(above)] < 0)
      above = skeleton.joint_parents[static_cast<std::size_t>(above)];
    character.link_parents.push_back(above < 0 ? -1 : link_of[static_cast<std::size_t>(above)]);
  }
  add_leaves(clip.bodies, link_of, character);
  for (const LinkPair& pair : adjacent_joints(clip.bodies))
    character.ignored_pairs.push_back(
        {static_cast<std::uint32_t>(link_of[pair.a]), static_cast<std::uint32_t>(link_of[pair.b])});
  add_poses(skeleton, joints, options, character);
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
