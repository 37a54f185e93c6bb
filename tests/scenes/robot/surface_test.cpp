// Meshes of robots as leaves of their triangles: every triangle is there once, where its file has it.
#include "scenes/robot/surface.h"

#include "scenes/import/limits.h"
#include "scenes/robot/session.h"
#include "tests/scenes/robot/mesh_robot.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using Corners = std::array<std::array<float, 3>, 3>;

// A triangle by its corners in order of place, since where it begins and how it turns does not count.
Corners sorted(Corners corners) {
  for (std::array<float, 3>& corner : corners)
    for (float& x : corner) x += 0.0f;  // -0 is 0
  std::sort(corners.begin(), corners.end());
  return corners;
}

std::vector<Corners> sorted(std::vector<Corners> triangles) {
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

// The triangles of a robot's leaves on a link.
std::vector<Corners> triangles_of(const scenes::Robot& robot, std::uint32_t link) {
  std::vector<Corners> out;
  for (const scenes::BodyLeaf& leaf : robot.body.leaves) {
    if (leaf.link != link) continue;
    for (std::size_t i = 0; i < leaf.triangles.size(); i += 3) {
      Corners corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = leaf.triangles[i + k];
        CHECK(robot.body.skin.influence_links[v] == link);
        CHECK(robot.body.skin.influence_weights[v] == 1);
        std::copy_n(&robot.body.skin.vertices[3 * std::size_t{v}], 3, corners[k].begin());
      }
      out.push_back(sorted(corners));
    }
  }
  return sorted(out);
}

std::vector<Corners> triangles_of(const scenes::LeafTriangles& triangles, const std::vector<std::size_t>& leaves) {
  std::vector<Corners> out;
  for (const std::size_t leaf : leaves)
    for (std::size_t t = 0; t < triangles[leaf].size(); t += 9) {
      Corners corners;
      for (std::size_t k = 0; k < 3; ++k) std::copy_n(&triangles[leaf][t + 3 * k], 3, corners[k].begin());
      out.push_back(sorted(corners));
    }
  return sorted(out);
}

scenes::RobotOptions surface_options() {
  scenes::RobotOptions options;
  options.surface = true;
  return options;
}

}  // namespace

TEST_CASE("every triangle of a robot's meshes is in one leaf of its link, and other shapes stay") {
  const MeshRobot made;
  const scenes::Robot hulls = scenes::import_robot(made.file, {}),
                      robot = scenes::import_robot(made.file, surface_options());
  const scenes::LeafTriangles triangles = scenes::import_triangles(made.file, surface_options());
  REQUIRE(triangles.size() == 5);
  CHECK(hulls.body.skin.vertices.empty());
  CHECK(exact_test_of(hulls) == Exact::kConvex);
  CHECK(exact_test_of(robot) == Exact::kSurface);
  CHECK(robot.body.skin.inverse_bind.empty());

  // The box, and the mesh without triangles, which is a hull.
  const std::vector<scenes::BodyLeaf>& leaves = robot.body.leaves;
  REQUIRE(leaves.size() == robot.leaf_sources.size());
  CHECK(leaves[0].parts[0].shape.kind == ShapeKind::kBox);
  CHECK(leaves[1].parts[0].shape.kind == ShapeKind::kConvexHull);
  CHECK(leaves[1].link == 2);
  CHECK(robot.leaf_sources[1].find("lines.obj") != std::string::npos);
  for (std::size_t n = 2; n < leaves.size(); ++n) {
    CHECK(leaves[n].parts.empty());
    CHECK(leaves[n].triangles.size() > 0);
    CHECK(leaves[n].triangles.size() <= 3 * 256);
    CHECK(robot.leaf_sources[n].find("grid.obj") != std::string::npos);
  }
  CHECK(triangles_of(robot, 0) == triangles_of(triangles, {1, 2}));
  CHECK(triangles_of(robot, 1).empty());
  CHECK(triangles_of(robot, 2) == triangles_of(triangles, {4}));

  const auto has_note = [&](const std::string& words) {
    return std::any_of(robot.notes.begin(), robot.notes.end(),
                       [&](const std::string& note) { return note.find(words) != std::string::npos; });
  };
  CHECK(has_note("lines.obj: no triangle of it has three different corners: it stays a hull"));
  CHECK(has_note("surface: 864 triangles in "));
  CHECK(has_note(" of 2 links, 3 parts, 3 of them open (144 edges; a body wholly inside these is not found)"));

  CollisionChecker checker;
  const scenes::ArticulationStorage storage(robot.body);
  const scenes::Kinematics kinematics(robot);
  CHECK(checker.set_robot(storage.desc(), kinematics.desc()) == Status::kOk);
}

TEST_CASE("a child process reads the same surface") {
  const MeshRobot made;
  scenes::RobotOptions options = surface_options();
  const scenes::Robot here = scenes::import_robot(made.file, options);
  options.sandbox = scenes::kImportSandbox;
  const scenes::Robot child = scenes::import_robot(made.file, options);
  CHECK(child.body.skin.vertices == here.body.skin.vertices);
  CHECK(child.leaf_sources == here.leaf_sources);
  CHECK(child.notes == here.notes);
  REQUIRE(child.body.leaves.size() == here.body.leaves.size());
  for (std::size_t n = 0; n < child.body.leaves.size(); ++n)
    CHECK(child.body.leaves[n].triangles == here.body.leaves[n].triangles);
}

TEST_CASE("a robot without meshes keeps its shapes, and a note says that surfaces change nothing") {
  const TemporaryFile file("r.urdf",
                           "<robot name='r'><link name='a'><collision><geometry><sphere radius='1'/></geometry>"
                           "</collision></link></robot>");
  const scenes::Robot robot = scenes::import_robot(file.path(), surface_options());
  REQUIRE(robot.body.leaves.size() == 1);
  CHECK(robot.body.leaves[0].parts[0].shape.kind == ShapeKind::kSphere);
  CHECK(exact_test_of(robot) == Exact::kConvex);
  REQUIRE(robot.notes.size() == 1);
  CHECK(robot.notes[0] == "no shape is a mesh with triangles: surfaces change nothing");
}

TEST_CASE(
    "a mesh of more triangles than leaves of 128 hold has larger leaves, beside as many other shapes as there are") {
  std::string text = "<robot name='r'><link name='a'>" + mesh("grid.obj", "");
  for (int n = 0; n < 1018; ++n) text += "<collision><geometry><sphere radius='1'/></geometry></collision>";
  const TemporaryFile file("r.urdf", text + "</link></robot>");
  write_beside(file, "grid.obj", grid(40));
  const scenes::Robot robot = scenes::import_robot(file.path(), surface_options());
  CHECK(robot.body.leaves.size() > 1018);
  CHECK(robot.body.leaves.size() <= kMaxLeaves);
  CHECK(triangles_of(robot, 0).size() == 3200);
}

}  // namespace cab::tests
