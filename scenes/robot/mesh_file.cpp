// Vertices of mesh files, and where a robot's file says they are.
#include "scenes/robot/mesh_file.h"

#include "scenes/import/input_file.h"
#include "scenes/import/polygon.h"
#include "scenes/import/prepared_file.h"
#include "scenes/import/printable.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iterator>

namespace cab::scenes {
namespace {

namespace fs = std::filesystem;

// What robots' meshes are written in. Other readers of assimp do not survive bad files.
constexpr const char* kMeshExtensions[] = {".stl", ".obj", ".dae", ".ply", ".gltf", ".glb"};

const std::string kFileScheme = "file://";

// Adds the vertices of a node's meshes and of those below it, in the frame of the root's parent, and the corners of
// their triangles unless `corners` is null. Nodes nest as deep as assimp's own recursion allows.
void add_vertices(const aiScene& scene, const aiNode& node, const aiMatrix4x4& to_parent, std::vector<Vec3>& vertices,
                  std::vector<Vec3>* corners) {
  const aiMatrix4x4 to_root = to_parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    const std::size_t first = vertices.size();
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D point = to_root * mesh.mVertices[v];
      vertices.push_back({point.x, point.y, point.z});
    }
    if (corners == nullptr) continue;
    std::vector<Vec3> polygon;
    std::vector<std::uint32_t> triangles;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      polygon.clear(), triangles.clear();
      for (unsigned k = 0; k < face.mNumIndices; ++k) polygon.push_back(vertices.at(first + face.mIndices[k]));
      cut_polygon(polygon, triangles);
      for (const std::uint32_t corner : triangles) corners->push_back(polygon[corner]);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) add_vertices(scene, *node.mChildren[c], to_root, vertices, corners);
}

}  // namespace

std::string MeshFinder::find_in_package(const std::string& name_and_rest) {
  const std::size_t slash = name_and_rest.find('/');
  const std::string name = name_and_rest.substr(0, slash);
  const fs::path rest = slash == std::string::npos ? fs::path() : fs::path(name_and_rest.substr(slash + 1));
  const auto first_file = [&](const std::vector<std::string>& folders) {
    for (const std::string& folder : folders)
      if (const fs::path file = folder / rest; is_file(file)) return file.string();
    return std::string();
  };
  for (const auto& [package, folder] : options_.packages)
    if (package == name) return first_file({folder});
  if (std::string file = first_file(folders_named(name, robot_path_)); !file.empty()) return file;
  if (!packages_) packages_ = read_packages(package_files_);
  if (std::string file = first_file((*packages_)[name]); !file.empty()) return file;
  return first_file(installed_folders_named(name));
}

std::string MeshFinder::find(const std::string& name) {
  for (const std::string scheme : {"package://", "model://"})
    if (name.compare(0, scheme.size(), scheme) == 0) return find_in_package(name.substr(scheme.size()));
  fs::path path = name;
  if (name.compare(0, kFileScheme.size(), kFileScheme) == 0) path = name.substr(kFileScheme.size());
  if (path.is_relative()) path = fs::path(robot_path_).parent_path() / path;
  return is_file(path) ? path.string() : std::string();
}

void check_mesh_name(const std::string& name, const std::string& source) {
  const std::size_t end = name.find("://");
  if (end == std::string::npos) return;
  const std::string scheme = name.substr(0, end + 3);
  if (scheme != "package://" && scheme != "model://" && scheme != kFileScheme)
    throw ImportError(source + ": only package://, model://, file:// and plain paths are read");
}

bool is_mesh_path(const std::string& path) {
  const std::string extension = lower_extension(path);
  return std::find(std::begin(kMeshExtensions), std::end(kMeshExtensions), extension) != std::end(kMeshExtensions);
}

std::vector<Vec3> read_mesh(const std::string& path, const std::string& source, std::vector<std::string>& notes,
                            std::vector<Vec3>* corners) {
  if (!is_mesh_path(path)) {
    const std::string extension = lower_extension(path);
    throw ImportError(source + ": meshes are read from .stl, .obj, .dae, .ply, .gltf and .glb files, not from " +
                      printable(extension.empty() ? "files without an extension" : extension));
  }
  Assimp::Importer importer;
  // Robots' files count z up whatever a mesh says.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = nullptr;
  std::string reason;
  FileFacts facts;
  try {
    scene = read_prepared(importer, path, source, facts);
    reason = importer.GetErrorString();
  } catch (const ImportError&) { throw; } catch (const std::exception& error) {
    reason = error.what();
  }
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw ImportError(source + ": assimp cannot read it: " + printable(reason));
  for (const std::string& note : facts.notes) notes.push_back(source + ": " + note);
  std::vector<Vec3> vertices;
  add_vertices(*scene, *scene->mRootNode, aiMatrix4x4(), vertices, corners);
  if (vertices.empty()) throw ImportError(source + ": the mesh has no vertices");
  for (const Vec3& vertex : vertices)
    for (const double component : vertex)
      if (!std::isfinite(component)) throw ImportError(source + ": a vertex is not a number");
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

}  // namespace cab::scenes
