// A Collada file on its way to assimp.
#include "scenes/import/collada_file.h"

#include "scenes/import/printable.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <unordered_map>

namespace cab::scenes {
namespace {

using Element = tinyxml2::XMLElement;

constexpr std::string_view kBlanks = " \t\r\n";

std::string attribute(const Element& element, const char* name) {
  const char* const value = element.Attribute(name);
  return value == nullptr ? std::string() : std::string(value);
}

std::string text_of(const Element& element) {
  const char* const text = element.GetText();
  return text == nullptr ? std::string() : std::string(text);
}

bool is(const Element& element, const char* name) { return std::strcmp(element.Name(), name) == 0; }

// The element after one in the text that is below `top`, or nullptr.
Element* next(Element* element, const Element* top) {
  if (Element* const child = element->FirstChildElement(); child != nullptr) return child;
  while (element != top) {
    if (Element* const sibling = element->NextSiblingElement(); sibling != nullptr) return sibling;
    tinyxml2::XMLNode* const parent = element->Parent();
    element = parent == nullptr ? nullptr : parent->ToElement();
    if (element == nullptr) break;
  }
  return nullptr;
}

void trim_attributes(Element& element) {
  for (const tinyxml2::XMLAttribute* one = element.FirstAttribute(); one != nullptr; one = one->Next()) {
    const std::string_view value = one->Value();
    const std::size_t begin = value.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) continue;
    const std::string trimmed(value.substr(begin, value.find_last_not_of(kBlanks) + 1 - begin));
    if (trimmed.size() < value.size()) element.SetAttribute(one->Name(), trimmed.c_str());
  }
}

// The elements of a document that others name.
class Ids {
 public:
  explicit Ids(Element& root, std::vector<std::string>& notes) {
    std::vector<Element*> without;
    std::vector<std::string> twice;
    for (Element* element = &root; element != nullptr; element = next(element, &root)) {
      const std::string id = attribute(*element, "id");
      if (id.empty() && is(*element, "node") && element->Attribute("sid") != nullptr) without.push_back(element);
      if (!id.empty() && !by_id_.try_emplace(id, element).second && is(*element, "node"))
        twice.push_back(printable(id));
    }
    if (!twice.empty())
      notes.push_back("warning: ids that several nodes have (" + listed(twice) + "): only one of them moves");
    for (Element* const node : without) {
      const std::string sid = attribute(*node, "sid");
      std::string id = sid;
      for (std::size_t& number = last_.try_emplace(sid, 1).first->second; !by_id_.try_emplace(id, node).second;)
        id = sid + "(" + std::to_string(++number) + ")";
      node->SetAttribute("id", id.c_str());
    }
  }

  // The element of a reference such as "#id"; nullptr if there is none.
  Element* named(const std::string& reference) const {
    if (reference.empty() || reference[0] != '#') return nullptr;
    const auto found = by_id_.find(reference.substr(1));
    return found == by_id_.end() ? nullptr : found->second;
  }

 private:
  std::unordered_map<std::string, Element*> by_id_;
  std::unordered_map<std::string, std::size_t> last_;  // numbers of made ids, by sid
};

// The names of the joints of a controller's skin by sid; nullptr if it has none.
Element* joint_names(const Ids& ids, const Element& instance) {
  const Element* const controller = ids.named(attribute(instance, "url"));
  const Element* const skin = controller == nullptr ? nullptr : controller->FirstChildElement("skin");
  const Element* const joints = skin == nullptr ? nullptr : skin->FirstChildElement("joints");
  if (joints == nullptr) return nullptr;
  for (const Element* input = joints->FirstChildElement("input"); input != nullptr;
       input = input->NextSiblingElement("input")) {
    if (attribute(*input, "semantic") != "JOINT") continue;
    Element* const source = ids.named(attribute(*input, "source"));
    return source == nullptr ? nullptr : source->FirstChildElement("Name_array");
  }
  return nullptr;
}

using IdsBySid = std::unordered_map<std::string, std::vector<std::string>>;

// Adds the ids of all nodes at and below a node by their sids, in the order of the text.
void add_sids(Element& top, IdsBySid& ids_of) {
  for (Element* element = &top; element != nullptr; element = next(element, &top))
    if (is(*element, "node") && element->Attribute("sid") != nullptr)
      ids_of[attribute(*element, "sid")].push_back(attribute(*element, "id"));
}

// The names of joints, each by its id. A sid is unique among the children of one node alone: the second time that it is
// named it means the second node that has it.
std::string by_id(const std::string& sids, const IdsBySid& ids_of) {
  std::unordered_map<std::string, std::size_t> times;
  std::string ids;
  for (std::size_t at = 0; (at = sids.find_first_not_of(kBlanks, at)) != std::string::npos;) {
    const std::size_t end = std::min(sids.find_first_of(kBlanks, at), sids.size());
    const std::string sid = sids.substr(at, end - at);
    const auto found = ids_of.find(sid);
    at = end;
    ids += ids.empty() ? "" : " ";
    ids += found == ids_of.end() ? sid : found->second[std::min(times[sid]++, found->second.size() - 1)];
  }
  return ids;
}

// Names the joints of every skin by id.
void name_joints(Element& root, const Ids& ids, std::vector<std::string>& notes) {
  std::unordered_map<const Element*, std::string> sids_of;  // of arrays whose names are changed already
  for (Element* element = &root; element != nullptr; element = next(element, &root)) {
    if (!is(*element, "instance_controller")) continue;
    Element* const names = joint_names(ids, *element);
    if (names == nullptr) continue;
    IdsBySid ids_of;
    for (const Element* skeleton = element->FirstChildElement("skeleton"); skeleton != nullptr;
         skeleton = skeleton->NextSiblingElement("skeleton"))
      if (Element* const top = ids.named(text_of(*skeleton)); top != nullptr) add_sids(*top, ids_of);
    if (ids_of.empty()) continue;
    const auto [sids, is_new] = sids_of.try_emplace(names, text_of(*names));
    const std::string changed = by_id(sids->second, ids_of);
    if (is_new)
      names->SetText(changed.c_str());
    else if (changed != text_of(*names))
      notes.push_back("warning: " + printable(attribute(*element, "url")) +
                      " is the skin of several skeletons: only the first moves it");
  }
}

}  // namespace

std::optional<std::string> collada_for_assimp(const std::string& text, std::vector<std::string>& notes) {
  tinyxml2::XMLDocument document(true, tinyxml2::COLLAPSE_WHITESPACE);
  document.Parse(text.data(), text.size());
  Element* const root = document.RootElement();
  if (document.Error() || root == nullptr) {
    notes.push_back("warning: its XML is read by assimp alone, which may take white space and joints of one name " +
                    ("wrong (line " + std::to_string(document.ErrorLineNum()) + ": ") + document.ErrorName() + ")");
    return {};
  }
  for (Element* element = root; element != nullptr; element = next(element, root)) trim_attributes(*element);
  name_joints(*root, Ids(*root, notes), notes);
  tinyxml2::XMLPrinter printer(nullptr, true);
  document.Print(&printer);
  return std::string(printer.CStr(), static_cast<std::size_t>(printer.CStrSize()) - 1);
}

}  // namespace cab::scenes
