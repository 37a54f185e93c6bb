// Disabled pairs of links from SRDF.
#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

namespace cab::scenes {
namespace {

using tinyxml2::XMLElement;
using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

class SrdfReader {
 public:
  SrdfReader(const std::string& path, const Robot& robot)
      : text_(path),
        name_(printable(path)),
        link_count_(static_cast<std::uint32_t>(robot.links.size())),
        robot_name_(robot.body.name) {
    for (std::uint32_t l = 0; l < link_count_; ++l) links_.emplace(robot.body.link_names[l], l);
  }

  DisabledPairs read() {
    if (text_.root().Name() != std::string("robot"))
      fail(text_.root(), "the first element is <" + printable(text_.root().Name()) + ">, but SRDF begins with <robot>");
    refuse_xacro(text_);
    const Pairs enabled = pairs_of("enable_collisions"), disabled = pairs_of("disable_collisions");
    Pairs masked = disabled;
    for (const XMLElement* element = first("disable_default_collisions"); element != nullptr;
         element = element->NextSiblingElement(element->Name())) {
      const std::optional<std::uint32_t> link = link_of(*element, "link");
      for (std::uint32_t other = 0; link && other < link_count_; ++other) {
        const auto pair = std::minmax(*link, other);
        if (other != *link && enabled.count(pair) == 0) masked.insert(pair);
      }
    }
    DisabledPairs result;
    const char* const model = text_.root().Attribute("name");
    if (model != nullptr && printable(model) != robot_name_)
      result.notes.push_back(name_ + ": it is for the robot " + brief(printable(model)) + ", and this one is " +
                             robot_name_);
    if (!unknown_.empty())
      result.notes.push_back(name_ + ": the robot has no link" + (unknown_.size() > 1 ? "s " : " ") +
                             listed({unknown_.begin(), unknown_.end()}));
    const std::string unread =
        unread_about_collisions(text_, {"disable_collisions", "enable_collisions", "disable_default_collisions"}, true);
    if (!unread.empty()) result.notes.push_back(unread);
    for (std::string& note : result.notes) note = brief(note);
    for (const auto& [a, b] : masked) result.pairs.push_back({a, b});
    return result;
  }

 private:
  [[noreturn]] void fail(const XMLElement& element, const std::string& reason) const {
    throw ImportError(name_ + ": line " + std::to_string(element.GetLineNum()) + ": " + reason);
  }

  const XMLElement* first(const char* tag) const { return text_.root().FirstChildElement(tag); }

  // The link that an attribute names, without blanks around it; nothing if the robot lacks it.
  std::optional<std::uint32_t> link_of(const XMLElement& element, const char* attribute) {
    const char* const value = element.Attribute(attribute);
    if (value == nullptr) fail(element, std::string("<") + element.Name() + "> without " + attribute);
    const std::string name = value;
    const std::size_t begin = std::min(name.find_first_not_of(" \t\r\n"), name.size());
    const std::string link = printable(name.substr(begin, name.find_last_not_of(" \t\r\n") + 1 - begin));
    const auto found = links_.find(link);
    if (found != links_.end()) return found->second;
    unknown_.insert(link);
    return {};
  }

  Pairs pairs_of(const char* tag) {
    Pairs pairs;
    for (const XMLElement* element = first(tag); element != nullptr; element = element->NextSiblingElement(tag)) {
      const std::optional<std::uint32_t> a = link_of(*element, "link1"), b = link_of(*element, "link2");
      if (a && b && a != b) pairs.insert(std::minmax(*a, *b));
    }
    return pairs;
  }

  const XmlText text_;
  const std::string name_;
  const std::uint32_t link_count_;
  const std::string robot_name_;
  std::map<std::string, std::uint32_t> links_;
  std::set<std::string> unknown_;
};

}  // namespace

DisabledPairs read_disabled_pairs(const std::string& path, const Robot& robot,
                                  const std::optional<SandboxLimits>& sandbox) {
  if (!sandbox) return SrdfReader(path, robot).read();
  return from_child(
      path, *sandbox, [&] { return disabled_pairs_payload(SrdfReader(path, robot).read()); },
      [&](const std::string& bytes) { return read_disabled_pairs_payload(bytes, robot); });
}

}  // namespace cab::scenes
