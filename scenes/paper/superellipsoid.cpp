// The 58-vertex superellipsoid polytope that the paper's links are made of.
#include "scenes/paper/superellipsoid.h"

namespace cab::scenes {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

std::vector<float> superellipsoid(double a, double b, double c, double e) {
  std::vector<float> vertices;
  vertices.reserve(58 * 3);
  const auto add = [&vertices](double x, double y, double z) {
    vertices.push_back(static_cast<float>(x));
    vertices.push_back(static_cast<float>(y));
    vertices.push_back(static_cast<float>(z));
  };
  add(-a, 0, 0);
  add(a, 0, 0);
  for (int k = 1; k <= 7; ++k) {
    const double theta = kPi * k / 8;
    const double s = -spow(std::cos(theta), e);
    const double r = spow(std::sin(theta), e);
    for (int j = 0; j < 8; ++j) {
      const double phi = kPi * j / 4;
      add(a * s, b * r * spow(std::cos(phi), e), c * r * spow(std::sin(phi), e));
    }
  }
  return vertices;
}

}  // namespace cab::scenes
