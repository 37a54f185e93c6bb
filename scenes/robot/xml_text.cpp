// The text of an XML file, checked before other parsers see it, and the lines of its elements.
#include "scenes/robot/xml_text.h"

#include "scenes/import/import.h"
#include "scenes/import/input_file.h"
#include "scenes/import/printable.h"

#include <tinyxml2.h>

namespace cab::scenes {
namespace {

// A parser's tree takes some ten times the bytes of the text.
constexpr std::size_t kMaxXmlBytes = std::size_t{16} << 20;

}  // namespace

XmlText::XmlText(const std::string& path)
    : path_(path), printable_path_(printable(path)), document_(std::make_unique<tinyxml2::XMLDocument>()) {
  const std::size_t size = check_file(path, printable_path_);
  if (size > kMaxXmlBytes)
    throw ImportError(printable_path_ + ": the file is larger than " + std::to_string(kMaxXmlBytes >> 20) + " MiB");
  bytes_ = read_bytes(path, printable_path_, size);
  if (bytes_.find('\0') != std::string::npos) throw ImportError(printable_path_ + ": a zero byte is not XML");
  if (document_->Parse(bytes_.data(), bytes_.size()) != tinyxml2::XML_SUCCESS)
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

}  // namespace cab::scenes
