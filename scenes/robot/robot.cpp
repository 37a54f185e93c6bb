// Robots from files of either format.
#include "scenes/robot/robot.h"

#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/mjcf.h"
#include "scenes/robot/mjcf_tree.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/urdf.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <filesystem>
#include <set>

namespace cab::scenes {

namespace {

// How deep included files of MJCF that are not below its folder may include others.
constexpr std::size_t kMaxIncludeRounds = 8;

bool is_urdf(const XmlText& text) { return text.root().Name() == std::string("robot"); }

Robot read_here(const std::string& path, const RobotOptions& options, CurrentFile* current) {
  const XmlText text(path);
  const std::string name = printable(path);
  const std::string root = text.root().Name();
  if (!is_urdf(text) && root != "mujoco")
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(root) + ">, but URDF begins with <robot> and MJCF with <mujoco>");
  Robot robot = is_urdf(text) ? read_urdf(text, options, current) : read_mjcf(text, options);
  if (is_urdf(text) && (!options.ignored_words.empty() || !options.root.empty()))
    robot.notes.emplace_back("words to ignore and a root folder say nothing for URDF");
  if (robot.body.leaves.empty()) throw ImportError(name + ": no link has a collision shape");
  if (robot.body.leaves.size() > kMaxLeaves)
    throw ImportError(name + ": more than " + std::to_string(kMaxLeaves) + " collision shapes");
  return robot;
}

struct NamedFiles {
  bool is_mjcf = false;
  std::vector<std::string> paths;
};

// The files that a robot's file names, as a child process says that can open `readable`.
NamedFiles named_files(const std::string& path, const RobotOptions& options, const std::set<std::string>& readable) {
  const auto list = [&] {
    const XmlText text(path);
    PayloadWriter writer;
    writer.value(static_cast<std::uint8_t>(!is_urdf(text)));
    writer.texts(is_urdf(text) ? mesh_files(text, options) : mjcf_files(text));
    return writer.take();
  };
  const auto unpack = [](const std::string& bytes) {
    PayloadReader reader(bytes);
    NamedFiles files;
    files.is_mjcf = reader.value<std::uint8_t>() != 0;
    files.paths = reader.texts();
    reader.finish();
    return files;
  };
  return from_child(path, *options.sandbox, list, unpack, {{readable.begin(), readable.end()}});
}

// What the child that reads a robot may open beside its file. The meshes of URDF have their folders too, where a mesh
// may have files of its own. An included file of MJCF has to be opened before it can name others.
std::vector<std::string> readable_files(const std::string& path, const RobotOptions& options) {
  std::set<std::string> readable;
  for (std::size_t known = 0, round = 0; round < kMaxIncludeRounds; ++round, known = readable.size()) {
    const NamedFiles named = named_files(path, options, readable);
    for (const std::string& file : named.paths) {
      if (named.is_mjcf ? !may_open_for_mjcf(file, path, options) : !is_mesh_path(file)) continue;
      readable.insert(file);
      if (!named.is_mjcf) readable.insert(std::filesystem::path(file).parent_path().string());
    }
    if (!named.is_mjcf || readable.size() == known) break;
  }
  return {readable.begin(), readable.end()};
}

}  // namespace

Robot import_robot(const std::string& path, const RobotOptions& options) {
  if (!options.sandbox) return read_here(path, options, nullptr);
  CurrentFile current;
  return from_child(path, *options.sandbox, [&] { return robot_payload(read_here(path, options, &current)); },
                    read_robot_payload, {readable_files(path, options), &current});
}

}  // namespace cab::scenes
