// The vertices that exact tests keep of a hull.
#include "engine/exact/hull.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;

std::vector<float> kept(const std::vector<float>& vertices) { return hull_vertices(vertices); }

}  // namespace

TEST_CASE("vertices inside a hull go where qhull is built in, and the others keep their order and bits") {
  const std::vector<float> octahedron = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  std::vector<float> with_inner = octahedron;
  with_inner.insert(with_inner.begin() + 6, {0.1f, 0.1f, 0.1f});
  CHECK(kept(octahedron) == octahedron);
  CHECK(kept(with_inner) == (has_qhull() ? octahedron : with_inner));
}

TEST_CASE("a flat hull keeps its vertices, in any unit of length") {
  const std::vector<float> point = {1, 2, 3}, line = {0, 0, 0, 1, 2, 3, 2, 4, 6};
  const std::vector<float> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::vector<float> square = {1, 1, 3, 1, -1, 3, -1, -1, 3, -1, 1, 3, 0.2f, 0.1f, 3};
  for (const float unit : {1e-30f, 1.0f, 1e17f}) {
    CAPTURE(unit);
    for (std::vector<float> flat : {point, line, triangle, square}) {
      for (float& v : flat) v *= unit;
      CHECK(kept(flat) == flat);
    }
  }
}
