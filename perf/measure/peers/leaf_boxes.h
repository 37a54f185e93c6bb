// Code that users of the peers write themselves: it makes leaf boxes in the world from poses and computes their bounds.
// It also has a scalar overlap test.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "perf/measure/peers/crowd_leaves.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// An oriented box in the world, in the peer's scalar: center + sum x_k axis[k], |x_k| <= half[k].
template <class Real>
struct WorldBox {
  Real center[3];
  Real axis[3][3];  // axis[k][component]
  Real half[3];
};

struct WorldBounds {
  float low[3], high[3];
};

// Leaf boxes of a crowd: from poses to the world. The figures' boxes lie along their links' axes.
template <class Real>
class LeafPoser : public CrowdLeaves {
 public:
  explicit LeafPoser(const scenes::Crowd& crowd) : CrowdLeaves(crowd) {
    for (const scenes::CrowdGroup& group : crowd.groups) {
      link_counts_.push_back(group.figure.link_parents.size());
      kinds_.insert(kinds_.end(), group.figure.leaves.begin(), group.figure.leaves.end());
    }
  }

  std::uint32_t kind_count() const { return static_cast<std::uint32_t>(kinds_.size()); }
  const Box& local_box(std::uint32_t kind) const { return kinds_[kind].box; }

  // The exact shape of a kind of leaf, along its box's axes about its centre. Null: the box.
  const ConvexPart* local_shape(std::uint32_t kind) const {
    return kinds_[kind].parts.empty() ? nullptr : &kinds_[kind].parts.front().shape;
  }

  // Poses are unit quaternions, which the scenes make. The origin is added in double and rounded once.
  WorldBox<Real> pose(const std::vector<scenes::PosedGroup>& posed, std::uint32_t leaf) const {
    const Character& owner = character(character_of(leaf));
    const scenes::PosedGroup& group = posed[owner.group];
    const scenes::BodyLeaf& kind = kinds_[kind_of(leaf)];
    const float* const f = group.poses.data() + (owner.instance * link_counts_[owner.group] + kind.link) * 7;
    const double* const origin = group.origins.data() + std::size_t{owner.instance} * 3;
    const Box& local = kind.box;
    const Real x = f[0], y = f[1], z = f[2], w = f[3];
    WorldBox<Real> box = {{},
                          {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                           {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                           {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}},
                          {local.half[0], local.half[1], local.half[2]}};
    for (std::size_t c = 0; c < 3; ++c) {
      const Real offset = f[4 + c] + (local.center[0] * box.axis[0][c] + local.center[1] * box.axis[1][c] +
                                      local.center[2] * box.axis[2][c]);
      box.center[c] = static_cast<Real>(origin[c] + static_cast<double>(offset));
    }
    return box;
  }

 private:
  std::vector<std::size_t> link_counts_;  // of each group's figure
  std::vector<scenes::BodyLeaf> kinds_;
};

template <class Real>
Real projected_radius(const WorldBox<Real>& box, std::size_t c) {
  return std::abs(box.axis[0][c]) * box.half[0] + std::abs(box.axis[1][c]) * box.half[1] +
         std::abs(box.axis[2][c]) * box.half[2];
}

inline WorldBounds bounds_of(const WorldBox<float>& box) {
  WorldBounds bounds;
  for (std::size_t c = 0; c < 3; ++c) {
    const float reach = projected_radius(box, c);
    bounds.low[c] = box.center[c] - reach;
    bounds.high[c] = box.center[c] + reach;
  }
  return bounds;
}

inline void grow(WorldBounds& bounds, const WorldBounds& by) {
  for (std::size_t c = 0; c < 3; ++c) {
    bounds.low[c] = by.low[c] < bounds.low[c] ? by.low[c] : bounds.low[c];
    bounds.high[c] = by.high[c] > bounds.high[c] ? by.high[c] : bounds.high[c];
  }
}

inline bool bounds_overlap(const WorldBounds& a, const WorldBounds& b) {
  return a.low[0] <= b.high[0] && b.low[0] <= a.high[0] && a.low[1] <= b.high[1] && b.low[1] <= a.high[1] &&
         a.low[2] <= b.high[2] && b.low[2] <= a.high[2];
}

// The textbook test on 15 axes (Gottschalk, Lin, Manocha 1996), which returns at the first axis that separates. 1e-6 is
// its usual slack for parallel edges.
inline bool boxes_overlap(const WorldBox<float>& a, const WorldBox<float>& b) {
  float r[3][3], s[3][3], t[3];
  const float d[3] = {b.center[0] - a.center[0], b.center[1] - a.center[1], b.center[2] - a.center[2]};
  const auto dot = [](const float(&u)[3], const float(&v)[3]) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; };
  for (std::size_t i = 0; i < 3; ++i) {
    t[i] = dot(d, a.axis[i]);
    for (std::size_t j = 0; j < 3; ++j) {
      r[i][j] = dot(a.axis[i], b.axis[j]);
      s[i][j] = std::abs(r[i][j]) + 1e-6f;
    }
    if (std::abs(t[i]) > a.half[i] + (b.half[0] * s[i][0] + b.half[1] * s[i][1] + b.half[2] * s[i][2])) return false;
  }
  for (std::size_t j = 0; j < 3; ++j)
    if (std::abs(t[0] * r[0][j] + t[1] * r[1][j] + t[2] * r[2][j]) >
        b.half[j] + (a.half[0] * s[0][j] + a.half[1] * s[1][j] + a.half[2] * s[2][j]))
      return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      if (std::abs(t[i2] * r[i1][j] - t[i1] * r[i2][j]) >
          a.half[i1] * s[i2][j] + a.half[i2] * s[i1][j] + b.half[j1] * s[i][j2] + b.half[j2] * s[i][j1])
        return false;
    }
  }
  return true;
}

// All leaf boxes of a crowd with their bounds, and the bounds of each character. Set-ups need it if their library tests
// only bounds.
class CrowdBoxes {
 public:
  explicit CrowdBoxes(const scenes::Crowd& crowd)
      : leaves_(crowd),
        boxes_(leaves_.leaf_count()),
        bounds_(leaves_.leaf_count()),
        characters_(leaves_.character_count()) {}

  void pose(const std::vector<scenes::PosedGroup>& posed) {
    for (std::uint32_t i = 0; i < characters_.size(); ++i) {
      const std::uint32_t first = leaves_.character(i).first_leaf;
      for (std::uint32_t n = first; n < leaves_.end_leaf(i); ++n) {
        boxes_[n] = leaves_.pose(posed, n);
        bounds_[n] = bounds_of(boxes_[n]);
        if (n == first) characters_[i] = bounds_[n];
        grow(characters_[i], bounds_[n]);
      }
    }
  }

  const LeafPoser<float>& leaves() const { return leaves_; }
  std::uint32_t character_of(std::uint32_t number) const { return leaves_.character_of(number); }
  const WorldBox<float>& box(std::uint32_t number) const { return boxes_[number]; }
  const WorldBounds& bounds(std::uint32_t number) const { return bounds_[number]; }
  const WorldBounds& character(std::uint32_t i) const { return characters_[i]; }

  // Calls found(a, b) for every leaf of one character and leaf of another whose bounds overlap. Looks only at leaves
  // that overlap the other character's bounds.
  template <class Found>
  void for_leaves(std::uint32_t i, std::uint32_t j, Found&& found) const {
    const std::uint32_t first_a = leaves_.character(i).first_leaf, end_a = leaves_.end_leaf(i);
    const std::uint32_t first_b = leaves_.character(j).first_leaf, end_b = leaves_.end_leaf(j);
    for (std::uint32_t a = first_a; a < end_a; ++a) {
      if (!bounds_overlap(bounds_[a], characters_[j])) continue;
      for (std::uint32_t b = first_b; b < end_b; ++b)
        if (bounds_overlap(bounds_[a], bounds_[b])) found(a, b);
    }
  }

 private:
  LeafPoser<float> leaves_;
  std::vector<WorldBox<float>> boxes_;
  std::vector<WorldBounds> bounds_;
  std::vector<WorldBounds> characters_;
};

}  // namespace cab::perf
