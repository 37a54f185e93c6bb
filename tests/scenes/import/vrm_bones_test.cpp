// The humanoid of VRM files: which names it has, and what becomes of a file without a skin.
#include "scenes/import/vrm_bones.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_person.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>

namespace {

using namespace cab::scenes;
using namespace cab::tests;
using Names = std::vector<std::string>;

// A humanoid of the nodes with an even number, in the form of VRM 0.x or 1.0.
Json humanoid(bool is_first_version) {
  Json bones = is_first_version ? Json::array() : Json::object();
  for (std::size_t n = 0; n < person_nodes().size(); n += 2) {
    if (is_first_version)
      bones.push_back({{"bone", "b" + std::to_string(n)}, {"node", n}});
    else
      bones["b" + std::to_string(n)] = {{"node", n}};
  }
  return {{"humanoid", {{"humanBones", bones}}}};
}

Skeleton skeleton_of(const MadePerson& person) {
  const TemporaryFile file("person.vrm", glb(person.gltf()));
  return import_skeleton(file.path(), {});
}

}  // namespace

TEST_CASE("the humanoid of any version says which nodes are bones") {
  std::vector<std::size_t> even;
  for (std::size_t n = 0; n < person_nodes().size(); n += 2) even.push_back(n);
  MadePerson person({}, {});
  CHECK(vrm_bones(person.json()).empty());
  for (const char* extension : {"VRM", "VRMC_vrm", "VRMC_vrm_animation"}) {
    CAPTURE(std::string(extension));
    person.json()["extensions"] = {{extension, humanoid(std::string(extension) == "VRM")}};
    CHECK(vrm_bones(person.json()) == even);
  }
}

TEST_CASE("a humanoid that names nothing that there is names nothing") {
  for (const char* text :
       {"null", "[]", "3", "{}", R"({"nodes": 3})", R"({"nodes": [{"name": "a"}], "extensions": 3})",
        R"({"nodes": [{"name": "a"}], "extensions": {"VRM": []}})",
        R"({"nodes": [{"name": "a"}], "extensions": {"VRM": {"humanoid": {"humanBones": [3, {}, {"node": -1},
            {"node": 1}, {"node": 0.5}, {"node": "a"}, {"node": 18446744073709551615}]}}}})",
        R"({"nodes": [], "extensions": {"VRM": {"humanoid": {"humanBones": [{"node": 0}]}}}})"}) {
    CAPTURE(std::string(text));
    CHECK(vrm_bones(Json::parse(text)).empty());
  }
}

TEST_CASE("a VRM file without a skin and without an animation has the joints that its humanoid names") {
  MadePerson person({}, {});
  // Hair hangs from the head, and is no bone.
  person.add("Hair", "Head", {{"translation", {0, .1, -.1}}});
  const auto complaint = [&person] {
    try {
      skeleton_of(person);
    } catch (const ImportError& error) { return std::string(error.what()); }
    return std::string();
  };
  CHECK(complaint().find("no skeleton: it has no bones and no animated nodes") != std::string::npos);
  for (const bool is_first : {true, false}) {
    CAPTURE(is_first);
    person.json()["extensions"] = {{is_first ? "VRM" : "VRMC_vrm", humanoid(is_first)}};
    const Skeleton skeleton = skeleton_of(person);
    CHECK(skeleton.is_static);
    // The named nodes and what is between them: of a leg with foot and no leg, the leg too.
    Names joints = skeleton.joint_names, named;
    for (std::size_t n = 0; n < person_nodes().size(); n += 2) named.emplace_back(person_nodes()[n].name);
    std::sort(joints.begin(), joints.end());
    std::sort(named.begin(), named.end());
    CHECK(std::includes(joints.begin(), joints.end(), named.begin(), named.end()));
    CHECK(std::find(joints.begin(), joints.end(), "Hair") == joints.end());
    CHECK(std::find(joints.begin(), joints.end(), "LeftLeg") != joints.end());
    CHECK(make_clip(skeleton, "person", {}).size_doubt.empty());
  }
}
