// Robots from files of either format.
#include "scenes/robot/robot.h"

#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/mesh_file.h"
#include "scenes/robot/mjcf.h"
#include "scenes/robot/mjcf_tree.h"
#include "scenes/robot/packages.h"
#include "scenes/robot/pieces.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/surface.h"
#include "scenes/robot/urdf.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <filesystem>
#include <set>
#include <utility>

namespace cab::scenes {

namespace {

// How deep included files of MJCF that are not below its folder may include others.
constexpr std::size_t kMaxIncludeRounds = 8;

bool is_urdf(const XmlText& text) { return text.root().Name() == std::string("robot"); }

Robot read_here(const std::string& path, const RobotOptions& options, const MeshFiles& meshes, CurrentFile* current,
                LeafTriangles* triangles) {
  const XmlText text(path);
  const std::string name = printable(path);
  const std::string root = text.root().Name();
  if (!is_urdf(text) && root != "mujoco")
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(root) + ">, but URDF begins with <robot> and MJCF with <mujoco>");
  Robot robot =
      is_urdf(text) ? read_urdf(text, options, meshes, current, triangles) : read_mjcf(text, options, triangles);
  if (is_urdf(text) && (!options.ignored_words.empty() || !options.root.empty()))
    robot.notes.emplace_back("words to ignore and a root folder say nothing for URDF");
  if (!is_urdf(text) && (!options.packages.empty() || options.missing_mesh != MissingMesh::kRefuse))
    robot.notes.emplace_back("packages, and what stands for a missing mesh, say nothing for MJCF");
  if (robot.body.leaves.empty()) throw ImportError(name + ": no link has a collision shape");
  if (robot.body.leaves.size() > kMaxLeaves)
    throw ImportError(name + ": more than " + std::to_string(kMaxLeaves) + " collision shapes");
  return robot;
}

// The files that a robot's file names.
struct NamedFiles {
  bool is_mjcf = false;
  MeshFiles meshes;                // of URDF
  std::vector<std::string> paths;  // of MJCF
};

NamedFiles named_files(const std::string& path, const RobotOptions& options, const std::vector<std::string>& packages) {
  const XmlText text(path);
  if (is_urdf(text)) return {false, find_meshes(text, options, packages), {}};
  return {true, {}, mjcf_files(text)};
}

// The same, as a child process says that can open `readable` and the files of packages.
NamedFiles named_files_from_child(const std::string& path, const RobotOptions& options,
                                  const std::set<std::string>& readable) {
  const std::vector<std::string> packages = package_files(path);
  const auto find = [&] {
    const NamedFiles named = named_files(path, options, packages);
    std::vector<std::string> names, files;
    for (const auto& [name, file] : named.meshes) {
      names.push_back(name);
      files.push_back(file);
    }
    PayloadWriter writer;
    writer.value(static_cast<std::uint8_t>(named.is_mjcf));
    writer.texts(names);
    writer.texts(files);
    writer.texts(named.paths);
    return writer.take();
  };
  const auto unpack = [](const std::string& bytes) {
    PayloadReader reader(bytes);
    NamedFiles named;
    named.is_mjcf = reader.value<std::uint8_t>() != 0;
    const std::vector<std::string> names = reader.texts(), files = reader.texts();
    named.paths = reader.texts();
    reader.finish();
    require_payload(names.size() == files.size(), "there is not one file for each mesh");
    for (std::size_t m = 0; m < names.size(); ++m) named.meshes.emplace(names[m], files[m]);
    return named;
  };
  std::vector<std::string> openable = packages;
  openable.insert(openable.end(), readable.begin(), readable.end());
  return from_child(path, *options.sandbox, find, unpack, {openable});
}

// What the child that reads a robot may open beside its file.
struct ForReader {
  MeshFiles meshes;
  std::set<std::string> readable;
};

// The meshes of URDF have their folders too, where a mesh may have files of its own. An included file of MJCF has to be
// opened before it can name others.
ForReader files_for_reader(const std::string& path, const RobotOptions& options) {
  ForReader files;
  for (std::size_t round = 0; round < kMaxIncludeRounds; ++round) {
    const NamedFiles named = named_files_from_child(path, options, files.readable);
    files.meshes = named.meshes;
    for (const auto& [name, file] : named.meshes) {
      if (!is_mesh_path(file)) continue;
      files.readable.insert(file);
      files.readable.insert(std::filesystem::path(file).parent_path().string());
    }
    const std::size_t known = files.readable.size();
    for (const std::string& file : named.paths)
      if (may_open_for_mjcf(file, path, options)) files.readable.insert(file);
    if (files.readable.size() == known) break;
  }
  return files;
}

MeshFiles meshes_here(const std::string& path, const RobotOptions& options) {
  return named_files(path, options, package_files(path)).meshes;
}

}  // namespace

Robot import_robot(const std::string& path, const RobotOptions& options) {
  LeafTriangles triangles;
  // Cutting is part of reading: a mesh may take long.
  const auto read_and_cut = [&](const MeshFiles& meshes, CurrentFile* current) {
    const bool cuts = !options.surface && options.leaves_per_link > 1;
    Robot robot = read_here(path, options, meshes, current, options.surface || cuts ? &triangles : nullptr);
    if (cuts) cut_meshes(robot, std::exchange(triangles, {}), options.leaves_per_link);
    return robot;
  };
  Robot robot;
  if (!options.sandbox) {
    robot = in_this_process([&] { return read_and_cut(meshes_here(path, options), nullptr); });
  } else {
    const ForReader files = files_for_reader(path, options);
    CurrentFile current;
    const auto read = [&] {
      PayloadWriter writer;
      writer.text(robot_payload(read_and_cut(files.meshes, &current)));
      writer.text(triangles_payload(triangles));
      return writer.take();
    };
    const auto unpack = [&](const std::string& bytes) {
      PayloadReader reader(bytes);
      Robot read_robot = read_robot_payload(reader.text());
      triangles = read_triangles_payload(reader.text());
      reader.finish();
      require_payload(!options.surface || triangles.size() == read_robot.body.leaves.size(),
                      "the triangles are not those of the shapes");
      return read_robot;
    };
    robot =
        from_child(path, *options.sandbox, read, unpack, {{files.readable.begin(), files.readable.end()}, &current});
  }
  if (options.surface) take_surfaces(robot, triangles);
  return robot;
}

std::vector<std::string> companion_files(const std::string& path, const RobotOptions& options) {
  if (options.sandbox) {
    const std::set<std::string> readable = files_for_reader(path, options).readable;
    return {readable.begin(), readable.end()};
  }
  return in_this_process([&] {
    NamedFiles named = named_files(path, options, package_files(path));
    for (const auto& [name, file] : named.meshes) named.paths.push_back(file);
    return named.paths;
  });
}

LeafTriangles import_triangles(const std::string& path, const RobotOptions& options) {
  LeafTriangles triangles;
  if (!options.sandbox) {
    in_this_process([&] { return read_here(path, options, meshes_here(path, options), nullptr, &triangles); });
    return triangles;
  }
  const ForReader files = files_for_reader(path, options);
  CurrentFile current;
  const auto read = [&] {
    read_here(path, options, files.meshes, &current, &triangles);
    return triangles_payload(triangles);
  };
  return from_child(path, *options.sandbox, read, read_triangles_payload,
                    {{files.readable.begin(), files.readable.end()}, &current});
}

}  // namespace cab::scenes
