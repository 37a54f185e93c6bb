// Poses as Unreal has them, left-handed with z up in centimetres, handed over as in docs/poses.md, against points that
// are posed one by one as rows and against the hits of the same crowd in right-handed metres with y up.
#include "tests/howtos/poses_unreal.h"

#include "tests/howtos/poses_check.h"

namespace {

using as_in_unreal::Matrix44f;
using FTransform = as_in_unreal::Transform;
using as_in_unreal::Transform3f;
using namespace poses_check;

// FTransform's product: first a, then b. Component space is local * parent's component space.
FTransform product(const FTransform& a, const FTransform& b) {
  const Point u = {b.rotation[0], b.rotation[1], b.rotation[2]}, v = {a.rotation[0], a.rotation[1], a.rotation[2]};
  const double s = b.rotation[3], t = a.rotation[3];
  const Point w = s * v + t * u + cross(u, v);
  const Point at =
      rotated({b.rotation[0], b.rotation[1], b.rotation[2], s},
              {b.scale[0] * a.translation[0], b.scale[1] * a.translation[1], b.scale[2] * a.translation[2]});
  FTransform out = {};
  for (std::size_t k = 0; k < 3; ++k) {
    out.rotation[k] = w[k];
    out.translation[k] = at[k] + b.translation[k];
    out.scale[k] = a.scale[k] * b.scale[k];
  }
  out.rotation[3] = s * t - u[0] * v[0] - u[1] * v[1] - u[2] * v[2];
  return out;
}

FTransform unreal(const Transform& t) {
  FTransform out = {};
  for (std::size_t k = 0; k < 4; ++k) out.rotation[k] = t.rotation[k];
  for (std::size_t k = 0; k < 3; ++k) out.translation[k] = t.translation[k], out.scale[k] = t.scale;
  return out;
}

// FTransform::ToMatrixWithScale: rows are where the axes go.
Matrix44f matrix(const FTransform& t) {
  Matrix44f m = {};
  for (std::size_t row = 0; row < 3; ++row) {
    Point axis{};
    axis[row] = t.scale[row];
    const Point image = rotated({t.rotation[0], t.rotation[1], t.rotation[2], t.rotation[3]}, axis);
    for (std::size_t k = 0; k < 3; ++k) m.M[row][k] = static_cast<float>(image[k]);
  }
  for (std::size_t k = 0; k < 3; ++k) m.M[3][k] = static_cast<float>(t.translation[k]);
  m.M[3][3] = 1;
  return m;
}

// A point as a row in front of a matrix.
Point row_times(const Point& p, const Matrix44f& m) {
  Point out{};
  for (std::size_t k = 0; k < 3; ++k) out[k] = p[0] * m.M[0][k] + p[1] * m.M[1][k] + p[2] * m.M[2][k] + m.M[3][k];
  return out;
}

std::vector<FTransform> component_space(const Crowd& crowd) {
  std::vector<FTransform> out(kLinks * kCharacters);
  for (std::size_t i = 0; i < kCharacters; ++i)
    for (std::size_t l = 0; l < kLinks; ++l) {
      out[kLinks * i + l] = unreal(crowd.links[i][l]);
      if (kParents[l] >= 0)
        out[kLinks * i + l] = product(out[kLinks * i + l], out[kLinks * i + static_cast<std::size_t>(kParents[l])]);
    }
  return out;
}

// Component-space matrices, times the scale of the component.
std::vector<Matrix44f> matrices_of(const Crowd& crowd) {
  std::vector<Matrix44f> out;
  for (const FTransform& t : component_space(crowd)) {
    const Transform size = {{}, {0, 0, 0, 1}, crowd.places[out.size() / kLinks].scale};
    out.push_back(matrix(product(t, unreal(size))));
  }
  return out;
}

// From Unreal to right-handed metres with y up: y and z change places, and lengths are divided by 100.
Transform converted(const Transform& t) {
  return {{t.translation[0] / 100, t.translation[2] / 100, t.translation[1] / 100},
          {-t.rotation[0], -t.rotation[2], -t.rotation[1], t.rotation[3]},
          t.scale};
}
Crowd converted(Crowd crowd) {
  for (Transform& place : crowd.places) place = converted(place);
  for (auto& links : crowd.links)
    for (Transform& link : links) link = converted(link);
  return crowd;
}
std::vector<cab::Leaf> converted(std::vector<cab::Leaf> leaves) {
  for (cab::Leaf& leaf : leaves) {
    for (int k = 0; k < 3; ++k) leaf.box.center[k] /= 100, leaf.box.half[k] /= 100;
    std::swap(leaf.box.center[1], leaf.box.center[2]);
    std::swap(leaf.box.half[1], leaf.box.half[2]);
  }
  return leaves;
}

}  // namespace

int main() {
  bool right = true;
  World world(leaves_of(100)), metres(converted(leaves_of(100)));
  for (const bool scales : {true, false}) {
    const Crowd crowd = crowd_of(100, scales), other = converted(crowd);
    const Places places(crowd), other_places(other);
    const std::vector<FTransform> transforms = component_space(crowd);
    std::vector<Matrix44f> local_matrices;
    for (const auto& links : crowd.links)
      for (const Transform& link : links) local_matrices.push_back(matrix(unreal(link)));
    const std::vector<Matrix44f> matrices = matrices_of(crowd), other_matrices = matrices_of(other);

    // Independent of the products above: the point as a row goes through the local matrices one by one.
    const auto posed = [&](std::uint32_t i, std::uint32_t link, Point p) {
      for (auto l = static_cast<std::int32_t>(link); l >= 0; l = kParents[static_cast<std::size_t>(l)])
        p = row_times(p, local_matrices[kLinks * i + static_cast<std::size_t>(l)]);
      return rotated(crowd.places[i].rotation, crowd.places[i].scale * p);
    };
    const cab::BatchInput by_matrices = input_of(world.batch(), as_in_unreal::poses_of(matrices.data()), places);
    const cab::BatchInput by_other =
        input_of(metres.batch(), as_in_unreal::poses_of(other_matrices.data()), other_places);
    const std::vector<cab::Hit> hits = world.hits(by_matrices);
    right &= line(scales ? "matrices with scales, also right-handed" : "matrices, also right-handed",
                  world.error(by_matrices, posed), hits.size(), same(metres.hits(by_other), hits));
    if (scales) continue;

    std::vector<Transform3f> floats(transforms.size());
    for (std::size_t i = 0; i < transforms.size(); ++i)
      for (std::size_t k = 0; k < 4; ++k) {
        floats[i].rotation[k] = static_cast<float>(transforms[i].rotation[k]);
        floats[i].translation[k] = static_cast<float>(transforms[i].translation[k]);
        floats[i].scale[k] = static_cast<float>(transforms[i].scale[k]);
      }
    cab::BatchInput by_floats = input_of(world.batch(), as_in_unreal::poses_of(floats.data()), places);
    by_floats.scales = places.scales;
    right &=
        line("transforms of floats", world.error(by_floats, posed), hits.size(), same(world.hits(by_floats), hits));

    std::vector<float> poses;
    as_in_unreal::append_poses(transforms.data(), transforms.size(), &poses);
    cab::PoseView view;
    view.data = poses.data();
    cab::BatchInput by_doubles = input_of(world.batch(), view, places);
    by_doubles.scales = places.scales;
    right &=
        line("transforms of doubles", world.error(by_doubles, posed), hits.size(), same(world.hits(by_doubles), hits));
  }
  return right ? 0 : 1;
}
