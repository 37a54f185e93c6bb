// Skeletons from any file that assimp reads, except BVH.
#include "scenes/import/scene_file.h"

#include "scenes/affine.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/scene_clock.h"
#include "scenes/import/scene_joints.h"
#include "scenes/import/skin_file.h"
#include "scenes/import/unit.h"

#include <assimp/commonMetaData.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <tuple>
#include <utility>

namespace cab::scenes {
namespace {

constexpr double kUsualRatio = 2;  // of lengths of bones in two files of one figure
constexpr double kCentimetre = .01;
// Scales of rest poses that differ by less are one: those of files are floats.
constexpr double kSameScale = 1e-4;

Quat slerp(const Quat& a, Quat b, double s) {
  double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  if (cosine < 0) {
    cosine = -cosine;
    for (double& component : b) component = -component;
  }
  double wa = 1 - s, wb = s;
  // Near 1 the sines cancel and the chord is as good as the arc.
  if (cosine < 1 - 1e-9) {
    const double angle = std::acos(cosine);
    wa = std::sin(wa * angle) / std::sin(angle);
    wb = std::sin(wb * angle) / std::sin(angle);
  }
  return normalized({wa * a[0] + wb * b[0], wa * a[1] + wb * b[1], wa * a[2] + wb * b[2], wa * a[3] + wb * b[3]});
}

// The keys about a time: the index of the earlier one, and the share of the time from it to the next.
template <class Key>
std::pair<unsigned, double> key_at(const Key* keys, unsigned count, double time) {
  const Key* const after =
      std::upper_bound(keys, keys + count, time, [](double t, const Key& key) { return t < key.mTime; });
  if (after == keys) return {0, 0};
  const auto k = static_cast<unsigned>(after - keys) - 1;
  if (k + 1 == count) return {k, 0};
  return {k, (time - keys[k].mTime) / (keys[k + 1].mTime - keys[k].mTime)};
}

Vec3 sample(const aiVectorKey* keys, unsigned count, double time, const Vec3& none) {
  if (count == 0) return none;
  const auto [k, s] = key_at(keys, count, time);
  const Vec3 a = {keys[k].mValue.x, keys[k].mValue.y, keys[k].mValue.z};
  if (s == 0) return a;
  const Vec3 b = {keys[k + 1].mValue.x, keys[k + 1].mValue.y, keys[k + 1].mValue.z};
  return a + s * (b - a);
}

Quat sample(const aiQuatKey* keys, unsigned count, double time) {
  if (count == 0) return {0, 0, 0, 1};
  const auto [k, s] = key_at(keys, count, time);
  const Quat a = normalized({keys[k].mValue.x, keys[k].mValue.y, keys[k].mValue.z, keys[k].mValue.w});
  if (s == 0) return a;
  return slerp(a, normalized({keys[k + 1].mValue.x, keys[k + 1].mValue.y, keys[k + 1].mValue.z, keys[k + 1].mValue.w}),
               s);
}

Affine sample(const aiNodeAnim& track, double time) {
  const Quat rotation = sample(track.mRotationKeys, track.mNumRotationKeys, time);
  const Vec3 scale = sample(track.mScalingKeys, track.mNumScalingKeys, time, {1, 1, 1});
  Affine local;
  for (std::size_t k = 0; k < 3; ++k) local.columns[k] = scale[k] * rotate(rotation, local.columns[k]);
  local.translation = sample(track.mPositionKeys, track.mNumPositionKeys, time, {0, 0, 0});
  return local;
}

// Checks that every time and value of a track is finite and in range, and that times are in order.
template <class Key>
void check_keys(const Key* keys, unsigned count, const char* kind, const std::string& where) {
  for (unsigned k = 0; k < count; ++k) {
    const auto fail = [&](const char* reason) {
      throw ImportError(where + ": " + kind + " key " + std::to_string(k) + reason);
    };
    double largest =
        std::max({std::fabs(static_cast<double>(keys[k].mValue.x)), std::fabs(static_cast<double>(keys[k].mValue.y)),
                  std::fabs(static_cast<double>(keys[k].mValue.z))});
    bool finite = std::isfinite(keys[k].mValue.x) && std::isfinite(keys[k].mValue.y) && std::isfinite(keys[k].mValue.z);
    if constexpr (std::is_same_v<Key, aiQuatKey>) finite = finite && std::isfinite(keys[k].mValue.w);
    if (!finite) fail(" is not finite");
    if (largest > kMaxImportValue) fail(" is out of range");
    if (!std::isfinite(keys[k].mTime) || std::fabs(keys[k].mTime) > kMaxImportValue)
      fail(" has a time that is not finite or out of range");
    if (k > 0 && keys[k].mTime < keys[k - 1].mTime) fail(" is earlier than the one before it");
  }
}

// How much a transform enlarges; 1 for one that is flat.
double scale_of(const Affine& a) {
  const double volume = std::fabs(dot(cross(a.columns[0], a.columns[1]), a.columns[2]));
  const double scale = std::cbrt(volume);
  return scale > 0 && std::isfinite(scale) ? scale : 1;
}

// The ratio of two scales, which is 1 if only rounding is between them.
double ratio_of(double scale, double other) {
  const double ratio = scale / other;
  return std::fabs(ratio - 1) <= kSameScale ? 1 : ratio;
}

// The scale of each node's rest pose, and the product over the nodes above it.
std::pair<std::vector<double>, std::vector<double>> rest_scales(const NodeTree& tree) {
  const std::size_t count = tree.nodes.size();
  std::vector<double> own(count), above(count, 1);
  for (std::size_t n = 0; n < count; ++n) {
    own[n] = scale_of(affine(tree.nodes[n]->mTransformation));
    if (tree.parents[n] < 0) continue;
    const auto parent = static_cast<std::size_t>(tree.parents[n]);
    above[n] = above[parent] * own[parent];
  }
  return {std::move(own), std::move(above)};
}

// What a file says of its length unit: metres per unit, 0 if it says nothing, and the share of it that assimp has put
// into the transform of the root.
struct StatedUnit {
  double metres = 0;
  double applied = 1;
};

StatedUnit stated_unit(const aiScene& scene) {
  StatedUnit unit;
  if (scene.mMetaData == nullptr) return unit;
  aiString format;
  const bool is_collada =
      scene.mMetaData->Get(AI_METADATA_SOURCE_FORMAT, format) && view(format).find("Collada") != std::string_view::npos;
  // A number that FBX states in centimetres. Its type differs between versions of assimp.
  float single = 0;
  double centimetres = 0;
  if (scene.mMetaData->Get("UnitScaleFactor", single)) centimetres = static_cast<double>(single);
  const bool is_fbx = centimetres > 0 || scene.mMetaData->Get("UnitScaleFactor", centimetres);
  if (!is_fbx && !is_collada) return unit;
  unit.applied = scale_of(affine(scene.mRootNode->mTransformation));
  unit.metres = is_collada ? unit.applied : kCentimetre * centimetres;
  // Numbers that are no unit are as none.
  if (!(unit.metres >= kLeastUnit && unit.metres <= kGreatestUnit)) unit = {};
  return unit;
}

// Frames a second that a file itself states: FBX counts ticks in frames. 0 if it does not.
double own_rate(const aiScene& scene, const aiAnimation& animation) {
  const bool is_fbx = scene.mMetaData != nullptr && scene.mMetaData->HasKey("UnitScaleFactor");
  return is_fbx ? animation.mTicksPerSecond : 0;
}

// [node] its name, or nothing if the name means another node.
std::vector<std::string> names_of(const NodeTree& tree) {
  std::vector<std::string> names(tree.nodes.size());
  for (const auto& [name, node] : tree.named) names[node] = name;
  return names;
}

// The times of an animation's keys, in ticks.
std::vector<KeyTimes> key_times(const aiAnimation& animation) {
  std::vector<KeyTimes> tracks;
  const auto add = [&](const auto* keys, unsigned count) {
    tracks.emplace_back();
    for (unsigned k = 0; k < count; ++k) tracks.back().push_back(keys[k].mTime);
  };
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& track = *animation.mChannels[c];
    add(track.mPositionKeys, track.mNumPositionKeys);
    add(track.mRotationKeys, track.mNumRotationKeys);
    add(track.mScalingKeys, track.mNumScalingKeys);
  }
  return tracks;
}

// The names of all animations, in quotes.
std::string animation_names(const aiScene& scene) {
  std::string names;
  for (unsigned a = 0; a < scene.mNumAnimations; ++a)
    names += (a > 0 ? ", \"" : "\"") + printable(view(scene.mAnimations[a]->mName)) + '"';
  return names;
}

// The animation of this name, or else of this number; the first one if the text is empty.
const aiAnimation& chosen_animation(const aiScene& scene, const std::string& path, const std::string& text) {
  if (text.empty()) {  // the first that moves nodes; others move faces or cameras
    for (unsigned a = 0; a < scene.mNumAnimations; ++a)
      if (scene.mAnimations[a]->mNumChannels > 0) return *scene.mAnimations[a];
    return *scene.mAnimations[0];
  }
  for (unsigned a = 0; a < scene.mNumAnimations; ++a)
    if (view(scene.mAnimations[a]->mName) == text) return *scene.mAnimations[a];
  for (unsigned a = 0; a < scene.mNumAnimations; ++a)
    if (std::to_string(a) == text) return *scene.mAnimations[a];
  throw ImportError(path + ": no animation " + printable(text) + " among " + animation_names(scene));
}

// Adds what is left of a joint's matrix before its rotation.
void add_stretch(const Affine& joint, const Quat& rotation, std::vector<float>& stretches) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 column = rotate(conjugate(rotation), joint.columns[k]);
    for (std::size_t c = 0; c <= k; ++c) stretches.push_back(static_cast<float>(column[c]));
  }
}

// The nodes of a file and where they are in each frame.
class PosedNodes {
 public:
  // `own`: the motion is of the same nodes. Otherwise it is of another file.
  PosedNodes(const NodeTree& tree, const Motion& motion, bool own) : tree_(tree), motion_(motion) {
    if (!own) {
      source_ = match_names(names_of(tree), motion.names);
      return;
    }
    source_.resize(tree.nodes.size());
    std::iota(source_.begin(), source_.end(), 0);
  }

  // Lets the file keep the scales of its own rest poses, such as that of an armature. A length of the motion is `ratio`
  // times as long in the file, and by as much more as the nodes above it enlarge more there if `as_seen`.
  void even_out(double ratio, bool as_seen) {
    const auto [own, above] = rest_scales(tree_);
    scale_.assign(own.size(), 1);
    length_.assign(own.size(), ratio);
    for (std::size_t n = 0; n < own.size(); ++n) {
      if (!has(n)) continue;
      const auto source = static_cast<std::size_t>(source_[n]);
      scale_[n] = ratio_of(own[n], motion_.rest_scale[source]);
      if (as_seen) length_[n] = ratio * ratio_of(motion_.scale_above[source], above[n]);
    }
  }

  // The factor of the lengths of a node in the motion.
  double length_factor(std::size_t node) const { return length_[node]; }

  // Whether the motion has a node.
  bool has(std::size_t node) const { return source_[node] >= 0; }

  // [node] whether the motion moves it.
  std::vector<bool> moved() const {
    std::vector<bool> moved(source_.size());
    for (std::size_t n = 0; n < moved.size(); ++n)
      moved[n] = has(n) && motion_.is_moved[static_cast<std::size_t>(source_[n])];
    return moved;
  }

  // In the parent's frame. A node that the motion lacks keeps its rest pose.
  Affine local(std::size_t node, std::uint32_t frame) const {
    if (!has(node)) return rest(node);
    Affine local = motion_.local(static_cast<std::size_t>(source_[node]), frame);
    if (scale_.empty()) return local;
    for (Vec3& column : local.columns) column = scale_[node] * column;
    local.translation = length_[node] * local.translation;
    return local;
  }

  Affine rest(std::size_t node) const { return affine(tree_.nodes[node]->mTransformation); }

 private:
  const NodeTree& tree_;
  const Motion& motion_;
  std::vector<std::int32_t> source_;
  std::vector<double> scale_, length_;  // [node] factors of the motion's scales and lengths; empty: 1
};

// How much longer bones are in the motion than in the file, by the median; 1 if none has a length in both.
double length_ratio(const PosedNodes& posed, const std::vector<std::size_t>& node_of) {
  std::vector<double> ratios;
  for (std::size_t j = 1; j < node_of.size(); ++j) {
    if (!posed.has(node_of[j])) continue;
    const double rest = length(posed.rest(node_of[j]).translation);
    const double moved = length(posed.local(node_of[j], 0).translation);
    if (rest > 0 && moved > 0) ratios.push_back(moved / rest);
  }
  if (ratios.empty()) return 1;
  const auto median = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), median, ratios.end());
  return *median;
}

bool is_usual(double length_ratio) { return length_ratio >= 1 / kUsualRatio && length_ratio <= kUsualRatio; }

// Says how many joints another file moves, and which not. Throws ImportError if it is none.
void note_motion(const PosedNodes& posed, const std::vector<std::size_t>& node_of, const Motion& motion,
                 const std::string& path, Skeleton& skeleton) {
  std::vector<std::string> missing;
  for (std::size_t j = 0; j < node_of.size(); ++j)
    if (!posed.has(node_of[j])) missing.push_back(skeleton.joint_names[j]);
  if (missing.size() == node_of.size()) {
    std::vector<std::string> names;
    for (const std::string& name : motion.names)
      if (!name.empty()) names.push_back(printable(name));
    throw ImportError(path + ": none of its joints (" + listed(missing) + ") has the name of a node of " + motion.file +
                      " (" + listed(names) + ")");
  }
  skeleton.notes.push_back("motion of " + motion.file + ": it has " + std::to_string(node_of.size() - missing.size()) +
                           " of " + std::to_string(node_of.size()) + " joints by name" +
                           (missing.empty() ? "" : "; in rest pose: " + listed(missing)));
  if (!missing.empty())
    skeleton.alterations.push_back({AlterationKind::kGuessed, "joints in rest pose, which the motion lacks",
                                    missing.size(), skeleton.notes.back()});
  const double ratio = length_ratio(posed, node_of);
  if (is_usual(ratio)) return;
  skeleton.notes.push_back("bones of " + motion.file + " are " + digits(ratio, 3) +
                           " times as long as those that they move: --motion-units says its length unit");
}

// Makes lengths and rest scales of a motion of another file those of the file, in which `metres` is one length of its
// nodes' transforms. Lengths are as they are seen in the motion, with its unit and the scale of the nodes above them.
// If bones have no usual length then, without that scale, or without its unit too unless it is given.
void even_out(const ImportOptions& options, const Motion& motion, double metres,
              const std::vector<std::size_t>& node_of, PosedNodes& posed, Skeleton& skeleton) {
  const double given = options.motion->metres_per_unit;
  const bool is_stated = !(given > 0) && !options.metres_per_unit && motion.stated_unit > 0;
  const double unit = given > 0 ? given : is_stated ? motion.stated_unit : skeleton.unit.metres;
  const double ratio = unit / motion.applied_unit / metres;
  posed.even_out(ratio, true);
  const double seen = posed.length_factor(node_of.front()), as_seen = length_ratio(posed, node_of);
  const double more = seen / ratio / (motion.applied_unit * metres / skeleton.unit.metres);
  if (!is_usual(as_seen)) {
    bool found = false;
    for (const double other : {ratio, 1.0}) {
      if (other != ratio && !is_stated) continue;
      posed.even_out(other, false);
      if (found = is_usual(length_ratio(posed, node_of)); found) break;
    }
    if (!found) posed.even_out(ratio, true);
  }
  if (std::fabs(more - 1) <= kSameScale) return;
  skeleton.notes.push_back("nodes above the joints of " + motion.file + " enlarge " + digits(more, 3) +
                           " times as much as those of the file: evened out");
}

// Says which nodes move and are no joints.
void note_left_out(const PosedNodes& posed, const std::vector<bool>& left_out, std::uint32_t frame_count,
                   const NodeTree& tree, Skeleton& skeleton) {
  constexpr double kMoves = 1e-5;  // of a transform's largest number
  std::vector<std::string> names;
  for (std::size_t n = 0; n < left_out.size(); ++n) {
    if (!left_out[n]) continue;
    const Affine first = posed.local(n, 0);
    bool moves = false;
    for (std::uint32_t f = 1; f < frame_count && !moves; ++f) {
      const Affine now = posed.local(n, f);
      double size = length(first.translation), change = length(now.translation - first.translation);
      for (std::size_t k = 0; k < 3; ++k) {
        size = std::max(size, length(first.columns[k]));
        change = std::max(change, length(now.columns[k] - first.columns[k]));
      }
      moves = change > kMoves * size;
    }
    if (moves) names.push_back(printable(view(tree.nodes[n]->mName)));
  }
  if (names.empty()) return;
  skeleton.notes.push_back(std::to_string(names.size()) +
                           (names.size() == 1 ? " node moves and is" : " nodes move and are") +
                           " no joint of the figure: " + listed(names));
  skeleton.alterations.push_back({AlterationKind::kDropped, "nodes that move", names.size(), skeleton.notes.back()});
}

}  // namespace

Motion motion_of_scene(std::shared_ptr<const aiScene> scene, const std::string& path, const std::string& animation) {
  Motion motion;
  motion.file = path;
  const NodeTree tree = tree_of(*scene, path);
  motion.names = names_of(tree);
  std::vector<const aiNodeAnim*> tracks(tree.nodes.size(), nullptr);
  SceneClock clock;
  if (scene->mNumAnimations == 0 && !animation.empty()) throw ImportError(path + ": it has no animation");
  if (scene->mNumAnimations > 0) {
    const aiAnimation& chosen = chosen_animation(*scene, path, animation);
    const std::string chosen_name = printable(view(chosen.mName));
    for (unsigned c = 0; c < chosen.mNumChannels; ++c) {
      const aiNodeAnim& track = *chosen.mChannels[c];
      const std::string where = path + ": animation " + chosen_name + ", node " + printable(view(track.mNodeName));
      check_keys(track.mPositionKeys, track.mNumPositionKeys, "position", where);
      check_keys(track.mRotationKeys, track.mNumRotationKeys, "rotation", where);
      check_keys(track.mScalingKeys, track.mNumScalingKeys, "scaling", where);
      const auto node = tree.named.find(view(track.mNodeName));
      if (node != tree.named.end()) tracks[node->second] = &track;
    }
    clock = make_clock(key_times(chosen), {chosen.mTicksPerSecond, own_rate(*scene, chosen), tree.nodes.size()}, path,
                       motion.notes, motion.alterations);
    if (scene->mNumAnimations > 1)
      motion.notes.push_back("animation " + chosen_name + " is read, one of " + animation_names(*scene));
  }
  motion.frame_seconds = clock.frame_seconds;
  motion.frame_count = clock.frame_count;
  for (const aiNodeAnim* track : tracks) motion.is_moved.push_back(track != nullptr);
  std::tie(motion.rest_scale, motion.scale_above) = rest_scales(tree);
  const StatedUnit unit = stated_unit(*scene);
  motion.stated_unit = unit.metres;
  motion.applied_unit = unit.applied;
  motion.local = [scene = std::move(scene), nodes = tree.nodes, tracks = std::move(tracks), clock](
                     std::size_t node, std::uint32_t frame) {
    if (tracks[node] == nullptr) return affine(nodes[node]->mTransformation);
    return sample(*tracks[node], clock.first_tick + frame * clock.ticks_per_frame);
  };
  return motion;
}

Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const Motion& motion,
                           const ImportOptions& options, const std::vector<std::string>& named_bones) {
  const NodeTree tree = tree_of(scene, path);
  const bool own = !options.motion;
  PosedNodes posed(tree, motion, own);
  check_frames(motion.frame_count, tree.nodes.size(), path);
  Skeleton skeleton;
  skeleton.notes = motion.notes;
  skeleton.alterations = motion.alterations;
  const StatedUnit unit = stated_unit(scene);
  set_unit(options, skeleton, unit.metres);
  if (skeleton.unit.source == UnitSource::kFile && skeleton.unit.metres != 1)
    skeleton.notes.push_back("length unit: " + digits(skeleton.unit.metres, 6) + " m, as the file says");
  const double metres = skeleton.unit.metres / unit.applied;  // of a length in its nodes' transforms
  skeleton.frame_seconds = motion.frame_seconds;
  skeleton.frame_count = motion.frame_count;

  // The joint of each node, -1 for a node that is not a joint.
  const std::vector<bool> has_track = posed.moved();
  const std::vector<bool> is_joint = choose_joints(scene, tree, {has_track, named_bones, options.skin.has_value()});
  if (is_joint.empty())
    throw ImportError(path + ": no skeleton: it has no bones and no " +
                      (own ? "animated nodes" : "nodes that " + motion.file + " moves, by name"));
  std::vector<std::int32_t> joint_of(tree.nodes.size(), -1);
  std::vector<std::size_t> node_of;
  for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
    if (!is_joint[n]) continue;
    joint_of[n] = static_cast<std::int32_t>(node_of.size());
    node_of.push_back(n);
    skeleton.joint_names.push_back(printable(view(tree.nodes[n]->mName)));
    skeleton.joint_parents.push_back(joint_of[n] == 0 ? -1 : joint_of[static_cast<std::size_t>(tree.parents[n])]);
    skeleton.is_end_site.push_back(false);
  }
  if (!own) {
    even_out(options, motion, metres, node_of, posed, skeleton);
    note_motion(posed, node_of, motion, path, skeleton);
  }
  note_left_out(posed, left_out_nodes(scene, tree, has_track, is_joint), motion.frame_count, tree, skeleton);

  std::vector<Affine> world(tree.nodes.size());
  for (std::uint32_t f = 0; f < motion.frame_count; ++f) {
    for (std::size_t n = 0; n < tree.nodes.size(); ++n) {
      world[n] = posed.local(n, f);
      if (tree.parents[n] >= 0) world[n] = multiply(world[static_cast<std::size_t>(tree.parents[n])], world[n]);
      if (!is_joint[n]) continue;
      if (!is_usable(world[n])) {
        throw ImportError(path + ": node " + skeleton.joint_names[static_cast<std::size_t>(joint_of[n])] +
                          " leaves the range of " + "coordinates in frame " + std::to_string(f));
      }
      const Quat rotation = rotation_of(world[n]);
      const Vec3 position = metres * world[n].translation;
      if (options.skin) add_stretch(world[n], rotation, skeleton.skin.stretches);
      skeleton.rotations.insert(skeleton.rotations.end(), rotation.begin(), rotation.end());
      skeleton.positions.insert(skeleton.positions.end(), position.begin(), position.end());
    }
  }

  if (options.skin) {
    const auto node_named = [&](const aiString& name) {
      const auto node = tree.named.find(view(name));
      return node == tree.named.end() ? -1 : static_cast<std::int32_t>(node->second);
    };
    const SceneNodes nodes = {tree.nodes, tree.parents, joint_of, node_named};
    read_skin(scene, nodes, path, metres, skeleton);
  }

  // Rest offsets are those of the first frame.
  for (std::size_t j = 0; j < skeleton.joint_names.size(); ++j) {
    const double* const p = skeleton.positions.data();
    Vec3 offset = {p[3 * j], p[3 * j + 1], p[3 * j + 2]};
    if (skeleton.joint_parents[j] >= 0) {
      const auto parent = static_cast<std::size_t>(skeleton.joint_parents[j]);
      const double* const q = skeleton.rotations.data() + 4 * parent;
      offset = rotate(conjugate({q[0], q[1], q[2], q[3]}),
                      offset - Vec3{p[3 * parent], p[3 * parent + 1], p[3 * parent + 2]});
    }
    skeleton.rest_offsets.insert(skeleton.rest_offsets.end(), offset.begin(), offset.end());
  }
  return skeleton;
}

}  // namespace cab::scenes
