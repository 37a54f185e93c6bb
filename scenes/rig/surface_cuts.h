// Cuts the triangles of a surface into leaves: by links, by place, and where the surface bends.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/rig/surface_mesh.h"

namespace cab::scenes {

// The triangles of a leaf, by their indices, and the link that carries it.
struct Cluster {
  std::uint32_t link = 0;
  std::vector<std::uint32_t> triangles;
  // The surface of its box that grows with the poses of links, and of a box with the same axes about its vertices: the
  // sum over all poses.
  double grown = 0, tight = 0;
};

// The vertices of a cluster, each once and ascending.
std::vector<std::uint32_t> vertices_of(const SurfaceMesh& mesh, const Cluster& cluster);

// How many links move the vertices of a cluster.
std::uint32_t count_links(const SurfaceMesh& mesh, const Cluster& cluster);

// Each triangle belongs to the link with most of its weight. The triangles of a link are halved along the direction
// in which their vertices differ most, until there are at most rules.most_triangles, and few enough links move them for
// a leaf.
// Statuses: kTooManyLeaves, kTooManyInfluences.
rig::SkinStatus cut_by_place(const SurfaceMesh& mesh, const rig::SurfaceRules& rules, std::vector<Cluster>& clusters);

// Halves clusters further while their boxes grow by more than rules.most_growth and the halves grow by less. Clusters
// whose boxes are too large by most are first. Measures all. poses: of all links, for one pose after the other.
// Statuses: kBadVertices (the library does not take them, as they are too far away), kOutOfMemory.
rig::SkinStatus cut_where_it_bends(const SurfaceMesh& mesh, const std::vector<std::int32_t>& link_parents,
                                   const std::vector<RigidFrame>& poses, const rig::SurfaceRules& rules,
                                   std::vector<Cluster>& clusters);

}  // namespace cab::scenes
