// The meshes of a robot as several convex hulls each.
#include "scenes/robot/pieces.h"

#include <cab/skin.h>

#include <cstdint>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "scenes/import/surface_words.h"
#include "scenes/robot/mesh_skin.h"

namespace cab::scenes {
namespace {

// Depths of hulls with more vertices are those of a local search (docs/exact.md).
constexpr std::uint32_t kMostVertices = 256;

}  // namespace

void cut_meshes(Robot& robot, const LeafTriangles& triangles, std::uint32_t most) {
  std::vector<std::uint32_t> cut;  // leaves that are meshes: each is a joint of the skin
  for (std::uint32_t n = 0; n < robot.body.leaves.size(); ++n)
    if (has_triangle(triangles[n])) cut.push_back(n);
  if (cut.empty()) {
    robot.notes.emplace_back("no shape is a mesh with triangles: nothing is cut");
    return;
  }
  MeshSkin meshes(std::vector<std::int32_t>(cut.size(), -1));
  for (std::uint32_t m = 0; m < cut.size(); ++m) meshes.add_mesh(cut[m], m, triangles[cut[m]]);
  rig::BodyRules rules;
  rules.max_hull_vertices = kMostVertices;
  rules.leaves_per_link = most;
  rig::SkinBodies bodies;
  const rig::SkinStatus status = rig::bodies_from_skin(meshes.skin(), rules, &bodies);
  if (status == rig::SkinStatus::kOutOfMemory) throw std::bad_alloc();
  if (status != rig::SkinStatus::kOk)
    throw ImportError(robot.body.name + ": hulls of its meshes: " + rig::to_string(status));

  std::vector<std::vector<BodyLeaf>> pieces(robot.body.leaves.size());
  std::size_t count = 0;
  for (BodyLeaf& piece : copied(bodies.desc().leaves)) {
    const std::uint32_t of = cut[bodies.joints()[piece.link]];
    piece.link = robot.body.leaves[of].link;
    pieces[of].push_back(std::move(piece));
    ++count;
  }
  std::vector<BodyLeaf> leaves;
  std::vector<std::string> sources;
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    if (pieces[n].empty()) pieces[n].push_back(std::move(robot.body.leaves[n]));
    for (BodyLeaf& piece : pieces[n]) {
      leaves.push_back(std::move(piece));
      sources.push_back(robot.leaf_sources[n]);
    }
  }
  if (leaves.size() > kMaxLeaves)
    throw ImportError(robot.body.name + ": more than " + std::to_string(kMaxLeaves) + " shapes: cut meshes into fewer");
  robot.body.leaves = std::move(leaves);
  robot.leaf_sources = std::move(sources);
  robot.notes.push_back("cut: " + counted(cut.size(), "mesh", "meshes") + " in " + counted(count, "hull", "hulls"));
}

}  // namespace cab::scenes
