// Random queries about a scene.
#include "perf/judge/oracle/random_queries.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::oracle {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

using Vec = Vec3<double>;

// What a query is aimed at.
struct Target {
  const QueryInstance* instance;
  const QueryLeaf* leaf;
  double size;  // how large the leaf is, above 0

  ExactBox box() const { return leaf->box.box; }
};

Target any_target(Random& random, const QueryScene& scene) {
  Target out{};
  do {
    out.instance = &scene[random.index(static_cast<std::uint32_t>(scene.size()))];
  } while (out.instance->leaves.empty());
  out.leaf = &out.instance->leaves[random.index(static_cast<std::uint32_t>(out.instance->leaves.size()))];
  out.size = static_cast<double>(out.leaf->box.reach);
  if (!(out.size > 0)) out.size = static_cast<double>(out.leaf->lengths) / 100;
  if (!(out.size > 0)) out.size = 1;
  return out;
}

// Of either sign, its magnitude uniform in the logarithm.
double signed_between(Random& random, double a, double b) {
  const double sign = random.sign();
  return sign * random.log_uniform(a, b);
}

float to_length(double v) { return static_cast<float>(std::clamp(v, 0.0, 1e18)); }

// Up to 300 u of either sign, often none.
Real few_ulps(Random& random) {
  return random.chance(0.2) ? 0 : static_cast<Real>(signed_between(random, 0.1, 300) * 0x1p-24);
}

// A direction that a leaf's box may be touched along: a face's normal, an edge's, a corner's, or any.
Point touching_direction(Random& random, const ExactBox& box) {
  Point out{};
  const std::uint32_t axes = 1 + random.index(3), first = random.index(3);
  if (random.chance(0.25)) return convert<Real>(random.unit_vector());
  for (std::size_t k = 0; k < axes; ++k) out = out + static_cast<Real>(random.sign()) * axis_of(box, (first + k) % 3);
  return 1 / length_of(out) * out;
}

// A point of a box that is farthest along a direction; anywhere on it where a face or an edge is.
Point far_point(Random& random, const ExactBox& box, const Point& direction) {
  Point out = center_of(box);
  for (std::size_t k = 0; k < 3; ++k) {
    const Real along = dot(axis_of(box, k), direction);
    const Real x = std::fabs(along) < 1e-6L ? static_cast<Real>(random.uniform(-1, 1)) : along < 0 ? -1 : 1;
    out = out + x * box.half[k] * axis_of(box, k);
  }
  return out;
}

// A point in a box that is `more` times as large.
Point point_in(Random& random, const ExactBox& box, double more) {
  Point out = center_of(box);
  for (std::size_t k = 0; k < 3; ++k)
    out = out + static_cast<Real>(random.uniform(-more, more)) * box.half[k] * axis_of(box, k);
  return out;
}

void place(const Target& target, const Point& at, Query& query) {
  for (std::size_t c = 0; c < 3; ++c) query.position[c] = static_cast<double>(target.instance->origin[c] + at[c]);
}

// Where the query now is, relative to the instance.
Point placed(const Target& target, const Query& query) {
  return Point{{query.position[0], query.position[1], query.position[2]}} - target.instance->origin;
}

// A direction of any length from 1e-30 to 1e30, some of it lost to denormal numbers.
void set_direction(Random& random, const Point& direction, Query& query) {
  const double times = random.chance(0.5) ? 1 : random.log_uniform(1e-30, 1e30);
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = static_cast<double>(direction[c]) * times;
    query.direction[c] = static_cast<float>(std::clamp(v, -1e38, 1e38));
  }
  if (random.chance(0.1)) query.direction[random.index(3)] = 0;
  if (random.chance(0.05)) query.direction[random.index(3)] = 1e-42f;
  if (query.direction[0] == 0 && query.direction[1] == 0 && query.direction[2] == 0)
    query.direction[random.index(3)] = 1;
}

void set_orientation(Random& random, const Target& target, bool aligned, Query& query) {
  double q[4];
  random_turn(random, q);
  if (aligned) {  // the quaternion of the box's axes, of which one is turned round if they are mirrored
    ExactBox box = target.box();
    if (dot(axis_of(box, 0), cross(axis_of(box, 1), axis_of(box, 2))) < 0)
      store(Real{-1} * axis_of(box, 2), box.axis[2]);
    const auto m = [&](std::size_t row, std::size_t column) { return static_cast<double>(box.axis[column][row]); };
    const double w = std::sqrt(std::fmax(0, 1 + m(0, 0) + m(1, 1) + m(2, 2))) / 2;
    if (w > 1e-3) {
      q[3] = w;
      for (std::size_t c = 0; c < 3; ++c) q[c] = (m((c + 2) % 3, (c + 1) % 3) - m((c + 1) % 3, (c + 2) % 3)) / (4 * w);
    }
  }
  const double times = random.chance(0.7) ? 1 : random.log_uniform(2e-3, 500);
  for (std::size_t c = 0; c < 4; ++c) query.orientation[c] = static_cast<float>(times * q[c]);
}

void set_sizes(Random& random, QueryRegime regime, double size, Query& query) {
  double low = 0.1, high = 2;
  if (regime == QueryRegime::kHuge) low = 1e2, high = 1e6;
  if (regime == QueryRegime::kTiny) low = 1e-6, high = 1e-2;
  if (regime == QueryRegime::kThin) low = 1e-6, high = 1;
  query.radius = to_length(size * random.log_uniform(low, high));
  for (float& half : query.half) half = to_length(size * random.log_uniform(low, high));
  if (regime == QueryRegime::kShort) {
    if (random.chance(0.7)) query.radius = 0;
    for (float& half : query.half)
      if (random.chance(0.5)) half = 0;
  }
  // Half of the rays are lines.
  if (query.kind == QueryKind::kRay && (regime == QueryRegime::kParallel || random.chance(0.5))) query.radius = 0;
}

// The query's own body, about the origin. A ray's is the ball that is moved, a point's has no size.
QueryBody own_body(const Query& query) {
  QueryBody out;
  Real column[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Real q[4] = {query.orientation[0], query.orientation[1], query.orientation[2], query.orientation[3]};
  if (query.kind == QueryKind::kBox || query.kind == QueryKind::kCapsule) quaternion_matrix(q, column);
  if (query.kind == QueryKind::kBox) {
    for (std::size_t k = 0; k < 3; ++k) store(to_vec3(column[k]), out.box.axis[k]);
    for (std::size_t k = 0; k < 3; ++k) out.box.half[k] = query.half[k];
  } else {
    out.kind = query.kind == QueryKind::kCapsule ? JudgeKind::kCapsule : JudgeKind::kSphere;
    out.size[0] = query.kind == QueryKind::kPoint ? 0 : query.radius;
    out.size[1] = query.half[2];
    for (std::size_t k = 0; k < 3; ++k) store(to_vec3(column[k]), out.column[k]);
  }
  complete(out);
  return out;
}

// The point of the query's body that is farthest along a direction of length 1.
Point own_far_point(Random& random, const QueryBody& body, const Point& direction) {
  if (body.kind == JudgeKind::kBox) return far_point(random, body.box, direction);
  Point out = body.size[0] * direction;
  if (body.kind == JudgeKind::kCapsule) {
    const Point axis = to_vec3(body.column[2]);
    out = out + (dot(axis, direction) < 0 ? -body.size[1] : body.size[1]) * axis;
  }
  return out;
}

void set_ray(Random& random, const Target& target, QueryRegime regime, Query& query) {
  const ExactBox box = target.box();
  const auto size = static_cast<Real>(target.size);
  Point to = point_in(random, box, 1.3);
  Point along = convert<Real>(random.unit_vector());
  Real away = size * static_cast<Real>(random.log_uniform(0.1, 10));
  if (regime == QueryRegime::kFar) away = size * static_cast<Real>(random.log_uniform(1e3, 1e9));
  if (regime == QueryRegime::kHuge || regime == QueryRegime::kTiny) away += 2 * Real{query.radius};
  if (regime == QueryRegime::kGrazing) {
    const Point out = touching_direction(random, box);
    to = far_point(random, box, out);
    to = to + (Real{query.radius} + few_ulps(random) * target.leaf->lengths) * out;
    along = cross(out, convert<Real>(random.unit_vector()));
    along = 1 / length_of(along) * along;
    away = size * static_cast<Real>(random.log_uniform(0.5, 4));
  } else if (regime == QueryRegime::kParallel) {
    const std::size_t k = random.index(3), beside = (k + 1 + random.index(2)) % 3;
    along = static_cast<Real>(random.sign()) * axis_of(box, k);
    if (random.chance(0.6)) {
      const Real side = static_cast<Real>(random.sign());
      const Real x = dot(to - center_of(box), axis_of(box, beside));
      to = to + (side * (box.half[beside] + few_ulps(random) * target.leaf->lengths) - x) * axis_of(box, beside);
    }
  } else if (regime == QueryRegime::kInside) {
    away = 0;
    to = point_in(random, box, 1);
    if (random.chance(0.2)) to = center_of(box);
    if (random.chance(0.3)) to = far_point(random, box, touching_direction(random, box));
  }
  set_direction(random, along, query);
  if (regime == QueryRegime::kFar) {  // aimed with the direction that is left after rounding
    const Point left = {{query.direction[0], query.direction[1], query.direction[2]}};
    along = 1 / length_of(left) * left;
  }
  place(target, to - away * along, query);
  const double length = static_cast<double>(away + size);
  query.length = random.chance(0.3)   ? kInfinity
                 : random.chance(0.2) ? static_cast<float>(static_cast<double>(away) * random.uniform(0.2, 1.2))
                                      : static_cast<float>(length * random.log_uniform(1, 10));
  if (regime == QueryRegime::kShort) {
    query.length = random.chance(0.5) ? 0 : static_cast<float>(target.size * random.log_uniform(1e-30, 1e-3));
    place(target, point_in(random, box, 1.2), query);
    if (query.length == 0 && random.chance(0.5)) std::fill_n(query.direction, 3, 0.0f);
  }
}

void set_shape_or_point(Random& random, const Target& target, QueryRegime regime, Query& query) {
  const ExactBox box = target.box();
  const QueryBody body = own_body(query);
  const auto size = static_cast<Real>(target.size);
  const Point out = touching_direction(random, box);
  const Real least =
      query.kind == QueryKind::kBox ? std::min({query.half[0], query.half[1], query.half[2]}) : query.radius;
  Real gap = (size + least) * static_cast<Real>(random.uniform(-0.5, 0.3));
  if (query.kind == QueryKind::kPoint) gap = size * static_cast<Real>(random.log_uniform(1e-3, 10));
  if (regime == QueryRegime::kFar) gap = size * static_cast<Real>(random.log_uniform(1e3, 1e9));
  const Real lengths = target.leaf->lengths + body.reach;
  if (regime == QueryRegime::kGrazing || (regime == QueryRegime::kParallel && random.chance(0.7)))
    gap = few_ulps(random) * lengths;
  if (regime == QueryRegime::kInside) {
    place(target, random.chance(0.2) ? center_of(box) : point_in(random, box, 1), query);
    if (random.chance(0.3)) place(target, far_point(random, box, out), query);
  } else {
    const Point own = own_far_point(random, body, Real{-1} * out);
    place(target, far_point(random, box, out) - own + gap * out, query);
  }
  if (query.kind != QueryKind::kPoint) return;
  const Real distance = distance_of_point(target.leaf->box, placed(target, query));
  const double near = static_cast<double>(distance) * (random.chance(0.5) ? random.uniform(0.5, 3) : 1);
  query.length =
      random.chance(0.2) ? kInfinity : static_cast<float>(near + static_cast<double>(few_ulps(random) * lengths));
  query.length = std::fmax(query.length, 0.0f);
  if (regime == QueryRegime::kShort && random.chance(0.5)) query.length = 0;
}

void set_region(Random& random, const Target& target, QueryRegime regime, RandomQueries& lists, Query& query) {
  const ExactBox box = target.box();
  const auto size = static_cast<Real>(target.size);
  const Real away = regime == QueryRegime::kFar ? static_cast<Real>(random.log_uniform(1e3, 1e9)) : 3;
  place(target, center_of(box) + size * away * convert<Real>(random.unit_vector()), query);
  if (regime == QueryRegime::kInside) place(target, center_of(box), query);
  const Point at = placed(target, query);
  query.first_plane = static_cast<std::uint32_t>(lists.planes.size());
  query.plane_count = random.index(9);
  for (std::uint32_t i = 0; i < query.plane_count; ++i) {
    QueryPlane plane;
    Point normal = touching_direction(random, box);
    if (regime == QueryRegime::kParallel) {
      const std::size_t k = random.index(3);
      normal = static_cast<Real>(random.sign()) * axis_of(box, k);
    }
    const double times = random.chance(0.5) ? 1 : random.log_uniform(1e-15, 1e15);
    for (std::size_t c = 0; c < 3; ++c) plane.normal[c] = static_cast<float>(static_cast<double>(normal[c]) * times);
    normal = {{plane.normal[0], plane.normal[1], plane.normal[2]}};
    // How far the box reaches against the normal, then how far the plane is beyond that.
    const Real nearest = -support_of(target.leaf->box, Real{-1} * normal) - dot(at, normal);
    Real beyond = few_ulps(random) * target.leaf->lengths;
    if (regime != QueryRegime::kGrazing && regime != QueryRegime::kParallel)
      beyond =
          size * static_cast<Real>(random.chance(0.1) ? -random.log_uniform(1e-3, 1) : random.log_uniform(1e-3, 10));
    const Real offset = nearest + beyond * length_of(normal);
    plane.offset = static_cast<float>(std::clamp(offset, Real{-1e38L}, Real{1e38L}));
    lists.planes.push_back(plane);
  }
}

// Numbers of any size that a query may have.
void scatter(Random& random, Query& query) {
  for (double& c : query.position) c = signed_between(random, 1e-30, 1e30);
  for (float& c : query.direction) c = static_cast<float>(signed_between(random, 1e-44, 1e38));
  query.radius = static_cast<float>(random.log_uniform(1e-44, 9e17));
  for (float& half : query.half) half = static_cast<float>(random.log_uniform(1e-44, 9e17));
  query.length = random.chance(0.2) ? kInfinity : static_cast<float>(random.log_uniform(1e-44, 3e38));
}

}  // namespace

void add_query(Random& random, const QueryScene& scene, QueryRegime regime, QueryKind kind, RandomQueries& out) {
  const Target target = any_target(random, scene);
  Query query;
  query.kind = kind;
  query.want = static_cast<QueryWant>(random.index(kQueryWantCount));
  query.with_depth = random.chance(0.5);
  if (query.want == QueryWant::kAll && random.chance(0.4)) query.max_hits = 1 + random.index(6);
  if (random.chance(0.15)) query.layer_mask = static_cast<std::uint32_t>(random.next_u64());
  if (random.chance(0.2)) {
    const QueryInstance& ignored = random.chance(0.5) ? *target.instance : *any_target(random, scene).instance;
    query.ignored_batch = {ignored.batch.value};
    query.ignored_instance = ignored.instance;
  }
  set_sizes(random, regime, target.size, query);
  set_orientation(random, target, regime == QueryRegime::kParallel, query);
  if (kind == QueryKind::kRegion)
    set_region(random, target, regime, out, query);
  else if (kind == QueryKind::kRay)
    set_ray(random, target, regime, query);
  else
    set_shape_or_point(random, target, regime, query);
  if (regime == QueryRegime::kNowhere) scatter(random, query);
  for (double& c : query.position) c = std::clamp(c, -kMaxQueryCoordinate, kMaxQueryCoordinate);
  // Small directions may have become 0, and large lengths too large.
  if (query.direction[0] == 0 && query.direction[1] == 0 && query.direction[2] == 0)
    query.direction[random.index(3)] = 1;
  query.radius = std::min(query.radius, kMaxCoordinate);
  for (float& half : query.half) half = std::min(half, kMaxCoordinate);
  out.queries.push_back(query);
}

void add_queries(Random& random, const QueryScene& scene, std::uint32_t count, RandomQueries& out) {
  for (std::uint32_t i = 0; i < count; ++i) {
    // Half of them are of the three regimes that are neither far nor of odd sizes.
    const std::uint32_t regime = random.chance(0.4) ? random.index(3) : random.index(kQueryRegimeCount);
    const std::uint32_t kind = random.chance(0.3) ? 0 : random.index(kQueryKindCount);
    add_query(random, scene, static_cast<QueryRegime>(regime), static_cast<QueryKind>(kind), out);
  }
}

void add_parts(Random& random, Rig& rig, KeptParts& kept) {
  for (Leaf& leaf : rig.leaves) {
    const Box& box = leaf.box;
    if (random.chance(0.2) || !(std::min({box.half[0], box.half[1], box.half[2]}) > 0)) continue;
    std::vector<ConvexPart> parts;
    for (std::uint32_t count = 1 + random.index(3); count > 0; --count) {
      ConvexPart part;
      part.kind = static_cast<ShapeKind>(random.index(7));
      double q[4], column[3][3];
      random_turn(random, q);
      for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
      quaternion_matrix(q, column);
      double sizes[3];
      for (double& size : sizes) size = random.log_uniform(0.2, 1);
      std::vector<Vec> vertices;
      if (part.kind == ShapeKind::kConvexHull) {
        const bool is_flat = random.chance(0.2);
        for (std::uint32_t left = 4 + random.index(12); left > 0; --left) {
          Vec at = random.unit_vector();
          if (is_flat) at[2] = 0;
          for (std::size_t c = 0; c < 3; ++c) at[c] *= sizes[c];
          vertices.push_back(at);
        }
      }
      // How far a body of these sizes reaches along the box's axes, at most.
      double room = HUGE_VAL;
      double reach[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec axis = {{static_cast<double>(box.axis[k][0]), static_cast<double>(box.axis[k][1]),
                           static_cast<double>(box.axis[k][2])}};
        reach[k] = 0;
        for (std::size_t j = 0; j < 3; ++j) {
          const bool is_long = j == 2 && (part.kind == ShapeKind::kCapsule || part.kind == ShapeKind::kCylinder);
          const bool is_round = part.kind == ShapeKind::kSphere || is_long || part.kind == ShapeKind::kCapsule ||
                                part.kind == ShapeKind::kCylinder;
          const double size = is_round ? sizes[0] + (is_long ? sizes[1] : 0) : sizes[j];
          reach[k] += size * std::fabs(dot(axis, to_vec3(column[j])));
        }
        room = std::min(room, static_cast<double>(box.half[k]) / reach[k]);
      }
      const double times = room * random.uniform(0.3, 0.98);
      Vec at = convert<double>(to_vec3(box.center));
      for (std::size_t k = 0; k < 3; ++k) {
        const double free = random.uniform(-0.98, 0.98) * (static_cast<double>(box.half[k]) - times * reach[k]);
        for (std::size_t c = 0; c < 3; ++c) at[c] += free * static_cast<double>(box.axis[k][c]);
      }
      for (std::size_t c = 0; c < 3; ++c) part.position[c] = static_cast<float>(at[c]);
      for (std::size_t c = 0; c < 3; ++c) part.size[c] = static_cast<float>(times * sizes[c]);
      if (!vertices.empty()) {
        std::vector<float>& list = kept.vertices.emplace_back();
        for (const Vec& v : vertices)
          for (std::size_t c = 0; c < 3; ++c) list.push_back(static_cast<float>(times * v[c]));
        part.vertices = list;
      }
      parts.push_back(part);
    }
    kept.parts.push_back(std::move(parts));
    leaf.parts = {kept.parts.back().data(), kept.parts.back().size()};
  }
}

void flatten_leaves(Random& random, Rig& rig) {
  for (Leaf& leaf : rig.leaves) {
    if (!random.chance(0.3)) continue;
    for (float& half : leaf.box.half)
      if (random.chance(0.4)) half = 0;
    if (random.chance(0.2)) leaf.box.half[random.index(3)] *= static_cast<float>(random.log_uniform(1e-5, 1e-2));
  }
}

void resize(double factor, Rig& rig, Poses& poses) {
  const auto times = [&](float& v) { v = static_cast<float>(factor * static_cast<double>(v)); };
  for (float& v : rig.joints) times(v);
  for (Vec& v : rig.parent_offset) v = factor * v;
  for (Leaf& leaf : rig.leaves) {
    for (float& v : leaf.box.center) times(v);
    for (float& v : leaf.box.half) times(v);
  }
  for (double& v : poses.origins) v *= factor;
  for (std::uint32_t i = 0; i < poses.instance_count; ++i)
    for (std::uint32_t link = 0; link < poses.link_count; ++link) {
      float* const pose = poses.pose(i, link);
      for (std::size_t c = 0; c < 3; ++c)
        times(pose[poses.format == PoseFormat::kQuaternionTranslation ? 4 + c
                   : poses.format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                      : 12 + c]);
    }
}

void mirror_links(Random& random, Poses& poses) {
  if (poses.format == PoseFormat::kQuaternionTranslation) return;
  for (std::uint32_t link = 0; link < poses.link_count; ++link) {
    if (random.chance(0.5)) continue;
    for (std::uint32_t i = 0; i < poses.instance_count; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        float& entry = poses.pose(i, link)[poses.format == PoseFormat::kMatrix3x4Rows ? 4 * c + 2 : 8 + c];
        entry = -entry;
      }
  }
}

}  // namespace cab::oracle
