#include "perf/judge/oracle/convex_pairs.h"

#include <algorithm>
#include <cmath>

namespace cab::oracle {
JudgeKind judge_kind(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox: return JudgeKind::kBox;
    case ShapeKind::kEllipsoid: return JudgeKind::kEllipsoid;
    case ShapeKind::kCapsule: return JudgeKind::kCapsule;
    case ShapeKind::kSphere: return JudgeKind::kSphere;
    case ShapeKind::kCylinder: return JudgeKind::kCylinder;
    case ShapeKind::kHalfSpace: return JudgeKind::kHalfSpace;
    case ShapeKind::kConvexHull: break;
  }
  return JudgeKind::kHull;
}

namespace {

// A random quaternion of length 1 to rounding. angle: 0 for any rotation, else the largest angle in rad.
void random_quaternion(Random& random, double most_angle, float* out) {
  double q[4];
  if (most_angle == 0) {
    for (double& component : q) component = random.normal();
  } else {
    const Vec3<double> axis = random.unit_vector();
    const double half = 0.5 * random.uniform(0, most_angle);
    for (std::size_t c = 0; c < 3; ++c) q[c] = std::sin(half) * axis[c];
    q[3] = std::cos(half);
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (std::size_t c = 0; c < 4; ++c) out[c] = static_cast<float>(q[c] / length);
}

// What makes a part thin: a needle keeps one size, a plate two.
struct Thin {
  double aspect = 1;
  bool is_plate = false;
};

// Uniform on the sphere, by rejection in the cube: hulls have many vertices.
Vec3<double> point_on_sphere(Random& random) {
  for (;;) {
    const Vec3<double> at = {{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}};
    const double square = dot(at, at);
    if (square <= 1 && square > 0.01) return (1 / std::sqrt(square)) * at;
  }
}

PosedPart random_part(Random& random, ShapeKind kind, double size, const Thin& thin) {
  PosedPart out = {};
  out.part.kind = kind;
  double sizes[3];
  for (double& s : sizes) s = size * random.uniform(0.25, 1.5);
  for (std::size_t c = thin.is_plate; c < 2; ++c) sizes[c] /= thin.aspect;
  for (std::size_t c = 0; c < 3; ++c) out.part.size[c] = static_cast<float>(sizes[c]);
  if (kind == ShapeKind::kConvexHull) {
    static constexpr std::uint32_t kCounts[] = {4, 5, 8, 16, 17, 32, 64};
    const bool is_flat = random.chance(1 / 6.);
    const std::uint32_t count = is_flat && random.chance(0.5) ? 3 : kCounts[random.index(7)];
    const double offset = random.chance(0.2) ? size : 0;  // the hull's centre need not be the part's origin
    for (std::uint32_t v = 0; v < count; ++v) {
      Vec3<double> at = point_on_sphere(random);
      if (is_flat) at[2] = 0;
      for (std::size_t c = 0; c < 3; ++c) out.vertices.push_back(static_cast<float>(sizes[c] * at[c] + offset));
    }
  }
  for (float& at : out.part.position) at = static_cast<float>(random.uniform(-0.3, 0.3) * size);
  random_quaternion(random, 0, out.part.rotation);
  return out;
}

Real length(const Point& v) { return std::sqrt(dot(v, v)); }

Real reach_of(const PosedPart& posed) {
  const ConvexPart& part = posed.part;
  Real most = 0;
  for (std::size_t v = 0; v < posed.vertices.size(); v += 3)
    most = std::max(most, length(Point{{posed.vertices[v], posed.vertices[v + 1], posed.vertices[v + 2]}}));
  switch (part.kind) {
    case ShapeKind::kCapsule: return Real{part.size[0]} + part.size[1];
    case ShapeKind::kCylinder: return length(Point{{part.size[0], part.size[1], 0}});
    case ShapeKind::kSphere: return part.size[0];
    case ShapeKind::kConvexHull: return most;
    case ShapeKind::kHalfSpace: return 0;
    default: return length(Point{{part.size[0], part.size[1], part.size[2]}});
  }
}

// The shape as the judge takes it, relative to the origin of a's instance.
JudgeShape judge_shape(const PosedPart& posed, const Point& shift, std::vector<Point>& vertices) {
  const ConvexPart& part = posed.part;
  JudgeShape out;
  out.kind = judge_kind(part.kind);
  for (std::size_t c = 0; c < 3; ++c) out.size[c] = part.size[c];
  for (std::size_t v = 0; v < posed.vertices.size(); v += 3)
    vertices.push_back({{posed.vertices[v], posed.vertices[v + 1], posed.vertices[v + 2]}});
  out.vertices = vertices;
  const Real link[4] = {posed.pose[0], posed.pose[1], posed.pose[2], posed.pose[3]};
  const Real own[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
  Real link_column[3][3], own_column[3][3];
  quaternion_matrix(link, link_column);
  quaternion_matrix(own, own_column);
  for (std::size_t k = 0; k < 3; ++k) store(rotated(link_column, to_vec3(own_column[k])), out.pose.column[k]);
  const Point position = {{part.position[0], part.position[1], part.position[2]}};
  out.pose.at = (Point{{posed.pose[4], posed.pose[5], posed.pose[6]}} + rotated(link_column, position)) + shift;
  return out;
}

void move(const Point& by, ConvexCase& made) {
  for (std::size_t c = 0; c < 3; ++c) made.b.pose[4 + c] = static_cast<float>(made.b.pose[4 + c] + by[c]);
}

// Moves b as the origins can, which are double.
void move_finely(const Point& by, ConvexCase& made) {
  for (std::size_t c = 0; c < 3; ++c) {
    const Real to = made.b.pose[4 + c] + by[c];
    made.b.pose[4 + c] = static_cast<float>(to);
    made.shift[c] += static_cast<double>(to - made.b.pose[4 + c]);
  }
}

// Where b is along the normal of two shapes: their gap, or less their depth.
struct Along {
  Point normal;
  Real gap;
};

// kDecide: of shapes that are apart, along some plane between them.
Along gap_of(const ConvexCase& made, Effort effort) {
  const JudgedShapes shapes(made);
  const Certificate found = certify(shapes.a, shapes.b, effort);
  if (found.proof == Proof::kApart) return {convert<Real>(found.normal), found.gap};
  const Verdict verdict = judge(shapes.a, shapes.b, Effort::kMeasure);
  return {verdict.normal, are_apart(verdict) ? verdict.gap_at_least : verdict.gap_at_most};
}

// Moves b to a small gap, of either sign. From far away it comes near, slides along a plane between the shapes so that
// other features are close, and goes the rest of the way.
void bring_near(Random& random, ConvexCase& made) {
  const Real reach = reach_of(made.a) + reach_of(made.b);
  {
    const JudgedShapes shapes(made);
    const Point away = random.uniform(1.01, 1.5) * reach * convert<Real>(random.unit_vector());
    move_finely(away - (shapes.b.pose.at - shapes.a.pose.at), made);
  }
  Along now = gap_of(made, Effort::kDecide);
  const Point side = 0.5L * reach * convert<Real>(random.unit_vector());
  move_finely((side - dot(side, now.normal) * now.normal) - (0.99L * now.gap) * now.normal, made);
  now = gap_of(made, Effort::kMeasure);
  const bool fine = random.chance(0.5);
  const Real gap = random.sign() * random.log_uniform(fine ? 1e-13 : 1e-8, 1e-2) * reach;
  (fine ? move_finely : move)((gap - now.gap) * now.normal, made);
}

}  // namespace

void bind_vertices(ConvexCase& made) {
  for (PosedPart* posed : {&made.a, &made.b}) posed->part.vertices = posed->vertices;
}

ConvexCase make_convex_case(Random& random, ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b) {
  double unit = 0.2, ratio = 1, away = 1.2, angle = 0, world = 0;
  Thin thin_a, thin_b;
  const auto make_thin = [&](double least, double most) {
    for (Thin* thin : {&thin_a, &thin_b}) *thin = {random.log_uniform(least, most), random.chance(0.5)};
  };
  switch (regime) {
    case ConvexRegime::kRegular:
    case ConvexRegime::kNear: break;
    case ConvexRegime::kThin: make_thin(1, 1e3); break;
    case ConvexRegime::kNeedles:
    case ConvexRegime::kPlates:
      make_thin(1e2, 1e5);
      thin_a.is_plate = thin_b.is_plate = regime == ConvexRegime::kPlates;
      break;
    case ConvexRegime::kUnequal: ratio = random.log_uniform(10, 1e3); break;
    case ConvexRegime::kConcentric: away = 0; break;
    case ConvexRegime::kAligned: angle = random.chance(0.3) ? 1e-30 : random.log_uniform(1e-8, 1e-3); break;
    case ConvexRegime::kFar:
      away = random.log_uniform(20, 1e5);
      world = 1e6;
      break;
    case ConvexRegime::kUnits: unit = random.log_uniform(1e-24, 1e12); break;
    case ConvexRegime::kNested:
      ratio = random.log_uniform(3, 30);
      away = 0.1;
      break;
    case ConvexRegime::kEqual: break;
  }
  ConvexCase out = {};
  const bool larger_b = random.chance(0.5);
  out.a = random_part(random, kind_a, larger_b ? unit : unit * ratio, thin_a);
  out.b = random_part(random, kind_b, larger_b ? unit * ratio : unit, thin_b);
  const bool equal = regime == ConvexRegime::kEqual || (regime == ConvexRegime::kConcentric && random.chance(0.5));
  if (equal && kind_a == kind_b) out.b = out.a;
  if (equal && kind_a != kind_b) std::copy_n(out.a.part.size, 3, out.b.part.size);
  const bool coincide = regime == ConvexRegime::kConcentric && random.chance(0.2);
  const double size = unit * ratio;
  for (PosedPart* posed : {&out.a, &out.b}) {
    random_quaternion(random, angle, posed->pose);
    for (std::size_t c = 4; c < 7; ++c) posed->pose[c] = static_cast<float>(random.uniform(-away, away) * size);
    if (angle > 0) std::copy_n(std::initializer_list<float>{0, 0, 0, 1}.begin(), 4, posed->part.rotation);
  }
  if (regime == ConvexRegime::kEqual && random.chance(0.5)) {
    std::copy_n(out.a.pose, 4, out.b.pose);
    std::copy_n(out.a.part.rotation, 4, out.b.part.rotation);
  }
  if (coincide) {
    std::copy_n(out.a.pose, 7, out.b.pose);
    std::copy_n(out.a.part.position, 3, out.b.part.position);
  }
  if (regime == ConvexRegime::kFar) {
    // Both links are far from their origins, and near each other in the world.
    double between[3];
    for (std::size_t c = 0; c < 3; ++c) {
      between[c] = static_cast<double>(out.a.pose[4 + c]) - static_cast<double>(out.b.pose[4 + c]);
      const double origin = random.uniform(-world, world);
      out.shift[c] = (origin + between[c] + random.uniform(-0.5, 0.5) * size) - origin;
    }
  }
  bind_vertices(out);
  if (kind_a == ShapeKind::kHalfSpace && kind_b == ShapeKind::kHalfSpace) return out;
  const bool has_near = regime != ConvexRegime::kRegular && regime != ConvexRegime::kUnits;
  const bool is_thin = regime == ConvexRegime::kNeedles || regime == ConvexRegime::kPlates;
  if (regime == ConvexRegime::kNear || (has_near && random.chance(is_thin ? 0.4 : 0.1))) bring_near(random, out);
  return out;
}

JudgedShapes::JudgedShapes(const ConvexCase& made)
    : a(judge_shape(made.a, Point{}, vertices_a_)),
      b(judge_shape(made.b, Point{{made.shift[0], made.shift[1], made.shift[2]}}, vertices_b_)) {}

JudgedCase judge_case(const ConvexCase& made, Effort effort) {
  const JudgedShapes shapes(made);
  return {judge(shapes.a, shapes.b, effort),
          reach_of(made.a) + reach_of(made.b) + length(shapes.b.pose.at - shapes.a.pose.at)};
}

}  // namespace cab::oracle
