// Skeletons from any file that assimp reads, except BVH.
#include "scenes/import/scene_file.h"

#include "scenes/affine.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/skin_file.h"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace cab::scenes {
namespace {

constexpr std::size_t kMaxNodes = std::size_t{1} << 16;
constexpr double kDefaultTicksPerSecond = 25;  // assimp's own value for files that do not say
constexpr double kMinFrameSeconds = 1e-3;
constexpr double kStaticFrameSeconds = 1.0 / 30;
constexpr double kUsualRatio = 2;  // of lengths of bones in two files of one figure

bool is_usable(const Affine& a) {
  for (const Vec3& column : {a.columns[0], a.columns[1], a.columns[2], a.translation}) {
    for (const double value : column) {
      if (!(std::fabs(value) <= kMaxImportValue)) return false;
    }
  }
  return true;
}

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

// The nodes of a scene in pre-order, and their parents.
struct Nodes {
  std::vector<const aiNode*> nodes;
  std::vector<std::int32_t> parents;
  std::unordered_map<std::string_view, std::size_t> by_name;
};

std::string_view view(const aiString& name) { return {name.C_Str(), name.length}; }

// Lists all nodes. A name may belong to several nodes (a bone and the mesh that it moves). Then it means the first node
// without a mesh, or the first node if all have meshes.
Nodes flatten(const aiScene& scene, const std::string& path) {
  Nodes flat;
  std::vector<std::pair<const aiNode*, std::int32_t>> open = {{scene.mRootNode, -1}};
  while (!open.empty()) {
    const auto [node, parent] = open.back();
    open.pop_back();
    if (flat.nodes.size() == kMaxNodes) throw ImportError(path + ": more than " + std::to_string(kMaxNodes) + " nodes");
    const std::size_t index = flat.nodes.size();
    flat.nodes.push_back(node);
    flat.parents.push_back(parent);
    if (!is_usable(affine(node->mTransformation))) {
      throw ImportError(path + ": node " + printable(view(node->mName)) +
                        ": its transform is not finite or out of range");
    }
    const auto [entry, is_new] = flat.by_name.try_emplace(view(node->mName), index);
    if (!is_new && flat.nodes[entry->second]->mNumMeshes > 0 && node->mNumMeshes == 0) entry->second = index;
    for (unsigned c = node->mNumChildren; c-- > 0;)
      open.emplace_back(node->mChildren[c], static_cast<std::int32_t>(index));
  }
  return flat;
}

// [node] its name, or nothing if the name means another node.
std::vector<std::string> names_of(const Nodes& flat) {
  std::vector<std::string> names(flat.nodes.size());
  for (const auto& [name, node] : flat.by_name) names[node] = name;
  return names;
}

// Marks the nodes that are joints, by the rule in scene_file.h: the bones or moved nodes and all nodes between them, up
// to the lowest node above them all. Empty if there are none.
std::vector<bool> choose_joints(const aiScene& scene, const Nodes& flat, const std::vector<bool>& is_moved) {
  std::vector<bool> joint(flat.nodes.size(), false);
  const auto mark = [&](const aiString& name) {
    const auto found = flat.by_name.find(view(name));
    if (found != flat.by_name.end()) joint[found->second] = true;
  };
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    for (unsigned b = 0; b < scene.mMeshes[m]->mNumBones; ++b) mark(scene.mMeshes[m]->mBones[b]->mName);
  }
  if (std::find(joint.begin(), joint.end(), true) == joint.end()) joint = is_moved;
  std::vector<std::size_t> below(flat.nodes.size(), 0);
  for (std::size_t n = flat.nodes.size(); n-- > 0;) {
    below[n] += joint[n] ? 1 : 0;
    if (flat.parents[n] >= 0) below[static_cast<std::size_t>(flat.parents[n])] += below[n];
  }
  if (below[0] == 0) return {};
  // The last node in pre-order with all marked nodes at or below it.
  std::size_t root = 0;
  for (std::size_t n = 0; n < flat.nodes.size(); ++n) {
    if (below[n] == below[0]) root = n;
  }
  for (std::size_t n = 0; n < flat.nodes.size(); ++n) joint[n] = n >= root && below[n] > 0;
  return joint;
}

// The times at which the animation is sampled.
struct Clock {
  double first_tick = 0;
  double ticks_per_frame = 0;
  double frame_seconds = kStaticFrameSeconds;
  std::uint32_t frame_count = 1;
};

void check_frames(double frames, std::size_t node_count, const std::string& path) {
  if (!(frames * static_cast<double>(node_count) <= static_cast<double>(kMaxJointFrames)))
    throw ImportError(path + ": frames x nodes is more than " + std::to_string(kMaxJointFrames));
}

Clock make_clock(const aiAnimation& animation, std::size_t node_count, const std::string& path,
                 std::vector<std::string>& notes) {
  // assimp gives a track that a file lacks one key at 0, which says nothing about the clock.
  constexpr unsigned kLeastKeys = 2;
  double first = 0, last = 0, densest_span = 0;
  unsigned most_keys = 0;
  const auto see = [&](const auto* keys, unsigned count) {
    if (count < kLeastKeys) return;
    const double begin = keys[0].mTime, end = keys[count - 1].mTime;
    first = most_keys > 0 ? std::min(first, begin) : begin;
    last = most_keys > 0 ? std::max(last, end) : end;
    if (count > most_keys) {
      most_keys = count;
      densest_span = end - begin;
    }
  };
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& track = *animation.mChannels[c];
    see(track.mPositionKeys, track.mNumPositionKeys);
    see(track.mRotationKeys, track.mNumRotationKeys);
    see(track.mScalingKeys, track.mNumScalingKeys);
  }
  Clock clock;
  clock.first_tick = first;
  if (most_keys < kLeastKeys || !(densest_span > 0)) return clock;
  double ticks_per_second = animation.mTicksPerSecond;
  if (ticks_per_second == 0) {
    ticks_per_second = kDefaultTicksPerSecond;
    notes.push_back("the file has no clock: 25 ticks a second assumed");
  }
  if (!std::isfinite(ticks_per_second) || ticks_per_second < 0)
    throw ImportError(path + ": the ticks a second of its animation must be finite and above 0");
  clock.frame_seconds = std::max(densest_span / (most_keys - 1) / ticks_per_second, kMinFrameSeconds);
  if (!(clock.frame_seconds <= kMaxFrameSeconds))
    throw ImportError(path + ": the frame time of its animation is more than an hour");
  clock.ticks_per_frame = clock.frame_seconds * ticks_per_second;
  // The tolerance keeps the last key if the quotient is a rounding error below a whole number.
  const double frames = std::floor((last - first) / clock.ticks_per_frame + 1e-6) + 1;
  check_frames(frames, node_count, path);
  clock.frame_count = static_cast<std::uint32_t>(frames);
  return clock;
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
  if (text.empty()) return *scene.mAnimations[0];
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
  PosedNodes(const Nodes& flat, const Motion& motion, bool own) : flat_(flat), motion_(motion) {
    if (!own) {
      source_ = match_names(names_of(flat), motion.names);
      return;
    }
    source_.resize(flat.nodes.size());
    std::iota(source_.begin(), source_.end(), 0);
  }

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
    local.translation = motion_.scale * local.translation;
    return local;
  }

  Affine rest(std::size_t node) const { return affine(flat_.nodes[node]->mTransformation); }

 private:
  const Nodes& flat_;
  const Motion& motion_;
  std::vector<std::int32_t> source_;
};

// Says how many joints another file moves, and which not. Throws ImportError if it is none.
void note_motion(const PosedNodes& posed, const std::vector<std::size_t>& node_of, const Motion& motion,
                 const std::string& path, Skeleton& skeleton) {
  std::vector<std::string> missing;
  std::vector<double> ratios;
  for (std::size_t j = 0; j < node_of.size(); ++j) {
    if (!posed.has(node_of[j])) {
      missing.push_back(skeleton.joint_names[j]);
      continue;
    }
    const double rest = length(posed.rest(node_of[j]).translation);
    const double moved = length(posed.local(node_of[j], 0).translation);
    if (j > 0 && rest > 0 && moved > 0) ratios.push_back(moved / rest);
  }
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
  if (ratios.empty()) return;
  const auto median = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), median, ratios.end());
  if (*median >= 1 / kUsualRatio && *median <= kUsualRatio) return;
  std::array<char, 32> ratio = {};
  std::snprintf(ratio.data(), ratio.size(), "%.3g", *median);
  skeleton.notes.push_back("bones of " + motion.file + " are " + ratio.data() +
                           " times as long as those that they move: --motion-units says its length unit");
}

}  // namespace

Motion motion_of_scene(std::shared_ptr<const aiScene> scene, const std::string& path, const std::string& animation) {
  Motion motion;
  motion.file = path;
  const Nodes flat = flatten(*scene, path);
  motion.names = names_of(flat);
  std::vector<const aiNodeAnim*> tracks(flat.nodes.size(), nullptr);
  Clock clock;
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
      const auto node = flat.by_name.find(view(track.mNodeName));
      if (node != flat.by_name.end()) tracks[node->second] = &track;
    }
    clock = make_clock(chosen, flat.nodes.size(), path, motion.notes);
    if (scene->mNumAnimations > 1)
      motion.notes.push_back("animation " + chosen_name + " is read, one of " + animation_names(*scene));
  }
  motion.frame_seconds = clock.frame_seconds;
  motion.frame_count = clock.frame_count;
  for (const aiNodeAnim* track : tracks) motion.is_moved.push_back(track != nullptr);
  motion.local = [scene = std::move(scene), nodes = flat.nodes, tracks = std::move(tracks), clock](
                     std::size_t node, std::uint32_t frame) {
    if (tracks[node] == nullptr) return affine(nodes[node]->mTransformation);
    return sample(*tracks[node], clock.first_tick + frame * clock.ticks_per_frame);
  };
  return motion;
}

Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const Motion& motion,
                           const ImportOptions& options) {
  const Nodes flat = flatten(scene, path);
  const bool own = !options.motion;
  const PosedNodes posed(flat, motion, own);
  check_frames(motion.frame_count, flat.nodes.size(), path);
  Skeleton skeleton;
  skeleton.notes = motion.notes;
  skeleton.is_static = motion.frame_count == 1;
  if (skeleton.is_static)
    skeleton.notes.push_back("no motion: the pose of " + (own ? "the file" : motion.file) + " holds for all frames");
  skeleton.frame_seconds = motion.frame_seconds;
  skeleton.frame_count = motion.frame_count;

  // The joint of each node, -1 for a node that is not a joint.
  const std::vector<bool> is_joint = choose_joints(scene, flat, posed.moved());
  if (is_joint.empty())
    throw ImportError(path + ": no skeleton: it has no bones and no " +
                      (own ? "animated nodes" : "nodes that " + motion.file + " moves, by name"));
  std::vector<std::int32_t> joint_of(flat.nodes.size(), -1);
  std::vector<std::size_t> node_of;
  for (std::size_t n = 0; n < flat.nodes.size(); ++n) {
    if (!is_joint[n]) continue;
    joint_of[n] = static_cast<std::int32_t>(node_of.size());
    node_of.push_back(n);
    skeleton.joint_names.push_back(printable(view(flat.nodes[n]->mName)));
    skeleton.joint_parents.push_back(joint_of[n] == 0 ? -1 : joint_of[static_cast<std::size_t>(flat.parents[n])]);
    skeleton.is_end_site.push_back(false);
  }
  if (!own) note_motion(posed, node_of, motion, path, skeleton);

  std::vector<Affine> world(flat.nodes.size());
  for (std::uint32_t f = 0; f < motion.frame_count; ++f) {
    for (std::size_t n = 0; n < flat.nodes.size(); ++n) {
      world[n] = posed.local(n, f);
      if (flat.parents[n] >= 0) world[n] = multiply(world[static_cast<std::size_t>(flat.parents[n])], world[n]);
      if (!is_joint[n]) continue;
      if (!is_usable(world[n])) {
        throw ImportError(path + ": node " + skeleton.joint_names[static_cast<std::size_t>(joint_of[n])] +
                          " leaves the range of " + "coordinates in frame " + std::to_string(f));
      }
      const Quat rotation = rotation_of(world[n]);
      const Vec3 position = options.metres_per_unit * world[n].translation;
      if (options.skin) add_stretch(world[n], rotation, skeleton.skin.stretches);
      skeleton.rotations.insert(skeleton.rotations.end(), rotation.begin(), rotation.end());
      skeleton.positions.insert(skeleton.positions.end(), position.begin(), position.end());
    }
  }

  if (options.skin) {
    const auto node_named = [&](const aiString& name) {
      const auto node = flat.by_name.find(view(name));
      return node == flat.by_name.end() ? -1 : static_cast<std::int32_t>(node->second);
    };
    const SceneNodes nodes = {flat.nodes, flat.parents, joint_of, node_named};
    read_skin(scene, nodes, path, options.metres_per_unit, skeleton);
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
