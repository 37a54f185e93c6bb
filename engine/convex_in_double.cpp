#include "engine/convex_in_double.h"

#include "engine/convex_pair.h"
#include "kernels/convex/gjk.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cab {
namespace {

using DifferencePoint = ConvexPair::DifferencePoint;
using kernel::cross;
using kernel::dot;
using kernel::Simplex;

double length(const Double3& v) { return std::sqrt(dot(v, v)); }
Double3 minus(const Double3& v) { return {-v.x, -v.y, -v.z}; }

// ------------------------------------------------------------------------------------------------------- contacts

// The closest point of the difference to the origin, or a tetrahedron of the difference that contains the origin.
struct Closest {
  bool inside = false;
  Double3 normal = {};                         // from the origin to the closest point; not inside
  double distance = 0;                         // a lower bound of its length, equal to rounding
  std::array<DifferencePoint, 4> corner = {};  // of the feature (the last is unused) or of the tetrahedron
};

// GJK until it cannot come closer.
Closest find_closest(const ConvexPair& pair) {
  Closest out;
  Simplex<double> simplex = {};
  std::array<DifferencePoint, kernel::kGjkInDouble.steps> visited = {};
  const auto visited_at = [&visited](const Double3& at, std::uint32_t count) {
    const auto same = [&at](const DifferencePoint& p) { return p.at.x == at.x && p.at.y == at.y && p.at.z == at.z; };
    const auto found = std::find_if(visited.begin(), visited.begin() + count, same);
    return found == visited.begin() + count ? visited[0] : *found;  // none only if the shapes hold a NaN
  };
  Double3 v = dot(pair.t(), pair.t()) > 0 ? minus(pair.t()) : Double3{1, 0, 0};
  for (std::uint32_t step = 0; step < visited.size() && dot(v, v) > 0; ++step) {
    const DifferencePoint point = visited[step] = pair.farthest(minus(v));
    const Double3& p = point.at;
    const double v_sq = dot(v, v), gap = dot(v, p);
    if (gap > out.distance * std::sqrt(v_sq)) {
      out.distance = gap / std::sqrt(v_sq);
      out.normal = v;
    }
    if (step == 0) {
      simplex = {{p, p, p}, p, dot(p, p)};
    } else {
      if (v_sq - gap <= kContactProgress * v_sq) break;
      const Simplex<double> before = simplex;
      out.inside = kernel::add_point(p, pair.slack(), pair.rounding(), simplex);
      if (out.inside) {
        for (std::size_t i = 0; i < 3; ++i) out.corner[i] = visited_at(before.corner[i], step + 1);
        out.corner[3] = point;
        return out;
      }
    }
    v = simplex.normal;
    if (simplex.length_sq <= pair.slack() * pair.slack()) break;
  }
  for (std::size_t i = 0; i < 3; ++i)
    out.corner[i] = visited_at(simplex.corner[i], static_cast<std::uint32_t>(visited.size()));
  return out;
}

// The weights of three corners at the point of their triangle, or of what is left of it, that is nearest to `at`.
std::array<double, 3> weights_at(const std::array<DifferencePoint, 4>& corner, const Double3& at) {
  const Double3 e = corner[1].at - corner[0].at, f = corner[2].at - corner[0].at, to = at - corner[0].at;
  const double ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), te = dot(to, e), tf = dot(to, f);
  const double area = ee * ff - ef * ef;
  double we = 0, wf = 0;
  if (area > 1e-20 * ee * ff) {
    we = (te * ff - tf * ef) / area;
    wf = (tf * ee - te * ef) / area;
  } else if (ee >= ff && ee > 0) {
    we = te / ee;
  } else if (ff > 0) {
    wf = tf / ff;
  }
  we = std::clamp(we, 0.0, 1.0);
  wf = std::clamp(wf, 0.0, 1.0 - we);
  return {1 - we - wf, we, wf};
}

// A direction along which b can leave a, how far it must go, and the difference's face at its end.
struct Exit {
  Double3 normal = {};
  double depth = 0;
  std::array<DifferencePoint, 4> corner = {};
};

// Follows a ray from the origin, which a tetrahedron contains, to the face of the difference through which it leaves.
// The triangle that the ray meets moves outwards until no point is farther beyond it than `within`.
Exit face_along(const ConvexPair& pair, const std::array<DifferencePoint, 4>& tetrahedron, const Double3& ray,
                double within) {
  constexpr int kMostSteps = 64;
  const auto meets = [&ray](const DifferencePoint& p, const DifferencePoint& q, const DifferencePoint& r) {
    const double pq = dot(ray, cross(p.at, q.at)), qr = dot(ray, cross(q.at, r.at)), rp = dot(ray, cross(r.at, p.at));
    return (pq >= 0 && qr >= 0 && rp >= 0) || (pq <= 0 && qr <= 0 && rp <= 0);
  };
  Exit out;
  for (std::size_t left_out = 0; left_out < 4; ++left_out) {
    for (std::size_t i = 0, at = 0; i < 4; ++i)
      if (i != left_out) out.corner[at++] = tetrahedron[i];
    const Double3 middle = (out.corner[0].at + out.corner[1].at) + out.corner[2].at;
    if (dot(ray, middle) > 0 && meets(out.corner[0], out.corner[1], out.corner[2])) break;
  }
  for (int step = 0; step < kMostSteps; ++step) {
    Double3 normal = cross(out.corner[1].at - out.corner[0].at, out.corner[2].at - out.corner[0].at);
    const double area = length(normal);
    if (!(area > 0)) break;
    normal = (dot(normal, ray) < 0 ? -1 / area : 1 / area) * normal;
    const DifferencePoint beyond = pair.farthest(normal);
    out.normal = normal;
    out.depth = dot(normal, beyond.at);
    if (out.depth - dot(normal, out.corner[0].at) <= within) break;
    const std::array<DifferencePoint, 4> old = out.corner;
    for (std::size_t i = 0; i < 3; ++i) {
      const DifferencePoint &p = old[i], &q = old[(i + 1) % 3];
      out.corner[0] = p;
      out.corner[1] = q;
      out.corner[2] = beyond;
      if (meets(p, q, beyond)) break;
    }
  }
  return out;
}

// Directions to look along first: between the centres, and the axes of both shapes and their products, both ways.
std::array<Double3, 31> first_directions(const ConvexPair& pair) {
  const Double3 own[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::array<Double3, 31> out;
  std::size_t count = 0;
  const auto add = [&](const Double3& v) {
    const double norm = length(v);
    out[count++] = norm > 0 ? (1 / norm) * v : own[0];
  };
  for (std::size_t i = 0; i < 3; ++i) {
    for (const double sign : {1.0, -1.0}) {
      add(sign * own[i]);
      add(sign * pair.axis_of_b(i));
      for (std::size_t j = 0; j < 3; ++j) add(sign * cross(own[i], pair.axis_of_b(j)));
    }
  }
  add(pair.t());
  return out;
}

// Improves an exit by following the ray along its normal: the face that this ray leaves through is no deeper, since the
// ray leaves no later than at the exit's depth. Ends when that gains no more than `within`.
void descend(const ConvexPair& pair, const std::array<DifferencePoint, 4>& tetrahedron, double within, Exit& exit) {
  constexpr int kMostRays = 16;
  for (int ray = 0; ray < kMostRays; ++ray) {
    const Exit next = face_along(pair, tetrahedron, exit.normal, within);
    if (!(next.depth <= exit.depth && dot(next.normal, next.normal) > 0)) return;
    const double gained = exit.depth - next.depth;
    exit = next;
    if (gained <= within) return;
  }
}

// The least of three exits, from the first directions of the least depths. They are found roughly first; the best of
// them is then improved. Without a tetrahedron about the origin, the difference is flat or the shapes barely touch: the
// first directions do.
Exit least_exit(const ConvexPair& pair, const Closest& closest) {
  constexpr std::size_t kStarts = 3;
  constexpr double kRough = 1.0 / 256, kFiner = 1.0 / 16;  // in parts of the reach; any would do
  const std::array<Double3, 31> directions = first_directions(pair);
  std::array<std::pair<double, std::size_t>, 31> order;
  for (std::size_t i = 0; i < directions.size(); ++i)
    order[i] = {dot(directions[i], pair.farthest(directions[i]).at), i};
  std::partial_sort(order.begin(), order.begin() + kStarts, order.end());
  Exit best;
  for (std::size_t start = 0; start < kStarts; ++start) {
    Exit exit;
    exit.depth = order[start].first;
    exit.normal = directions[order[start].second];
    exit.corner.fill(pair.farthest(exit.normal));
    if (closest.inside) descend(pair, closest.corner, kRough * pair.reach(), exit);
    if (start == 0 || exit.depth < best.depth) best = exit;
  }
  for (double within = kRough; closest.inside && within > kContactProgress;) {
    within = std::max(within * kFiner, kContactProgress);
    descend(pair, closest.corner, within * pair.reach(), best);
  }
  return best;
}

// ------------------------------------------------------------------------------------------------ touching or not

kernel::ConvexAnswer answer_of(const ConvexPair& pair, double radius) {
  const auto support = [&pair](const Double3& d, std::uint32_t) { return pair.farthest(d).at; };
  return kernel::gjk<double>({pair.t(), radius, pair.slack(), pair.rounding()}, kernel::kGjkInDouble, 1, support);
}

// The answer for a pair with an ellipsoid, in the frame of the ellipsoid and in a space in which it is a ball of radius
// 1. The direction between its centre and the other shape keeps its digits there however close the shapes are: on a
// curved side a direction that is a little off misses by more than a small gap. The plane across each direction is also
// tried where the pair is: the slack of that space is wide along the longer radii. is_of_a: which side the ellipsoid
// is.
kernel::ConvexAnswer answer_about_ball(const ConvexPair& pair, bool is_of_a, double radius) {
  const Double3& radii = is_of_a ? *pair.radii_of_a() : *pair.radii_of_b();
  const auto shrunk = [&radii](const Double3& v) { return Double3{v.x / radii.x, v.y / radii.y, v.z / radii.z}; };
  const Double3 axis[3] = {pair.axis_of_b(0), pair.axis_of_b(1), pair.axis_of_b(2)};
  const auto in_b = [&axis](const Double3& v) { return Double3{dot(axis[0], v), dot(axis[1], v), dot(axis[2], v)}; };
  bool is_apart = false;
  const auto support = [&](const Double3& d, std::uint32_t) {
    const Double3 own = shrunk(d), in_a = is_of_a ? own : kernel::rotate(axis, own);
    const DifferencePoint point = pair.farthest(in_a);
    is_apart = is_apart || dot(in_a, point.at) < -(radius + pair.slack()) * length(in_a);
    // Without the ellipsoid, with the balls.
    const Double3 rest = (is_of_a ? point.at - point.on_a : point.on_a - pair.t()) + (radius / length(in_a)) * in_a;
    return shrunk(is_of_a ? rest : in_b(rest));
  };
  const double by = 1 / std::min({radii.x, radii.y, radii.z});
  const kernel::GjkPair<double> lengths = {shrunk(is_of_a ? pair.t() : in_b(pair.t())), 1, by * pair.slack(),
                                           by * by * by * pair.rounding()};
  const kernel::ConvexAnswer answer = kernel::gjk(lengths, kernel::kGjkInDouble, 1, support);
  return is_apart ? kernel::ConvexAnswer{1, 0} : answer;
}

}  // namespace

kernel::ConvexAnswer answer_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  const auto placed = [lane](const kernel::ConvexSide& side) {
    return PlacedShape{side.shape[lane], side.format, side.pose[lane], side.orientation[lane]};
  };
  const auto& by = block.shift.by;
  const ConvexPair pair(placed(block.a), placed(block.b), {by[0][lane], by[1][lane], by[2][lane]});
  const double radius = (pair.radius_of_a() + pair.radius_of_b()) + pair.scale() * static_cast<double>(block.margin);
  kernel::ConvexAnswer answer = answer_of(pair, radius);
  for (const bool is_of_a : {true, false}) {
    const bool undecided = answer.apart == 0 && answer.touching == 0;
    if (undecided && (is_of_a ? pair.radii_of_a() : pair.radii_of_b()))
      answer = answer_about_ball(pair, is_of_a, radius);
  }
  return answer;
}

Contact contact_in_double(const PlacedShape& a, const PlacedShape& b, const double (&shift)[3]) {
  const ConvexPair pair(a, b, shift);
  const Closest closest = find_closest(pair);
  Double3 normal, on_difference;
  std::array<DifferencePoint, 4> corner = closest.corner;
  double depth = pair.radius_of_a() + pair.radius_of_b();
  const double to_closest = length(closest.normal);
  if (!closest.inside && closest.distance > 0 && to_closest > 0) {
    normal = (-1 / to_closest) * closest.normal;
    on_difference = closest.normal;
    depth -= closest.distance;
  } else {
    const Exit exit = least_exit(pair, closest);
    normal = exit.normal;
    on_difference = exit.depth * normal;
    corner = exit.corner;
    depth += exit.depth;
  }
  const std::array<double, 3> weight = weights_at(corner, on_difference);
  Double3 on_a = {}, apart = {};
  for (std::size_t i = 0; i < 3; ++i) {
    on_a = on_a + weight[i] * corner[i].on_a;
    apart = apart + weight[i] * corner[i].at;
  }
  const Double3 end_a = on_a + pair.radius_of_a() * normal, end_b = (on_a - apart) - pair.radius_of_b() * normal;
  const Double3 point = pair.point_in_world(0.5 * (end_a + end_b)), along = pair.direction_in_world(normal);
  const auto narrow = [](double v) { return static_cast<float>(v); };
  // Rounded up: the depth suffices, and a distance, which is minus the depth, is not too large.
  const double unscaled = depth / pair.scale();
  const bool is_below = static_cast<double>(narrow(unscaled)) < unscaled;
  const float at_least =
      is_below ? std::nextafter(narrow(unscaled), std::numeric_limits<float>::infinity()) : narrow(unscaled);
  return {{narrow(along.x), narrow(along.y), narrow(along.z)},
          at_least,
          {narrow(point.x), narrow(point.y), narrow(point.z)}};
}

}  // namespace cab
