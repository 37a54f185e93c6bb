// The meshes of a robot as leaves of their triangles.
#include "scenes/robot/surface.h"

#include <limits>
#include <new>
#include <utility>

#include "scenes/import/surface_words.h"
#include "scenes/robot/mesh_skin.h"

namespace cab::scenes {
namespace {

// The most triangles of a leaf. Boxes of rigid leaves do not grow, so that larger leaves pay than those of a skin: of
// 128, 256 and 512, states of the UR5, the Panda and the Allegro hand take least with 256, all in all.
constexpr std::uint32_t kMostTriangles = 256;

}  // namespace

void take_surfaces(Robot& robot, const LeafTriangles& triangles) {
  MeshSkin meshes(robot.body.link_parents);
  std::vector<BodyLeaf> leaves;
  std::vector<std::string> sources;
  for (std::uint32_t n = 0; n < robot.body.leaves.size(); ++n) {
    BodyLeaf& leaf = robot.body.leaves[n];
    if (has_triangle(triangles[n])) {
      meshes.add_mesh(n, leaf.link, triangles[n]);
      continue;
    }
    if (!triangles[n].empty())
      robot.notes.push_back(robot.leaf_sources[n] + ": no triangle of it has three different corners: it stays a hull");
    leaves.push_back(std::move(leaf));
    sources.push_back(robot.leaf_sources[n]);
  }
  if (meshes.triangles.empty()) {
    robot.notes.emplace_back("no shape is a mesh with triangles: surfaces change nothing");
    robot.body.leaves = std::move(leaves);
    return;
  }
  rig::SurfaceRules rules;
  rules.most_triangles = kMostTriangles;
  rules.max_leaves = kMaxLeaves - static_cast<std::uint32_t>(leaves.size());
  rules.most_growth = std::numeric_limits<float>::infinity();  // nothing bends
  rig::SkinBodies bodies;
  rig::SurfaceInfo info;
  const rig::SkinStatus status = rig::surface_from_skin(meshes.skin(), rules, &bodies, &info);
  if (status == rig::SkinStatus::kOutOfMemory) throw std::bad_alloc();
  if (status != rig::SkinStatus::kOk)
    throw ImportError(robot.body.name + ": surface of its meshes: " + rig::to_string(status));

  const ArticulationDesc desc = bodies.desc();
  std::size_t next = 0;
  for (BodyLeaf& leaf : copied(desc.leaves)) {
    sources.push_back(robot.leaf_sources[meshes.leaf_of[bodies.source_triangles()[next]]]);
    next += leaf.triangles.size() / 3;
    leaf.link = bodies.joints()[leaf.link];
    leaves.push_back(std::move(leaf));
  }
  robot.body.leaves = std::move(leaves);
  robot.leaf_sources = std::move(sources);
  robot.body.skin = copied(desc.skin);
  for (std::uint32_t& link : robot.body.skin.influence_links) link = bodies.joints()[link];
  robot.body.skin.inverse_bind.clear();  // vertices are in the frames of their links
  std::string note = "surface: " + triangle_words(info, desc.leaves.size) + ", " + part_words(info);
  if (info.left_out_count > 0)
    note += "; " + counted(info.left_out_count, "triangle", "triangles") + " with two corners at one place left out";
  robot.notes.push_back(std::move(note));
}

}  // namespace cab::scenes
