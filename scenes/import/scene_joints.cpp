// Chooses the joints among the nodes of a scene.
#include "scenes/import/scene_joints.h"

#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/import/printable.h"
#include "scenes/import/skin_file.h"
#include "scenes/rig/body_parts.h"

namespace cab::scenes {
namespace {

constexpr std::size_t kMaxNodes = std::size_t{1} << 16;

bool any(const std::vector<bool>& values) { return std::find(values.begin(), values.end(), true) != values.end(); }

// What each node of a scene is, besides a node.
struct Roles {
  std::vector<bool> is_bone;    // of a mesh
  std::vector<bool> is_device;  // a camera or a light
  std::vector<bool> has_mesh;
  std::vector<bool> has_skinned_mesh;
};

Roles roles_of(const aiScene& scene, const NodeTree& tree) {
  const std::size_t count = tree.nodes.size();
  Roles roles = {std::vector<bool>(count), std::vector<bool>(count), std::vector<bool>(count),
                 std::vector<bool>(count)};
  const auto mark = [&](const aiString& name, std::vector<bool>& marks) {
    const auto found = tree.named.find(view(name));
    if (found != tree.named.end()) marks[found->second] = true;
  };
  for (unsigned m = 0; m < scene.mNumMeshes; ++m)
    for (unsigned b = 0; b < scene.mMeshes[m]->mNumBones; ++b) mark(scene.mMeshes[m]->mBones[b]->mName, roles.is_bone);
  for (unsigned c = 0; c < scene.mNumCameras; ++c) mark(scene.mCameras[c]->mName, roles.is_device);
  for (unsigned l = 0; l < scene.mNumLights; ++l) mark(scene.mLights[l]->mName, roles.is_device);
  for (std::size_t n = 0; n < count; ++n) {
    const aiNode& node = *tree.nodes[n];
    roles.has_mesh[n] = node.mNumMeshes > 0;
    for (unsigned k = 0; k < node.mNumMeshes; ++k)
      if (node.mMeshes[k] < scene.mNumMeshes && scene.mMeshes[node.mMeshes[k]]->mNumBones > 0)
        roles.has_skinned_mesh[n] = true;
  }
  return roles;
}

// The last node in pre-order that has all marked nodes at or below it.
std::size_t common_node(const NodeTree& tree, const std::vector<bool>& marks) {
  std::size_t first = marks.size(), last = 0;
  for (std::size_t n = 0; n < marks.size(); ++n) {
    if (!marks[n]) continue;
    first = std::min(first, n);
    last = n;
  }
  while (tree.ends[first] <= last) first = static_cast<std::size_t>(tree.parents[first]);
  return first;
}

// Chooses among the nodes with tracks where there are bones.
class TrackChooser {
 public:
  TrackChooser(const NodeTree& tree, const Roles& roles, const std::vector<bool>& is_bone, bool with_meshes)
      : tree_(tree), roles_(roles), with_meshes_(with_meshes), top_(common_node(tree, is_bone)) {}

  bool counts(std::size_t node) const {
    if (roles_.is_device[node] || roles_.has_skinned_mesh[node]) return false;
    if (tree_.is_at_or_below(node, top_)) {
      if (with_meshes_ && has_any(roles_.has_mesh, node)) return true;
      return !roles_.has_mesh[node] && !is_helper(name(node));
    }
    if (roles_.has_mesh[node] || is_helper(name(node))) return false;
    if (tree_.is_at_or_below(top_, node)) return !is_container(name(node));
    return is_limb(branch_of(node));
  }

 private:
  std::string name(std::size_t node) const { return std::string(view(tree_.nodes[node]->mName)); }

  bool has_any(const std::vector<bool>& marks, std::size_t top) const {
    const auto begin = marks.begin();
    return std::find(begin + static_cast<std::ptrdiff_t>(top), begin + static_cast<std::ptrdiff_t>(tree_.ends[top]),
                     true) != begin + static_cast<std::ptrdiff_t>(tree_.ends[top]);
  }

  // The node at or above one, which hangs from a node above all bones.
  std::size_t branch_of(std::size_t node) const {
    for (;;) {
      const std::int32_t parent = tree_.parents[node];
      if (parent < 0 || tree_.is_at_or_below(top_, static_cast<std::size_t>(parent))) return node;
      node = static_cast<std::size_t>(parent);
    }
  }

  // A chain without meshes and cameras is a limb that the skin lacks. One node alone is a mark or a target, unless its
  // name is that of a body part.
  bool is_limb(std::size_t branch) const {
    if (has_any(roles_.has_mesh, branch) || has_any(roles_.is_device, branch)) return false;
    return tree_.ends[branch] - branch > 1 || is_body_part(name(branch));
  }

  const NodeTree& tree_;
  const Roles& roles_;
  bool with_meshes_;
  std::size_t top_;
};

}  // namespace

std::string_view view(const aiString& name) { return {name.C_Str(), name.length}; }

bool is_usable(const Affine& transform) {
  for (const Vec3& column : {transform.columns[0], transform.columns[1], transform.columns[2], transform.translation}) {
    for (const double value : column) {
      if (!(std::fabs(value) <= kMaxImportValue)) return false;
    }
  }
  return true;
}

NodeTree tree_of(const aiScene& scene, const std::string& path) {
  NodeTree tree;
  std::vector<std::pair<const aiNode*, std::int32_t>> open = {{scene.mRootNode, -1}};
  while (!open.empty()) {
    const auto [node, parent] = open.back();
    open.pop_back();
    if (tree.nodes.size() == kMaxNodes) throw ImportError(path + ": more than " + std::to_string(kMaxNodes) + " nodes");
    const std::size_t index = tree.nodes.size();
    tree.nodes.push_back(node);
    tree.parents.push_back(parent);
    if (!is_usable(affine(node->mTransformation))) {
      throw ImportError(path + ": node " + printable(view(node->mName)) +
                        ": its transform is not finite or out of range");
    }
    const auto [entry, is_new] = tree.named.try_emplace(view(node->mName), index);
    if (!is_new && tree.nodes[entry->second]->mNumMeshes > 0 && node->mNumMeshes == 0) entry->second = index;
    for (unsigned c = node->mNumChildren; c-- > 0;)
      open.emplace_back(node->mChildren[c], static_cast<std::int32_t>(index));
  }
  tree.ends.resize(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {
    tree.ends[n] = std::max(tree.ends[n], n + 1);
    if (tree.parents[n] < 0) continue;
    std::size_t& end = tree.ends[static_cast<std::size_t>(tree.parents[n])];
    end = std::max(end, tree.ends[n]);
  }
  return tree;
}

std::vector<bool> choose_joints(const aiScene& scene, const NodeTree& tree, const JointHints& hints) {
  const std::size_t count = tree.nodes.size();
  const Roles roles = roles_of(scene, tree);
  std::vector<bool> joint = roles.is_bone;
  for (const std::string& bone : hints.named_bones)
    if (const auto found = tree.named.find(bone); found != tree.named.end()) joint[found->second] = true;
  const bool adds_below = any(roles.is_bone) || any(hints.has_track);
  if (any(joint)) {
    const std::vector<bool> is_bone = joint;
    const TrackChooser chooser(tree, roles, is_bone, hints.with_meshes);
    for (std::size_t n = 0; n < count; ++n) joint[n] = is_bone[n] || (hints.has_track[n] && chooser.counts(n));
  } else {
    for (std::size_t n = 0; n < count; ++n) joint[n] = hints.has_track[n] && !roles.is_device[n];
  }
  if (!any(joint)) return {};

  for (std::size_t n = 1; adds_below && n < count; ++n) {
    if (!joint[static_cast<std::size_t>(tree.parents[n])] || joint[n]) continue;
    joint[n] = !roles.has_mesh[n] && !roles.is_device[n] && !is_helper(std::string(view(tree.nodes[n]->mName)));
  }
  // What connects them.
  const std::size_t root = common_node(tree, joint);
  for (std::size_t n = count; n-- > root + 1;)
    if (joint[n]) joint[static_cast<std::size_t>(tree.parents[n])] = true;
  return joint;
}

std::vector<bool> left_out_nodes(const aiScene& scene, const NodeTree& tree, const std::vector<bool>& has_track,
                                 const std::vector<bool>& is_joint) {
  const Roles roles = roles_of(scene, tree);
  const std::size_t root = common_node(tree, is_joint);
  std::vector<bool> left_out(tree.nodes.size());
  for (std::size_t n = 0; n < left_out.size(); ++n)
    left_out[n] = has_track[n] && !is_joint[n] && !tree.is_at_or_below(root, n) && !roles.is_device[n] &&
                  !roles.has_skinned_mesh[n];
  return left_out;
}

}  // namespace cab::scenes
