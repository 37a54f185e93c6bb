#include "scenes/robot/mjcf_words.h"

#include <algorithm>
#include <iterator>

namespace cab::scenes {
namespace {

// Words are separated by blanks.
struct Words {
  const char* read = "";
  const char* cut = "";
  const char* refused = "";
};

struct Element {
  const char* name;
  Words attributes;
  Words children;
};

// Elements that are cut whole, such as <sensor>, have no row: nobody looks inside. <inertial> is read where coordinates
// are global.
constexpr Element kElements[] = {
    {"mujoco",
     {"model"},
     {"asset compiler contact default deformable option worldbody",
      "actuator custom equality extension keyframe sensor size statistic tendon visual"}},
    {"compiler",
     {"angle assetdir autolimits coordinate eulerseq exactmeshinertia fitaabb meshdir strippath",
      "alignfree balanceinertia boundinertia boundmass conflict convexhull discardvisual fusestatic "
      "inertiafromgeom inertiagrouprange saveinertial settotalmass texturedir usethread"},
     {"", "lengthrange"}},
    {"default",
     {"class"},
     {"default geom joint mesh",
      "adhesion camera cylinder damper dcmotor equality general intvelocity light material motor muscle orientation "
      "pair pid plugin position site tendon velocity"}},
    {"asset", {}, {"mesh hfield", "material model skin texture"}},
    {"mesh",
     {"class face file name refpos refquat scale vertex",
      "content_type inertia material maxhullvert normal smoothnormal texcoord", "builtin params"},
     {"", "", "plugin"}},
    {"deformable", {}, {"", "skin", "flex"}},
    {"worldbody", {}, {"body composite frame geom replicate", "camera inertial light plugin site", "attach flexcomp"}},
    {"body",
     {"axisangle childclass euler mocap name pos quat xyaxes zaxis", "gravcomp simple sleep user"},
     {"body composite frame freejoint geom joint replicate", "camera inertial light plugin site", "attach flexcomp"}},
    {"frame",
     {"axisangle childclass euler pos quat xyaxes zaxis", "name"},
     {"body composite frame geom replicate", "camera inertial light plugin site", "attach flexcomp freejoint joint"}},
    {"replicate",
     {"childclass count euler offset sep"},
     {"body composite frame geom replicate", "camera inertial light plugin site", "attach flexcomp freejoint joint"}},
    {"inertial", {"axisangle diaginertia euler fullinertia mass pos quat xyaxes zaxis"}, {}},
    {"joint",
     {"axis class limited name pos range ref type",
      "actuatorforcelimited actuatorforcerange actuatorfrclimited actuatorfrcrange actuatorgravcomp armature damping "
      "frictionloss group margin solimpfriction "
      "solimplimit solreffriction solreflimit springdamper springref stiffness user"},
     {}},
    {"freejoint", {"name", "align group"}, {}},
    {"geom",
     {"axisangle class conaffinity contype euler fitscale fromto hfield mesh name pos quat size type xyaxes zaxis",
      "adhesion condim density fluidcoef fluidshape friction gap group margin mass material priority rgba "
      "shellinertia solimp solmix solref surfacevel user"},
     {"", "", "plugin"}},
    {"site", {"", "axisangle class euler fromto group material name pos quat rgba size type user xyaxes zaxis"}, {}},
    {"composite",
     {"count offset prefix spacing type", "flatinertia solimpsmooth solrefsmooth",
      "curve face initial quat size vertex"},
     {"geom joint pin", "plugin site skin tendon"}},
    {"composite/geom",
     {"conaffinity contype size type",
      "adhesion condim density friction gap group margin mass material priority rgba solimp solmix solref surfacevel"},
     {}},
    {"composite/joint",
     {"kind limited range",
      "armature damping frictionloss group margin solimpfix solimpfriction solimplimit solreffix solreffriction "
      "solreflimit stiffness",
      "axis type"},
     {}},
    {"composite/pin", {"coord"}, {}},
    {"contact", {}, {"exclude pair"}},
    {"exclude", {"body1 body2 name"}, {}},
    {"pair", {"class geom1 geom2 name", "adhesion condim friction gap margin solimp solref solreffriction"}, {}},
};

bool has_word(std::string_view words, std::string_view word) {
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    if (words.substr(begin, end - begin) == word) return true;
    begin = end + 1;
  }
  return false;
}

MjcfUse use_of(const Words& words, std::string_view word) {
  if (has_word(words.read, word)) return MjcfUse::kRead;
  if (has_word(words.cut, word)) return MjcfUse::kCut;
  return has_word(words.refused, word) ? MjcfUse::kRefused : MjcfUse::kUnknown;
}

const Element* find(std::string_view name) {
  const auto found =
      std::find_if(std::begin(kElements), std::end(kElements), [&](const Element& e) { return e.name == name; });
  return found == std::end(kElements) ? nullptr : found;
}

}  // namespace

MjcfUse mjcf_attribute(std::string_view element, std::string_view attribute) {
  const Element* const row = find(element);
  return row == nullptr ? MjcfUse::kUnknown : use_of(row->attributes, attribute);
}

MjcfUse mjcf_child(std::string_view parent, std::string_view element) {
  const Element* const row = find(parent);
  return row == nullptr ? MjcfUse::kUnknown : use_of(row->children, element);
}

bool mjcf_has_row(std::string_view element) { return find(element) != nullptr; }

}  // namespace cab::scenes
