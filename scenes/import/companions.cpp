// The files that a motion file is read with.
#include "scenes/import/companions.h"

#include "scenes/import/asf_amc.h"
#include "scenes/import/gltf_file.h"
#include "scenes/import/in_child.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"

#include <algorithm>
#include <filesystem>

namespace cab::scenes {
namespace {

constexpr std::size_t kMagicBytes = 4;  // by which a GLB is told

std::vector<std::string> list_here(const std::string& path) {
  const std::string name = printable(path), extension = lower_extension(path);
  const std::size_t size = check_file(path, name);
  if (extension == ".amc") return {find_asf(path).path};
  const std::filesystem::path file(path);
  if (extension == ".md5mesh") return {std::filesystem::path(file).replace_extension(".md5anim").string()};
  if (extension == ".md5anim") return {std::filesystem::path(file).replace_extension(".md5mesh").string()};
  if (!is_gltf(extension, read_bytes(path, name, std::min(size, kMagicBytes)))) return {};
  std::vector<std::string> files;
  for (const std::filesystem::path& buffer : gltf_buffer_files(read_bytes(path, name, size), name))
    files.push_back((file.parent_path() / buffer).string());
  return files;
}

}  // namespace

std::vector<std::string> companion_files(const std::string& path, const std::optional<SandboxLimits>& sandbox) {
  if (!sandbox) return in_this_process([&path] { return list_here(path); });
  const auto list = [&path] {
    PayloadWriter writer;
    writer.texts(list_here(path));
    return writer.take();
  };
  const auto unpack = [](const std::string& bytes) {
    PayloadReader reader(bytes);
    std::vector<std::string> files = reader.texts();
    reader.finish();
    return files;
  };
  return from_child(path, *sandbox, list, unpack);
}

}  // namespace cab::scenes
