// The support function of the difference of two convex shapes, smoothed by entropy, and its minimum.
//
// A shape is the sum of a hull of vertices, a body and a ball. A body is the set {sum u_k axis_k : |u| <= 1}. The
// support of a hull along z, max(v . z), becomes mu log sum exp(v . z / mu); that of a body, |(axis_k . z)_k|, becomes
// the root of its square plus mu^2. The gradient of either is a point of the shape, whatever mu is. So every direction
// bounds the gap of two shapes from below, and every gradient bounds it from above.
#pragma once

#include "perf/judge/oracle/vec3.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace cab::oracle {

// A symmetric matrix: xx, yy, zz, xy, xz, yz.
template <class T>
struct Symmetric {
  T m[6] = {};

  void add_outer(const T& weight, const Vec3<T>& p) {
    for (std::size_t k = 0; k < 3; ++k) m[k] += weight * p[k] * p[k];
    m[3] += weight * p[0] * p[1];
    m[4] += weight * p[0] * p[2];
    m[5] += weight * p[1] * p[2];
  }
  void add(const T& weight, const Symmetric& other) {
    for (std::size_t k = 0; k < 6; ++k) m[k] += weight * other.m[k];
  }
  void add_diagonal(const T& value) {
    for (std::size_t k = 0; k < 3; ++k) m[k] += value;
  }
  T trace() const { return m[0] + m[1] + m[2]; }
};

template <class T>
Vec3<T> product(const Symmetric<T>& s, const Vec3<T>& p) {
  return {{s.m[0] * p[0] + s.m[3] * p[1] + s.m[4] * p[2], s.m[3] * p[0] + s.m[1] * p[1] + s.m[5] * p[2],
           s.m[4] * p[0] + s.m[5] * p[1] + s.m[2] * p[2]}};
}

// A Cholesky factor L of a symmetric matrix; positive: whether the matrix is positive definite.
template <class T>
struct Cholesky {
  T xx, yx, yy, zx, zy, zz;
  bool positive = false;

  explicit Cholesky(const Symmetric<T>& s) : xx{}, yx{}, yy{}, zx{}, zy{}, zz{} {
    if (!(s.m[0] > 0)) return;
    xx = std::sqrt(s.m[0]);
    yx = s.m[3] / xx;
    zx = s.m[4] / xx;
    const T y = s.m[1] - yx * yx;
    if (!(y > 0)) return;
    yy = std::sqrt(y);
    zy = (s.m[5] - zx * yx) / yy;
    const T z = s.m[2] - zx * zx - zy * zy;
    if (!(z > 0)) return;
    zz = std::sqrt(z);
    positive = true;
  }

  // x of L L^T x = b.
  Vec3<T> solve(const Vec3<T>& b) const {
    const T p = b[0] / xx, q = (b[1] - yx * p) / yy, r = (b[2] - zx * p - zy * q) / zz;
    const T z = r / zz, y = (q - zy * z) / yy;
    return {{(p - yx * y - zx * z) / xx, y, z}};
  }
};

template <class T>
struct Body {
  Vec3<T> axis[3] = {};
  T extent = 0;  // root of the sum of the squared lengths of the axes; no axis is longer

  Vec3<T> along(const Vec3<T>& z) const { return {{dot(axis[0], z), dot(axis[1], z), dot(axis[2], z)}}; }
  Vec3<T> point(const Vec3<T>& u) const { return u[0] * axis[0] + u[1] * axis[1] + u[2] * axis[2]; }
};

template <class T>
T length(const Vec3<T>& p) {
  return std::sqrt(dot(p, p));
}

// A shape, or its negative, without its ball.
template <class T>
struct Side {
  std::vector<Vec3<T>> vertices;
  Body<T> body;
  T diameter = 0;  // of the vertices, or more
  // What the last soften chose: a weight per vertex, not yet divided by their sum, and the body's u.
  std::vector<T> weights;
  Vec3<T> u{};
};

// The sum of one shape and the negative of another. It contains 0 if the shapes overlap.
template <class T>
struct Difference {
  std::array<Side<T>, 2> side;
  Body<T> ball;  // of both shapes: axes as long as the sum of their radii
  T radius = 0;  // that sum
  T size = 0;    // no extent of the difference is larger
  T noise = 0;   // bound of the rounding of a support along a direction of length 1
};

// Whether the balls of both shapes count.
enum class Balls { kLeftOut, kCounted };

// The support of the difference along a direction, without the balls.
template <class T>
T support(const Difference<T>& difference, const Vec3<T>& direction) {
  T sum = 0;
  for (const Side<T>& side : difference.side) {
    T best = dot(side.vertices.front(), direction);
    for (const Vec3<T>& v : side.vertices) best = larger(best, dot(v, direction));
    sum += best;
    if (side.body.extent > 0) sum += length(side.body.along(direction));
  }
  return sum;
}

// A smoothed support and its derivatives.
template <class T>
struct Softened {
  T value = 0;
  Vec3<T> point[2] = {};  // of each side: their sum is the gradient, but for the balls
  Vec3<T> gradient{};
  Symmetric<T> hessian;
  // Along each direction d of length 1, the difference reaches beyond the gradient by at least d . margin d.
  Symmetric<T> margin;
};

// The point of a side's vertices with the weights of the last soften.
template <class T>
Vec3<T> weighted_mean(const Side<T>& side) {
  T sum = 0;
  Vec3<T> mean{};
  for (std::size_t i = 0; i < side.vertices.size(); ++i) {
    sum += side.weights[i];
    mean = mean + side.weights[i] * side.vertices[i];
  }
  return (1 / sum) * mean;
}

template <class T>
void add_vertices(Side<T>& side, const Vec3<T>& z, const T& mu, Softened<T>& out, Vec3<T>& point) {
  // Less than exp(-kNone) adds nothing to a sum in T.
  constexpr T kNone = static_cast<T>(std::numeric_limits<T>::digits);
  const std::size_t count = side.vertices.size();
  T best = dot(side.vertices.front(), z), sum = 0;
  side.weights.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    side.weights[i] = dot(side.vertices[i], z);
    best = larger(best, side.weights[i]);
  }
  Vec3<T> mean{};
  for (std::size_t i = 0; i < count; ++i) {
    const T below = (side.weights[i] - best) / mu;
    side.weights[i] = below < -kNone ? T(0) : std::exp(below);
    sum += side.weights[i];
    mean = mean + side.weights[i] * side.vertices[i];
  }
  mean = (1 / sum) * mean;
  Symmetric<T> spread;
  for (std::size_t i = 0; i < count; ++i)
    if (side.weights[i] > 0) spread.add_outer(side.weights[i] / sum, side.vertices[i] - mean);
  out.value += best + mu * std::log(sum);
  point = point + mean;
  out.hessian.add(1 / mu, spread);
  // Some point is as far beyond the mean as the variance over the diameter.
  if (side.diameter > 0) out.margin.add(1 / side.diameter, spread);
}

// Returns the u of the body's point.
template <class T>
Vec3<T> add_body(const Body<T>& body, const Vec3<T>& z, const T& mu, Softened<T>& out, Vec3<T>& point) {
  const Vec3<T> along = body.along(z);
  const T root = std::sqrt(dot(along, along) + mu * mu);
  const Vec3<T> u = (1 / root) * along, at = body.point(u);
  const T inside = mu / root * (mu / root);  // 1 - |u|^2, at most twice the 1 - |u| that is free in every direction
  out.value += root;
  point = point + at;
  Symmetric<T> square;
  for (const Vec3<T>& axis : body.axis) square.add_outer(1, axis);
  out.hessian.add(1 / root, square);
  out.hessian.add_outer(-1 / root, at);
  out.margin.add(inside / (2 * body.extent), square);
  return u;
}

template <class T>
Softened<T> soften(Difference<T>& difference, const Vec3<T>& z, const T& mu, Balls balls) {
  Softened<T> out;
  for (std::size_t k = 0; k < 2; ++k) {
    Side<T>& side = difference.side[k];
    add_vertices(side, z, mu, out, out.point[k]);
    if (side.body.extent > 0) side.u = add_body(side.body, z, mu, out, out.point[k]);
  }
  out.gradient = out.point[0] + out.point[1];
  if (balls == Balls::kCounted && difference.radius > 0) add_body(difference.ball, z, mu, out, out.gradient);
  return out;
}

// How much the terms of a smoothed support change at most over a step, relative to mu.
template <class T>
T change_over(const Difference<T>& difference, const Vec3<T>& step, const T& mu, Balls balls) {
  T sum = 0;
  for (const Side<T>& side : difference.side) {
    T least = dot(side.vertices.front(), step), most = least;
    for (const Vec3<T>& v : side.vertices) {
      const T here = dot(v, step);
      least = here < least ? here : least;
      most = larger(most, here);
    }
    sum += most - least + 2 * length(side.body.along(step));
  }
  if (balls == Balls::kCounted) sum += 2 * length(difference.ball.along(step));
  return sum / mu;
}

// Moves the weights and the u of the last soften, so that the points of the sides sum to a multiple of a direction of
// length 1. They stay points of the sides: weights stay positive, and no u becomes longer than 1. What soften chooses
// carries the rounding of v . z, magnified by 1 / mu.
template <class T>
void balance(Difference<T>& difference, const Vec3<T>& direction, Softened<T>& softened) {
  for (int round = 0; round < 3; ++round) {
    Vec3<T> mean[2];
    T inside[2] = {};
    Symmetric<T> freedom;
    for (std::size_t k = 0; k < 2; ++k) {
      const Side<T>& side = difference.side[k];
      mean[k] = weighted_mean(side);
      T sum = 0;
      for (const T& weight : side.weights) sum += weight;
      for (std::size_t i = 0; i < side.vertices.size(); ++i)
        freedom.add_outer(side.weights[i] / sum, side.vertices[i] - mean[k]);
      inside[k] = larger(T(0), T(1) - dot(side.u, side.u));
      for (const Vec3<T>& axis : side.body.axis) freedom.add_outer(inside[k], axis);
    }
    const T trace = freedom.trace();
    if (!(trace > 0)) return;
    freedom.add_outer(trace, direction);
    freedom.add_diagonal(trace * std::sqrt(std::numeric_limits<T>::epsilon()));
    const Cholesky<T> factor(freedom);
    if (!factor.positive) return;
    const Vec3<T> sum = softened.point[0] + softened.point[1];
    const Vec3<T> move = factor.solve(dot(sum, direction) * direction - sum);
    for (std::size_t k = 0; k < 2; ++k) {
      Side<T>& side = difference.side[k];
      for (std::size_t i = 0; i < side.vertices.size(); ++i)
        side.weights[i] *= larger(T(0.5), T(1) + dot(side.vertices[i] - mean[k], move));
      side.u = side.u + inside[k] * side.body.along(move);
      side.u = (1 / larger(T(1), length(side.u))) * side.u;
      softened.point[k] = weighted_mean(side) + side.body.point(side.u);
    }
  }
}

// Newton's method for the smoothed support plus pull |z|^2 / 2, from z. Ends after some rounds, or when a round would
// gain least_gain or less, or when stop(z, softened) says so. Returns the last z. A third derivative of the smoothed
// support is at most change_over times the second, so a step shortened to log(1 + change) / change never overshoots.
template <class T, class Stop>
Vec3<T> minimise(Difference<T>& difference, Vec3<T> z, const T& mu, const T& pull, Balls balls, int rounds,
                 const T& least_gain, const Stop& stop) {
  Softened<T> here = soften(difference, z, mu, balls);
  for (int round = 0; round < rounds; ++round) {
    if (stop(z, here)) return z;
    Symmetric<T> hessian = here.hessian;
    hessian.add_diagonal(pull);
    hessian.add_diagonal(4 * std::numeric_limits<T>::epsilon() * hessian.trace());
    const Cholesky<T> factor(hessian);
    if (!factor.positive) return z;
    const Vec3<T> gradient = here.gradient + pull * z, step = factor.solve(T(-1) * gradient);
    const T slope = dot(gradient, step);
    if (!(-slope > least_gain)) return z;
    const T change = change_over(difference, step, mu, balls);
    const T safe = change > 0 ? std::log1p(change) / change : T(1);
    const auto value = [&](const Vec3<T>& at, const Softened<T>& soft) { return soft.value + pull * dot(at, at) / 2; };
    T t = 1;
    Vec3<T> next = z + step;
    Softened<T> there = soften(difference, next, mu, balls);
    while (t > safe && !(value(next, there) <= value(z, here) + t * slope / 4)) {
      t = larger(t / 4, safe);
      next = z + t * step;
      there = soften(difference, next, mu, balls);
    }
    z = next;
    here = there;
  }
  return z;
}

// A local minimum over directions of length 1 of the support without balls, near a direction. Smoothing falls from
// `from` to `to`, in parts of the size.
template <class T>
Vec3<T> descend(Difference<T>& difference, Vec3<T> d, const T& from, const T& to) {
  d = (1 / length(d)) * d;
  for (T part = from; part > to; part *= T(0.2)) {
    const T mu = part * difference.size;
    Softened<T> here = soften(difference, d, mu, Balls::kLeftOut);
    for (int round = 0; round < 12; ++round) {
      // The Hessian on the sphere, along two directions u and v in the tangent plane.
      std::size_t least = 0;
      for (std::size_t k = 1; k < 3; ++k) least = magnitude(d[k]) < magnitude(d[least]) ? k : least;
      Vec3<T> axis{};
      axis[least] = 1;
      Vec3<T> u = cross(d, axis);
      u = (1 / length(u)) * u;
      const Vec3<T> v = cross(d, u);
      const T bend = dot(here.gradient, d);
      const T uu = dot(u, product(here.hessian, u)) - bend, vv = dot(v, product(here.hessian, v)) - bend;
      const T uv = dot(u, product(here.hessian, v));
      const T gu = dot(here.gradient, u), gv = dot(here.gradient, v);
      // Along its eigenvectors, with the magnitudes of its eigenvalues, a step always descends.
      const T middle = (uu + vv) / 2, half = (uu - vv) / 2, root = std::sqrt(half * half + uv * uv);
      const T turn = std::atan2(uv, half) / 2, c = std::cos(turn), s = std::sin(turn);
      const T floor = std::numeric_limits<T>::epsilon() * (magnitude(middle) + root) + difference.noise;
      const T high = larger(magnitude(middle + root), floor), low = larger(magnitude(middle - root), floor);
      const T gp = c * gu + s * gv, gq = c * gv - s * gu;
      const T p = -gp / high, q = -gq / low;
      const T slope = gp * p + gq * q;
      if (!(-slope > T(1e-10) * mu)) break;
      const Vec3<T> step = (c * p - s * q) * u + (s * p + c * q) * v;
      T t = larger(T(1), length(step)) > 1 ? 1 / length(step) : T(1);
      bool better = false;
      for (int halving = 0; halving < 24 && !better; ++halving, t /= 3) {
        Vec3<T> next = d + t * step;
        next = (1 / length(next)) * next;
        const Softened<T> there = soften(difference, next, mu, Balls::kLeftOut);
        better = there.value <= here.value + t * slope / 4;
        if (!better) continue;
        d = next;
        here = there;
      }
      if (!better) break;
    }
  }
  return d;
}

}  // namespace cab::oracle
