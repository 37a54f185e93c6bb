#include "engine/queries/ray_cast.h"

#include "kernels/cast_box.h"
#include "kernels/convex/gjk.h"
#include "kernels/convex/support.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {
namespace {

using kernel::cross;
using kernel::dot;

constexpr int kAdvances = 80;  // at most this many planes, before a ray counts as touching where it has got to
constexpr int kHullAdvances = 120;
constexpr int kFaceSteps = 6;     // every so many steps the planes along faces are tried
constexpr int kNewtonSteps = 60;  // for the closest point of an ellipsoid

double length(const Double3& v) { return std::sqrt(dot(v, v)); }

double norm_1(const Double3& v) { return kernel::sum(kernel::abs(v)); }

// What is left of a ray: the range in which the sphere may touch a shape. The shape is a core and a ball about it, as
// the sphere is a point and a ball, and both radii are in `radius`. Points are relative to the core's centre.
struct Chord : kernel::RayChord<double> {
  Double3 at(double s) const { return from + s * along; }

  // Takes away what the plane across a normal of length 1 keeps apart. height: how far the core reaches along the
  // normal. Returns whether anything is left.
  bool cut(const Double3& n, double height) {
    const double gap = dot(n, from) - (height + radius + slack), fall = -dot(n, along);
    if (fall > 0) {
      const double s = gap / fall;
      if (s > first) {
        first = s;
        normal = n;
      }
    } else if (fall < 0) {
      last = std::min(last, gap / fall);
    } else if (gap > 0) {
      return false;
    }
    return first <= last;
  }

  // Whether a distance of a point of the core from the sphere's centre is a touch. Two slacks of the growth are left
  // for rounding.
  bool touches(double distance) const { return distance <= radius + (kRayGrowth - 2) * slack; }

  // Takes the direction from the core's closest point as the normal where the sphere touches. About a core alone it is
  // rounding, and the normal of the plane stays.
  void face(const Double3& n) {
    if (radius > kRayGrowth * slack) normal = n;
  }
};

// Cores of shapes. height: how far the core reaches along a direction. offset: the distance of a point from the core;
// *n is then the direction from the core's closest point, of length 1. If the distance is 0, *n is not written.
struct Segment {
  double half;  // along z

  double height(const Double3& n) const { return half * std::fabs(n.z); }
  double offset(const Double3& x, Double3* n) const {
    const Double3 v = {x.x, x.y, x.z - std::clamp(x.z, -half, half)};
    const double distance = length(v);
    if (distance > 0) *n = (1 / distance) * v;
    return distance;
  }
};

struct Cylinder {
  double radius, half;  // around z, along z

  double height(const Double3& n) const { return radius * std::sqrt(n.x * n.x + n.y * n.y) + half * std::fabs(n.z); }
  double offset(const Double3& x, Double3* n) const {
    const double across = std::sqrt(x.x * x.x + x.y * x.y);
    const double by = across > radius ? (across - radius) / across : 0;
    const Double3 v = {by * x.x, by * x.y, x.z - std::clamp(x.z, -half, half)};
    const double distance = length(v);
    if (distance > 0) *n = (1 / distance) * v;
    return distance;
  }
};

struct Ellipsoid {
  Double3 radii;  // above 0

  double height(const Double3& n) const { return length({radii.x * n.x, radii.y * n.y, radii.z * n.z}); }

  // The closest point is a^2 x / (t + a^2) for the t at which it is on the surface. Newton's method finds it from
  // below on 1 - 1 / |a x / (t + a^2)|, which is concave and nearly straight.
  double offset(const Double3& x, Double3* n) const {
    const double a[3] = {radii.x, radii.y, radii.z}, at[3] = {x.x, x.y, x.z};
    double t = 0;  // no weight of the closest point is above 1
    for (int k = 0; k < 3; ++k) t = std::max(t, a[k] * (std::fabs(at[k]) - a[k]));
    for (int i = 0; i < kNewtonSteps; ++i) {
      double square = 0, slope = 0;
      for (int k = 0; k < 3; ++k) {
        const double by = 1 / (t + a[k] * a[k]), p = a[k] * at[k] * by;
        square += p * p;
        slope += p * p * by;
      }
      if (i == 0 && t == 0 && square <= 1) return 0;
      const double step = square * (std::sqrt(square) - 1) / slope;
      if (!(step > t * std::numeric_limits<double>::epsilon())) break;
      t += step;
    }
    const Double3 v = {x.x / (t + a[0] * a[0]), x.y / (t + a[1] * a[1]), x.z / (t + a[2] * a[2])};
    const double distance = length(v);
    if (!(t > 0) || !(distance > 0)) return 0;
    *n = (1 / distance) * v;
    return t * distance;
  }
};

// All points sum y_k axis_k with |y_k| <= half_k. The axes are orthonormal, to rounding of a float if is_skew and of a
// double if not.
struct Brick {
  Double3 axis[3];
  double half[3];
  kernel::BoxFaces<double> faces;
  bool is_skew;

  double height(const Double3& n) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += half[k] * std::fabs(dot(axis[k], n));
    return sum;
  }

  // Along one axis after the other the point of the brick moves to where it is closest. What is left of x is updated
  // with it, so that it is across the axes along which the point is free to the last digit of itself.
  double offset(const Double3& x, Double3* n) const {
    Double3 v = x;
    double y[3] = {};
    for (int sweep = 0; sweep < (is_skew ? 4 : 2); ++sweep)
      for (int k = 0; k < 3; ++k) {
        const double free = dot(axis[k], v) / dot(axis[k], axis[k]);
        const double by = std::clamp(free, -half[k] - y[k], half[k] - y[k]);
        v = v - by * axis[k];
        y[k] += by;
      }
    const double distance = length(v);
    if (distance > 0) *n = (1 / distance) * v;
    return distance;
  }
};

// A triangle about a point in its middle. Points and segments are triangles, too.
struct TriangleCore {
  Double3 corner[3], edge[3], normal;  // edge: from each corner to the next. normal: of length 1, or 0
  double edge_sq[3];
  int longest = 0;  // edge

  explicit TriangleCore(const Double3 (&corners)[3]) {
    for (int k = 0; k < 3; ++k) {
      corner[k] = corners[k];
      edge[k] = corners[(k + 1) % 3] - corners[k];
      edge_sq[k] = dot(edge[k], edge[k]);
      if (edge_sq[k] > edge_sq[longest]) longest = k;
    }
    // In a thin triangle rounding turns the normal along the longest edge.
    Double3 n = cross(edge[0], edge[1]);
    if (edge_sq[longest] > 0) n = kernel::across(n, edge[longest], edge_sq[longest]);
    const double size = length(n);
    normal = size > 0 ? (1 / size) * n : Double3{0, 0, 0};
  }

  double height(const Double3& n) const { return std::max({dot(n, corner[0]), dot(n, corner[1]), dot(n, corner[2])}); }

  // Whether a point is in the triangle, seen along the normal, and the weights of the corners there. First across the
  // longest edge, then along it: so both are right in a thin triangle, too.
  bool weigh_inside(const Double3& x, double (&weights)[3]) const {
    const int from = longest, to = (from + 1) % 3, third = (from + 2) % 3;
    const Double3 across = cross(normal, edge[from]), side = corner[third] - corner[from], way = x - corner[from];
    const double height = dot(across, side);
    if (!(height > 0)) return false;
    weights[third] = dot(across, way) / height;
    weights[to] = dot(way - weights[third] * side, edge[from]) / edge_sq[from];
    weights[from] = (1 - weights[third]) - weights[to];
    return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0;
  }

  // Of the edge that is nearest to a point: its number, and how far along it the nearest point is, 0 to 1.
  struct OnEdge {
    int edge;
    double along;
    Double3 v;  // from there to the point
  };
  OnEdge nearest_edge(const Double3& x) const {
    OnEdge out = {0, 0, {}};
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      const Double3 from = x - corner[k];
      const double along = edge_sq[k] > 0 ? std::clamp(dot(from, edge[k]) / edge_sq[k], 0.0, 1.0) : 0;
      Double3 v = from - along * edge[k];
      if (along >= 1) v = x - corner[(k + 1) % 3];
      if (along > 0 && along < 1) v = kernel::across(v, edge[k], edge_sq[k]);
      const double distance_sq = dot(v, v);
      if (distance_sq < least) {
        least = distance_sq;
        out = {k, along, v};
      }
    }
    return out;
  }

  double offset(const Double3& x, Double3* n) const {
    double weights[3];
    if (weigh_inside(x, weights)) {
      const double above = dot(normal, x - corner[0]);
      *n = above < 0 ? -1.0 * normal : normal;
      return std::fabs(above);
    }
    const Double3 v = nearest_edge(x).v;
    const double distance = length(v);
    if (distance > 0) *n = (1 / distance) * v;
    return distance;
  }
};

// Moves the beginning of a chord forward, by the plane across the direction from the core's closest point each time:
// Newton's method on the distance, which is convex along the chord. Returns whether the sphere touches.
template <class Core>
bool advance(Chord& chord, const Core& core) {
  for (int i = 0; i < kAdvances; ++i) {
    Double3 n;
    const double distance = core.offset(chord.at(chord.first), &n), before = chord.first;
    if (chord.touches(distance)) {
      chord.face(n);
      return true;
    }
    if (!chord.cut(n, core.height(n))) return false;
    if (!(chord.first > before)) return true;
  }
  return true;
}

// The plane that touches a core where a ray enters it, by a closed form. The form is for a radius that is larger than
// the cut's by the slack: the plane then passes behind the ray's point, whatever rounding has done to that. Returns
// whether anything is left.
bool cut_at_entry(Chord& chord, const Segment& core) {
  const Double3 &q = chord.from, &d = chord.along;
  const double radius = chord.radius + 2 * chord.slack;
  double end_z = d.z > 0 ? -core.half : core.half;
  const double across_sq = d.x * d.x + d.y * d.y;
  if (across_sq > 0 && core.half > 0) {
    const double moment = q.x * d.y - q.y * d.x;
    const double root_sq = across_sq * radius * radius - moment * moment;
    if (root_sq < 0) {
      const double by = (moment < 0 ? -1 : 1) / std::sqrt(across_sq);
      return chord.cut({by * d.y, -by * d.x, 0}, 0);
    }
    const double s = -((q.x * d.x + q.y * d.y) + std::sqrt(root_sq)) / across_sq;
    const Double3 x = chord.at(s);
    if (std::fabs(x.z) <= core.half) {
      const double distance = std::sqrt(x.x * x.x + x.y * x.y);
      return !(distance > 0) || chord.cut({x.x / distance, x.y / distance, 0}, 0);
    }
    end_z = x.z < 0 ? -core.half : core.half;
  }
  const Double3 center = {0, 0, end_z}, to = q - center;
  const double along = dot(to, d);
  const Double3 across = to - along * d;
  const double root_sq = radius * radius - dot(across, across);
  const Double3 v = root_sq < 0 ? across : across - std::sqrt(root_sq) * d;
  const double distance = length(v);
  if (!(distance > 0)) return true;
  const Double3 n = (1 / distance) * v;
  return chord.cut(n, core.height(n));
}

bool cut_at_entry(Chord& chord, const Cylinder& core) {
  const Double3 &q = chord.from, &d = chord.along;
  if (!chord.cut({0, 0, 1}, core.half) || !chord.cut({0, 0, -1}, core.half)) return false;
  const double across_sq = d.x * d.x + d.y * d.y;
  const auto cut_side = [&](double x, double y) {
    const double distance = std::sqrt(x * x + y * y);
    return !(distance > 0) || chord.cut({x / distance, y / distance, 0}, core.radius);
  };
  if (!(across_sq > 0)) return cut_side(q.x, q.y);
  const double radius = core.radius + chord.radius + 2 * chord.slack;
  const double moment = q.x * d.y - q.y * d.x, root_sq = across_sq * radius * radius - moment * moment;
  if (root_sq < 0) {
    const double by = (moment < 0 ? -1 : 1) / std::sqrt(across_sq);
    return chord.cut({by * d.y, -by * d.x, 0}, core.radius);
  }
  const double middle = -(q.x * d.x + q.y * d.y), root = std::sqrt(root_sq);
  const double enter = (middle - root) / across_sq, leave = (middle + root) / across_sq;
  return cut_side(q.x + enter * d.x, q.y + enter * d.y) && cut_side(q.x + leave * d.x, q.y + leave * d.y);
}

// In the space in which the ellipsoid, with `radius` added to its radii, is a ball of radius 1.
bool cut_at_entry(Chord& chord, const Ellipsoid& core) {
  const Double3& a = core.radii;
  const double more = chord.radius;
  const auto shrunk = [&](const Double3& v) {
    return Double3{v.x / (a.x + more), v.y / (a.y + more), v.z / (a.z + more)};
  };
  const Double3 q = shrunk(chord.from), d = shrunk(chord.along);
  const double d_sq = dot(d, d);
  const Double3 across = q - (dot(q, d) / d_sq) * d;
  const double root_sq = 1 - dot(across, across);
  const Double3 v = shrunk(root_sq < 0 ? across : across - std::sqrt(root_sq / d_sq) * d);
  const double distance = length(v);
  if (!(distance > 0)) return true;
  const Double3 n = (1 / distance) * v;
  return chord.cut(n, core.height(n));
}

bool cut_at_entry(Chord& chord, const Brick& core) {
  kernel::cut_at_faces(core.faces, chord);
  return chord.is_left;
}

bool cut_at_entry(Chord& chord, const TriangleCore& core) {
  const Double3 &n = core.normal, back = -1.0 * n;
  return !(dot(n, n) > 0) || (chord.cut(n, core.height(n)) && chord.cut(back, core.height(back)));
}

// The hull of vertices, relative to `shape.part`'s origin, times a factor.
struct Hull {
  Span<const float> vertices;
  double factor;

  Double3 farthest(const Double3& d) const {
    std::size_t best = 0;
    double height = dot(double3(vertices.data), d);
    for (std::size_t v = 3; v < vertices.size; v += 3)
      if (const double h = dot(double3(vertices.data + v), d); h > height) {
        height = h;
        best = v;
      }
    return factor * double3(vertices.data + best);
  }
};

// The plane along a triangle, on the side that the ray comes from. Its normal is made square to the longest edge once
// more: in a thin triangle rounding turns it that way. Returns whether anything is left.
bool cut_along_face(Chord& chord, const Hull& hull, const Double3& a, const Double3& b, const Double3& c) {
  Double3 longest = b - a;
  for (const Double3& edge : {c - a, c - b})
    if (dot(edge, edge) > dot(longest, longest)) longest = edge;
  if (!(dot(longest, longest) > 0)) return true;
  const Double3 v = kernel::across(cross(b - a, c - a), longest, dot(longest, longest));
  const double distance = length(v);
  if (!(distance > 0)) return true;
  const Double3 n = ((dot(v, chord.along) < 0 ? 1 : -1) / distance) * v;
  return chord.cut(n, dot(n, hull.farthest(n)));
}

// The planes along the faces of a simplex and a point.
bool cut_along_faces(Chord& chord, const Hull& hull, const Double3 (&corner)[3], const Double3& point) {
  return cut_along_face(chord, hull, corner[0], corner[1], corner[2]) &&
         cut_along_face(chord, hull, corner[0], corner[1], point) &&
         cut_along_face(chord, hull, corner[1], corner[2], point) &&
         cut_along_face(chord, hull, corner[2], corner[0], point);
}

// As advance, with GJK's simplex instead of the core's closest point. The simplex moves as the chord's beginning
// does. size: of the hull and its distance; reach: of the hull.
bool advance(Chord& chord, const Hull& hull, Double3 v, double size) {
  const double rounding = kTetrahedronRoundingDouble * (size * (size * size));
  kernel::Simplex<double> simplices[2];  // corners relative to the chord's beginning: the last step's and this step's
  Double3 x = chord.at(chord.first);
  for (int step = 0; step < kHullAdvances; ++step) {
    const double v_sq = dot(v, v);
    if (!(v_sq > kLeastDirectionSqDouble)) return true;
    const Double3 n = (-1 / std::sqrt(v_sq)) * v, p = hull.farthest(n);
    const double before = chord.first;
    if (!chord.cut(n, dot(n, p))) return false;
    const bool is_ahead = chord.first > before;
    kernel::Simplex<double>&last = simplices[1 - step % 2], &simplex = simplices[step % 2];
    const auto follow = [&] {
      const Double3 to = chord.at(chord.first), by = to - x;
      for (Double3& corner : last.corner) corner = corner - by;
      x = to;
    };
    if (is_ahead) follow();
    if (step == 0) {
      simplex.set(p - x);
    } else {
      if (!is_ahead && v_sq - dot(v, p - x) <= kGjkProgressDouble * v_sq) return true;
      // v loses digits close to a thin triangle, whose normal has kept them, and steps may then go in a circle.
      if (step % kFaceSteps == 0) {
        if (!cut_along_faces(chord, hull, last.corner, p - x)) return false;
        if (chord.first > before) follow();
      }
      if (kernel::add_point<double>(p - x, chord.slack, rounding, last, simplex)) return true;
    }
    v = simplex.normal;
    if (const double distance = std::sqrt(simplex.length_sq); chord.touches(distance)) {
      if (distance > 0) chord.face((-1 / length(v)) * v);
      return true;
    }
  }
  return true;
}

// A shape's place, and the ray's part near it.
struct Place {
  Double3 column[3], center;
  double scale;
  double away;  // lengths that posing has added up
};

Place place_of(const ConvexShape& shape, const StoredPose& at) {
  const kernel::RigidLanes<double> pose = pose_in_double(at);
  Place out;
  out.scale = pose.scale;
  for (std::size_t k = 0; k < 3; ++k) out.column[k] = kernel::rotate(pose.column, axis_of(shape, k));
  const Double3 own = pose.scale * double3(shape.kind == ConvexKind::kHull ? shape.part->position : shape.position);
  out.center = pose.translation + kernel::rotate(pose.column, own);
  out.away = norm_1(pose.translation) + norm_1(own);
  return out;
}

// How far a shape reaches from what place_of calls its centre. A hull's centre is the origin of its part, and `reach`
// counts from the middle of its bounds, which is rounded to float.
double reach_of(const ConvexShape& shape) {
  const double reach = static_cast<double>(shape.reach);
  if (shape.kind != ConvexKind::kHull) return reach;
  const Double3 middle = double3(shape.position);
  return reach + norm_1(middle - double3(shape.part->position)) +
         std::numeric_limits<float>::epsilon() * norm_1(middle);
}

double reach_of(const BoxAos& box) {
  return kBoxReach *
         (static_cast<double>(box.half[0]) + static_cast<double>(box.half[1]) + static_cast<double>(box.half[2]));
}

double slack_of(const LocalRay& ray, double reach, double away) {
  return kConvexSlackDouble * (reach + ray.radius) + kConvexPoseSlackDouble * away + ray.error;
}

// A chord of the ray about a centre, in the world's axes, or none if the ray passes a ball about it. reach: the radius
// of a ball about the centre that contains the shape. *shift: the t where the chord's s is 0.
bool begin_chord(const LocalRay& ray, const Double3& to_ray, double reach, double slack, Chord* out, double* shift) {
  out->radius = ray.radius;
  out->slack = slack;
  kernel::begin_chord(to_ray, ray.direction, ray.begin, ray.end, reach, *out);
  *shift = out->shift;
  return out->is_left;
}

void turn(const Double3 (&column)[3], Double3& v) { v = {dot(column[0], v), dot(column[1], v), dot(column[2], v)}; }

void report_inside(const LocalRay& ray, RayTouch* out) {
  *out = {ray.begin, ray.at + ray.begin * ray.direction, {0, 0, 0}, true};
}

// Writes a touch where a chord, in the world's axes, begins. shift: as by begin_chord.
void report(const LocalRay& ray, const Chord& chord, const Double3& center, double shift, RayTouch* out) {
  if (chord.first <= ray.begin - shift) return report_inside(ray, out);
  out->at = std::clamp(shift + chord.first, ray.begin, ray.end);
  // Without a plane all lengths are 0, and the ray passes through the shape, which is a point.
  out->normal = dot(chord.normal, chord.normal) > 0 ? chord.normal : (-1 / length(ray.direction)) * ray.direction;
  out->point = center + (chord.at(chord.first) - ray.radius * out->normal);
  out->inside = false;
}

template <class Core>
bool touches(Chord& chord, const Core& core) {
  return cut_at_entry(chord, core) && advance(chord, core);
}

bool cast_brick(const LocalRay& ray, const Brick& brick, const Double3& center, double reach, double slack,
                RayTouch* out) {
  Chord chord;
  double shift;
  if (!begin_chord(ray, ray.at - center, reach, slack, &chord, &shift)) return false;
  if (!cut_at_entry(chord, brick)) return false;
  if (ray.radius > 0 && !advance(chord, brick)) return false;
  report(ray, chord, center, shift, out);
  return true;
}

// The plane is at 0 along the normal. The slack grows with the way along the ray, since the normal is rounded: a touch
// is where the height is at most slack + kConvexSlackDouble |t|.
bool cast_half_space(const LocalRay& ray, const Place& place, double slack, RayTouch* out) {
  const Double3& n = place.column[2];
  const double gap = dot(n, ray.at - place.center) - (ray.radius + slack), fall = -dot(n, ray.direction);
  const auto is_apart = [&](double t) { return gap - fall * t > kConvexSlackDouble * std::fabs(t); };
  if (!is_apart(ray.begin)) {
    report_inside(ray, out);
    return true;
  }
  const double steep = fall + (ray.begin < 0 && !is_apart(0) ? -kConvexSlackDouble : kConvexSlackDouble);
  if (!(steep > 0)) return false;
  const double t = std::max(gap / steep, ray.begin);
  if (t > ray.end) return false;
  *out = {t, (ray.at + t * ray.direction) - ray.radius * n, n, false};
  return true;
}

bool cast_hull(Chord& chord, const ConvexShape& shape, double scale, double size, const Double3& to_middle) {
  int exponent = 0;
  std::frexp(size, &exponent);
  const double by = std::ldexp(1.0, -exponent);
  Chord scaled = chord;
  scaled.from = by * chord.from;
  for (double* const length : {&scaled.first, &scaled.last, &scaled.radius, &scaled.slack}) *length *= by;
  const bool does_touch =
      advance(scaled, {shape.part->vertices, by * scale}, by * to_middle - scaled.at(scaled.first), by * size);
  chord.first = scaled.first / by;
  chord.normal = scaled.normal;
  return does_touch;
}

// Where a triangle is: a point in its middle, the corners about that, and how far they reach from it.
struct TrianglePlace {
  Double3 center, corner[3];
  double reach;
};

TrianglePlace place_of(const PlacedTriangle& triangle) {
  const auto& at = triangle.at.corner;
  TrianglePlace out;
  out.center = 0.5 * (kernel::min(kernel::min(at[0], at[1]), at[2]) + kernel::max(kernel::max(at[0], at[1]), at[2]));
  out.reach = 0;
  for (int k = 0; k < 3; ++k) {
    out.corner[k] = at[k] - out.center;
    out.reach = std::max(out.reach, length(out.corner[k]));
  }
  return out;
}

// Each coordinate of a corner may be off by kSurfaceErrorDouble of the size.
double slack_of(const LocalRay& ray, const PlacedTriangle& triangle, const TrianglePlace& place) {
  return slack_of(ray, place.reach, norm_1(place.center) + norm_1(ray.at - place.center)) +
         2 * kSurfaceErrorDouble * triangle.size;
}

Double3 grown(const Double3& radii, double least) {
  return {std::max(radii.x, least), std::max(radii.y, least), std::max(radii.z, least)};
}

}  // namespace

double ray_slack(const LocalRay& ray, const BoxAos& box) {
  return slack_of(ray, reach_of(box), norm_1(ray.at - double3(box.center)));
}

double ray_slack(const LocalRay& ray, const ConvexShape& shape, const StoredPose& at) {
  const Place place = place_of(shape, at);
  return slack_of(ray, place.scale * reach_of(shape), place.away + norm_1(ray.at - place.center));
}

double ray_slack(const LocalRay& ray, const PlacedTriangle& triangle) {
  return slack_of(ray, triangle, place_of(triangle));
}

bool cast_ray(const LocalRay& ray, const BoxAos& box, RayTouch* out) {
  Brick brick;
  brick.is_skew = true;
  for (int k = 0; k < 3; ++k) {
    brick.axis[k] = double3(box.axis + 3 * k);
    brick.half[k] = static_cast<double>(box.half[k]);
  }
  kernel::set_faces(brick.axis, brick.half, brick.faces);
  return cast_brick(ray, brick, double3(box.center), reach_of(box), ray_slack(ray, box), out);
}

bool cast_ray(const LocalRay& ray, const ConvexShape& shape, const StoredPose& at, RayTouch* out) {
  const Place place = place_of(shape, at);
  const Double3 to_ray = ray.at - place.center;
  const double reach = place.scale * reach_of(shape);
  const double slack = slack_of(ray, reach, place.away + norm_1(to_ray));
  const Double3 size = place.scale * double3(shape.size);
  if (shape.kind == ConvexKind::kHalfSpace) return cast_half_space(ray, place, slack, out);
  if (shape.kind == ConvexKind::kBox) {
    Brick brick;
    brick.is_skew = false;
    for (int k = 0; k < 3; ++k) brick.axis[k] = brick.faces.normal[k] = place.column[k];
    brick.half[0] = brick.faces.face[0] = size.x;
    brick.half[1] = brick.faces.face[1] = size.y;
    brick.half[2] = brick.faces.face[2] = size.z;
    return cast_brick(ray, brick, place.center, reach, slack, out);
  }
  Chord chord;
  double shift;
  if (!begin_chord(ray, to_ray, reach, slack, &chord, &shift)) return false;
  turn(place.column, chord.from);
  turn(place.column, chord.along);
  bool does_touch = false;
  switch (shape.kind) {
    case ConvexKind::kRound:
      chord.radius += size.x;
      does_touch = touches(chord, Segment{size.z});
      break;
    case ConvexKind::kEllipsoid: does_touch = touches(chord, Ellipsoid{grown(size, slack)}); break;
    case ConvexKind::kCylinder: does_touch = touches(chord, Cylinder{size.x, size.z}); break;
    case ConvexKind::kHull:
      does_touch = cast_hull(chord, shape, place.scale, reach + ray.radius + slack, {0, 0, 0});
      break;
    case ConvexKind::kBox:
    case ConvexKind::kHalfSpace: break;  // cast above
  }
  if (!does_touch) return false;
  for (Double3* v : {&chord.from, &chord.along, &chord.normal}) *v = kernel::rotate(place.column, *v);
  report(ray, chord, place.center, shift, out);
  return true;
}

bool cast_ray(const LocalRay& ray, const PlacedTriangle& triangle, RayTouch* out) {
  const TrianglePlace place = place_of(triangle);
  Chord chord;
  double shift;
  if (!begin_chord(ray, ray.at - place.center, place.reach, slack_of(ray, triangle, place), &chord, &shift) ||
      !touches(chord, TriangleCore(place.corner)))
    return false;
  report(ray, chord, place.center, shift, out);
  return true;
}

void weigh_corners(const PlacedTriangle& triangle, const Double3& point, double (&weights)[3]) {
  const TrianglePlace place = place_of(triangle);
  const TriangleCore core(place.corner);
  const Double3 at = point - place.center;
  if (core.weigh_inside(at, weights)) return;
  const TriangleCore::OnEdge nearest = core.nearest_edge(at);
  weights[0] = weights[1] = weights[2] = 0;
  weights[nearest.edge] = 1 - nearest.along;
  weights[(nearest.edge + 1) % 3] = nearest.along;
}

}  // namespace cab
