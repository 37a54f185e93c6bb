#include "engine/exact/convex_in_double.h"

#include "engine/exact/convex_pair.h"
#include "kernels/convex/gjk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {
namespace {

using kernel::dot;

double length(const Double3& v) { return std::sqrt(dot(v, v)); }

kernel::ConvexAnswer answer_of(const ConvexPair& pair, double radius) {
  const auto support = [&pair](const Double3& d, std::uint32_t) { return pair.farthest(d); };
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
  const auto& axis = pair.axis_of_b();
  const auto in_b = [&axis](const Double3& v) { return Double3{dot(axis[0], v), dot(axis[1], v), dot(axis[2], v)}; };
  bool is_apart = false;
  const auto support = [&](const Double3& d, std::uint32_t) {
    const Double3 own = shrunk(d), in_a = is_of_a ? own : kernel::rotate(axis, own);
    const Double3 on_a = pair.farthest_of_a(in_a), on_b = pair.farthest_of_b({-in_a.x, -in_a.y, -in_a.z});
    is_apart = is_apart || (dot(in_a, in_a) > kLeastDirectionSqDouble &&
                            dot(in_a, on_a - on_b) < -(radius + pair.slack()) * length(in_a));
    // Without the ellipsoid, with the balls.
    const Double3 ball = (radius / length(in_a)) * in_a;
    const Double3 rest = is_of_a ? ball - on_b : (on_a - pair.t()) + ball;
    return shrunk(is_of_a ? rest : in_b(rest));
  };
  const double by = 1 / std::min({radii.x, radii.y, radii.z});
  const kernel::GjkPair<double> lengths = {shrunk(is_of_a ? pair.t() : in_b(pair.t())), 1, by * pair.slack(),
                                           by * by * by * pair.rounding()};
  const kernel::ConvexAnswer answer = kernel::gjk(lengths, kernel::kGjkInDouble, 1, support);
  return is_apart ? kernel::ConvexAnswer{1, 0} : answer;
}

// Whether the plane across v parts the shapes. support: the point of the difference farthest against v.
bool separates(const ConvexPair& pair, double radius, const Double3& v, const Double3& support) {
  const double v_sq = dot(v, v);
  return v_sq > kLeastDirectionSqDouble && dot(v, support) > (radius + pair.slack()) * std::sqrt(v_sq);
}

// The answer for a pair that GJK leaves undecided, as it does needles and plates: the normals of its simplices come
// from edges that are long and short by turns, and lose digits. The plane between a needle and another shape contains
// the needle's axis, which is known to the last digit. So the best of GJK's directions is made square to each axis of
// both shapes in turn, and turned about it. On the tangent of that circle the height of the difference is concave, and
// its support point says on which side it is higher.
kernel::ConvexAnswer answer_about_axes(const ConvexPair& pair, double radius) {
  constexpr int kHalvings = 60;
  constexpr double kAcrossSq = 1e-4;  // a direction that is nearer to an axis is not turned about it
  Double3 best = {};
  double best_gap = -std::numeric_limits<double>::infinity();
  const auto support = [&](const Double3& d, std::uint32_t) {
    const Double3 point = pair.farthest(d), v = kernel::normalized(Double3{-d.x, -d.y, -d.z});
    if (const double gap = dot(v, point); gap > best_gap) {
      best_gap = gap;
      best = v;
    }
    return point;
  };
  kernel::gjk<double>({pair.t(), radius, pair.slack(), pair.rounding()}, kernel::kGjkInDouble, 1, support);
  const auto& of_b = pair.axis_of_b();
  for (const Double3& axis : {Double3{1, 0, 0}, Double3{0, 1, 0}, Double3{0, 0, 1}, of_b[0], of_b[1], of_b[2]}) {
    Double3 across = best - dot(best, axis) * axis;
    if (dot(across, across) < kAcrossSq) continue;
    across = kernel::normalized(across);
    across = kernel::normalized(across - dot(across, axis) * axis);
    const Double3 along = kernel::cross(axis, across);
    double lo = -1, hi = 1;
    for (int i = 0; i < kHalvings; ++i) {
      const double at = 0.5 * (lo + hi);
      const Double3 v = across + at * along, point = pair.farthest({-v.x, -v.y, -v.z});
      if (separates(pair, radius, v, point)) return {1, 0};
      (dot(along, point) > 0 ? lo : hi) = at;
    }
  }
  return {};
}

// The answer for one half space, or two, which touch.
kernel::ConvexAnswer answer_by_plane(const ConvexPair& pair, double radius) {
  if (pair.half_spaces() == 2) return {0, 1};
  const double height = pair.height_above_plane();
  return {height > radius + pair.slack(), height < radius - pair.slack()};
}

}  // namespace

kernel::ConvexAnswer answer_pair_in_double(const ConvexPair& pair, double margin) {
  const double radius = pair.radius() + pair.scale() * margin;
  if (pair.half_spaces() > 0) return answer_by_plane(pair, radius);
  kernel::ConvexAnswer answer = answer_of(pair, radius);
  for (const bool is_of_a : {true, false}) {
    const bool undecided = answer.apart == 0 && answer.touching == 0;
    if (undecided && (is_of_a ? pair.radii_of_a() : pair.radii_of_b()))
      answer = answer_about_ball(pair, is_of_a, radius);
  }
  return answer.apart == 0 && answer.touching == 0 ? answer_about_axes(pair, radius) : answer;
}

kernel::ConvexAnswer answer_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  const auto placed = [lane](const kernel::ConvexSide& side) {
    return PlacedShape{side.shape[lane], {side.coding, side.pose[lane], side.orientation[lane], side.scales[lane]}};
  };
  const auto& by = block.shift.by;
  return answer_pair_in_double(ConvexPair(placed(block.a), placed(block.b), {by[0][lane], by[1][lane], by[2][lane]}),
                               static_cast<double>(block.margin[lane]));
}

}  // namespace cab
