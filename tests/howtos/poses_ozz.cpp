// Matrices as ozz-animation has them, handed over as in docs/poses.md, against points that are posed one by one.
#include "tests/howtos/poses_ozz.h"

#include "tests/howtos/poses_check.h"

namespace {

using as_in_ozz::Float4x4;
using namespace poses_check;

// A joint's matrix in its parent: columns are where the axes go, then the translation.
Float4x4 local(const Transform& t) {
  Float4x4 m{};
  for (std::size_t column = 0; column < 3; ++column) {
    Point axis{};
    axis[column] = t.scale;
    const Point image = rotated(t.rotation, axis);
    for (std::size_t k = 0; k < 3; ++k) m.cols[column][k] = static_cast<float>(image[k]);
  }
  for (std::size_t k = 0; k < 3; ++k) m.cols[3][k] = static_cast<float>(t.translation[k]);
  m.cols[3][3] = 1;
  return m;
}

Float4x4 operator*(const Float4x4& a, const Float4x4& b) {
  Float4x4 product{};
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      for (int k = 0; k < 4; ++k) product.cols[column][row] += a.cols[k][row] * b.cols[column][k];
  return product;
}

}  // namespace

int main() {
  const Crowd crowd = crowd_of(1, true);
  const Places places(crowd);
  std::vector<as_in_ozz::Character> characters(kCharacters);
  std::vector<Float4x4> models;
  for (std::size_t i = 0; i < kCharacters; ++i) {
    for (std::size_t l = 0; l < kLinks; ++l) {  // as LocalToModelJob does, which stands for it here
      Float4x4& model = characters[i].models[l];
      model = local(crowd.links[i][l]);
      if (kParents[l] >= 0) model = characters[i].models[kParents[l]] * model;
      models.push_back(model);
    }
  }
  const std::int16_t joint_parents[] = {-1, 0, 1, 0};
  World world(as_in_ozz::parents_of(joint_parents), leaves_of(1));
  const auto posed = [&](std::uint32_t i, std::uint32_t link, const Point& p) {
    return rotated(crowd.places[i].rotation, crowd.in_character(i, link, p));
  };
  const cab::BatchInput packed = input_of(world.batch(), as_in_ozz::poses_of(models.data()), places);
  const cab::BatchInput strided = input_of(world.batch(), as_in_ozz::poses_of(characters.data()), places);
  const std::vector<cab::Hit> hits = world.hits(packed);
  bool right = line("matrices in one array", world.error(packed, posed), hits.size(), true);
  right &= line("matrices in structures", world.error(strided, posed), hits.size(), same(world.hits(strided), hits));
  return right ? 0 : 1;
}
