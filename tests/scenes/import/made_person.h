// A person of 18 nodes as a glTF file, of which some have tracks and some are bones of a mesh.
#pragma once

#include "tests/scenes/import/made_skin.h"

#include <algorithm>
#include <string>
#include <vector>

namespace cab::tests {

struct PersonNode {
  const char* name;
  const char* parent;
  std::vector<double> place;  // in the parent's frame, metres
};

inline const std::vector<PersonNode>& person_nodes() {
  static const std::vector<PersonNode> nodes = {{"Hips", "", {0, .95, 0}},
                                                {"Spine", "Hips", {0, .2, 0}},
                                                {"Neck", "Spine", {0, .35, 0}},
                                                {"Head", "Neck", {0, .1, 0}},
                                                {"LeftUpLeg", "Hips", {.1, -.05, 0}},
                                                {"LeftLeg", "LeftUpLeg", {0, -.42, 0}},
                                                {"LeftFoot", "LeftLeg", {0, -.42, 0}},
                                                {"LeftToe", "LeftFoot", {0, -.05, .15}},
                                                {"LeftArm", "Spine", {.2, .3, 0}},
                                                {"LeftForeArm", "LeftArm", {.3, 0, 0}},
                                                {"LeftHand", "LeftForeArm", {.25, 0, 0}},
                                                {"RightUpLeg", "Hips", {-.1, -.05, 0}},
                                                {"RightLeg", "RightUpLeg", {0, -.42, 0}},
                                                {"RightFoot", "RightLeg", {0, -.42, 0}},
                                                {"RightToe", "RightFoot", {0, -.05, .15}},
                                                {"RightArm", "Spine", {-.2, .3, 0}},
                                                {"RightForeArm", "RightArm", {-.3, 0, 0}},
                                                {"RightHand", "RightForeArm", {-.25, 0, 0}}};
  return nodes;
}

// The nodes with names in `tracks` turn about x in three frames of 1/25 s; a tetrahedron has the bones `bones`, if
// there are any.
class MadePerson {
 public:
  MadePerson(const std::vector<std::string>& tracks, const std::vector<std::string>& bones) {
    Json& json = file_.json;
    json["nodes"] = Json::array();
    json["scenes"] = {{{"nodes", Json::array()}}};
    json["scene"] = 0;
    for (const PersonNode& node : person_nodes()) add(node.name, node.parent, {{"translation", node.place}});
    if (!bones.empty()) add_mesh(bones);
    if (tracks.empty()) return;
    const std::size_t times = file_.add(std::vector<float>{0, .04f, .08f}, "SCALAR", 1);
    turns_ = file_.add(std::vector<float>{0, 0, 0, 1, .1f, 0, 0, .995f, .2f, 0, 0, .98f}, "VEC4", 4);
    json["animations"] = {{{"samplers", {{{"input", times}, {"output", turns_}}}}, {"channels", Json::array()}}};
    for (const std::string& track : tracks) turn(track);
  }

  // Adds a node below another, or beside the person if that has no name. Returns its index.
  std::size_t add(const std::string& name, const std::string& parent, Json node) {
    Json& nodes = file_.json["nodes"];
    node["name"] = name;
    nodes.push_back(std::move(node));
    const std::size_t index = nodes.size() - 1;
    (parent.empty() ? file_.json["scenes"][0]["nodes"] : nodes[index_of(parent)]["children"]).push_back(index);
    return index;
  }

  // Puts all that has no parent below a new node.
  void hold(const std::string& name, Json node) {
    Json& top = file_.json["scenes"][0]["nodes"];
    node["children"] = top;
    top = Json::array();
    add(name, "", std::move(node));
  }

  void turn(const std::string& name) {
    file_.json["animations"][0]["channels"].push_back(
        {{"sampler", 0}, {"target", {{"node", index_of(name)}, {"path", "rotation"}}}});
  }

  Json& json() { return file_.json; }

  MadeGltf gltf() const {
    MadeGltf made = {file_.json, file_.bytes};
    made.json["buffers"][0]["byteLength"] = file_.bytes.size();
    return made;
  }

 private:
  std::size_t index_of(const std::string& name) const {
    const Json& nodes = file_.json["nodes"];
    const auto found = std::find_if(nodes.begin(), nodes.end(), [&](const Json& node) { return node["name"] == name; });
    return static_cast<std::size_t>(found - nodes.begin());
  }

  // Mesh 0 has the bones, mesh 1 is the same without.
  void add_mesh(const std::vector<std::string>& bones) {
    std::vector<float> weights, bind;
    std::vector<std::uint16_t> joints;
    for (std::size_t v = 0; v < 4; ++v) {
      weights.insert(weights.end(), {1, 0, 0, 0});
      joints.insert(joints.end(), {static_cast<std::uint16_t>(v % bones.size()), 0, 0, 0});
    }
    Json indices = Json::array();
    for (const std::string& bone : bones) {
      indices.push_back(index_of(bone));
      for (int k = 0; k < 16; ++k) bind.push_back(k % 5 == 0 ? 1.0f : 0.0f);
    }
    const std::size_t points = file_.add(std::vector<float>{0, 0, 0, .1f, 0, 0, 0, .1f, 0, 0, 0, .1f}, "VEC3", 3);
    const std::size_t faces = file_.add(std::vector<std::uint16_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}, "SCALAR", 1);
    const std::size_t first = file_.add(joints, "VEC4", 4), weight = file_.add(weights, "VEC4", 4);
    const std::size_t matrices = file_.add(bind, "MAT4", 16);
    file_.json["meshes"] = {
        {{"primitives",
          {{{"attributes", {{"POSITION", points}, {"JOINTS_0", first}, {"WEIGHTS_0", weight}}}, {"indices", faces}}}}},
        {{"primitives", {{{"attributes", {{"POSITION", points}}}, {"indices", faces}}}}}};
    file_.json["skins"] = {{{"joints", indices}, {"inverseBindMatrices", matrices}}};
    add("Mesh", "", {{"mesh", 0}, {"skin", 0}});
  }

  SkinWriter file_;
  std::size_t turns_ = 0;
};

inline std::vector<std::string> names_of_person() {
  std::vector<std::string> names;
  for (const PersonNode& node : person_nodes()) names.emplace_back(node.name);
  return names;
}

}  // namespace cab::tests
