// Meshes, weights and inverse bind matrices through assimp.
#include "scenes/import/skin_file.h"

#include "scenes/import/limits.h"
#include "scenes/import/polygon.h"
#include "scenes/import/printable.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>

namespace cab::scenes {
namespace {

// A vertex with more weights is refused. The largest found in files is 8.
constexpr std::size_t kMaxInfluences = 32;

// All vertices have as many weights as the one with most; more of them are refused.
constexpr std::size_t kMaxWeights = std::size_t{1} << 25;

struct Influence {
  std::uint32_t bone;
  float weight;
};

// What is read, with as many influences per vertex as the file has.
struct Gathered {
  FileSkin& skin;
  std::vector<std::vector<Influence>> influences;
  std::size_t loose_meshes = 0;  // without a joint
};

std::string name_of(const aiMesh& mesh) { return printable({mesh.mName.C_Str(), mesh.mName.length}); }

// Adds a bone of the last mesh and returns its index.
std::uint32_t add_bone(FileSkin& skin, std::int32_t joint, const Affine& bind, double metres_per_unit) {
  const std::vector<Vec3> columns = {bind.columns[0], bind.columns[1], bind.columns[2], bind.translation};
  for (std::size_t k = 0; k < 4; ++k) {
    for (const double component : columns[k])
      skin.inverse_bind.push_back(static_cast<float>(metres_per_unit * component));
    skin.inverse_bind.push_back(k == 3 ? 1.0f : 0.0f);
  }
  skin.bone_joints.push_back(static_cast<std::uint32_t>(joint));
  skin.bone_meshes.push_back(static_cast<std::uint32_t>(skin.mesh_names.size() - 1));
  return static_cast<std::uint32_t>(skin.bone_joints.size() - 1);
}

// Adds the name, vertices without influences, and triangles: polygons are cut into them, points and lines are left
// out. Returns the index of the first vertex.
std::size_t add_mesh(const aiMesh& mesh, const std::string& path, Gathered& gathered) {
  FileSkin& skin = gathered.skin;
  const std::size_t first = gathered.influences.size();
  const auto fail = [&](const std::string& reason) {
    throw ImportError(path + ": mesh " + name_of(mesh) + ": " + reason);
  };
  skin.mesh_names.push_back(name_of(mesh));
  if (first + mesh.mNumVertices > kMaxSkinVertices)
    fail("more than " + std::to_string(kMaxSkinVertices) + " vertices in all meshes");
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    for (const float component : {p.x, p.y, p.z}) {
      if (!(std::fabs(component) <= kMaxImportValue))
        fail("vertex " + std::to_string(v) + " is not finite or too large");
      skin.vertices.push_back(component);
    }
  }
  gathered.influences.resize(first + mesh.mNumVertices);
  std::vector<Vec3> polygon;
  std::vector<std::uint32_t> triangles;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    for (unsigned k = 0; k < face.mNumIndices; ++k)
      if (face.mIndices[k] >= mesh.mNumVertices)
        fail("face " + std::to_string(f) + " has a vertex that does not exist");
    if (skin.triangles.size() / 3 + face.mNumIndices > kMaxSkinTriangles)
      fail("more than " + std::to_string(kMaxSkinTriangles) + " triangles in all meshes");
    polygon.clear(), triangles.clear();
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const aiVector3D& p = mesh.mVertices[face.mIndices[k]];
      polygon.push_back({p.x, p.y, p.z});
    }
    cut_polygon(polygon, triangles);
    for (const std::uint32_t corner : triangles)
      skin.triangles.push_back(static_cast<std::uint32_t>(first + face.mIndices[corner]));
  }
  return first;
}

void add_skinned(const aiMesh& mesh, const SceneNodes& nodes, const std::string& path, double metres_per_unit,
                 Gathered& gathered) {
  const std::size_t first = add_mesh(mesh, path, gathered);
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const auto fail = [&](const std::string& reason) {
      throw ImportError(path + ": bone " + printable({bone.mName.C_Str(), bone.mName.length}) + ": " + reason);
    };
    const std::int32_t node = nodes.node_of(bone.mName);
    if (node < 0) fail("no node has its name");
    const Affine bind = affine(bone.mOffsetMatrix);
    for (const Vec3& column : {bind.columns[0], bind.columns[1], bind.columns[2], bind.translation})
      for (const double component : column)
        if (!(std::fabs(component) <= kMaxImportValue)) fail("its inverse bind matrix is not finite or out of range");
    const std::uint32_t index =
        add_bone(gathered.skin, nodes.joint_of[static_cast<std::size_t>(node)], bind, metres_per_unit);
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      const aiVertexWeight& weight = bone.mWeights[w];
      if (weight.mVertexId >= mesh.mNumVertices) fail("it moves a vertex that does not exist");
      if (!std::isfinite(weight.mWeight)) fail("a weight is not finite");
      if (weight.mWeight < 0) fail("a weight is negative");
      if (weight.mWeight > 0) gathered.influences[first + weight.mVertexId].push_back({index, weight.mWeight});
    }
  }
  for (std::size_t v = first; v < gathered.influences.size(); ++v)
    if (gathered.influences[v].size() > kMaxInfluences)
      throw ImportError(path + ": mesh " + name_of(mesh) + ": vertex " + std::to_string(v - first) + " has more than " +
                        std::to_string(kMaxInfluences) + " weights");
}

// A mesh at a node, which moves with the joint at or above the node.
void add_rigid(const aiMesh& mesh, const SceneNodes& nodes, std::size_t node, const std::string& path,
               double metres_per_unit, Gathered& gathered) {
  Affine bind;
  while (nodes.joint_of[node] < 0) {
    bind = multiply(affine(nodes.nodes[node]->mTransformation), bind);
    if (nodes.parents[node] < 0) {
      ++gathered.loose_meshes;
      return;
    }
    node = static_cast<std::size_t>(nodes.parents[node]);
  }
  const std::size_t first = add_mesh(mesh, path, gathered);
  const std::uint32_t bone = add_bone(gathered.skin, nodes.joint_of[node], bind, metres_per_unit);
  for (std::size_t v = first; v < gathered.influences.size(); ++v) gathered.influences[v].push_back({bone, 1});
}

// Gives every vertex as many influences as the one with most has.
void set_influences(const std::string& path, Gathered& gathered) {
  FileSkin& skin = gathered.skin;
  std::size_t most = 1;
  for (std::vector<Influence>& influences : gathered.influences) {
    std::stable_sort(influences.begin(), influences.end(),
                     [](const Influence& a, const Influence& b) { return a.weight > b.weight; });
    most = std::max(most, influences.size());
  }
  const std::size_t vertices = gathered.influences.size();
  if (most * vertices > kMaxWeights)
    throw ImportError(path + ": " + std::to_string(vertices) + " vertices with up to " + std::to_string(most) +
                      " weights each are more than " + std::to_string(kMaxWeights) + " weights");
  skin.influence_bones.assign(most * vertices, 0);
  skin.influence_weights.assign(most * vertices, 0);
  for (std::size_t v = 0; v < vertices; ++v)
    for (std::size_t i = 0; i < gathered.influences[v].size(); ++i) {
      skin.influence_bones[most * v + i] = gathered.influences[v][i].bone;
      skin.influence_weights[most * v + i] = gathered.influences[v][i].weight;
    }
  skin.influence_count = static_cast<std::uint32_t>(most);
}

}  // namespace

Affine affine(const aiMatrix4x4& m) {
  Affine a;
  a.columns = {{{m.a1, m.b1, m.c1}, {m.a2, m.b2, m.c2}, {m.a3, m.b3, m.c3}}};
  a.translation = {m.a4, m.b4, m.c4};
  return a;
}

void read_skin(const aiScene& scene, const SceneNodes& nodes, const std::string& path, double metres_per_unit,
               Skeleton& skeleton) {
  Gathered gathered = {skeleton.skin, {}};
  std::vector<bool> is_read(scene.mNumMeshes, false);
  for (std::size_t n = 0; n < nodes.nodes.size(); ++n) {
    const aiNode& node = *nodes.nodes[n];
    for (unsigned k = 0; k < node.mNumMeshes; ++k) {
      const unsigned m = node.mMeshes[k];
      if (m >= scene.mNumMeshes) throw ImportError(path + ": a node has a mesh that does not exist");
      const aiMesh& mesh = *scene.mMeshes[m];
      if (mesh.mNumBones == 0) {
        add_rigid(mesh, nodes, n, path, metres_per_unit, gathered);
      } else if (!is_read[m]) {
        add_skinned(mesh, nodes, path, metres_per_unit, gathered);
        is_read[m] = true;
      }
    }
  }
  set_influences(path, gathered);
  if (gathered.loose_meshes == 0) return;
  skeleton.notes.push_back(std::to_string(gathered.loose_meshes) + (gathered.loose_meshes == 1 ? " mesh" : " meshes") +
                           " left out (no joint moves them)");
  skeleton.alterations.push_back(
      {AlterationKind::kDropped, "meshes that no joint moves", gathered.loose_meshes, skeleton.notes.back()});
}

}  // namespace cab::scenes
