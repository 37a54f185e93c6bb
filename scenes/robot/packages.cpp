#include "scenes/robot/packages.h"

#include "scenes/import/import.h"
#include "scenes/import/input_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace cab::scenes {
namespace {

namespace fs = std::filesystem;

// What is looked through, at most. A workspace has its packages side by side, seldom more than a few folders above a
// robot's file. Above those are homes and mounts, which may be large or slow.
constexpr std::size_t kNearFolders = 6;
constexpr std::size_t kMostEntries = 1000;  // of a folder
constexpr std::size_t kMostFiles = 4000;
constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // of a package.xml

const std::string kPackageFile = "package.xml";

// The folders above a file, the nearest first.
std::vector<fs::path> folders_above(const std::string& path) {
  std::error_code error;
  std::vector<fs::path> folders;
  for (fs::path folder = fs::absolute(path, error).lexically_normal().parent_path(); !error;
       folder = folder.parent_path()) {
    folders.push_back(folder);
    if (folder == folder.parent_path()) break;
  }
  return folders;
}

// The folders that an environment variable lists.
std::vector<fs::path> folders_of(const char* variable) {
  const char* const value = std::getenv(variable);
  std::vector<fs::path> folders;
  const std::string text = value == nullptr ? "" : value;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    if (end > begin) folders.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return folders;
}

// The folders in a folder, sorted.
std::vector<fs::path> folders_in(const fs::path& folder) {
  std::error_code error, ignored;
  std::vector<fs::path> folders;
  std::size_t count = 0;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end && count < kMostEntries;
       entry.increment(error), ++count)
    if (entry->is_directory(ignored)) folders.push_back(entry->path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

// Adds the package.xml of a folder if there is one. Returns whether there is.
bool add_file_of(const fs::path& folder, std::vector<std::string>& files) {
  if (files.size() >= kMostFiles || !is_file(folder / kPackageFile)) return false;
  files.push_back((folder / kPackageFile).string());
  return true;
}

// The same for a folder and those below it, `depth` folders deep. A package has no package below it.
void add_files_below(const fs::path& folder, int depth, std::vector<std::string>& files) {
  if (add_file_of(folder, files) || depth == 0) return;
  for (const fs::path& below : folders_in(folder)) add_files_below(below, depth - 1, files);
}

// The name in a package.xml; empty if it is none.
std::string package_name(const std::string& file) {
  try {
    const std::string bytes = read_bytes(file, file, std::min(check_file(file, file), kMostBytes));
    tinyxml2::XMLDocument document;
    if (document.Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS) return {};
    const tinyxml2::XMLElement* const package = document.FirstChildElement("package");
    const tinyxml2::XMLElement* const name = package != nullptr ? package->FirstChildElement("name") : nullptr;
    const std::string text = name != nullptr && name->GetText() != nullptr ? name->GetText() : "";
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  } catch (const ImportError&) { return {}; }
}

}  // namespace

std::vector<std::string> package_files(const std::string& robot_path) {
  std::vector<std::string> files;
  const std::vector<fs::path> above = folders_above(robot_path);
  for (const fs::path& folder : above) add_file_of(folder, files);
  for (std::size_t f = 0; f < std::min(above.size(), kNearFolders); ++f) {
    const bool is_top = above[f] == above[f].root_path() || above[f].parent_path() == above[f].root_path();
    if (is_top) break;  // such as /home
    for (const fs::path& beside : folders_in(above[f])) add_file_of(beside, files);
  }
  for (const fs::path& folder : folders_of("ROS_PACKAGE_PATH")) add_files_below(folder, 2, files);
  return files;
}

PackageFolders read_packages(const std::vector<std::string>& files) {
  PackageFolders packages;
  for (const std::string& file : files)
    if (const std::string name = package_name(file); !name.empty())
      packages[name].push_back(fs::path(file).parent_path().string());
  return packages;
}

std::vector<std::string> folders_named(const std::string& package, const std::string& robot_path) {
  std::vector<std::string> folders;
  for (const fs::path& folder : folders_above(robot_path)) {
    if (folder.filename() == package) folders.push_back(folder.string());
    folders.push_back((folder / package).string());
  }
  return folders;
}

std::vector<std::string> installed_folders_named(const std::string& package) {
  std::vector<std::string> folders;
  for (const fs::path& prefix : folders_of("AMENT_PREFIX_PATH"))
    folders.push_back((prefix / "share" / package).string());
  for (const fs::path& folder : folders_of("ROS_PACKAGE_PATH")) {
    if (folder.filename() == package) folders.push_back(folder.string());
    folders.push_back((folder / package).string());
  }
  return folders;
}

}  // namespace cab::scenes
