// The dented link of the paper's Table 3: its convex pieces, and the boundary of their union.
#include "scenes/paper/dented_link.h"

#include "scenes/paper/superellipsoid.h"

#include <array>
#include <cmath>
#include <utility>

namespace cab::scenes {
namespace {

// The search that found the chains' motion found these numbers too.
constexpr double kHeight = 2 * kDentedHalf[2];
constexpr double kDent = .75;      // depth of the dent over the height
constexpr double kExponent = .75;  // of the superellipsoid

constexpr double kPi = 3.14159265358979323846;

// Pieces along x and around it. In a grid of twice as many steps, corners of pieces have even indices, and
// middles have odd ones.
constexpr int kAlong = 4, kAround = 3;

enum class Side { kOuter, kInner };

// cos and sin of a fraction of a half turn. They return an exact 0 where the rounded pi would give 6e-17.
double cosine(int step, int steps) { return 2 * step == steps ? 0 : std::cos(kPi * step / steps); }
double sine(int step, int steps) { return step == steps ? 0 : std::sin(kPi * step / steps); }

// The point of the surface at step i of 2 kAlong from pole to pole, and step j of 2 kAround from rim to rim.
Vec3 surface_point(int i, int j, Side side) {
  const double s = -spow(cosine(i, 2 * kAlong), kExponent);
  const double r = spow(sine(i, 2 * kAlong), kExponent);
  const double y = -spow(cosine(j, 2 * kAround), kExponent) * (side == Side::kOuter ? 1 : (1 + kDent) / 2);
  const double z = -spow(sine(j, 2 * kAround), kExponent) * (side == Side::kOuter ? 1 : kDent);
  return {kDentedHalf[0] * s, kDentedHalf[1] * r * y, kHeight * r * z + kHeight / 2};
}

bool is_pole(int i) { return i == 0 || i == 2 * kAlong; }

void append(std::vector<float>& vertices, const Vec3& v) {
  for (const double x : v) vertices.push_back(static_cast<float>(x));
}

// The mesh's vertices in order: the two poles, then kAlong - 1 rings of outer and inner corners, then the middles.
std::uint32_t corner_index(int k, int w, Side side) {
  if (k == 0) return 0;
  if (k == kAlong) return 1;
  const int in_ring = side == Side::kOuter ? w : kAround + 1 + w;
  return static_cast<std::uint32_t>(2 + (k - 1) * 2 * (kAround + 1) + in_ring);
}

std::uint32_t middle_index(int k, int w) {
  return static_cast<std::uint32_t>(2 + (kAlong - 1) * 2 * (kAround + 1) + k * kAround + w);
}

// Appends a triangle, unless two of its corners are the same pole, so that it has no area.
void append_triangle(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (a == b || b == c || c == a) return;
  mesh.triangles.insert(mesh.triangles.end(), {a, b, c});
}

void append_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  append_triangle(mesh, a, b, c);
  append_triangle(mesh, a, c, d);
}

// Appends the faces of piece (k, w) that no other piece shares.
void append_faces(TriangleMesh& mesh, int k, int w) {
  const auto corners = [k, w](Side side) {
    return std::array<std::uint32_t, 4>{corner_index(k, w, side), corner_index(k, w + 1, side),
                                        corner_index(k + 1, w + 1, side), corner_index(k + 1, w, side)};
  };
  const std::array<std::uint32_t, 4> outer = corners(Side::kOuter), inner = corners(Side::kInner);
  for (std::size_t e = 0; e < 4; ++e) append_triangle(mesh, middle_index(k, w), outer[e], outer[(e + 1) % 4]);
  append_quad(mesh, inner[0], inner[3], inner[2], inner[1]);
  if (w == 0) append_quad(mesh, outer[0], outer[3], inner[3], inner[0]);
  if (w == kAround - 1) append_quad(mesh, inner[1], inner[2], outer[2], outer[1]);
}

}  // namespace

std::vector<std::vector<float>> dented_link_pieces() {
  std::vector<std::vector<float>> pieces;
  for (int k = 0; k < kAlong; ++k) {
    for (int w = 0; w < kAround; ++w) {
      std::vector<float> vertices;
      for (const int i : {2 * k, 2 * k + 2}) {
        if (is_pole(i)) {
          append(vertices, surface_point(i, 0, Side::kOuter));
          continue;
        }
        for (const Side side : {Side::kOuter, Side::kInner})
          for (const int j : {2 * w, 2 * w + 2}) append(vertices, surface_point(i, j, side));
      }
      append(vertices, surface_point(2 * k + 1, 2 * w + 1, Side::kOuter));
      pieces.push_back(std::move(vertices));
    }
  }
  return pieces;
}

TriangleMesh dented_link_mesh() {
  TriangleMesh mesh;
  for (const int k : {0, kAlong}) append(mesh.vertices, surface_point(2 * k, 0, Side::kOuter));
  for (int k = 1; k < kAlong; ++k)
    for (const Side side : {Side::kOuter, Side::kInner})
      for (int w = 0; w <= kAround; ++w) append(mesh.vertices, surface_point(2 * k, 2 * w, side));
  for (int k = 0; k < kAlong; ++k)
    for (int w = 0; w < kAround; ++w) append(mesh.vertices, surface_point(2 * k + 1, 2 * w + 1, Side::kOuter));
  for (int k = 0; k < kAlong; ++k)
    for (int w = 0; w < kAround; ++w) append_faces(mesh, k, w);
  return mesh;
}

}  // namespace cab::scenes
