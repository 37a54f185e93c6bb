// Articulations whose links carry any number of leaves, and the judge of whether a point is inside a box.
#pragma once

#include "layout/arena.h"
#include "layout/link_bounds.h"
#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/random.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::tests {

// An articulation and its link bounds.
struct LinkRig {
  explicit LinkRig(const ArticulationDesc& desc) : arena(default_allocator()) {
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
    build_link_bounds(articulation, arena, &link_bounds);
  }
  Arena arena;
  Articulation articulation;
  LinkBounds link_bounds;
};

// One to six links with 0 to most_leaves leaves each, in any order. Boxes are about `size` large and thick to
// needle-thin; many are plates, lines or points. They are near a point in the link's frame that is up to `away` sizes
// from its origin.
inline LinkRig random_links(oracle::Random& random, unsigned most_leaves, double size, double away) {
  std::vector<std::int32_t> parents;
  std::vector<Leaf> leaves;
  const unsigned links = 1 + random.index(6);
  for (unsigned link = 0; link < links; ++link) {
    parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(link)));
    const oracle::Vec3<double> about = size * random.log_uniform(1e-2, away) * random.unit_vector();
    const bool rotated = random.chance(0.7), flat = random.chance(0.3);
    for (unsigned n = random.chance(0.2) && link > 0 ? 0 : 1 + random.index(most_leaves); n > 0; --n) {
      Leaf leaf;
      leaf.link = link;
      double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      if (rotated) random.rotation(axis);
      const oracle::Vec3<double> at = about + size * random.uniform(0.0, 1.0) * random.unit_vector();
      for (std::size_t k = 0; k < 3; ++k) {
        leaf.box.center[k] = static_cast<float>(at[k]);
        leaf.box.half[k] = flat && random.chance(0.5) ? 0 : static_cast<float>(size * random.log_uniform(1e-5, 0.5));
        for (std::size_t c = 0; c < 3; ++c) leaf.box.axis[k][c] = static_cast<float>(axis[k][c]);
      }
      leaves.push_back(leaf);
    }
  }
  for (std::size_t i = leaves.size(); i > 1; --i)
    std::swap(leaves[i - 1], leaves[random.index(static_cast<unsigned>(i))]);
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = leaves;
  return LinkRig(desc);
}

// How far a ball around a corner of `inner` sticks out of `outer` at most, as a part of outer's half extents. Not
// positive if all balls are inside. Both boxes are taken as the exact sets of points that their numbers describe.
inline long double sticking_out(const oracle::OracleBox<float>& outer, const oracle::OracleBox<float>& inner,
                                long double radius) {
  using Real = long double;
  const auto box = oracle::convert<Real>(outer), in = oracle::convert<Real>(inner);
  oracle::Vec3<Real> dual[3];  // rows of the inverse of outer's axes
  for (std::size_t k = 0; k < 3; ++k)
    dual[k] = oracle::cross(oracle::axis_of(box, (k + 1) % 3), oracle::axis_of(box, (k + 2) % 3));
  const Real determinant = oracle::dot(oracle::axis_of(box, 0), dual[0]);
  const oracle::Vec3<Real> between = oracle::center_of(in) - oracle::center_of(box);
  Real worst = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const oracle::Vec3<Real> row = (1 / determinant) * dual[k];
    Real reach = std::fabs(oracle::dot(between, row)) + radius * std::sqrt(oracle::dot(row, row));
    for (std::size_t j = 0; j < 3; ++j) reach += in.half[j] * std::fabs(oracle::dot(oracle::axis_of(in, j), row));
    worst = std::max(worst, (reach - box.half[k]) / std::max(reach, box.half[k]));
  }
  return worst;
}

inline oracle::OracleBox<float> oracle_box(const Box& box) {
  oracle::OracleBox<float> out;
  std::copy_n(box.center, 3, out.center);
  std::copy_n(box.half, 3, out.half);
  for (int k = 0; k < 3; ++k) std::copy_n(box.axis[k], 3, out.axis[k]);
  return out;
}

// A link's box also contains each point that is this part of a leaf's size away from the leaf's box. It is about the
// distance at which the slack of the leaf predicate may still call two leaf boxes touching (docs/proof.md, 6.3).
inline constexpr long double kLeafSlack = 1.18e-3L;

}  // namespace cab::tests
