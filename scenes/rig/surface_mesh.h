// The mesh of a skin as an articulation takes it: links instead of bones, and vertices welded.
#pragma once

#include <cstdint>
#include <vector>

#include "scenes/rig/link_binds.h"

namespace cab::scenes {

inline constexpr std::uint32_t kNoVertex = 0xffffffff;

struct SurfaceMesh {
  rig::SurfaceStorage skin;             // without triangles
  std::vector<Triangle> triangles;      // with three different vertices
  std::vector<std::uint32_t> sources;   // of each triangle: which one of the skin it is
  std::vector<std::uint32_t> index_of;  // of each vertex of the skin, or kNoVertex of one without triangles
  std::uint32_t welded_count = 0;       // vertices that are one with an earlier one
  std::uint32_t left_out_count = 0;     // triangles of the skin that are not here
};

// Takes the vertices of triangles to one space, gives them weights of links that add to 1, and welds those of equal
// place and weights. Triangles with two equal corners after that are left out.
SurfaceMesh make_surface_mesh(const CheckedSkin& skin, const LinkMap& map, const LinkBinds& binds,
                              std::size_t triangle_count);

Vec3 place_of(const SurfaceMesh& mesh, std::uint32_t vertex);

// The poses of links, of one pose after the other, after the links' inverse bind matrices.
std::vector<Affine> link_bones(const SurfaceMesh& mesh, const std::vector<RigidFrame>& poses);

// Where a vertex is in a pose, by the bones of its links.
Vec3 posed_vertex(const SurfaceMesh& mesh, const Affine* bones, std::uint32_t vertex);

// The connected parts of a mesh: triangles with a vertex in common are of one part. An edge is open if an odd number of
// triangles have it, and a part with an open edge has no inside.
struct MeshParts {
  std::uint32_t count = 0;
  std::uint32_t open_count = 0;
  std::uint32_t open_edge_count = 0;
};
MeshParts parts_of(const SurfaceMesh& mesh);

}  // namespace cab::scenes
