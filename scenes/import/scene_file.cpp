// Skeletons from any file that assimp reads, except BVH.
#include "scenes/import/scene_file.h"

#include "scenes/affine.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/skin_file.h"

#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>

namespace cab::scenes {
namespace {

constexpr std::size_t kMaxNodes = std::size_t{1} << 16;
constexpr double kDefaultTicksPerSecond = 25;  // assimp's own value for files that do not say
constexpr double kMinFrameSeconds = 1e-3;
constexpr double kStaticFrameSeconds = 1.0 / 30;

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

// The nodes of a scene in pre-order, their parents, and which of them are joints.
struct Nodes {
  std::vector<const aiNode*> nodes;
  std::vector<std::int32_t> parents;
  std::unordered_map<std::string_view, std::size_t> by_name;
  std::vector<const aiNodeAnim*> tracks;
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
  flat.tracks.resize(flat.nodes.size(), nullptr);
  return flat;
}

// Marks the nodes that are joints, by the rule in scene_file.h: the bones or moved nodes and all nodes between them, up
// to the lowest node above them all.
std::vector<bool> choose_joints(const aiScene& scene, const Nodes& flat, const std::string& path) {
  std::vector<bool> joint(flat.nodes.size(), false);
  const auto mark = [&](const aiString& name) {
    const auto found = flat.by_name.find(view(name));
    if (found != flat.by_name.end()) joint[found->second] = true;
  };
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    for (unsigned b = 0; b < scene.mMeshes[m]->mNumBones; ++b) mark(scene.mMeshes[m]->mBones[b]->mName);
  }
  if (std::find(joint.begin(), joint.end(), true) == joint.end()) {
    for (std::size_t n = 0; n < flat.nodes.size(); ++n) joint[n] = flat.tracks[n] != nullptr;
  }
  std::vector<std::size_t> below(flat.nodes.size(), 0);
  for (std::size_t n = flat.nodes.size(); n-- > 0;) {
    below[n] += joint[n] ? 1 : 0;
    if (flat.parents[n] >= 0) below[static_cast<std::size_t>(flat.parents[n])] += below[n];
  }
  if (below[0] == 0) throw ImportError(path + ": no skeleton: it has no bones and no animated nodes");
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
  if (!(frames * static_cast<double>(node_count) <= static_cast<double>(kMaxJointFrames))) {
    throw ImportError(path + ": frames x nodes is more than " + std::to_string(kMaxJointFrames));
  }
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

}  // namespace

Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const ImportOptions& options) {
  Nodes flat = flatten(scene, path);
  Skeleton skeleton;
  Clock clock;
  if (scene.mNumAnimations == 0 && !options.animation.empty()) throw ImportError(path + ": it has no animation");
  if (scene.mNumAnimations > 0) {
    const aiAnimation& animation = chosen_animation(scene, path, options.animation);
    const std::string animation_name = printable(view(animation.mName));
    for (unsigned c = 0; c < animation.mNumChannels; ++c) {
      const aiNodeAnim& track = *animation.mChannels[c];
      const std::string where = path + ": animation " + animation_name + ", node " + printable(view(track.mNodeName));
      check_keys(track.mPositionKeys, track.mNumPositionKeys, "position", where);
      check_keys(track.mRotationKeys, track.mNumRotationKeys, "rotation", where);
      check_keys(track.mScalingKeys, track.mNumScalingKeys, "scaling", where);
      const auto node = flat.by_name.find(view(track.mNodeName));
      if (node != flat.by_name.end()) flat.tracks[node->second] = &track;
    }
    clock = make_clock(animation, flat.nodes.size(), path, skeleton.notes);
    if (scene.mNumAnimations > 1)
      skeleton.notes.push_back("animation " + animation_name + " is read, one of " + animation_names(scene));
  }
  skeleton.is_static = clock.frame_count == 1;
  if (skeleton.is_static) skeleton.notes.push_back("no motion: the pose of the file holds for all frames");
  skeleton.frame_seconds = clock.frame_seconds;
  skeleton.frame_count = clock.frame_count;

  // The joint of each node, -1 for a node that is not a joint.
  const std::vector<bool> is_joint = choose_joints(scene, flat, path);
  std::vector<std::int32_t> joint_of(flat.nodes.size(), -1);
  for (std::size_t n = 0; n < flat.nodes.size(); ++n) {
    if (!is_joint[n]) continue;
    joint_of[n] = static_cast<std::int32_t>(skeleton.joint_names.size());
    const bool is_root = skeleton.joint_names.empty();
    skeleton.joint_names.push_back(printable(view(flat.nodes[n]->mName)));
    skeleton.joint_parents.push_back(is_root ? -1 : joint_of[static_cast<std::size_t>(flat.parents[n])]);
    skeleton.is_end_site.push_back(false);
  }

  std::vector<Affine> world(flat.nodes.size());
  for (std::uint32_t f = 0; f < clock.frame_count; ++f) {
    const double tick = clock.first_tick + f * clock.ticks_per_frame;
    for (std::size_t n = 0; n < flat.nodes.size(); ++n) {
      world[n] = flat.tracks[n] != nullptr ? sample(*flat.tracks[n], tick) : affine(flat.nodes[n]->mTransformation);
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
    const auto node_of = [&](const aiString& name) {
      const auto node = flat.by_name.find(view(name));
      return node == flat.by_name.end() ? -1 : static_cast<std::int32_t>(node->second);
    };
    const SceneNodes nodes = {flat.nodes, flat.parents, joint_of, node_of};
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
