// Robots from files of either format.
#include "scenes/robot/robot.h"

#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/mjcf.h"
#include "scenes/robot/packages.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/urdf.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <filesystem>
#include <set>

namespace cab::scenes {

namespace {

bool is_urdf(const XmlText& text) { return text.root().Name() == std::string("robot"); }

MeshFiles meshes_of(const std::string& path, const RobotOptions& options, const std::vector<std::string>& packages) {
  const XmlText text(path);
  return is_urdf(text) ? find_meshes(text, options, packages) : MeshFiles();
}

Robot read_here(const std::string& path, const RobotOptions& options, const MeshFiles& meshes, CurrentFile* current) {
  const XmlText text(path);
  const std::string name = printable(path);
  const std::string root = text.root().Name();
  if (!is_urdf(text) && root != "mujoco")
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(root) + ">, but URDF begins with <robot> and MJCF with <mujoco>");
  Robot robot = is_urdf(text) ? read_urdf(text, options, meshes, current) : read_mjcf(text);
  if (robot.body.leaves.empty()) throw ImportError(name + ": no link has a collision shape");
  if (robot.body.leaves.size() > kMaxLeaves)
    throw ImportError(name + ": more than " + std::to_string(kMaxLeaves) + " collision shapes");
  return robot;
}

// The same meshes, found in a child process.
MeshFiles meshes_from_child(const std::string& path, const RobotOptions& options) {
  const std::vector<std::string> packages = package_files(path);
  const auto find = [&] {
    std::vector<std::string> names, files;
    for (const auto& [name, file] : meshes_of(path, options, packages)) {
      names.push_back(name);
      files.push_back(file);
    }
    PayloadWriter writer;
    writer.texts(names);
    writer.texts(files);
    return writer.take();
  };
  const auto unpack = [](const std::string& bytes) {
    PayloadReader reader(bytes);
    const std::vector<std::string> names = reader.texts(), files = reader.texts();
    reader.finish();
    require_payload(names.size() == files.size(), "there is not one file for each mesh");
    MeshFiles meshes;
    for (std::size_t m = 0; m < names.size(); ++m) meshes.emplace(names[m], files[m]);
    return meshes;
  };
  return from_child(path, *options.sandbox, find, unpack, {packages});
}

// The mesh files and their folders, where a mesh may have files of its own.
std::vector<std::string> files_and_folders(const MeshFiles& meshes) {
  std::set<std::string> readable;
  for (const auto& [name, file] : meshes) {
    if (!is_mesh_path(file)) continue;
    readable.insert(file);
    readable.insert(std::filesystem::path(file).parent_path().string());
  }
  return {readable.begin(), readable.end()};
}

}  // namespace

Robot import_robot(const std::string& path, const RobotOptions& options) {
  if (!options.sandbox) return read_here(path, options, meshes_of(path, options, package_files(path)), nullptr);
  const MeshFiles meshes = meshes_from_child(path, options);
  CurrentFile current;
  return from_child(path, *options.sandbox, [&] { return robot_payload(read_here(path, options, meshes, &current)); },
                    read_robot_payload, {files_and_folders(meshes), &current});
}

}  // namespace cab::scenes
