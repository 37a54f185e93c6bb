// Meshes of robots as several hulls: all of a mesh is in them, and less of its hollow.
#include "scenes/robot/pieces.h"

#include "scenes/import/limits.h"
#include "scenes/rig/hull.h"
#include "scenes/robot/session.h"
#include "tests/scenes/robot/mesh_robot.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using scenes::Vec3;
using scenes::operator+;

// Whether points of a link's frame are all in a leaf: a hull, or a flat box.
bool holds(const scenes::BodyLeaf& leaf, const std::vector<Vec3>& points) {
  constexpr double kRounding = 1e-6;  // of a box's axes: meshes here are about 1 large
  if (leaf.parts.empty())
    return std::all_of(points.begin(), points.end(), [&](const Vec3& point) {
      bool is_in = true;
      for (std::size_t k = 0; k < 3; ++k) {
        double at = 0;
        for (std::size_t c = 0; c < 3; ++c) at += double{leaf.box.axis[k][c]} * (point[c] - double{leaf.box.center[c]});
        is_in = is_in && std::fabs(at) <= double{leaf.box.half[k]} + kRounding;
      }
      return is_in;
    });
  REQUIRE(leaf.parts.size() == 1);
  const scenes::ShapePart& part = leaf.parts[0];
  REQUIRE(part.shape.kind == ShapeKind::kConvexHull);
  std::vector<Vec3> vertices;
  for (std::size_t v = 0; v < part.vertices.size(); v += 3) {
    const Vec3 at = {part.vertices[v], part.vertices[v + 1], part.vertices[v + 2]};
    vertices.push_back(
        scenes::rotate({part.shape.rotation[0], part.shape.rotation[1], part.shape.rotation[2], part.shape.rotation[3]},
                       at) +
        Vec3{part.shape.position[0], part.shape.position[1], part.shape.position[2]});
  }
  const scenes::Hull hull = scenes::convex_hull(vertices, vertices.size());
  for (const Vec3& point : points)
    for (const scenes::Plane& plane : hull.planes)
      if (scenes::dot(plane.normal, point) > plane.offset + kRounding) return false;
  return true;
}

// A box from lo to hi as OBJ, of which `first` vertices are before.
std::string box(int first, const Vec3& lo, const Vec3& hi) {
  std::string text;
  for (int v = 0; v < 8; ++v) {
    text += "v";
    for (std::size_t c = 0; c < 3; ++c) text += " " + std::to_string(v >> c & 1 ? hi[c] : lo[c]);
    text += "\n";
  }
  constexpr int kFaces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& face : kFaces) {
    text += "f";
    for (const int v : face) text += " " + std::to_string(first + v + 1);
    text += "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("every triangle of a mesh that is cut is in one of its hulls, and other shapes stay") {
  const MeshRobot made;
  const scenes::Robot whole = scenes::import_robot(made.file, {});
  const scenes::LeafTriangles triangles = scenes::import_triangles(made.file, {});
  for (const std::uint32_t most : {2u, 5u}) {
    scenes::RobotOptions options;
    options.leaves_per_link = most;
    const scenes::Robot robot = scenes::import_robot(made.file, options);
    CHECK(exact_test_of(robot) == Exact::kConvex);
    REQUIRE(robot.leaf_sources.size() == robot.body.leaves.size());
    std::size_t leaf = 0, count = 0;
    for (std::size_t n = 0; n < whole.body.leaves.size(); ++n) {
      const std::size_t begin = leaf;
      while (leaf < robot.body.leaves.size() && robot.leaf_sources[leaf] == whole.leaf_sources[n]) ++leaf;
      CAPTURE(whole.leaf_sources[n]);
      for (std::size_t piece = begin; piece < leaf; ++piece)
        CHECK(robot.body.leaves[piece].link == whole.body.leaves[n].link);
      const bool is_grid = whole.leaf_sources[n].find("grid.obj") != std::string::npos;
      count += is_grid ? leaf - begin : 0;
      CHECK(leaf - begin > (is_grid ? 1 : 0));
      CHECK(leaf - begin <= (is_grid ? most : 1));
      for (std::size_t t = 0; is_grid && t < triangles[n].size(); t += 9) {
        std::vector<Vec3> corners;
        for (std::size_t k = 0; k < 9; k += 3)
          corners.push_back({triangles[n][t + k], triangles[n][t + k + 1], triangles[n][t + k + 2]});
        CHECK(std::any_of(robot.body.leaves.begin() + static_cast<std::ptrdiff_t>(begin),
                          robot.body.leaves.begin() + static_cast<std::ptrdiff_t>(leaf),
                          [&](const scenes::BodyLeaf& piece) { return holds(piece, corners); }));
      }
    }
    CHECK(leaf == robot.body.leaves.size());
    CHECK(robot.notes.back() == "cut: 3 meshes in " + std::to_string(count) + " hulls");
    options.sandbox = scenes::kImportSandbox;
    CHECK(scenes::import_robot(made.file, options).leaf_sources == robot.leaf_sources);
  }
}

TEST_CASE("what is between the arms of a mesh is in its hull, and in none of those it is cut into") {
  const TemporaryFile file("r.urdf", "<robot name='r'><link name='a'>" + mesh("u.obj", "") + "</link></robot>");
  write_beside(file, "u.obj",
               box(0, {0, 0, 0}, {2, 1, 0.2}) + box(8, {0, 0, 0}, {0.2, 1, 1}) + box(16, {1.8, 0, 0}, {2, 1, 1}));
  scenes::RobotOptions options;
  const Vec3 between = {1, 0.5, 0.7}, wall = {0.1, 0.5, 0.7};
  const scenes::Robot whole = scenes::import_robot(file.path(), options);
  REQUIRE(whole.body.leaves.size() == 1);
  CHECK(holds(whole.body.leaves[0], {between, wall}));
  options.leaves_per_link = 8;
  const scenes::Robot robot = scenes::import_robot(file.path(), options);
  CHECK(robot.body.leaves.size() > 1);
  CHECK(robot.body.leaves.size() <= 8);
  const auto is_in_one = [&](const Vec3& point) {
    return std::any_of(robot.body.leaves.begin(), robot.body.leaves.end(),
                       [&](const scenes::BodyLeaf& leaf) { return holds(leaf, {point}); });
  };
  CHECK(is_in_one(wall));
  CHECK_FALSE(is_in_one(between));
}

TEST_CASE("a robot without meshes is not cut, and a note says so") {
  const TemporaryFile file("r.urdf",
                           "<robot name='r'><link name='a'><collision><geometry><sphere radius='1'/></geometry>"
                           "</collision></link></robot>");
  scenes::RobotOptions options;
  options.leaves_per_link = 4;
  const scenes::Robot robot = scenes::import_robot(file.path(), options);
  REQUIRE(robot.body.leaves.size() == 1);
  REQUIRE(robot.notes.size() == 1);
  CHECK(robot.notes[0] == "no shape is a mesh with triangles: nothing is cut");
}

}  // namespace cab::tests
