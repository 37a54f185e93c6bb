// Names of nodes that an FBX file has more than once: they are found, and told where they are joints.
#include "scenes/import/fbx_names.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "scenes/import/import.h"
#include "tests/scenes/temporary_file.h"

namespace {

using namespace cab::scenes;
using namespace cab::tests;
using Names = std::vector<std::string>;

std::string property(const std::string& name, const std::string& kind) {
  const std::string text = name + std::string("\0\1", 2) + kind;
  std::string bytes = "S";
  for (std::size_t k = 0; k < 4; ++k) bytes += static_cast<char>(text.size() >> (8 * k) & 0xff);
  return bytes + text;
}

std::string model(int number, const std::string& name) {
  return "\tModel: " + std::to_string(number) + ", \"Model::" + name +
         "\", \"LimbNode\" {\n\t\tVersion: 232\n\t\tProperties70:  {\n"
         "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",0,90,0\n\t\t}\n\t}\n";
}

// Two chains of two nodes, of which the first root moves along z.
std::string two_people(const std::string& second_root) {
  return "; FBX 7.4.0 project file\n; Model::Hips, Model::Hips\n"
         "FBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n}\nObjects:  {\n" +
         model(1, "Hips") + model(2, "Spine") + model(3, second_root) + model(4, "SpineB") +
         "\tAnimationStack: 10, \"AnimStack::walk\", \"\" {\n\t}\n\tAnimationLayer: 11, \"AnimLayer::base\", \"\" "
         "{\n\t}\n"
         "\tAnimationCurveNode: 12, \"AnimCurveNode::T\", \"\" {\n\t\tProperties70:  {\n"
         "\t\t\tP: \"d|X\", \"Number\", \"\", \"A\",0\n\t\t}\n\t}\n"
         "\tAnimationCurve: 13, \"AnimCurve::\", \"\" {\n\t\tKeyVer: 4008\n"
         "\t\tKeyTime: *2 {\n\t\t\ta: 0,46186158000\n\t\t}\n\t\tKeyValueFloat: *2 {\n\t\t\ta: 0,100\n\t\t}\n"
         "\t\tKeyAttrFlags: *1 {\n\t\t\ta: 24840\n\t\t}\n\t\tKeyAttrDataFloat: *4 {\n\t\t\ta: 0,0,0,0\n\t\t}\n"
         "\t\tKeyAttrRefCount: *1 {\n\t\t\ta: 2\n\t\t}\n\t}\n}\nConnections:  {\n"
         "\tC: \"OO\",1,0\n\tC: \"OO\",2,1\n\tC: \"OO\",3,0\n\tC: \"OO\",4,3\n\tC: \"OO\",11,10\n\tC: \"OO\",12,11\n"
         "\tC: \"OP\",12,1, \"Lcl Translation\"\n\tC: \"OP\",13,12, \"d|Z\"\n}\n";
}

bool tells_names(const std::string& second_root) {
  const TemporaryFile file("people.fbx", two_people(second_root));
  const Skeleton skeleton = import_skeleton(file.path(), {});
  return std::any_of(skeleton.notes.begin(), skeleton.notes.end(), [](const std::string& note) {
    return note.find("of several nodes of one name (Hips)") != std::string::npos;
  });
}

}  // namespace

TEST_CASE("names that several models of an FBX file have are found, in binary files and in texts") {
  const std::string head = "Kaydara FBX Binary  ";
  CHECK(repeated_fbx_names(head + property("Hips", "Model") + property("Spine", "Model")).empty());
  CHECK(repeated_fbx_names(head + property("Hips", "Model") + property("Hips", "Geometry")).empty());
  CHECK(repeated_fbx_names(head + property("Hips", "Model") + "xx" + property("Hips", "Model") +
                           property("S", "Model") + property("", "Model") + property("S", "Model")) ==
        Names{"Hips", "S"});
  CHECK(repeated_fbx_names(two_people("Hips")) == Names{"Hips"});
  CHECK(repeated_fbx_names(two_people("HipsB")).empty());
}

TEST_CASE("what only looks like the name of a model is none, and nothing is read beyond the end") {
  for (const std::string& bytes :
       {std::string(), std::string("\0\1Model", 7), "Kaydara FBX Binary" + std::string("\0\1Model\0\1Model", 14),
        "Kaydara FBX Binary" + property("a", "Model").substr(2) + property("a", "Model"), std::string("Model: "),
        std::string("Model: 1, \"Model::a"), std::string("; Model: 1, \"Model::a\"\nModel: 2, \"Model::a\"\n")}) {
    CAPTURE(bytes);
    CHECK(repeated_fbx_names(bytes).empty());
  }
}

TEST_CASE("joints of an FBX file that have one name are told, since the motion of all goes to the first") {
  CHECK(tells_names("Hips"));
  CHECK_FALSE(tells_names("HipsB"));
}
