// Disabled pairs of links from SRDF.
#include "scenes/import/in_child.h"
#include "scenes/import/printable.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/robot_payload.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <set>

namespace cab::scenes {
namespace {

DisabledPairs read_here(const std::string& path, const Robot& robot) {
  const XmlText text(path);
  const std::string name = printable(path);
  if (text.root().Name() != std::string("robot"))
    throw ImportError(name + ": line " + std::to_string(text.root().GetLineNum()) + ": the first element is <" +
                      printable(text.root().Name()) + ">, but SRDF begins with <robot>");
  std::map<std::string, std::uint32_t> links;
  for (std::uint32_t l = 0; l < robot.body.link_names.size(); ++l) links.emplace(robot.body.link_names[l], l);

  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  std::set<std::string> unknown;
  for (const tinyxml2::XMLElement* element = text.root().FirstChildElement("disable_collisions"); element != nullptr;
       element = element->NextSiblingElement("disable_collisions")) {
    std::uint32_t found[2] = {0, 0};
    bool known = true;
    for (std::size_t k = 0; k < 2; ++k) {
      const char* const attribute = k == 0 ? "link1" : "link2";
      const char* const link = element->Attribute(attribute);
      if (link == nullptr)
        throw ImportError(name + ": line " + std::to_string(element->GetLineNum()) + ": <disable_collisions> without " +
                          attribute);
      const auto at = links.find(printable(link));
      if (at == links.end()) unknown.insert(printable(link));
      known = known && at != links.end();
      if (known) found[k] = at->second;
    }
    if (known && found[0] != found[1]) pairs.emplace(std::min(found[0], found[1]), std::max(found[0], found[1]));
  }
  DisabledPairs result;
  for (const std::string& link : unknown) result.notes.push_back(name + ": the robot has no link " + link);
  for (const auto& [a, b] : pairs) result.pairs.push_back({a, b});
  return result;
}

}  // namespace

DisabledPairs read_disabled_pairs(const std::string& path, const Robot& robot,
                                  const std::optional<SandboxLimits>& sandbox) {
  if (!sandbox) return read_here(path, robot);
  return from_child(
      path, *sandbox, [&] { return disabled_pairs_payload(read_here(path, robot)); },
      [&](const std::string& bytes) { return read_disabled_pairs_payload(bytes, robot); });
}

}  // namespace cab::scenes
