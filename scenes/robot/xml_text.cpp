// The text of an XML file, checked before other parsers see it, and the lines of its elements.
#include "scenes/robot/xml_text.h"

#include "scenes/import/import.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"
#include "scenes/import/words.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

namespace cab::scenes {
namespace {

// A parser's tree takes some ten times the bytes of the text.
constexpr std::size_t kMaxXmlBytes = std::size_t{16} << 20;

// The first element of xacro in an element, which may be that itself. Elements nest as deep as tinyxml2 allows.
const tinyxml2::XMLElement* find_xacro(const tinyxml2::XMLElement& element) {
  if (std::strncmp(element.Name(), "xacro:", 6) == 0) return &element;
  for (const tinyxml2::XMLElement* child = element.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement())
    if (const tinyxml2::XMLElement* const found = find_xacro(*child)) return found;
  return nullptr;
}

// Counts elements about collisions among the children of an element, and below those. Elements nest as deep as tinyxml2
// allows.
void count_unread(const tinyxml2::XMLElement& above, const std::vector<std::string>& read, bool deep,
                  SeenElements& unread) {
  for (const tinyxml2::XMLElement* element = above.FirstChildElement(); element != nullptr;
       element = element->NextSiblingElement()) {
    const bool is_read = std::find(read.begin(), read.end(), element->Name()) != read.end();
    if (!is_read && is_about_collisions(element->Name())) unread.add(*element);
    if (deep) count_unread(*element, {}, deep, unread);  // what is read is read below the root alone
  }
}

}  // namespace

XmlText::XmlText(const std::string& path)
    : path_(path), printable_path_(printable(path)), document_(std::make_unique<tinyxml2::XMLDocument>()) {
  const std::size_t size = check_file(path, printable_path_);
  if (size > kMaxXmlBytes)
    throw ImportError(printable_path_ + ": the file is larger than " + std::to_string(kMaxXmlBytes >> 20) + " MiB");
  const std::string bytes = read_bytes(path, printable_path_, size);
  if (bytes.find('\0') != std::string::npos) throw ImportError(printable_path_ + ": a zero byte is not XML");
  byte_count_ = bytes.size();
  if (document_->Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS)
    throw ImportError(printable_path_ + ": line " + std::to_string(document_->ErrorLineNum()) +
                      ": not well-formed XML (" + tinyxml2::XMLDocument::ErrorIDToName(document_->ErrorID()) + ")");
  if (document_->RootElement() == nullptr) throw ImportError(printable_path_ + ": no XML element");
  for (const tinyxml2::XMLElement* element = root().FirstChildElement(); element != nullptr;
       element = element->NextSiblingElement())
    if (const char* const name = element->Attribute("name"))
      lines_.emplace(std::pair(element->Name(), name), element->GetLineNum());
}

XmlText::~XmlText() = default;

const tinyxml2::XMLElement& XmlText::root() const { return *document_->RootElement(); }

std::string XmlText::place_of(const std::string& tag, const std::string& name) const {
  const auto found = lines_.find({tag, name});
  return found == lines_.end() ? printable_path_ : printable_path_ + ": line " + std::to_string(found->second);
}

std::string XmlText::place_in(const std::string& message) const {
  for (std::size_t begin = 0; begin < message.size(); ++begin) {
    if (message[begin] != '[' && message[begin] != '\'') continue;
    const std::size_t end = message.find(message[begin] == '[' ? ']' : '\'', begin + 1);
    if (end == std::string::npos) continue;
    const std::string name = message.substr(begin + 1, end - begin - 1);
    for (const char* tag : {"joint", "link"})
      if (lines_.count({tag, name}) != 0) return place_of(tag, name);
  }
  return printable_path_;
}

std::string text_of(const tinyxml2::XMLElement& element, const char* name) {
  const char* const value = element.Attribute(name);
  return value == nullptr ? std::string() : value;
}

bool is_about_collisions(const std::string& name) {
  return lower_case(name).find("collision") != std::string::npos || name == "link_sphere_approximation";
}

void SeenElements::add(const tinyxml2::XMLElement& element) {
  Seen& seen = by_name[element.Name()];
  if (seen.count++ == 0) seen.first_line = element.GetLineNum();
}

std::string SeenElements::words() const {
  std::vector<std::string> names;
  for (const auto& [name, seen] : by_name)
    names.push_back("<" + printable(name) + "> (" + std::to_string(seen.count) + ", the first in line " +
                    std::to_string(seen.first_line) + ")");
  return listed(names);
}

void refuse_xacro(const XmlText& text) {
  if (const tinyxml2::XMLElement* const found = find_xacro(text.root()))
    throw ImportError(printable(text.path()) + ": line " + std::to_string(found->GetLineNum()) + ": <" +
                      printable(found->Name()) + "> is of xacro; let xacro expand the file first");
}

std::string unread_about_collisions(const XmlText& text, const std::vector<std::string>& read, bool deep) {
  SeenElements unread;
  count_unread(text.root(), read, deep, unread);
  const std::string words = unread.words();
  return words.empty() ? words : printable(text.path()) + ": not read, though about collisions: " + words;
}

}  // namespace cab::scenes
