// Which triangles of one set touch which of another, by brute force: of every two whose bounds overlap a plane between
// them is looked for in double, and where none is certain they are intersected in long double.
#pragma once

#include "perf/judge/oracle/triangle_certificate.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace cab::oracle {

// Triangles where they are, with their bounds.
class TriangleSet {
 public:
  TriangleSet() = default;
  explicit TriangleSet(std::vector<Triangle<double>> triangles) : at_(std::move(triangles)) {
    for (const Triangle<double>& triangle : at_) {
      Bounds bounds;
      for (const Vec3<double>& corner : triangle.corner) bounds.add(corner);
      all_.add(bounds.lo);
      all_.add(bounds.hi);
      bounds_.push_back(bounds);
    }
  }

  std::size_t size() const { return at_.size(); }

  // Calls on_pair(triangle of a, triangle of b, whether they touch) for every two that touch, or that are not certainly
  // farther apart than `within`, until it returns false.
  template <class OnPair>
  friend void for_near(const TriangleSet& a, const TriangleSet& b, double within, const OnPair& on_pair) {
    if (!a.all_.overlaps(b.all_, within)) return;
    const double reach = std::max(a.all_.reach(), b.all_.reach());
    std::vector<std::size_t> near_b;
    for (std::size_t y = 0; y < b.size(); ++y)
      if (a.all_.overlaps(b.bounds_[y], within)) near_b.push_back(y);
    for (std::size_t x = 0; x < a.size(); ++x) {
      if (!b.all_.overlaps(a.bounds_[x], within)) continue;
      for (const std::size_t y : near_b)
        if (a.bounds_[x].overlaps(b.bounds_[y], within) && !certainly_apart(a.at_[x], b.at_[y], reach, within) &&
            !on_pair(x, y, meet(widened(a.at_[x]), widened(b.at_[y]))))
          return;
    }
  }

  // Calls on_pair(triangle of a, triangle of b) for every two that touch, until it returns false.
  template <class OnPair>
  friend void for_touching(const TriangleSet& a, const TriangleSet& b, const OnPair& on_pair) {
    for_near(a, b, 0, [&](std::size_t x, std::size_t y, bool touches) { return !touches || on_pair(x, y); });
  }

  friend bool any_touch(const TriangleSet& a, const TriangleSet& b) {
    bool found = false;
    for_touching(a, b, [&found](std::size_t, std::size_t) { return !(found = true); });
    return found;
  }

 private:
  struct Bounds {
    Vec3<double> lo = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}}, hi = {{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};

    void add(const Vec3<double>& point) {
      for (std::size_t c = 0; c < 3; ++c) {
        lo[c] = std::min(lo[c], point[c]);
        hi[c] = std::max(hi[c], point[c]);
      }
    }
    bool overlaps(const Bounds& other, double within) const {
      for (std::size_t c = 0; c < 3; ++c)
        if (lo[c] > other.hi[c] + within || other.lo[c] > hi[c] + within) return false;
      return true;
    }
    double reach() const { return std::max(norm_max(lo), norm_max(hi)); }
  };

  static Triangle<Real> widened(const Triangle<double>& triangle) {
    Triangle<Real> out;
    for (std::size_t k = 0; k < 3; ++k) out.corner[k] = convert<Real>(triangle.corner[k]);
    return out;
  }

  std::vector<Triangle<double>> at_;
  std::vector<Bounds> bounds_;
  Bounds all_;
};

}  // namespace cab::oracle
