// Collada as it is written: white space, joints of the same names in several figures, and concave polygons.
#include "scenes/import/collada_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;

// `blank` where XML Schema allows white space that means nothing. A figure has a joint `bone` and a tetrahedron that it
// moves; the second stands at x = 5. Node ids have the figure's number, sids have not.
std::string two_figures(const std::string& blank, const std::string& id = "bone") {
  const auto list = [&blank](const std::string& text) { return blank + text + blank; };
  const auto source = [&](const std::string& name, const std::string& type, const std::string& values,
                          const std::string& count, const std::string& stride) {
    return "<source id='" + name + "'><" + type + " id='" + name + "a' count='" + count + "'>" + list(values) + "</" +
           type + "><technique_common><accessor source='#" + name + "a' count='" +
           std::to_string(std::stoi(count) / std::stoi(stride)) + "' stride='" + stride + "'><param name='" +
           (type == "Name_array" ? "JOINT' type='name" : "X' type='float") +
           "'/></accessor></technique_common></source>";
  };
  const std::string identity = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  std::string controllers, nodes;
  for (const std::string n : {"1", "2"}) {
    controllers +=
        "<controller id='skin" + n + "'><skin source='#mesh'><bind_shape_matrix>" + list(identity) +
        "</bind_shape_matrix>" + source("j" + n, "Name_array", "bone", "1", "1") +
        source("b" + n, "float_array", identity, "16", "16") + source("w" + n, "float_array", "1 .5", "2", "1") +
        "<joints><input semantic='JOINT' source='#j" + n + "'/><input semantic='INV_BIND_MATRIX' source='#b" + n +
        "'/></joints><vertex_weights count='4'><input semantic='JOINT' source='#j" + n +
        "' offset='0'/><input semantic='WEIGHT' source='#w" + n + "' offset='1'/><vcount>" + list("1 1 1 1") +
        "</vcount><v>" + list("0 0 0 0 0 0 0 0") + "</v></vertex_weights></skin></controller>";
    const std::string own_id = id.empty() ? std::string() : " id='" + blank + id + n + blank + "'";
    nodes += "<node id='top" + n + "'><translate>" + list(n == "1" ? "0 0 0" : "5 0 0") + "</translate><node" + own_id +
             " name='bone' sid='bone' type='JOINT'><matrix>" + list(identity) +
             "</matrix></node></node><node id='shape" + n + "'><instance_controller url='#skin" + n + "'><skeleton>" +
             list("#top" + n) + "</skeleton></instance_controller></node>";
  }
  return "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset>"
         "<unit meter='" +
         blank + "1.0'/><up_axis>" + list("Y_UP") +
         "</up_axis></asset><library_effects><effect id='e'>"
         "<profile_COMMON><technique sid='c'><phong><diffuse><color>" +
         list("0.8 0.8 0.8 1.0") + "</color></diffuse><shininess><float>" + list("5") +
         "</float></shininess></phong></technique></profile_COMMON>"
         "</effect></library_effects><library_lights><light id='l'><technique_common><ambient><color>" +
         list("1 1 1") +
         "</color></ambient></technique_common></light></library_lights><library_geometries><geometry "
         "id='mesh'><mesh>" +
         source("p", "float_array", "0 0 0 1 0 0 0 1 0 0 0 1", "12", "3") +
         "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles count='4'>"
         "<input semantic='VERTEX' source='#v' offset='0'/><p>" +
         list("0 2 1 0 1 3 0 3 2 1 2 3") +
         "</p></triangles></mesh></geometry></library_geometries><library_controllers>" + controllers +
         "</library_controllers><library_visual_scenes><visual_scene id='s'>" + nodes +
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>";
}

Skeleton skin_of(const std::string& text) {
  const TemporaryFile file("figures.dae", text);
  ImportOptions options;
  options.skin.emplace();
  return import_skeleton(file.path(), options);
}

}  // namespace

TEST_CASE("white space at the ends of texts and attributes of a Collada file means nothing") {
  const Skeleton plain = skin_of(two_figures(""));
  CHECK(plain.joint_names.size() == 5);
  for (const std::string blank : {" ", "\n\t ", "\r\n"}) {
    const Skeleton skeleton = skin_of(two_figures(blank));
    CHECK(skeleton.joint_names == plain.joint_names);
    CHECK(skeleton.positions == plain.positions);
    CHECK(skeleton.skin.vertices == plain.skin.vertices);
    CHECK(skeleton.skin.influence_weights == plain.skin.influence_weights);
    CHECK(skeleton.skin.influence_bones == plain.skin.influence_bones);
  }
  // assimp would take Y for the up axis.
  std::vector<std::string> notes;
  const std::string text = collada_for_assimp("<a>  <b c=' x '>\n Z_UP\t</b>  <d/> </a>", notes).value();
  CHECK(text == "<a><b c=\"x\">Z_UP</b><d/></a>");
  CHECK(notes.empty());
}

TEST_CASE("a Collada file that assimp alone reads has a note, and no other has one") {
  for (const char* const text : {"<a><b></a>", "", "<?xml version='1.0'?>"}) {
    std::vector<std::string> notes;
    CHECK(!collada_for_assimp(text, notes));
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("warning: its XML is read by assimp alone") == 0);
  }
  const auto says_alone = [](const std::vector<std::string>& notes) {
    return std::any_of(notes.begin(), notes.end(),
                       [](const std::string& note) { return note.find("assimp alone") != std::string::npos; });
  };
  const std::string plain = two_figures("");
  CHECK(!says_alone(skin_of(plain).notes));
  std::string deep;
  for (int k = 0; k < 600; ++k) deep += "<extra>";
  for (int k = 0; k < 600; ++k) deep += "</extra>";
  CHECK(says_alone(skin_of(std::string(plain).insert(plain.rfind("</COLLADA>"), deep)).notes));
}

TEST_CASE("joints with the same sid in two Collada figures are those below each skin's own skeleton") {
  for (const char* id : {"bone", ""}) {
    const Skeleton skeleton = skin_of(two_figures("", id));
    REQUIRE(skeleton.joint_names.size() == 5);
    const FileSkin& skin = skeleton.skin;
    const std::size_t half = 3 * 4;  // corners of one figure's triangles
    REQUIRE(skin.vertices.size() == 3 * 2 * half);
    std::vector<double> places;  // along x, of what moves each vertex
    for (std::size_t v = 0; v < 2 * half; ++v)
      places.push_back(skeleton.positions[3 * skin.bone_joints[skin.influence_bones[v * skin.influence_count]]]);
    std::vector<double> expected(half, 0);
    expected.resize(2 * half, 5);
    CHECK(places == expected);
  }
}

TEST_CASE("what a Collada file does not tell apart is a note") {
  std::string text = two_figures("");
  for (std::size_t at = 0; (at = text.find("#skin2", at)) != std::string::npos;) text.replace(at, 6, "#skin1");
  const std::vector<std::string> notes = skin_of(text).notes;
  CHECK(std::find(notes.begin(), notes.end(),
                  "warning: #skin1 is the skin of several skeletons: only the first moves it") != notes.end());
  text = two_figures("");
  text.replace(text.find("'bone2'"), 7, "'bone1'");
  std::vector<std::string> found;
  collada_for_assimp(text, found);
  CHECK(found == std::vector<std::string>{"warning: ids that several nodes have (bone1): only one of them moves"});
}

TEST_CASE("a concave polygon of a skin is cut along the diagonal inside it") {
  std::string text = two_figures("");
  for (const auto& [old, now] : std::vector<std::pair<std::string, std::string>>{
           {"0 0 0 1 0 0 0 1 0 0 0 1", "0 0 0 2 2 0 0 1 0 -2 2 0"},
           {"stride='3'><param name='X' type='float'/>",
            "stride='3'><param name='X' type='float'/><param name='Y' type='float'/><param name='Z' type='float'/>"},
           {"<triangles count='4'>", "<polylist count='1'>"},
           {"<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>", "<vcount>4</vcount><p>1 2 3 0</p></polylist>"}})
    text.replace(text.find(old), old.size(), now);
  CHECK(skin_of(text).skin.triangles == std::vector<std::uint32_t>{3, 0, 1, 1, 2, 3, 7, 4, 5, 5, 6, 7});
}
