// The text of an XML file, checked before other parsers see it, and the lines of its elements.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace cab::scenes {

class XmlText {
 public:
  // Reads and parses a file. Throws ImportError that names the file, and the line where the text is not XML.
  explicit XmlText(const std::string& path);
  ~XmlText();
  XmlText(const XmlText&) = delete;
  XmlText& operator=(const XmlText&) = delete;

  const std::string& path() const { return path_; }
  std::size_t byte_count() const { return byte_count_; }
  const tinyxml2::XMLElement& root() const;

  // The path, printable, and the line of an element below the root, by its tag and its attribute `name`:
  // "FILE: line N". Without such an element the path alone.
  std::string place_of(const std::string& tag, const std::string& name) const;

  // The same for the first link or joint whose name a message of a parser quotes, as [NAME] or 'NAME'.
  std::string place_in(const std::string& message) const;

 private:
  std::string path_;
  std::string printable_path_;
  std::size_t byte_count_ = 0;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  std::map<std::pair<std::string, std::string>, int> lines_;  // by tag and name
};

// The value of an attribute; empty without it.
std::string text_of(const tinyxml2::XMLElement& element, const char* name);

// Elements by name: how many there are, and the line of the first.
struct SeenElements {
  struct Seen {
    std::size_t count = 0;
    int first_line = 0;
  };
  std::map<std::string, Seen> by_name;

  void add(const tinyxml2::XMLElement& element);

  // "<NAME> (COUNT, the first in line N), ..."; empty if there is none.
  std::string words() const;
};

// Throws ImportError if there is an element of xacro, which stands for others.
void refuse_xacro(const XmlText& text);

// Whether the name of an element says that it is about collisions.
bool is_about_collisions(const std::string& name);

// A note that names the elements below the root, at any depth if `deep`, whose names are about collisions and that are
// not among `read`. Empty if there is none.
std::string unread_about_collisions(const XmlText& text, const std::vector<std::string>& read, bool deep);

}  // namespace cab::scenes
