// Vertices of mesh files, and where a robot's file says they are.
#include "scenes/robot/mesh_file.h"

#include "scenes/import/input_file.h"
#include "scenes/import/prepared_file.h"
#include "scenes/import/printable.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <exception>
#include <filesystem>
#include <iterator>

namespace cab::scenes {
namespace {

namespace fs = std::filesystem;

// What robots' meshes are written in. Other readers of assimp do not survive bad files.
constexpr const char* kMeshExtensions[] = {".stl", ".obj", ".dae", ".ply", ".gltf", ".glb"};

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// The file of package://NAME/REST: in the folder given for NAME, or in a folder NAME above or beside the robot's file.
std::string find_in_package(const std::string& name_and_rest, const std::string& robot_path,
                            const RobotOptions& options) {
  const std::size_t slash = name_and_rest.find('/');
  const std::string name = name_and_rest.substr(0, slash);
  const fs::path rest = slash == std::string::npos ? fs::path() : fs::path(name_and_rest.substr(slash + 1));
  for (const auto& [package, folder] : options.packages)
    if (package == name) return is_file(folder / rest) ? (folder / rest).string() : std::string();
  std::error_code error;
  for (fs::path folder = fs::absolute(robot_path, error).lexically_normal().parent_path(); !error;
       folder = folder.parent_path()) {
    if (folder.filename() == name && is_file(folder / rest)) return (folder / rest).string();
    if (is_file(folder / name / rest)) return (folder / name / rest).string();
    if (folder == folder.parent_path()) break;
  }
  return {};
}

// Adds the vertices of a node's meshes and of those below it, in the frame of the root's parent. Nodes nest as deep as
// assimp's own recursion allows.
void add_vertices(const aiScene& scene, const aiNode& node, const aiMatrix4x4& to_parent, std::vector<Vec3>& vertices) {
  const aiMatrix4x4 to_root = to_parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[m]];
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D point = to_root * mesh.mVertices[v];
      vertices.push_back({point.x, point.y, point.z});
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) add_vertices(scene, *node.mChildren[c], to_root, vertices);
}

}  // namespace

std::string find_mesh(const std::string& name, const std::string& robot_path, const RobotOptions& options,
                      const std::string& source) {
  for (const std::string scheme : {"package://", "model://"})
    if (name.compare(0, scheme.size(), scheme) == 0)
      return find_in_package(name.substr(scheme.size()), robot_path, options);
  const std::string file_scheme = "file://";
  fs::path path = name;
  if (name.compare(0, file_scheme.size(), file_scheme) == 0) {
    path = name.substr(file_scheme.size());
  } else if (name.find("://") != std::string::npos) {
    throw ImportError(source + ": only package://, model://, file:// and plain paths are read");
  }
  if (path.is_relative()) path = fs::path(robot_path).parent_path() / path;
  return is_file(path) ? path.string() : std::string();
}

bool is_mesh_path(const std::string& path) {
  const std::string extension = lower_extension(path);
  return std::find(std::begin(kMeshExtensions), std::end(kMeshExtensions), extension) != std::end(kMeshExtensions);
}

std::vector<Vec3> read_mesh(const std::string& path, const std::string& source) {
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
  std::vector<std::string> notes;  // of names, weights and motion, which a mesh alone does not need
  try {
    scene = read_prepared(importer, path, source, notes);
    reason = importer.GetErrorString();
  } catch (const ImportError&) { throw; } catch (const std::exception& error) {
    reason = error.what();
  }
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw ImportError(source + ": assimp cannot read it: " + printable(reason));
  std::vector<Vec3> vertices;
  add_vertices(*scene, *scene->mRootNode, aiMatrix4x4(), vertices);
  if (vertices.empty()) throw ImportError(source + ": the mesh has no vertices");
  for (const Vec3& vertex : vertices)
    for (const double component : vertex)
      if (!std::isfinite(component)) throw ImportError(source + ": a vertex is not a number");
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

}  // namespace cab::scenes
