// An MJCF file and those that it includes, and which files a child process may open for them.
#pragma once

#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace cab::scenes {

// A file and those that it includes, as one tree. The main text must outlive it.
class MjcfTree {
 public:
  enum class OnError : std::uint8_t {
    kThrow,
    kPassOver,  // an included file that is not there, cannot be opened or is not XML has no elements
  };

  // Throws ImportError.
  MjcfTree(const XmlText& main, OnError on_error);

  const tinyxml2::XMLElement& root() const { return main_.root(); }

  // The elements below another; instead of an <include> those of its file.
  std::vector<const tinyxml2::XMLElement*> children(const tinyxml2::XMLElement& parent) const;

  // Where an element is written: "robot.xml" or "robot.xml: in arm.xml"; the same with ": line 12".
  std::string file_of(const tinyxml2::XMLElement& element) const;
  std::string place_of(const tinyxml2::XMLElement& element) const;

  // What <compiler> says; of several values the last one. Empty: nothing.
  std::string setting(const std::string& name) const;

  // The path of a <mesh>'s file, there or not: in the folder of meshes, else beside the file that names it.
  std::string mesh_path(const tinyxml2::XMLElement& mesh) const;

  const std::vector<std::string>& included_paths() const { return paths_; }

 private:
  void add_children(const tinyxml2::XMLElement& parent, std::vector<const tinyxml2::XMLElement*>& found) const;
  void include_below(const tinyxml2::XMLElement& parent, std::size_t depth);
  void include(const tinyxml2::XMLElement& element, std::size_t depth);
  std::filesystem::path folder_of(const tinyxml2::XMLElement& element) const;

  const XmlText& main_;
  const OnError on_error_;
  std::filesystem::path folder_;  // of the main file
  std::set<std::string> seen_;    // full paths of all files
  std::vector<std::string> paths_;
  std::size_t bytes_ = 0;
  std::vector<std::unique_ptr<XmlText>> files_;
  std::map<const tinyxml2::XMLElement*, const tinyxml2::XMLElement*> included_;  // by <include>: the root of its file
  std::map<const tinyxml2::XMLDocument*, std::string> names_;                    // paths of included files
  std::map<std::string, std::string> settings_;
};

// Throws ImportError that begins with `place`, unless the file at `path` is there and can be opened.
void require_mjcf_file(const std::string& path, const std::string& place);

// The files that a text includes, as far as they can be opened, and the meshes that they name: the paths of those that
// are there. What is wrong with the text is passed over.
std::vector<std::string> mjcf_files(const XmlText& text);

// Whether a child process may open a file that the MJCF file at `path` names: a mesh or an MJCF file that is below the
// folder of that file or below the two above it, in its package (the nearest folder above with a package.xml), or
// below options.root.
bool may_open_for_mjcf(const std::string& file, const std::string& path, const RobotOptions& options);

}  // namespace cab::scenes
