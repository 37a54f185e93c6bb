// The dented link of the paper's Table 3: the lower half of a superellipsoid, hollowed out from above.
#pragma once

#include "scenes/vec3d.h"

#include <cstdint>
#include <vector>

namespace cab::scenes {

// Half extents of the link's leaf box along x, y and z; its centre is 0. Vertices touch all faces of the box except the
// lower face along z, because no vertex lies at the lowest point of the round side.
inline constexpr Vec3 kDentedHalf = {3, .5, .2};

// The 12 convex pieces whose union is the link, four along x by three around it. A piece is x y z of its vertices in
// the link's frame: six vertices for a piece at a pole, nine for any other. Neighbours share a face. Computed in double
// and rounded once.
std::vector<std::vector<float>> dented_link_pieces();

// A closed surface.
struct TriangleMesh {
  std::vector<float> vertices;           // x y z per vertex
  std::vector<std::uint32_t> triangles;  // three vertices per triangle, counter-clockwise from outside
};

// The boundary of the union of the pieces: 38 vertices and 72 triangles. Its vertices are vertices of the pieces, bit
// for bit.
TriangleMesh dented_link_mesh();

}  // namespace cab::scenes
