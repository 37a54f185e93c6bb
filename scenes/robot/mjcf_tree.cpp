#include "scenes/robot/mjcf_tree.h"

#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"

#include <tinyxml2.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace cab::scenes {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

constexpr std::size_t kMaxIncludes = 100;
constexpr std::size_t kMaxIncludedBytes = std::size_t{32} << 20;
constexpr std::size_t kMaxDepth = 90;  // tinyxml2 reads 100, with what the text has about it

// How many folders above that of the file are open to it without a package.
constexpr int kFoldersAbove = 2;

// What an MJCF file names and libmujoco reads.
constexpr const char* kOpenedExtensions[] = {".stl", ".obj", ".msh", ".xml", ".mjcf"};

fs::path full_path(const fs::path& path) {
  std::error_code ignored;
  return fs::absolute(path, ignored).lexically_normal();
}

bool is_below(const fs::path& file, const fs::path& folder) {
  std::string start = full_path(folder).string();
  if (start.empty() || start.back() != '/') start += '/';
  return full_path(file).string().compare(0, start.size(), start) == 0;
}

bool is(const XMLElement& element, const char* name) { return element.Name() == std::string(name); }

}  // namespace

MjcfTree::MjcfTree(const XmlText& main, OnError on_error)
    : main_(main), on_error_(on_error), folder_(fs::path(main.path()).parent_path()) {
  seen_.insert(full_path(main.path()).string());
  include_below(main.root(), 0);
  for (const XMLElement* section : children(root()))
    if (is(*section, "compiler"))
      for (const tinyxml2::XMLAttribute* a = section->FirstAttribute(); a != nullptr; a = a->Next())
        settings_[a->Name()] = a->Value();
}

std::vector<const XMLElement*> MjcfTree::children(const XMLElement& parent) const {
  std::vector<const XMLElement*> found;
  add_children(parent, found);
  return found;
}

void MjcfTree::add_children(const XMLElement& parent, std::vector<const XMLElement*>& found) const {
  for (const XMLElement* child = parent.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    const auto file = included_.find(child);
    if (file != included_.end()) {
      add_children(*file->second, found);
    } else if (!is(*child, "include")) {
      found.push_back(child);
    }
  }
}

void MjcfTree::include_below(const XMLElement& parent, std::size_t depth) {
  if (depth > kMaxDepth)
    throw ImportError(place_of(parent) + ": elements nest deeper than " + std::to_string(kMaxDepth));
  for (const XMLElement* child = parent.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (!is(*child, "include")) {
      include_below(*child, depth + 1);
      continue;
    }
    try {
      include(*child, depth);
    } catch (const ImportError&) {
      if (on_error_ == OnError::kThrow) throw;
    }
  }
}

// MuJoCo looks beside the main file, then beside the file that includes.
void MjcfTree::include(const XMLElement& element, std::size_t depth) {
  const std::string place = place_of(element) + ": <include>";
  const std::string name = text_of(element, "file");
  if (name.empty()) throw ImportError(place + " without a file");
  if (element.FirstChildElement() != nullptr) throw ImportError(place + " cannot have elements");
  fs::path path = folder_ / name;
  if (!is_file(path) && is_file(folder_of(element) / name)) path = folder_of(element) / name;
  if (paths_.size() == kMaxIncludes)
    throw ImportError(place + ": more than " + std::to_string(kMaxIncludes) + " included files");
  if (!seen_.insert(full_path(path).string()).second)
    throw ImportError(place + ": " + printable(name) + " is included already");
  paths_.push_back(path.string());
  require_mjcf_file(path.string(), place);
  try {
    files_.push_back(std::make_unique<XmlText>(path.string()));
  } catch (const ImportError& error) { throw ImportError(place + ": " + error.what()); }
  const XmlText& file = *files_.back();
  bytes_ += file.byte_count();
  if (bytes_ > kMaxIncludedBytes)
    throw ImportError(place + ": included files are larger than " + std::to_string(kMaxIncludedBytes >> 20) + " MiB");
  names_.emplace(file.root().GetDocument(), path.string());
  include_below(file.root(), depth);
  included_.emplace(&element, &file.root());
}

std::string MjcfTree::file_of(const XMLElement& element) const {
  const auto file = names_.find(element.GetDocument());
  return printable(main_.path()) + (file == names_.end() ? std::string() : ": in " + printable(file->second));
}

std::string MjcfTree::place_of(const XMLElement& element) const {
  return file_of(element) + ": line " + std::to_string(element.GetLineNum());
}

fs::path MjcfTree::folder_of(const XMLElement& element) const {
  const auto file = names_.find(element.GetDocument());
  return file == names_.end() ? folder_ : fs::path(file->second).parent_path();
}

std::string MjcfTree::setting(const std::string& name) const {
  const auto found = settings_.find(name);
  return found == settings_.end() ? std::string() : found->second;
}

std::string MjcfTree::mesh_path(const XMLElement& mesh) const {
  fs::path name = text_of(mesh, "file");
  if (setting("strippath") == "true") name = name.filename();
  const fs::path path = folder_ / setting(settings_.count("meshdir") != 0 ? "meshdir" : "assetdir") / name;
  const fs::path beside = folder_of(mesh) / name;
  return full_path(!is_file(path) && is_file(beside) ? beside : path).string();
}

void require_mjcf_file(const std::string& path, const std::string& place) {
  if (!is_file(path)) throw ImportError(place + ": no such file: " + printable(path));
  if (!std::ifstream(path, std::ios::binary))
    throw ImportError(place + ": " + printable(path) +
                      " is there, but the process that reads files may not open it; --root DIR opens a folder");
}

std::vector<std::string> mjcf_files(const XmlText& text) {
  std::set<std::string> files;
  if (!is(text.root(), "mujoco")) return {};
  try {
    const MjcfTree tree(text, MjcfTree::OnError::kPassOver);
    files.insert(tree.included_paths().begin(), tree.included_paths().end());
    for (const XMLElement* section : tree.children(tree.root()))
      if (is(*section, "asset"))
        for (const XMLElement* child : tree.children(*section))
          if (is(*child, "mesh") && child->Attribute("file") != nullptr) files.insert(tree.mesh_path(*child));
  } catch (const ImportError&) { return {}; }  // the process that reads the file says what is wrong
  std::vector<std::string> there;
  std::copy_if(files.begin(), files.end(), std::back_inserter(there), is_file);
  return there;
}

bool may_open_for_mjcf(const std::string& file, const std::string& path, const RobotOptions& options) {
  const std::string extension = lower_extension(file);
  if (std::find(std::begin(kOpenedExtensions), std::end(kOpenedExtensions), extension) == std::end(kOpenedExtensions))
    return false;
  if (!options.root.empty() && is_below(file, options.root)) return true;
  fs::path folder = full_path(path).parent_path();
  bool is_in_package = false;
  for (int above = 0; folder != folder.root_path(); ++above, folder = folder.parent_path()) {
    const bool is_package = !is_in_package && is_file(folder / "package.xml");
    is_in_package = is_in_package || is_package;
    if ((above <= kFoldersAbove || is_package) && is_below(file, folder)) return true;
    if (above >= kFoldersAbove && is_in_package) return false;
  }
  return false;
}

}  // namespace cab::scenes
