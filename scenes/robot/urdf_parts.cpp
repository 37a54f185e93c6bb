#include "scenes/robot/urdf_parts.h"

#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "scenes/import/words.h"
#include "scenes/scene.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string_view>

namespace cab::scenes {
namespace {

using tinyxml2::XMLElement;

// The joint above a link.
struct JointAbove {
  std::string name;
  std::string parent;  // the link above the joint
  std::string line;    // of the joint, with its file
};

// Throws if a link is above itself. urdfdom would never free such links.
void check_loops(const std::map<std::string, JointAbove>& above) {
  for (const auto& [link, joint] : above) {
    std::size_t steps = 0;
    for (auto at = above.find(joint.parent); at != above.end(); at = above.find(at->second.parent))
      if (++steps > above.size())
        throw ImportError(joint.line + ": joint " + printable(joint.name) + ": link " + printable(link) +
                          " is in or below a loop of joints");
  }
}

// An attribute with numbers as XML reads it: white space is blanks. urdfdom takes one blank for a separator and a tab
// for a part of a number.
std::string numbers_of(const char* text) {
  std::string numbers;
  for (const char* at = text; *at != '\0'; ++at) {
    if (std::strchr(" \t\r\n", *at) == nullptr) {
      numbers += *at;
    } else if (!numbers.empty() && numbers.back() != ' ') {
      numbers += ' ';
    }
  }
  if (!numbers.empty() && numbers.back() == ' ') numbers.pop_back();
  return numbers;
}

void copy_numbers(const XMLElement& from, XMLElement& to, std::initializer_list<const char*> names) {
  for (const char* const name : names)
    if (const char* const value = from.Attribute(name)) to.SetAttribute(name, numbers_of(value).c_str());
}

void copy_texts(const XMLElement& from, XMLElement& to, std::initializer_list<const char*> names) {
  for (const char* const name : names)
    if (const char* const value = from.Attribute(name)) to.SetAttribute(name, value);
}

class PartsReader {
 public:
  explicit PartsReader(const XmlText& text) : text_(text) {}

  UrdfParts read() {
    refuse_xacro(text_);
    const XMLElement& root = text_.root();
    const char* const version = root.Attribute("version");
    if (version != nullptr && *version != '1') fail(root, "version " + printable(version) + " of URDF is not read");
    XMLElement& robot = *to_.NewElement("robot");
    to_.InsertEndChild(&robot);
    const char* const name = root.Attribute("name");
    robot.SetAttribute("name", name != nullptr && *name != '\0'
                                   ? name
                                   : printable(std::filesystem::path(text_.path()).stem().string()).c_str());
    look_for_unread(root, {"link", "joint"});
    for (const XMLElement* element = root.FirstChildElement(); element != nullptr;
         element = element->NextSiblingElement()) {
      if (std::strcmp(element->Name(), "link") == 0) copy_link(*element, robot);
      if (std::strcmp(element->Name(), "joint") == 0) copy_joint(*element, robot);
    }
    check_loops(above_);
    if (!only_seen_.empty())
      parts_.notes.push_back("links with a visual but no collision shape, which nothing tests: " +
                             std::to_string(only_seen_.size()) + ": " + listed(only_seen_));
    if (const std::string unread = unread_about_collisions(text_, {}, false); !unread.empty())
      parts_.notes.push_back(unread);
    if (const std::string words = unread_.words(); !words.empty())
      parts_.notes.push_back(printable(text_.path()) + ": not known to URDF, and not read: " + words);
    tinyxml2::XMLPrinter printer;
    to_.Print(&printer);
    parts_.text = printer.CStr();
    return std::move(parts_);
  }

 private:
  std::string line_of(const XMLElement& element) const {
    return printable(text_.path()) + ": line " + std::to_string(element.GetLineNum());
  }

  [[noreturn]] void fail(const XMLElement& element, const std::string& reason) const {
    throw ImportError(line_of(element) + ": " + reason);
  }

  void guess(const std::string& note) {
    ++parts_.guess_count;
    parts_.notes.push_back(note);
  }

  // The name of a link or joint.
  std::string name_of(const XMLElement& element) const {
    const char* const name = element.Attribute("name");
    if (name == nullptr || *name == '\0') fail(element, std::string("a <") + element.Name() + "> without a name");
    return name;
  }

  // Notes the elements directly in another that differ from `known` ones by upper and lower case alone, and below the
  // root those about collisions.
  void look_for_unread(const XMLElement& above, std::initializer_list<std::string_view> known) {
    const auto is_known = [&](std::string_view name) {
      return std::find(known.begin(), known.end(), name) != known.end();
    };
    for (const XMLElement* element = above.FirstChildElement(); element != nullptr;
         element = element->NextSiblingElement()) {
      const std::string name = element->Name();
      if (!is_known(name) && (is_known(lower_case(name)) || (&above != &text_.root() && is_about_collisions(name))))
        unread_.add(*element);
    }
  }

  static XMLElement& add(XMLElement& to, const char* name) { return *to.InsertNewChildElement(name); }

  void copy_origin(const XMLElement& from, XMLElement& to) const {
    const XMLElement* const origin = from.FirstChildElement("origin");
    if (origin == nullptr) return;
    if (origin->Attribute("quat_xyzw") != nullptr)
      fail(*origin, "an origin with quat_xyzw, of URDF 1.1, is not read; write rpy");
    copy_numbers(*origin, add(to, "origin"), {"xyz", "rpy"});
  }

  void copy_link(const XMLElement& from, XMLElement& robot) {
    if (++link_count_ > kMaxLinks) fail(from, "more than " + std::to_string(kMaxLinks) + " links");
    const std::string name = name_of(from);
    XMLElement& link = add(robot, "link");
    link.SetAttribute("name", name.c_str());
    look_for_unread(from, {"collision", "inertial", "visual"});
    std::size_t number = 0;
    for (const XMLElement* element = from.FirstChildElement("collision"); element != nullptr;
         element = element->NextSiblingElement("collision"))
      copy_collision(*element, link, name, number++);
    if (number == 0 && from.FirstChildElement("visual") != nullptr) only_seen_.push_back(printable(name));
  }

  void copy_collision(const XMLElement& from, XMLElement& link, const std::string& name, std::size_t number) {
    const std::string source = "link " + printable(name) + ": collision " + std::to_string(number + 1);
    XMLElement& to = add(link, "collision");
    look_for_unread(from, {"geometry", "origin"});
    copy_origin(from, to);
    const XMLElement* const geometry = from.FirstChildElement("geometry");
    const XMLElement* const shape = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
    if (shape == nullptr) fail(from, source + ": it has no shape");
    if (shape->NextSiblingElement() != nullptr || geometry->NextSiblingElement("geometry") != nullptr)
      fail(from, source + ": it has more than one shape");
    const std::string kind = shape->Name();
    const bool is_capsule = kind == "capsule" || kind == "drake:capsule";
    if (is_capsule) parts_.capsules.emplace(name, number);
    if (!is_capsule && kind != "box" && kind != "sphere" && kind != "cylinder" && kind != "mesh")
      fail(*shape, source + ": <" + printable(kind) + "> is none of box, sphere, cylinder, capsule and mesh");
    XMLElement& copy = add(add(to, "geometry"), is_capsule ? "cylinder" : kind.c_str());
    if (kind != "mesh") {
      copy_numbers(*shape, copy, {"size", "radius", "length"});
      return;
    }
    copy_texts(*shape, copy, {"filename"});
    if (shape->Attribute("scale") == nullptr) return;
    const std::string scale = numbers_of(shape->Attribute("scale"));
    const bool is_one = scale.find(' ') == std::string::npos;
    copy.SetAttribute("scale", (is_one ? scale + " " + scale + " " + scale : scale).c_str());
    if (is_one) guess(line_of(*shape) + ": " + source + ": its scale is one number, which is taken for all three axes");
  }

  void copy_joint(const XMLElement& from, XMLElement& robot) {
    const std::string name = name_of(from);
    const std::string source = "joint " + printable(name);
    const auto link_of = [&](const char* tag) {
      const XMLElement* const end = from.FirstChildElement(tag);
      return end != nullptr ? end->Attribute("link") : nullptr;
    };
    const char* const child = link_of("child");
    const char* const parent = link_of("parent");
    if (child == nullptr || parent == nullptr) fail(from, source + ": it has no parent or no child");
    if (above_.size() > kMaxLinks) fail(from, "more than " + std::to_string(kMaxLinks) + " joints");
    const auto [other, is_new] = above_.emplace(child, JointAbove{name, parent, line_of(from)});
    if (!is_new && other->second.name != name)
      fail(from, "link " + printable(child) + " is the child of two joints, " + printable(other->second.name) +
                     " and " + printable(name));

    look_for_unread(from, {"axis", "child", "limit", "mimic", "origin", "parent"});
    XMLElement& joint = add(robot, "joint");
    copy_texts(from, joint, {"name", "type"});
    add(joint, "parent").SetAttribute("link", parent);
    add(joint, "child").SetAttribute("link", child);
    copy_origin(from, joint);
    const std::string type = from.Attribute("type") != nullptr ? from.Attribute("type") : "";
    const bool has_limit = type == "revolute" || type == "prismatic";
    if (!has_limit && type != "continuous") return;  // it does not move, or is none that urdfdom knows
    if (const XMLElement* const axis = from.FirstChildElement("axis")) copy_numbers(*axis, add(joint, "axis"), {"xyz"});
    if (has_limit) copy_limit(from, joint, source);
    if (const XMLElement* const mimic = from.FirstChildElement("mimic")) {
      XMLElement& copy = add(joint, "mimic");
      copy_texts(*mimic, copy, {"joint"});
      copy_numbers(*mimic, copy, {"multiplier", "offset"});
    }
  }

  void copy_limit(const XMLElement& from, XMLElement& joint, const std::string& source) {
    const XMLElement* const limit = from.FirstChildElement("limit");
    if (limit == nullptr) fail(from, source + ": it is " + from.Attribute("type") + " and has no <limit>");
    XMLElement& copy = add(joint, "limit");
    copy_numbers(*limit, copy, {"lower", "upper"});
    for (const char* const needed : {"effort", "velocity"}) copy.SetAttribute(needed, "0");  // by urdfdom
    if (limit->Attribute("lower") == nullptr && limit->Attribute("upper") == nullptr)
      guess(line_of(*limit) + ": " + source +
            " has no lower and no upper limit, which URDF takes for 0: it stands still");
  }

  const XmlText& text_;
  tinyxml2::XMLDocument to_;
  UrdfParts parts_;
  std::size_t link_count_ = 0;
  std::map<std::string, JointAbove> above_;  // of each child link
  std::vector<std::string> only_seen_;       // links with visuals alone
  SeenElements unread_;
};

}  // namespace

UrdfParts urdf_parts(const XmlText& text) { return PartsReader(text).read(); }

}  // namespace cab::scenes
