// Poses as Unity has them, left-handed, handed over as in docs/poses.md, against points that are posed one by one and
// against the hits of the same crowd in right-handed coordinates.
#include "tests/howtos/poses_unity.h"

#include "tests/howtos/poses_check.h"

namespace {

using as_in_unity::Matrix4x4;
using as_in_unity::RigidTransform;
using namespace poses_check;

// A character's bone in its root, by where three axes and the origin go: Matrix4x4.GetColumn.
template <class Posed>
Matrix4x4 matrix(Posed posed) {
  const Point origin = posed(Point{0, 0, 0});
  const auto column = [&](const Point& axis, std::size_t k) { return static_cast<float>(posed(axis)[k] - origin[k]); };
  const Point x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
  Matrix4x4 m = {};
  m.m00 = column(x, 0), m.m10 = column(x, 1), m.m20 = column(x, 2);
  m.m01 = column(y, 0), m.m11 = column(y, 1), m.m21 = column(y, 2);
  m.m02 = column(z, 0), m.m12 = column(z, 1), m.m22 = column(z, 2);
  m.m03 = static_cast<float>(origin[0]), m.m13 = static_cast<float>(origin[1]), m.m23 = static_cast<float>(origin[2]);
  m.m33 = 1;
  return m;
}

// The product of quaternions: first b, then a.
std::array<double, 4> product(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  const Point u = {a[0], a[1], a[2]}, v = {b[0], b[1], b[2]};
  const Point w = a[3] * v + b[3] * u + cross(u, v);
  return {w[0], w[1], w[2], a[3] * b[3] - u[0] * v[0] - u[1] * v[1] - u[2] * v[2]};
}

// The crowd in a mirror: x points the other way, as from Unity's axes to glTF's.
Transform mirrored(Transform t) {
  t.translation[0] = -t.translation[0];
  t.rotation[1] = -t.rotation[1];
  t.rotation[2] = -t.rotation[2];
  return t;
}

std::vector<Matrix4x4> matrices_of(const Crowd& crowd) {
  std::vector<Matrix4x4> matrices;
  for (std::uint32_t i = 0; i < kCharacters; ++i)
    for (std::uint32_t l = 0; l < kLinks; ++l)
      matrices.push_back(matrix([&](const Point& p) { return crowd.places[i].scale * crowd.in_character(i, l, p); }));
  return matrices;
}

}  // namespace

int main() {
  bool right = true;
  World world(leaves_of(1));
  {  // matrices of characters and bones of several sizes
    const Crowd crowd = crowd_of(1, true);
    const Places places(crowd);
    const std::vector<Matrix4x4> matrices = matrices_of(crowd);
    const cab::BatchInput input = input_of(world.batch(), as_in_unity::poses_of(matrices.data()), places);
    const auto posed = [&](std::uint32_t i, std::uint32_t link, const Point& p) {
      return crowd.along_world(i, link, p);
    };
    const std::vector<cab::Hit> hits = world.hits(input);

    Crowd mirror = crowd;
    for (Transform& place : mirror.places) place = mirrored(place);
    for (auto& links : mirror.links)
      for (Transform& link : links) link = mirrored(link);
    std::vector<cab::Leaf> leaves = leaves_of(1);
    for (cab::Leaf& leaf : leaves) leaf.box.center[0] = -leaf.box.center[0];
    World mirror_world(leaves);
    const Places mirror_places(mirror);
    const std::vector<Matrix4x4> mirror_matrices = matrices_of(mirror);
    const cab::BatchInput mirror_input =
        input_of(mirror_world.batch(), as_in_unity::poses_of(mirror_matrices.data()), mirror_places);
    right &= line("matrices, also right-handed", world.error(input, posed), hits.size(),
                  same(mirror_world.hits(mirror_input), hits));
  }
  {  // rigid transforms
    const Crowd crowd = crowd_of(1, false);
    const Places places(crowd);
    std::vector<RigidTransform> transforms;
    for (std::uint32_t i = 0; i < kCharacters; ++i) {
      for (std::uint32_t l = 0; l < kLinks; ++l) {
        std::array<double, 4> q = {0, 0, 0, 1};
        for (auto k = static_cast<std::int32_t>(l); k >= 0; k = kParents[static_cast<std::size_t>(k)])
          q = product(crowd.links[i][static_cast<std::size_t>(k)].rotation, q);
        const Point origin = crowd.in_character(i, l, {0, 0, 0});
        RigidTransform t;
        for (std::size_t k = 0; k < 4; ++k) t.rot[k] = static_cast<float>(q[k]);
        for (std::size_t k = 0; k < 3; ++k) t.pos[k] = static_cast<float>(origin[k]);
        transforms.push_back(t);
      }
    }
    cab::BatchInput input = input_of(world.batch(), as_in_unity::poses_of(transforms.data()), places);
    input.scales = places.scales;
    const auto posed = [&](std::uint32_t i, std::uint32_t link, const Point& p) {
      return crowd.along_world(i, link, p);
    };
    const std::vector<Matrix4x4> matrices = matrices_of(crowd);
    const cab::BatchInput by_matrices = input_of(world.batch(), as_in_unity::poses_of(matrices.data()), places);
    const std::vector<cab::Hit> hits = world.hits(input);
    right &= line("rigid transforms, also matrices", world.error(input, posed), hits.size(),
                  same(world.hits(by_matrices), hits));
  }
  return right ? 0 : 1;
}
