// The dented link of the paper's Table 3: a superellipsoid's lower half, hollowed out from above.
#pragma once

#include "scenes/vec3d.h"

#include <cstdint>
#include <vector>

namespace cab::scenes {

// Half extents of the link's leaf box along x, y, z, centre 0. Vertices reach all faces but the lower one of z,
// since none lies at the lowest point of the round.
inline constexpr Vec3 kDentedHalf = {3, .5, .2};

// The 12 convex pieces whose union is the link, four along x by three around: x y z of each piece's vertices in the
// link's frame, six for a piece at a pole and nine for the others. Neighbours share a face. Computed in double,
// rounded once.
std::vector<std::vector<float>> dented_link_pieces();

// A closed surface.
struct TriangleMesh {
  std::vector<float> vertices;           // x y z each
  std::vector<std::uint32_t> triangles;  // three vertices each, counter-clockwise seen from outside
};

// The boundary of the union of the pieces: 38 vertices, 72 triangles. Its vertices are the pieces' bit for bit.
TriangleMesh dented_link_mesh();

}  // namespace cab::scenes
