// Robots from files of either format.
#include "scenes/robot/robot.h"

#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/mjcf.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/urdf.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <filesystem>
#include <set>

namespace cab::scenes {

namespace {

bool is_urdf(const XmlText& text) { return text.root().Name() == std::string("robot"); }

Robot read_here(const std::string& path, const RobotOptions& options, CurrentFile* current) {
  const XmlText text(path);
  const std::string name = printable(path);
  const std::string root = text.root().Name();
  if (!is_urdf(text) && root != "mujoco")
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(root) + ">, but URDF begins with <robot> and MJCF with <mujoco>");
  Robot robot = is_urdf(text) ? read_urdf(text, options, current) : read_mjcf(text);
  if (robot.body.leaves.empty()) throw ImportError(name + ": no link has a collision shape");
  if (robot.body.leaves.size() > kMaxLeaves)
    throw ImportError(name + ": more than " + std::to_string(kMaxLeaves) + " collision shapes");
  return robot;
}

// The mesh files of a URDF file and their folders, where a mesh may have files of its own. A child process says which.
std::vector<std::string> meshes_and_folders(const std::string& path, const RobotOptions& options) {
  const auto list = [&] {
    const XmlText text(path);
    PayloadWriter writer;
    writer.texts(is_urdf(text) ? mesh_files(text, options) : std::vector<std::string>());
    return writer.take();
  };
  const auto unpack = [](const std::string& bytes) {
    PayloadReader reader(bytes);
    std::vector<std::string> files = reader.texts();
    reader.finish();
    return files;
  };
  std::set<std::string> readable;
  for (const std::string& file : from_child(path, *options.sandbox, list, unpack)) {
    if (!is_mesh_path(file)) continue;
    readable.insert(file);
    readable.insert(std::filesystem::path(file).parent_path().string());
  }
  return {readable.begin(), readable.end()};
}

}  // namespace

Robot import_robot(const std::string& path, const RobotOptions& options) {
  if (!options.sandbox) return read_here(path, options, nullptr);
  CurrentFile current;
  return from_child(path, *options.sandbox, [&] { return robot_payload(read_here(path, options, &current)); },
                    read_robot_payload, {meshes_and_folders(path, options), &current});
}

}  // namespace cab::scenes
