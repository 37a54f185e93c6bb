// The judge of queries: against answers worked out by hand, against dense samples of points, and with planted faults.
#include "perf/judge/oracle/query_judge.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "perf/judge/oracle/random_queries.h"
#include "tests/rounds.h"

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::least_count;
using cab::tests::rounds;

constexpr float kFloatInfinity = std::numeric_limits<float>::infinity();

// A distance of a hand-made case as given, which the judge works out in long double.
constexpr double kExactly = 1e-15;

// How much a leaf of a hand-made case may grow: 128 u of lengths of some 20.
constexpr double kLoosely = 5e-4;

// The judge does not say what a query must meet that is this many lengths of a leaf away.
constexpr Real kTold = 1e10L;

// ---------------------------------------------------------------------------------------------- cases by hand

// One link with one leaf, on which a case is built.
struct Stage {
  Rig rig;
  Poses poses;
  std::vector<float> vertices;
  std::vector<ConvexPart> parts;

  Stage() {
    rig.parents = {-1};
    rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 2, 3}}, {}}};
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0};
    poses.origins = {10, 0, 0};
  }
  QueryScene scene() {
    if (!parts.empty()) rig.leaves[0].parts = parts;
    return {query_instance({1}, rig, poses, 0)};
  }
};

Query ray(double x, double y, double z, float dx, float dy, float dz) {
  Query out;
  out.position[0] = x;
  out.position[1] = y;
  out.position[2] = z;
  out.direction[0] = dx;
  out.direction[1] = dy;
  out.direction[2] = dz;
  out.length = kFloatInfinity;
  return out;
}

Query shape(QueryKind kind, double x, double y, double z, float size = 0) {
  Query out = ray(x, y, z, 0, 0, 0);
  out.kind = kind;
  out.radius = size;
  out.half[0] = out.half[1] = out.half[2] = size;
  return out;
}

Query with_depth(Query query) {
  query.with_depth = true;
  return query;
}

// What the judge says about the stage's one link.
struct Said {
  bool must = false, may = false;
  JudgedHit hit;
};

Said say(const QueryScene& scene, const Query& query, Exact exact = Exact::kNone,
         const std::vector<QueryPlane>& planes = {}) {
  const std::vector<JudgedLink> links = judge_query(scene, query, planes, exact);
  REQUIRE(links.size() <= 1);
  return links.empty() ? Said{} : Said{links[0].must, true, links[0]};
}

bool is_between(const Said& said, double distance) {
  return said.must && std::fabs(static_cast<double>(said.hit.most) - distance) < kExactly * (1 + distance) + kExactly &&
         said.hit.least <= said.hit.most && static_cast<double>(said.hit.most - said.hit.least) < kLoosely;
}

bool is_missed(const Said& said) { return !said.may; }

}  // namespace

TEST_CASE("query judge: rays and moved spheres meet a box where they should") {
  Stage stage;
  const QueryScene scene = stage.scene();
  CHECK(is_between(say(scene, ray(0, 0, 0, 1, 0, 0)), 9));
  CHECK(is_between(say(scene, ray(0, 0, 0, 1e-30f, 0, 0)), 9));
  CHECK(is_between(say(scene, ray(10, 0, 100, 0, 0, -4)), 97));
  CHECK(is_between(say(scene, ray(8, 1, 0, 1, 1, 0)), std::sqrt(2.0)));  // enters by an edge
  CHECK(is_missed(say(scene, ray(0, 0, 0, -1, 0, 0))));
  CHECK(is_missed(say(scene, ray(0, 2.001, 0, 1, 0, 0))));
  CHECK(is_between(say(scene, ray(0, 2, 3, 1, 0, 0)), 9));  // along an edge
  const Said near = say(scene, ray(0, 2 + 1e-5, 0, 1, 0, 0));
  CHECK(near.may);
  CHECK(!near.must);

  Query shorter = ray(0, 0, 0, 1, 0, 0);
  shorter.length = 9;
  CHECK(is_between(say(scene, shorter), 9));
  shorter.length = 8.9f;
  CHECK(is_missed(say(scene, shorter)));
  shorter.length = 0;
  CHECK(is_missed(say(scene, shorter)));

  Query inside = ray(10, 1, 0, 0, 0, 0);
  inside.length = 0;
  CHECK(is_between(say(scene, inside), 0));
  CHECK(say(scene, inside).hit.must_inside);
  CHECK(!say(scene, ray(0, 0, 0, 1, 0, 0)).hit.may_inside);
  CHECK(say(scene, ray(9, 0, 0, 1, 0, 0)).hit.may_inside);  // on the face

  Query moved = ray(0, 0, 0, 1, 0, 0);
  moved.radius = 0.5f;
  CHECK(is_between(say(scene, moved), 8.5));
  moved.position[1] = 2.3;  // by an edge: 0.3 beside it, so 0.4 before it
  CHECK(is_between(say(scene, moved), 8.6));
  moved.position[2] = 3 + std::sqrt(0.25 - 0.09 - 0.01);  // by a corner
  CHECK(is_between(say(scene, moved), 8.9));
  moved.position[1] = 2.501;
  CHECK(is_missed(say(scene, moved)));
  moved.position[0] = 10;
  moved.position[1] = 2.4;
  moved.position[2] = 0;
  CHECK(say(scene, moved).hit.must_inside);
}

TEST_CASE("query judge: shapes, points and regions meet a box where they should") {
  Stage stage;
  const QueryScene scene = stage.scene();
  CHECK(is_between(say(scene, shape(QueryKind::kSphere, 8, 0, 0, 1)), 0));
  CHECK(is_missed(say(scene, shape(QueryKind::kSphere, 7.9, 0, 0, 1))));
  CHECK(is_between(say(scene, with_depth(shape(QueryKind::kSphere, 8.25, 0, 0, 1))), -0.25));
  CHECK(is_between(say(scene, with_depth(shape(QueryKind::kSphere, 10.5, 0, 0, 1))), -1.5));
  CHECK(is_between(say(scene, with_depth(shape(QueryKind::kSphere, 12, 3, 0, 1.5f))), -(1.5 - std::sqrt(2.0))));
  CHECK(is_missed(say(scene, shape(QueryKind::kSphere, 12, 3, 0, 1.41f))));

  CHECK(is_between(say(scene, with_depth(shape(QueryKind::kBox, 8.25, 0, 0, 1))), -0.25));
  CHECK(is_missed(say(scene, shape(QueryKind::kBox, 7.999, 0, 0, 1))));
  Query turned = shape(QueryKind::kBox, 7.6, 0, 0, 1);  // by 45 degrees about z, with a quaternion of another length
  turned.orientation[2] = static_cast<float>(100 * std::sin(std::numbers::pi / 8));
  turned.orientation[3] = static_cast<float>(100 * std::cos(std::numbers::pi / 8));
  CHECK(say(scene, turned).must);
  turned.position[0] = 7.58;
  CHECK(is_missed(say(scene, turned)));

  Query capsule = shape(QueryKind::kCapsule, 10, 6, 0, 0);
  capsule.radius = 1;
  capsule.half[2] = 3;
  CHECK(is_missed(say(scene, capsule)));
  capsule.orientation[0] = capsule.orientation[3] = 1;  // its z to -y
  CHECK(is_between(say(scene, capsule), 0));
  capsule.position[1] = 6.001;
  CHECK(is_missed(say(scene, capsule)));
  capsule.position[1] = 5.75;
  CHECK(say(scene, with_depth(capsule)).hit.most == doctest::Approx(-0.25).epsilon(1e-9));

  Query point = shape(QueryKind::kPoint, 6, 6, 0);
  CHECK(is_between(say(scene, point), 5));
  point.length = 5;
  CHECK(is_between(say(scene, point), 5));
  point.length = 4.99f;
  CHECK(is_missed(say(scene, point)));
  CHECK(say(scene, shape(QueryKind::kPoint, 10, 1, 1)).hit.must_inside);

  Query region = shape(QueryKind::kRegion, 8, 0, 0);
  CHECK(is_between(say(scene, region), 0));
  region.plane_count = 1;
  const auto by = [&](float x, float y, float offset) {
    return say(scene, region, Exact::kNone, {{{x, y, 0}, offset}});
  };
  CHECK(is_missed(by(1, 0, 0)));
  CHECK(is_missed(by(1e-20f, 0, 0.99e-20f)));
  CHECK(is_between(by(4, 0, 4), 0));
  CHECK(is_between(by(-1, 0, -3), 0));
  CHECK(is_missed(by(-1, 0, -3.01f)));
}

TEST_CASE("query judge: which instances are looked at, and which leaf stands for a link") {
  Stage stage;
  stage.rig.parents = {-1, 0};
  stage.rig.leaves = {stage.rig.leaves[0], stage.rig.leaves[0], stage.rig.leaves[0]};
  stage.rig.leaves[0].link = 1;
  stage.rig.leaves[1].box.center[0] = -4;
  stage.poses.link_count = 2;
  stage.poses.data.resize(14);
  stage.poses.data[10] = 1;
  const QueryScene scene = {query_instance({3}, stage.rig, stage.poses, 0, 6)};
  Query query = ray(0, 0, 0, 1, 0, 0);
  const auto count = [&] { return judge_query(scene, query, {}, Exact::kNone).size(); };
  const std::vector<JudgedLink> links = judge_query(scene, query, {}, Exact::kNone);
  REQUIRE(links.size() == 2);
  CHECK(links[0].link == 0);
  CHECK(links[0].leaves.size() == 2);
  CHECK(links[0].most == 5);
  CHECK(links[1].most == 9);
  query.layer_mask = 9;
  CHECK(count() == 0);
  query.layer_mask = 12;
  query.ignored_instance = 0;
  CHECK(count() == 2);
  query.ignored_batch = {0x1234500000003};
  CHECK(count() == 0);
  query.ignored_instance = 1;
  CHECK(count() == 2);
}

TEST_CASE("query judge: shapes are where poses, scales and mirrors put them") {
  Stage stage;
  ConvexPart part;
  part.kind = ShapeKind::kSphere;
  part.size[0] = 0.5f;
  part.position[2] = 2;
  stage.parts = {part};
  stage.poses.format = PoseFormat::kMatrix3x4Rows;
  stage.poses.data = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 1};  // mirrored across z, and moved by 1
  stage.poses.scales = {2};
  const auto s = static_cast<float>(std::sqrt(0.5));
  stage.poses.orientations = {0, s, 0, s};  // z to x
  const QueryScene scene = stage.scene();
  // The sphere is at 2 (1 - 2) = -2 along z, so at 8 along x, with radius 1.
  CHECK(say(scene, ray(0, 0, 0, 1, 0, 0), Exact::kConvex).hit.most == doctest::Approx(7).epsilon(1e-6));
  // The box spans 2 (1 +- 3) along z, and 2 along what was x.
  CHECK(say(scene, ray(0, 0, 0, 1, 0, 0)).hit.most == doctest::Approx(6).epsilon(1e-6));
  CHECK(say(scene, ray(12, 0, 20, 0, 0, -1)).hit.most == doctest::Approx(18).epsilon(1e-6));
}

TEST_CASE("query judge: shapes of every kind are met where they should be") {
  Stage stage;
  ConvexPart& part = stage.parts.emplace_back();
  const auto entry = [&](double y, double z) { return say(stage.scene(), ray(0, y, z, 1, 0, 0), Exact::kConvex); };
  part.kind = ShapeKind::kSphere;
  part.size[0] = 1;
  CHECK(is_between(entry(0, 0.6), 9.2));
  CHECK(is_missed(entry(0.8, 0.601)));
  part.kind = ShapeKind::kEllipsoid;
  part.size[1] = 2;
  part.size[2] = 3;
  CHECK(is_between(entry(0, 1.8), 9.2));
  CHECK(is_between(entry(1.6, 0), 9.4));
  CHECK(is_between(say(stage.scene(), shape(QueryKind::kPoint, 10, 5, 0), Exact::kConvex), 3));
  part.kind = ShapeKind::kCapsule;
  part.size[0] = 0.5f;
  part.size[1] = 1;
  CHECK(is_between(entry(0, 1.3), 9.6));
  CHECK(is_between(entry(0.3, 0.9), 9.6));
  part.kind = ShapeKind::kCylinder;
  CHECK(is_between(entry(0.3, 0.9), 9.6));
  CHECK(is_missed(entry(0, 1.01)));
  part.kind = ShapeKind::kBox;
  part.size[2] = 2;
  CHECK(is_between(entry(0, 2), 9.5));
  CHECK(is_missed(entry(0, 2.01)));
  part.kind = ShapeKind::kConvexHull;
  stage.vertices = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  part.vertices = stage.vertices;
  CHECK(is_between(entry(0.25, 0.25), 10));
  CHECK(is_between(say(stage.scene(), ray(20, 0.25, 0.25, -1, 0, 0), Exact::kConvex), 9.5));
  CHECK(is_between(say(stage.scene(), shape(QueryKind::kPoint, 11, 1, 1), Exact::kConvex), 2 / std::sqrt(3.0)));
  stage.vertices = {0, -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1};  // flat
  CHECK(is_between(entry(0.9, -0.9), 10));
  part.kind = ShapeKind::kHalfSpace;
  const auto down = [&](double x) { return say(stage.scene(), ray(x, 0, 20, 0, 0, -1), Exact::kConvex); };
  CHECK(is_between(down(10), 20));
  CHECK(is_missed(down(8.9)));  // beside the box
  const Said low = entry(0, -1);
  CHECK(low.must);
  CHECK(low.hit.most == 9);   // of the box's part
  CHECK(low.hit.least == 0);  // of the half space
  CHECK(is_missed(entry(0, 1)));
}

// ------------------------------------------------------------------------------------------------- dense samples

namespace {

// Whether a point is in a body, by the definition of its shape. `within`: how much larger the body may be.
bool holds(const QueryBody& body, const Point& p, Real within) {
  if (body.kind == JudgeKind::kBox) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Point n = cross(axis_of(body.box, (k + 1) % 3), axis_of(body.box, (k + 2) % 3));
      if (std::fabs(dot(n, p - center_of(body.box))) >
          body.box.half[k] * std::fabs(dot(n, axis_of(body.box, k))) + within)
        return false;
    }
    return true;
  }
  const Point from = p - body.at;
  const Real x = dot(to_vec3(body.column[0]), from), y = dot(to_vec3(body.column[1]), from),
             z = dot(to_vec3(body.column[2]), from), r = body.size[0] + within, h = body.size[1];
  switch (body.kind) {
    case JudgeKind::kSphere: return x * x + y * y + z * z <= r * r;
    case JudgeKind::kCapsule: {
      const Real beyond = std::fmax(0, std::fabs(z) - h);
      return x * x + y * y + beyond * beyond <= r * r;
    }
    case JudgeKind::kCylinder: return x * x + y * y <= r * r && std::fabs(z) <= h + within;
    case JudgeKind::kEllipsoid: {
      const Real a = x / r, b = y / (body.size[1] + within), c = z / (body.size[2] + within);
      return a * a + b * b + c * c <= 1;
    }
    case JudgeKind::kHalfSpace: return z <= within;
    default: return distance_of_point(body, p) <= within;
  }
}

// Any point of a body other than a half space, often on its surface.
Point sample(Random& random, const QueryBody& body) {
  const auto any = [&] { return static_cast<Real>(random.chance(0.3) ? random.sign() : random.uniform(-1, 1)); };
  if (body.kind == JudgeKind::kBox) {
    Point out = center_of(body.box);
    for (std::size_t k = 0; k < 3; ++k) out = out + any() * body.box.half[k] * axis_of(body.box, k);
    return out;
  }
  if (body.kind == JudgeKind::kHull) {
    Point out{};
    Real sum = 0;
    for (const Point& v : body.vertices) {
      const Real weight = random.chance(0.5) ? 0 : static_cast<Real>(random.uniform(0.01, 1));
      out = out + weight * v;
      sum += weight;
    }
    return body.at + (sum > 0 ? 1 / sum : 0) * out + (sum > 0 ? Point{} : body.vertices[0]);
  }
  Point u = convert<Real>(random.unit_vector());
  if (random.chance(0.5)) u = static_cast<Real>(random.uniform(0, 1)) * u;
  Point local{};
  switch (body.kind) {
    case JudgeKind::kEllipsoid: local = {{u[0] * body.size[0], u[1] * body.size[1], u[2] * body.size[2]}}; break;
    case JudgeKind::kCylinder: local = {{u[0] * body.size[0], u[1] * body.size[0], any() * body.size[1]}}; break;
    case JudgeKind::kCapsule: local = body.size[0] * u + Point{{0, 0, any() * body.size[1]}}; break;
    default: local = body.size[0] * u; break;
  }
  return body.at + rotated(body.column, local);
}

struct Crowd {
  Rig rig;
  Poses poses;
  KeptParts kept;
  QueryScene scene;
};

void make_crowd(Random& random, Crowd& out) {
  const auto topology = static_cast<Topology>(random.index(3));
  out.rig = random_rig(random, topology, 2 + random.index(6), 2);
  if (random.chance(0.3)) flatten_leaves(random, out.rig);
  const std::uint32_t count = 1 + random.index(6);
  PoseRange range{random.uniform(0.2, 2), random.chance(0.5), random.chance(0.5), {}};
  if (range.origins && random.chance(0.4)) {
    const double away = random.log_uniform(1, 1e9);
    range.about = away * random.unit_vector();
  }
  out.poses = random_poses(random, out.rig, count, static_cast<PoseFormat>(random.index(3)), range);
  if (random.chance(0.3)) mirror_links(random, out.poses);
  if (random.chance(0.3)) resize(random.log_uniform(1e-20, 1e15), out.rig, out.poses);
  add_parts(random, out.rig, out.kept);
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < count; ++i)
      out.poses.scales.push_back(static_cast<float>(random.log_uniform(1e-2, 1e2)));
  for (std::uint32_t i = 0; i < count; ++i) out.scene.push_back(query_instance({1}, out.rig, out.poses, i));
}

// The body of a query about an instance, or of the ball that a ray moves, by the definition of Query.
QueryBody query_body(const Query& query, const Point& at) {
  QueryBody out;
  out.at = at;
  const Real q[4] = {query.orientation[0], query.orientation[1], query.orientation[2], query.orientation[3]};
  quaternion_matrix(q, out.column);
  out.kind = query.kind == QueryKind::kBox       ? JudgeKind::kBox
             : query.kind == QueryKind::kCapsule ? JudgeKind::kCapsule
                                                 : JudgeKind::kSphere;
  if (out.kind == JudgeKind::kBox) {
    store(at, out.box.center);
    for (std::size_t k = 0; k < 3; ++k) {
      store(to_vec3(out.column[k]), out.box.axis[k]);
      out.box.half[k] = query.half[k];
    }
  }
  out.size[0] = query.radius;
  out.size[1] = query.half[2];
  return out;
}

Point place_of(const Query& query, const QueryInstance& instance) {
  return Point{{query.position[0], query.position[1], query.position[2]}} - instance.origin;
}

}  // namespace

TEST_CASE("query judge: nearest points and supports are right for every point that is sampled") {
  std::size_t bodies = 0, insides = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Crowd crowd;
    make_crowd(random, crowd);
    for (const QueryInstance& instance : crowd.scene)
      for (const QueryLeaf& leaf : instance.leaves) {
        std::vector<QueryBody> all = leaf.parts;
        all.push_back(leaf.box);
        for (const QueryBody& body : all) {
          if (body.kind == JudgeKind::kHalfSpace) continue;
          CAPTURE(static_cast<int>(body.kind));
          ++bodies;
          const Real noise = 1e-15L * (body.reach + norm_1(body.middle));
          const Real far_away = static_cast<Real>(random.log_uniform(0.1, 100)) * body.reach;
          const Point to = body.middle + far_away * convert<Real>(random.unit_vector());
          const Point nearest = nearest_point(body, to), away = to - nearest, d = convert<Real>(random.unit_vector());
          CHECK(holds(body, nearest, noise));
          const Real far = support_of(body, d);
          if (holds(body, to, 0)) {
            ++insides;
            CHECK(length_of(away) <= noise);
          }
          for (int i = 0; i < 30; ++i) {
            const Point p = sample(random, body);
            CHECK(holds(body, p, noise));
            CHECK(length_of(p - body.middle) <= body.reach + noise);
            CHECK(dot(p, d) <= far + noise);
            // The plane through the nearest point, across the way there, has the body behind it.
            CHECK(dot(p - nearest, away) <= noise * (length_of(away) + body.reach));
          }
        }
      }
  }
  CHECK(bodies >= least_count(700, 40));
  CHECK(insides >= least_count(20, 40));
}

TEST_CASE("query judge: what a sampled point shows to be met must be met, and what a plane parts must not be") {
  std::size_t met = 0, parted = 0, judged = 0, entries = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Crowd crowd;
    make_crowd(random, crowd);
    RandomQueries asked;
    add_queries(random, crowd.scene, 40, asked);
    for (std::size_t q = 0; q < asked.queries.size(); ++q) {
      Query query = asked.queries[q];
      query.layer_mask = ~0u;
      query.ignored_batch = {};
      query.with_depth = false;
      if (query.kind == QueryKind::kRegion) continue;
      const Exact exact = random.chance(0.5) ? Exact::kConvex : Exact::kNone;
      CAPTURE(q);
      CAPTURE(static_cast<int>(query.kind));
      const std::vector<JudgedLink> links = judge_query(crowd.scene, query, asked.planes, exact);
      const QueryInstance& instance = crowd.scene[random.index(static_cast<std::uint32_t>(crowd.scene.size()))];
      const Point at = place_of(query, instance);
      const Point line = {{query.direction[0], query.direction[1], query.direction[2]}};
      const Point direction = length_of(line) > 0 ? 1 / length_of(line) * line : Point{};
      for (const QueryLeaf& leaf : instance.leaves) {
        const auto link = std::find_if(links.begin(), links.end(), [&](const JudgedLink& known) {
          return known.instance == &instance && known.link == leaf.link;
        });
        const JudgedLeaf* known = nullptr;
        if (link != links.end())
          for (const JudgedLeaf& one : link->leaves)
            if (one.leaf == &leaf) known = &one;
        ++judged;
        std::vector<const QueryBody*> bodies;
        if (exact == Exact::kConvex)
          for (const QueryBody& part : leaf.parts) bodies.push_back(&part);
        if (bodies.empty()) bodies = {&leaf.box};
        bool all_parted = true;
        for (const QueryBody* const body : bodies) {
          CAPTURE(static_cast<int>(body->kind));
          if (body->kind == JudgeKind::kHalfSpace) {
            all_parted = false;
            continue;
          }
          const Real noise = 1e-13L * (leaf.lengths + norm_1(at) * 1e-3L + query.radius);
          Real near = query.length;  // the least length of a point of the body along the ray, or to the point
          bool is_met = false, is_parted = false;
          const auto met_at = [&](Real distance) {
            if (distance > query.length) return;
            is_met = true;
            near = std::fmin(near, distance);
          };
          for (int i = 0; i < 40; ++i) {
            const Point p = sample(random, *body);
            if (query.kind == QueryKind::kPoint) {
              met_at(length_of(p - at));
            } else if (query.kind == QueryKind::kRay) {
              // Near the line, or at a point of it that is in the body.
              const Real t = std::clamp(dot(p - at, direction), Real{0}, static_cast<Real>(query.length));
              const Point here = at + t * direction;
              if (length_of(p - here) <= query.radius * (1 - 1e-15L) || holds(*body, here, -noise)) met_at(t);
            } else {
              is_met = is_met || holds(query_body(query, at), p, -noise);
            }
          }
          const Point u = convert<Real>(random.unit_vector());
          for (const Point& d : {u, Real{-1} * u, at - body->middle, axis_of(leaf.box.box, 0), axis_of(leaf.box.box, 1),
                                 axis_of(leaf.box.box, 2), Real{-1} * axis_of(leaf.box.box, 0),
                                 Real{-1} * axis_of(leaf.box.box, 1), Real{-1} * axis_of(leaf.box.box, 2)}) {
            if (!(length_of(d) > 0)) continue;
            const Point n = 1 / length_of(d) * d;
            const Real own = query.radius + Real{query.half[0]} + query.half[1] + query.half[2];
            Real gap = dot(n, at) - support_of(*body, n) - 1e-3L * (leaf.lengths + own) - 1e-12L * norm_1(at);
            if (query.kind == QueryKind::kRay) {
              gap -= query.radius;
              if (dot(n, direction) < 0) gap += query.length < kFloatInfinity ? dot(n, direction) * query.length : -gap;
            } else if (query.kind == QueryKind::kPoint) {
              gap -= query.length;
            } else {
              gap -= support_of(query_body(query, {}), Real{-1} * n);
            }
            is_parted = is_parted || gap > 0;
          }
          all_parted = all_parted && is_parted;
          CHECK(!(is_met && is_parted));
          if (!is_met || norm_1(at) > kTold * leaf.lengths) continue;
          ++met;
          REQUIRE(known);
          CHECK(known->least <= near + noise);
          if (exact == Exact::kConvex && leaf.parts.empty()) continue;  // its box is asked with other axes
          CHECK(known->must);
          CHECK(known->most <= near + noise);
        }
        if (all_parted) {
          ++parted;
          CHECK(!known);
        }
        // Nothing of a body is on the ray before its distance.
        if (query.kind == QueryKind::kRay && query.radius == 0 && known && known->must && known->most > 0) {
          ++entries;
          for (int i = 0; i < 10; ++i) {
            const Point p = at + static_cast<Real>(random.uniform(0, 0.9999)) * known->most * direction;
            for (const QueryBody* const body : bodies)
              if (body->kind != JudgeKind::kHalfSpace) CHECK(!holds(*body, p, -1e-12L * norm_1(at)));
          }
        }
      }
    }
  }
  MESSAGE("leaves judged: ", judged, ", met: ", met, ", parted: ", parted, ", entered: ", entries);
  CHECK(met >= least_count(500, 40));
  CHECK(parted >= least_count(5000, 40));
  CHECK(entries >= least_count(50, 40));
}

// -------------------------------------------------------------------------------------------------- answered jobs

namespace {

// A job with answers, and what it points to.
struct Answered {
  std::vector<Query> queries;
  std::vector<QueryPlane> planes;
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  Exact exact = Exact::kNone;

  QueryJob job() {
    QueryJob out;
    out.queries = queries;
    out.planes = planes;
    out.exact = exact;
    out.hits = hits;
    out.found = found;
    out.hit_count = out.hits_needed = hits.size();
    return out;
  }
};

void write(const Point& from, float (&to)[3]) {
  for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(from[c]);
}

// The hit of a query and a body that meet at a distance, with a point and a normal that are worked out from the body.
// False if they are not clear: where the query only just touches.
bool complete_hit(const Query& query, const QueryBody& body, const Point& at, bool is_inside, Real distance,
                  QueryHit& hit) {
  hit.distance = static_cast<float>(distance);
  hit.inside = is_inside;
  write({}, hit.point);
  write({}, hit.normal);
  if (query.kind == QueryKind::kPoint) {
    const Point away = at - nearest_point(body, at);
    write(Real{-1} * away, hit.point);
    if (!is_inside) write(1 / length_of(away) * away, hit.normal);
    return is_inside || distance > 1e-9L * body.reach;
  }
  if (query.kind == QueryKind::kRay) {
    const Point line = {{query.direction[0], query.direction[1], query.direction[2]}};
    const Point along = length_of(line) > 0 ? 1 / length_of(line) * line : line;
    const Point center = at + distance * along;
    if (is_inside) return true;
    // The nearest point from a little before says where the surface faces.
    const Real before = query.radius > 0 ? 0 : 1e-7L * body.reach;
    const Point from = center - before * along, arm = from - nearest_point(body, from);
    if (!(length_of(arm) > 1e-3L * (before + query.radius))) return false;
    write(1 / length_of(arm) * arm, hit.normal);
    write(distance * along - static_cast<Real>(query.radius) / length_of(arm) * arm, hit.point);
    return true;
  }
  if (query.kind == QueryKind::kRegion || !query.with_depth) return true;
  QueryBody own = query_body(query, at);
  complete(own);
  const Verdict verdict = judge(shape_of(body), shape_of(own), Effort::kMeasure);
  write(verdict.normal, hit.normal);
  write(verdict.on_a - at, hit.point);
  hit.distance = static_cast<float>(verdict.gap_at_least);
  return overlap(verdict) && own.reach < 1e9L * body.reach;
}

// Answers random queries by what a query must find: with hits that are not clear the query asks for any link alone.
void answer(Random& random, const Crowd& crowd, Answered& out) {
  RandomQueries asked;
  add_queries(random, crowd.scene, 30, asked);
  out.planes = asked.planes;
  out.exact = random.chance(0.5) ? Exact::kConvex : Exact::kNone;
  for (Query query : asked.queries) {
    const auto index = static_cast<std::uint32_t>(out.queries.size());
    std::vector<QueryHit> hits;
    bool is_clear = true;
    for (const JudgedLink& link : judge_query(crowd.scene, query, out.planes, out.exact)) {
      const JudgedLeaf* best = nullptr;
      for (const JudgedLeaf& leaf : link.leaves)
        if (leaf.must && (!best || leaf.most < best->most)) best = &leaf;
      is_clear = is_clear && best && best->may_inside == best->must_inside &&
                 norm_1(place_of(query, *link.instance)) < kTold * best->leaf->lengths;
      if (!best) continue;
      QueryHit& hit = hits.emplace_back();
      hit.query = index;
      hit.batch = link.instance->batch;
      hit.instance = link.instance->instance;
      hit.link = link.link;
      hit.leaf = best->leaf->leaf;
      bool is_right = false;
      std::vector<QueryBody> bodies = best->leaf->parts;
      if (out.exact == Exact::kNone || bodies.empty() || query.kind == QueryKind::kRegion) bodies = {best->leaf->box};
      for (QueryBody& body : bodies) {
        if (body.kind == JudgeKind::kHalfSpace) body = clipped(best->leaf->box.box, body);
        if (body.kind == JudgeKind::kHull && body.vertices.empty()) continue;
        QueryScene one = {{link.instance->batch, link.instance->instance, ~0u, link.instance->origin, {}}};
        one[0].leaves.push_back({best->leaf->link, best->leaf->leaf, best->leaf->lengths, best->leaf->box, {body}});
        const std::vector<JudgedLink> alone = judge_query(one, query, out.planes, out.exact);
        if (is_right || alone.empty() || alone[0].most > best->most) continue;
        is_right = complete_hit(query, body, place_of(query, *link.instance), best->must_inside, best->most, hit);
      }
      is_clear = is_clear && is_right && (query.length < 1e30f || query.kind != QueryKind::kRay || best->most < 1e30L);
    }
    std::sort(hits.begin(), hits.end(), [](const QueryHit& a, const QueryHit& b) {
      return std::make_tuple(a.distance, a.batch.value, a.instance, a.link) <
             std::make_tuple(b.distance, b.batch.value, b.instance, b.link);
    });
    if (!is_clear) query.want = QueryWant::kAny;
    out.found.push_back(!hits.empty());
    const std::size_t most = query.want == QueryWant::kAny ? 0 : query.want == QueryWant::kClosest ? 1 : query.max_hits;
    if (hits.size() > most) hits.resize(most);
    out.queries.push_back(query);
    out.hits.insert(out.hits.end(), hits.begin(), hits.end());
  }
}

}  // namespace

TEST_CASE("query judge: what boxes with the padding of posed leaves answer passes") {
  // docs/numerics.md: by up to 56 u of S and |c|_1, and 48 u of t.
  constexpr Real kPadding = 56 * 0x1p-24L;
  std::size_t hits = 0;
  double needed = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Crowd crowd;
    make_crowd(random, crowd);
    const QueryScene given = crowd.scene;
    for (QueryInstance& instance : crowd.scene)
      for (QueryLeaf& leaf : instance.leaves) {
        leaf.box = grown(leaf.box, kPadding * leaf.lengths);
        for (QueryBody& part : leaf.parts) part = grown(part, kPadding * leaf.lengths);
      }
    Answered padded;
    answer(random, crowd, padded);
    CHECK(fault_of(given, padded.job()) == "");
    hits += padded.hits.size();
    if (seed <= 10) needed = std::fmax(needed, needed_growth(given, padded.job()));
  }
  CHECK(hits >= least_count(400, 60));
  CHECK(needed <= 128);
  CHECK(needed >= 16);
}

TEST_CASE("query judge: right answers pass, and every planted fault is found") {
  std::size_t hits = 0, planted = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Crowd crowd;
    make_crowd(random, crowd);
    Answered right;
    answer(random, crowd, right);
    CHECK(fault_of(crowd.scene, right.job()) == "");
    hits += right.hits.size();
    const auto plant = [&](const std::string& what, const std::function<bool(Answered&)>& change) {
      CAPTURE(what);
      Answered wrong = right;
      if (!change(wrong)) return;
      ++planted;
      CHECK(fault_of(crowd.scene, wrong.job()) != "");
    };
    if (right.hits.empty()) continue;
    const std::size_t h = random.index(static_cast<std::uint32_t>(right.hits.size()));
    const Query& query = right.queries[right.hits[h].query];
    CAPTURE(right.hits[h].query);
    CAPTURE(static_cast<int>(query.kind));
    const bool has_distance = query.kind == QueryKind::kRay || query.kind == QueryKind::kPoint ||
                              (query.kind != QueryKind::kRegion && query.with_depth);
    const auto swap_hits = [](Answered& wrong, std::size_t a) {
      if (a + 1 >= wrong.hits.size()) return false;
      std::swap(wrong.hits[a], wrong.hits[a + 1]);
      return true;
    };
    plant("a hit is lost", [&](Answered& wrong) {
      wrong.hits.erase(wrong.hits.begin() + static_cast<std::ptrdiff_t>(h));
      return true;
    });
    plant("a hit is there twice", [&](Answered& wrong) {
      wrong.hits.insert(wrong.hits.begin() + static_cast<std::ptrdiff_t>(h), wrong.hits[h]);
      return true;
    });
    plant("two hits are swapped", [&](Answered& wrong) { return swap_hits(wrong, h); });
    plant("the count is wrong", [&](Answered& wrong) {
      wrong.found[wrong.hits[h].query] ^= 1;
      return true;
    });
    plant("an odd byte", [&](Answered& wrong) {
      wrong.found[wrong.hits[h].query] = 0xee;
      return true;
    });
    plant("another leaf", [&](Answered& wrong) {
      const QueryInstance& instance = crowd.scene[wrong.hits[h].instance];
      for (const QueryLeaf& leaf : instance.leaves)
        if (leaf.link != wrong.hits[h].link) wrong.hits[h].leaf = leaf.leaf;
      return wrong.hits[h].leaf != right.hits[h].leaf;
    });
    plant("another link", [&](Answered& wrong) {
      wrong.hits[h].link = static_cast<std::uint16_t>(crowd.rig.link_count());
      return true;
    });
    plant("another batch", [&](Answered& wrong) {
      wrong.hits[h].batch.value += 1;
      return true;
    });
    plant("not a number", [&](Answered& wrong) {
      wrong.hits[h].point[random.index(3)] = std::nanf("");
      return true;
    });
    plant("a query too many", [&](Answered& wrong) {
      wrong.hits.back().query = 30;
      return true;
    });
    plant("a link that is not met", [&](Answered& wrong) {
      const std::vector<JudgedLink> met = judge_query(crowd.scene, query, right.planes, right.exact);
      for (const QueryInstance& instance : crowd.scene)
        for (const QueryLeaf& leaf : instance.leaves)
          if (std::none_of(met.begin(), met.end(), [&](const JudgedLink& link) {
                return link.instance == &instance && link.link == leaf.link;
              })) {
            wrong.hits[h].instance = instance.instance;
            wrong.hits[h].link = leaf.link;
            wrong.hits[h].leaf = leaf.leaf;
            return true;
          }
      return false;
    });
    plant("more hits than wanted", [&](Answered& wrong) {
      std::size_t count = 0;
      for (const QueryHit& hit : wrong.hits) count += hit.query == wrong.hits[h].query;
      Query& changed = wrong.queries[wrong.hits[h].query];
      changed.want = QueryWant::kAll;
      changed.max_hits = static_cast<std::uint32_t>(count - 1);
      return count > 1;
    });
    plant("a hit of a query that wants none", [&](Answered& wrong) {
      wrong.queries[wrong.hits[h].query].want = QueryWant::kAny;
      return true;
    });
    plant("the second nearest", [&](Answered& wrong) {
      if (h + 1 >= wrong.hits.size() || wrong.hits[h + 1].query != wrong.hits[h].query) return false;
      if (has_distance && !(wrong.hits[h + 1].distance > 1.01f * wrong.hits[h].distance)) return false;
      if (has_distance && query.kind != QueryKind::kRay && query.kind != QueryKind::kPoint) return false;
      Query& changed = wrong.queries[wrong.hits[h].query];
      changed.want = QueryWant::kAll;
      changed.max_hits = 0;
      for (const QueryHit& hit : wrong.hits) changed.max_hits += hit.query == wrong.hits[h].query;
      --changed.max_hits;
      wrong.hits.erase(wrong.hits.begin() + static_cast<std::ptrdiff_t>(h));
      return true;
    });
    if (!has_distance) {
      plant("a distance where there is none", [&](Answered& wrong) {
        wrong.hits[h].distance = -1e-3f;
        return true;
      });
      plant("a normal where there is none", [&](Answered& wrong) {
        wrong.hits[h].normal[0] = 1;
        return true;
      });
      continue;
    }
    // Faults of numbers show where numbers are not lost in what the leaf may grow by.
    Real size = 0, away = 0;
    for (const QueryInstance& instance : crowd.scene)
      if (instance.instance == right.hits[h].instance) {
        const QueryLeaf* leaf = nullptr;
        for (const QueryLeaf& one : instance.leaves)
          if (one.leaf == right.hits[h].leaf) leaf = &one;
        size = leaf->lengths + query.radius + Real{query.half[0]} + query.half[1] + query.half[2];
        away = norm_1(place_of(query, instance));
      }
    if (right.hits[h].inside) {
      plant("a normal inside", [&](Answered& wrong) {
        wrong.hits[h].normal[2] = 1;
        return true;
      });
      plant("not inside", [&](Answered& wrong) {
        wrong.hits[h].inside = false;
        return true;
      });
      plant("a distance inside", [&](Answered& wrong) {
        wrong.hits[h].distance = static_cast<float>(size);
        return true;
      });
      continue;
    }
    plant("inside", [&](Answered& wrong) {
      wrong.hits[h].inside = true;
      return true;
    });
    plant("a short normal", [&](Answered& wrong) {
      for (float& c : wrong.hits[h].normal) c *= 0.999f;
      return true;
    });
    plant("no normal", [&](Answered& wrong) {
      std::fill_n(wrong.hits[h].normal, 3, 0.0f);
      return true;
    });
    plant("a normal turned round", [&](Answered& wrong) {
      for (float& c : wrong.hits[h].normal) c = -c;
      if (query.kind == QueryKind::kRay) return away < 100 * size && (query.radius == 0 || query.radius > size / 100);
      return query.kind == QueryKind::kPoint && right.hits[h].distance > size / 100;
    });
    plant("a point elsewhere", [&](Answered& wrong) {
      wrong.hits[h].point[random.index(3)] += static_cast<float>((size + away) / 10);
      return true;
    });
    plant("too far", [&](Answered& wrong) {
      wrong.hits[h].distance += static_cast<float>((size + away) / 100);
      return true;
    });
    plant("a little too far", [&](Answered& wrong) {
      wrong.hits[h].distance *= 1.001f;
      return right.hits[h].distance > size / 10;
    });
    plant("a little too near", [&](Answered& wrong) {
      wrong.hits[h].distance *= 0.999f;
      return right.hits[h].distance > size / 10;
    });
    plant("a little too deep", [&](Answered& wrong) {
      wrong.hits[h].distance *= 1.01f;
      return right.hits[h].distance < -size / 10;
    });
    plant("a little too shallow", [&](Answered& wrong) {
      wrong.hits[h].distance *= 0.99f;
      return right.hits[h].distance < -size / 10;
    });
  }
  MESSAGE("hits: ", hits, ", faults planted: ", planted);
  CHECK(hits >= least_count(400, 60));
  CHECK(planted >= least_count(800, 60));
}
