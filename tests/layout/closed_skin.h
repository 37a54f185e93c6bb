// Skins of closed parts, and how often they wind about a point: by the solid angles of all triangles, which shares
// nothing with rays.
#pragma once

#include "perf/judge/oracle/random_skins.h"
#include "perf/judge/oracle/triangle_judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace cab::tests {

using namespace cab::oracle;

// Vertices of a skin, and triangles that are counter-clockwise from outside.
struct Mesh {
  std::vector<Vec3<double>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  void add(const Mesh& other) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const auto& t : other.triangles) triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
};

// An octahedron, each of whose triangles is divided into four several times, on a unit ball.
inline Mesh ball_mesh(unsigned times) {
  Mesh out;
  for (std::size_t c = 0; c < 3; ++c)
    for (const double side : {1.0, -1.0}) {
      Vec3<double> v{};
      v[c] = side;
      out.vertices.push_back(v);
    }
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const std::uint32_t x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    const bool swap = (x + y + z) % 2 != 0;
    out.triangles.push_back({x, swap ? z : y, swap ? y : z});
  }
  for (unsigned n = 0; n < times; ++n) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(out.vertices.size()));
      if (is_new) {
        const Vec3<double> sum = out.vertices[a] + out.vertices[b];
        out.vertices.push_back((1 / std::sqrt(dot(sum, sum))) * sum);
      }
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : out.triangles) {
      const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    out.triangles = finer;
  }
  return out;
}

// A closed part of about a size, neither convex nor regular, about a place.
inline Mesh lump_mesh(Random& random, unsigned times, const Vec3<double>& size, const Vec3<double>& at) {
  Mesh out = ball_mesh(times);
  for (Vec3<double>& v : out.vertices) {
    const double radius = random.uniform(0.55, 1);
    for (std::size_t c = 0; c < 3; ++c) v[c] = at[c] + radius * size[c] * v[c];
  }
  return out;
}

// A skin of a mesh on a chain of links along x, each of `length`. Every vertex is moved by the two links that are
// nearest to it. Leaves have up to `most` triangles each, in the order along x or in any.
inline SkinRig rig_of(const Mesh& mesh, std::uint32_t links, double length, std::uint32_t most,
                      Random* shuffle = nullptr) {
  SkinRig out;
  out.size = length;
  out.influence_count = 2;
  for (std::uint32_t link = 0; link < links; ++link) {
    out.parents.push_back(static_cast<std::int32_t>(link) - 1);
    out.bound_turn.push_back({0, 0, 0, 1});
    out.bound_at.push_back(length * Vec3<double>{{static_cast<double>(link), 0, 0}});
    append_inverse_bind(out.bound_turn.back(), out.bound_at.back(), {{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}},
                        out.inverse_bind);
  }
  const auto last = static_cast<double>(links - 1);
  for (const Vec3<double>& v : mesh.vertices) {
    const double place = std::clamp(v[0] / length, 0.0, last),
                 first = std::min(std::floor(place), std::max(0.0, last - 1));
    for (std::size_t c = 0; c < 3; ++c) out.vertices.push_back(static_cast<float>(v[c]));
    for (const double i : {0.0, 1.0}) {
      out.links.push_back(static_cast<std::uint32_t>(std::min(first + i, last)));
      out.weights.push_back(static_cast<float>(i == 0 ? 1 - (place - first) : place - first));
    }
  }
  std::vector<std::size_t> order(mesh.triangles.size());
  for (std::size_t t = 0; t < order.size(); ++t) order[t] = t;
  std::stable_sort(order.begin(), order.end(), [&mesh](std::size_t x, std::size_t y) {
    return mesh.vertices[mesh.triangles[x][0]][0] < mesh.vertices[mesh.triangles[y][0]][0];
  });
  if (shuffle)
    for (std::size_t t = order.size(); t > 1; --t)
      std::swap(order[t - 1], order[shuffle->index(static_cast<unsigned>(t))]);
  for (std::size_t begin = 0; begin < order.size(); begin += most) {
    std::vector<std::uint32_t> corners;
    for (std::size_t t = begin; t < std::min<std::size_t>(begin + most, order.size()); ++t)
      corners.insert(corners.end(), mesh.triangles[order[t]].begin(), mesh.triangles[order[t]].end());
    Leaf leaf;
    leaf.link = static_cast<std::uint32_t>(std::clamp(mesh.vertices[corners[0]][0] / length, 0.0, last));
    out.leaves.push_back(leaf);
    out.triangles.push_back(std::move(corners));
  }
  for (std::size_t leaf = 0; leaf < out.leaves.size(); ++leaf) out.leaves[leaf].triangles = out.triangles[leaf];
  return out;
}

// All triangles of an instance of a skin in the world.
inline std::vector<Triangle<Real>> placed_triangles(const SkinRig& rig, const Poses& poses, std::uint32_t instance) {
  std::vector<Triangle<Real>> out;
  const ArticulationDesc desc = rig.desc();
  const std::vector<ExactPose> exact = exact_poses(poses, instance);
  for (const std::vector<std::uint32_t>& corners : rig.triangles)
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      Triangle<Real> triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        triangle.corner[k] = skinned_vertex(desc.skin, exact, corners[t + k]);
        for (std::size_t c = 0; c < 3 && !poses.origins.empty(); ++c)
          triangle.corner[k][c] += Real{poses.origins[3 * std::size_t{instance} + c]};
      }
      out.push_back(triangle);
    }
  return out;
}

// How often triangles wind about a point: 0 outside of a closed part, 1 or -1 inside.
inline Real winding_of(const std::vector<Triangle<Real>>& triangles, const Point& at) {
  Real sum = 0;
  for (const Triangle<Real>& triangle : triangles) {
    const Point a = triangle.corner[0] - at, b = triangle.corner[1] - at, c = triangle.corner[2] - at;
    const Real la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::acos(Real{-1}));
}

// The least distance of any two triangles.
inline Real distance_of(const std::vector<Triangle<Real>>& a, const std::vector<Triangle<Real>>& b) {
  Real out = HUGE_VALL;
  for (const Triangle<Real>& s : a)
    for (const Triangle<Real>& t : b) out = std::min(out, distance(s, t));
  return out;
}

}  // namespace cab::tests
