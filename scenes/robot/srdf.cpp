// Disabled pairs of links from SRDF.
#include "scenes/import/printable.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <set>

namespace cab::scenes {

std::vector<LinkPair> read_disabled_pairs(const std::string& path, const Robot& robot,
                                          std::vector<std::string>* notes) {
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
  for (const std::string& link : unknown) notes->push_back(name + ": the robot has no link " + link);
  std::vector<LinkPair> result;
  for (const auto& [a, b] : pairs) result.push_back({a, b});
  return result;
}

}  // namespace cab::scenes
