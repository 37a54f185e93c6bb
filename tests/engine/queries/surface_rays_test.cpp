// Rays and moved spheres with Exact::kSurface, judged in long double by every triangle of a crowd.
#include "perf/harness/world.h"
#include "perf/judge/oracle/random_skins.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/rounds.h"

#include <cab/query.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// How far a hit may be from its triangle, of the lengths to it: distances and points are rounded to floats. Most
// measured: 0.49 of it.
constexpr Real kOff = 0x1p-23L;

// How near to a triangle a ray may be that meets it though it passes by, of the lengths to it and of the numbers that
// place the triangle. Most measured: 0.56 x 2^-41.
constexpr Real kMargin = 0x1p-41L;

// How far the weights of a hit are from 0, 1 and a sum of 1. Most measured: 0.38 of it.
constexpr Real kWeightOff = 0x1p-23L;

// Instances of a random skin near each other, far from the world's origin or not.
struct Crowd {
  static constexpr std::uint32_t kCount = 5;
  SkinRig rig;
  Poses poses;
  EnginePtr engine;
  BatchId batch;

  Crowd(Random& random, SkinRegime regime, const EngineDesc& desc = {})
      : rig(random_skin(random, regime, 0.1)),
        poses(random_skin_poses(random, rig, kCount,
                                random.chance(0.5) ? PoseFormat::kMatrix3x4Rows : PoseFormat::kQuaternionTranslation, 1,
                                0.1, 0.5)),
        engine(make_engine(desc)) {
    const double away = random.chance(0.5) ? 0 : random.log_uniform(1, 1e6);
    for (std::uint32_t i = 0; i < 3 * kCount && away > 0; ++i)
      poses.origins.push_back(rig.size * (away + random.uniform(-1, 1)));
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    batch = add_instances(*engine, articulation, kCount);
    ReserveDesc room;
    room.queries = 64;
    require(reserve(*engine, room));
  }

  Point origin(std::uint32_t i) const {
    Point out{};
    for (std::size_t c = 0; c < 3 && !poses.origins.empty(); ++c) out[c] = poses.origins[3 * i + c];
    return out;
  }
};

// A triangle of a crowd, in the world.
struct Placed {
  std::uint32_t instance, leaf, triangle;
  Point origin;  // of the instance
  Triangle<Real> at;
};

struct Scene {
  std::vector<Placed> triangles;
  Real size = 0;  // the largest coordinate relative to an instance's origin

  explicit Scene(const Crowd& crowd) {
    const ArticulationDesc desc = crowd.rig.desc();
    for (std::uint32_t i = 0; i < Crowd::kCount; ++i) {
      const std::vector<ExactPose> exact = exact_poses(crowd.poses, i);
      const Real scale = crowd.poses.scales.empty() ? 1 : Real{crowd.poses.scales[i]};
      size = std::max(size, scale * Real{crowd.rig.size} * crowd.rig.link_count());  // of vertices before they move
      for (std::uint32_t leaf = 0; leaf < crowd.rig.leaves.size(); ++leaf)
        for (std::uint32_t t = 0; t < crowd.rig.triangles[leaf].size() / 3; ++t) {
          Placed one = {i, leaf, t, crowd.origin(i), {}};
          for (std::size_t k = 0; k < 3; ++k) {
            const Point v = skinned_vertex(desc.skin, exact, crowd.rig.triangles[leaf][3 * t + k]);
            for (std::size_t c = 0; c < 3; ++c) size = std::max(size, std::fabs(v[c]));
            one.at.corner[k] = v + one.origin;
          }
          triangles.push_back(one);
        }
    }
  }
};

struct Shot {
  Query query;
  Point from, along;

  explicit Shot(const Query& of) : query(of) {
    for (std::size_t c = 0; c < 3; ++c) {
      from[c] = query.position[c];
      along[c] = query.direction[c];
    }
    along = (1 / length(along)) * along;
  }
  Point at(Real t) const { return from + t * along; }
};

// Where a ray meets a triangle, or -1.
Real first_touch(const Shot& shot, const Triangle<Real>& triangle) {
  const Point edge[2] = {triangle.corner[1] - triangle.corner[0], triangle.corner[2] - triangle.corner[0]};
  const Point to = shot.from - triangle.corner[0], h = cross(shot.along, edge[1]), r = cross(to, edge[0]);
  const Real det = dot(edge[0], h);
  if (det == 0) return -1;
  const Real u = dot(to, h) / det, v = dot(shot.along, r) / det, t = dot(edge[1], r) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= Real{shot.query.length} ? t : -1;
}

// A point of a triangle: a corner, a point of an edge, or one inside.
Point point_of(Random& random, const Triangle<Real>& triangle) {
  const auto& c = triangle.corner;
  const unsigned kind = random.index(3), first = random.index(3);
  if (kind == 0) return c[first];
  const Real by = random.uniform(0, 1);
  const Point on_edge = c[first] + by * (c[(first + 1) % 3] - c[first]);
  if (kind == 1) return on_edge;
  return on_edge + Real{random.uniform(0, 1)} * (c[(first + 2) % 3] - on_edge);
}

enum class Aim { kAt, kInPlane, kBeside, kFromSurface, kAnywhere };
constexpr unsigned kAimCount = 5;

// A ray at a point of a random triangle. is_aimed: becomes whether it meets that, and the triangle.
Shot random_shot(Random& random, const Scene& scene, Aim aim, const Placed** aimed) {
  const Placed& one = scene.triangles[random.index(static_cast<unsigned>(scene.triangles.size()))];
  Point at = point_of(random, one.at);
  Vec3<double> direction = random.unit_vector();
  if (aim == Aim::kInPlane) {
    const Point in_plane =
        Real{random.uniform(-1, 1)} * (one.at.corner[1] - one.at.corner[0]) + one.at.corner[2] - one.at.corner[0];
    const Real size = length(in_plane);
    for (std::size_t c = 0; c < 3 && size > 0; ++c) direction[c] = static_cast<double>(in_plane[c] / size);
  }
  if (random.chance(0.1)) direction = {{random.sign(), 0, 0}};
  Query query;
  for (std::size_t c = 0; c < 3; ++c)
    query.direction[c] = static_cast<float>(random.chance(0.2) ? direction[c] : 3 * direction[c]);
  Point along{{query.direction[0], query.direction[1], query.direction[2]}};
  along = (1 / length(along)) * along;
  if (aim == Aim::kBeside)
    at = at + scene.size * Real{random.log_uniform(1e-16, 1e-2)} *
                  Point{{random.normal(), random.normal(), random.normal()}};
  if (aim == Aim::kAnywhere)
    at = at + scene.size * Point{{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}};
  const Real back = aim == Aim::kFromSurface ? 0 : scene.size * Real{random.log_uniform(0.01, 1000)};
  const Point from = at - back * along;
  for (std::size_t c = 0; c < 3; ++c) query.position[c] = static_cast<double>(from[c]);
  query.length = random.chance(0.3) ? kInfinity
                 : random.chance(0.1)
                     ? 0
                     : static_cast<float>((back + scene.size * Real{random.uniform(0.01, 2)}) * (1 + 0x1p-22L));
  if (aim != Aim::kFromSurface && query.length == 0) query.length = static_cast<float>(scene.size);
  query.want = QueryWant::kAll;
  // Far from the world's origin the rounding of its position may move a ray off.
  const bool is_aimed = aim == Aim::kAt || aim == Aim::kInPlane || aim == Aim::kFromSurface;
  *aimed =
      is_aimed && Real{query.length} >= back && length(from) <= 4 * back + 8 * length(at - one.origin) ? &one : nullptr;
  return Shot(query);
}

struct Answer {
  std::vector<QueryHit> hits;
  std::vector<SurfacePoint> points;
  std::vector<std::uint32_t> counts;
  std::vector<std::uint8_t> found;
  QueryStats stats;
};

Answer ask(const Crowd& crowd, const std::vector<Query>& queries, bool reuse = false) {
  Answer out;
  out.hits.resize(4096);
  out.points.resize(out.hits.size());
  out.counts.resize(queries.size());
  out.found.resize(queries.size());
  const BatchInput input = crowd.poses.input(crowd.batch);
  QueryJob job;
  job.inputs = {&input, 1};
  job.queries = queries;
  job.exact = Exact::kSurface;
  job.reuse_bounds = reuse;
  job.hits = out.hits;
  job.surface_points = out.points;
  job.counts = out.counts;
  job.found = out.found;
  require(run_queries(*crowd.engine, job));
  out.hits.resize(job.hit_count);
  out.points.resize(job.hit_count);
  out.stats = job.stats;
  return out;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

using Name = std::pair<std::uint32_t, std::uint32_t>;  // instance and link

// The triangles of each link.
std::map<Name, std::vector<const Placed*>> triangles_by_link(const Crowd& crowd, const Scene& scene) {
  std::map<Name, std::vector<const Placed*>> out;
  for (const Placed& one : scene.triangles)
    out[{one.instance, static_cast<std::uint32_t>(crowd.rig.leaves[one.leaf].link)}].push_back(&one);
  return out;
}

struct Counts {
  std::size_t met = 0, missed = 0, undecided = 0;
};

// Checks the hits of a ray of kAll against the truth.
void check_hits(const Crowd& crowd, const Scene& scene, const Shot& shot, const Placed* aimed, const QueryHit* begin,
                const QueryHit* end, const SurfacePoint* points, Counts& counts) {
  const Real radius = shot.query.radius;
  Real farthest = 0;
  for (const Placed& one : scene.triangles)
    for (const Point& corner : one.at.corner) farthest = std::max(farthest, length(corner - shot.from));
  const Point far = shot.at(std::min(farthest + radius, Real{shot.query.length}));
  for (const auto& [name, triangles] : triangles_by_link(crowd, scene)) {
    const QueryHit* const hit = std::find_if(begin, end, [&name = name](const QueryHit& one) {
      return one.instance == name.first && one.link == name.second;
    });
    Real first = HUGE_VALL, least = HUGE_VALL;
    for (const Placed* one : triangles) {
      const Real touch = first_touch(shot, one->at);
      if (touch >= 0) first = std::min(first, touch);
      const Real apart = distance(one->at, {{shot.from, far, far}});
      least = std::min(least, apart);
      if (one == aimed) CHECK(hit != end);
    }
    const Real lengths = length(shot.from - crowd.origin(name.first)) + scene.size + radius, near = kMargin * lengths;
    const bool touches = radius > 0 ? least <= radius : first < HUGE_VALL;
    if (touches) CHECK(hit != end);
    if (least > radius + near) CHECK(hit == end);
    ++(touches ? counts.met : least > radius + near ? counts.missed : counts.undecided);
    if (hit == end) continue;
    const Real t = hit->distance, off = kOff * (t + scene.size + radius);
    CHECK(t <= first + off);
    // The sphere's centre is as far from the link's triangles as its radius, and from the named triangle.
    Real nearest = HUGE_VALL;
    const Point center = shot.at(t);
    for (const Placed* one : triangles) nearest = std::min(nearest, distance(one->at, {{center, center, center}}));
    CHECK(nearest <= radius + off + near);
    if (t > 0) CHECK(nearest >= radius - off - near);
    const SurfacePoint& point = points[hit - begin];
    const auto named = std::find_if(triangles.begin(), triangles.end(), [&](const Placed* one) {
      return one->leaf == hit->leaf && one->triangle == point.triangle;
    });
    REQUIRE(named != triangles.end());
    Real sum = 0;
    Point at = (*named)->at.corner[0];
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(point.weights[k] >= 0);
      CHECK(point.weights[k] <= 1);
      sum += point.weights[k];
      at = at + Real{point.weights[k]} * ((*named)->at.corner[k] - (*named)->at.corner[0]);
    }
    CHECK(std::fabs(sum - 1) <= kWeightOff);
    const Real size = length((*named)->at.corner[1] - (*named)->at.corner[0]) +
                      length((*named)->at.corner[2] - (*named)->at.corner[0]);
    CHECK(length(at - center) <= radius + off + near + kWeightOff * size);
    if (hit->inside) continue;
    const Point normal{{hit->normal[0], hit->normal[1], hit->normal[2]}},
        touch{{hit->point[0], hit->point[1], hit->point[2]}};
    CHECK(std::fabs(length(normal) - 1) <= kOff);
    CHECK(dot(normal, shot.along) <= kOff);
    CHECK(length(shot.from + touch - center) <= radius + off + near);
  }
}

}  // namespace

TEST_CASE("rays and moved spheres meet the triangles of skins where these are, and name the point") {
  Random random(180);
  Counts counts;
  const std::uint64_t count = rounds(40);
  for (std::uint64_t round = 0; round < count; ++round) {
    const Crowd crowd(random, static_cast<SkinRegime>(round % kSkinRegimeCount));
    const Scene scene(crowd);
    std::vector<Shot> shots;
    std::vector<const Placed*> aimed;
    std::vector<Query> queries;
    for (unsigned i = 0; i < 25; ++i) {
      const Placed* at = nullptr;
      Shot shot = random_shot(random, scene, static_cast<Aim>(i % kAimCount), &at);
      if (random.chance(0.2)) shot.query.radius = static_cast<float>(scene.size * Real{random.log_uniform(1e-6, 1)});
      shots.push_back(shot);
      aimed.push_back(at);
      queries.push_back(shot.query);
    }
    const Answer all = ask(crowd, queries);
    std::vector<const QueryHit*> first(queries.size() + 1);
    const QueryHit* hit = all.hits.data();
    const QueryHit* const end = hit + all.hits.size();
    for (std::uint32_t i = 0; i < queries.size(); ++i) {
      first[i] = hit;
      while (hit != end && hit->query == i) ++hit;
      CHECK(static_cast<std::size_t>(hit - first[i]) == all.counts[i]);
      check_hits(crowd, scene, shots[i], aimed[i], first[i], hit, all.points.data() + (first[i] - all.hits.data()),
                 counts);
    }
    CHECK(hit == end);
    first.back() = end;
    // The closest is the first of all, and there is any if there is one; whatever is asked at a time.
    std::vector<Query> closest = queries, any = queries;
    for (Query& query : closest) query.want = QueryWant::kClosest;
    for (Query& query : any) query.want = QueryWant::kAny;
    const Answer nearest = ask(crowd, closest), found = ask(crowd, any);
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < queries.size(); ++i) {
      const bool has_any = first[i] != first[i + 1];
      CHECK((found.found[i] != 0) == has_any);
      CHECK((nearest.found[i] != 0) == has_any);
      if (!has_any) continue;
      REQUIRE(at < nearest.hits.size());
      CHECK(std::memcmp(&nearest.hits[at], first[i], sizeof(QueryHit)) == 0);
      CHECK(std::memcmp(&nearest.points[at], &all.points[static_cast<std::size_t>(first[i] - all.hits.data())],
                        sizeof(SurfacePoint)) == 0);
      ++at;
      const Answer alone = ask(crowd, {closest[i]});
      REQUIRE(alone.hits.size() == 1);
      CHECK(alone.hits[0].distance == first[i]->distance);
      CHECK(alone.points[0].triangle == all.points[static_cast<std::size_t>(first[i] - all.hits.data())].triangle);
    }
    CHECK(at == nearest.hits.size());
  }
  CHECK(counts.met >= least_count(800, 40));
  CHECK(counts.missed >= least_count(1000, 40));
  MESSAGE("neither: " << counts.undecided);
}

TEST_CASE("rays at skins have the same hits on every instruction set and for every number of threads") {
  Random random(181);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(10);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % kSkinRegimeCount);
    const Random again = random;
    const Crowd crowd(random, regime);
    const Scene scene(crowd);
    std::vector<Query> queries;
    for (unsigned i = 0; i < 100; ++i) {
      const Placed* at = nullptr;
      queries.push_back(random_shot(random, scene, static_cast<Aim>(i % kAimCount), &at).query);
      queries.back().want = i % 3 == 0 ? QueryWant::kAll : QueryWant::kClosest;
      if (random.chance(0.2))
        queries.back().radius = static_cast<float>(scene.size * Real{random.log_uniform(1e-6, 1)});
    }
    const Answer first = ask(crowd, queries);
    seen += first.hits.size();
    REQUIRE(first.points.size() >= first.hits.size());
    for (std::size_t i = 0; i < first.hits.size(); ++i) CHECK(first.points[i].triangle != 0xffffffffu);
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 3u}) {
        EngineDesc desc;
        desc.isa = isa;
        desc.thread_count = threads;
        Random same = again;
        const Answer other = ask(Crowd(same, regime, desc), queries);
        CHECK(same_bits(other.hits, first.hits));
        CHECK(same_bits(other.points, first.points));
      }
  }
  CHECK(seen >= least_count(500, 10));
}

TEST_CASE("what was skinned for rays serves later calls about the same frame, and no others") {
  Random random(182);
  std::size_t seen = 0;
  for (int round = 0; round < 10; ++round) {
    Random same = random;
    Crowd crowd(random, SkinRegime::kSmooth), other(same, SkinRegime::kSmooth);
    const auto frame = [&] {
      const BatchInput input = crowd.poses.input(crowd.batch);
      FrameJob job;
      job.inputs = {&input, 1};
      require(run_frame(*crowd.engine, job));
    };
    std::vector<Query> queries;
    for (unsigned i = 0; i < 50; ++i) {
      const Placed* at = nullptr;
      queries.push_back(random_shot(random, Scene(crowd), Aim::kAt, &at).query);
    }
    frame();
    const Answer first = ask(crowd, queries, true), second = ask(crowd, queries, true);
    CHECK(first.stats.leaves_skinned > 0);
    CHECK(second.stats.leaves_skinned < first.stats.leaves_skinned);
    CHECK(same_bits(first.hits, second.hits));
    CHECK(same_bits(first.points, second.points));
    for (std::uint32_t i = 1; i < Crowd::kCount; ++i)
      std::swap_ranges(crowd.poses.pose(0, 0), crowd.poses.pose(0, 0) + crowd.poses.floats_per_pose(),
                       crowd.poses.pose(i, 0));
    frame();
    other.poses = crowd.poses;
    const Answer moved = ask(crowd, queries, true), fresh = ask(crowd, queries), anew = ask(other, queries);
    CHECK(same_bits(moved.hits, anew.hits));
    CHECK(same_bits(fresh.hits, anew.hits));
    seen += anew.hits.size();
  }
  CHECK(seen >= 100);
}

TEST_CASE("with surfaces rays meet the shapes of static bodies, too, which name no triangle") {
  Random random(183);
  const Crowd crowd(random, SkinRegime::kSmooth);
  const Scene scene(crowd);
  ConvexPart ball;
  ball.kind = ShapeKind::kSphere;
  ball.size[0] = static_cast<float>(scene.size);
  StaticBody body;
  body.parts = {&ball, 1};
  std::fill_n(body.box.half, 3, ball.size[0]);
  const Point at = crowd.origin(0) + Point{{20 * scene.size, 0, 0}};
  for (std::size_t c = 0; c < 3; ++c) body.origin[c] = static_cast<double>(at[c]);
  StaticDesc level;
  level.bodies = {&body, 1};
  BatchId around;
  std::uint32_t bad = 0;
  REQUIRE(add_static_batch(*crowd.engine, level, &around, &bad) == Status::kOk);
  BatchInput inputs[2] = {crowd.poses.input(crowd.batch), {}};
  inputs[1].batch = around;
  Query query;
  std::copy_n(body.origin, 3, query.position);
  query.position[0] += static_cast<double>(scene.size) * 5;
  query.direction[0] = -1;
  query.length = kInfinity;
  std::vector<QueryHit> hits(8);
  std::vector<SurfacePoint> points(8, SurfacePoint{5, {1, 1, 1}});
  QueryJob job;
  job.inputs = inputs;
  job.queries = {&query, 1};
  job.exact = Exact::kSurface;
  job.hits = hits;
  job.surface_points = points;
  REQUIRE(run_queries(*crowd.engine, job) == Status::kOk);
  REQUIRE(job.hit_count == 1);
  CHECK(hits[0].batch.value == 2);
  CHECK(std::fabs(Real{hits[0].distance} - 4 * scene.size) <= 1e-5L * scene.size);
  CHECK(points[0].triangle == 0xffffffff);
  for (const float weight : points[0].weights) CHECK(weight == 0);
}

TEST_CASE("queries of skins that surfaces do not answer are refused") {
  Random random(184);
  const Crowd crowd(random, SkinRegime::kSmooth);
  const BatchInput input = crowd.poses.input(crowd.batch);
  Query queries[2];
  queries[0].direction[0] = 1;
  queries[1].kind = QueryKind::kRegion;
  std::vector<QueryHit> hits(Crowd::kCount * crowd.rig.leaves.size());
  std::vector<SurfacePoint> points(hits.size());
  QueryJob job;
  job.inputs = {&input, 1};
  job.queries = queries;
  job.exact = Exact::kSurface;
  job.hits = hits;
  job.surface_points = points;
  CHECK(run_queries(*crowd.engine, job) == Status::kOk);
  for (const QueryKind kind : {QueryKind::kSphere, QueryKind::kBox, QueryKind::kCapsule, QueryKind::kPoint}) {
    queries[1].kind = kind;
    CHECK(run_queries(*crowd.engine, job) == Status::kSkinNotTaken);
    CHECK(job.bad_query == 1);
  }
  queries[1].kind = QueryKind::kRegion;
  job.surface_points = {points.data(), points.size() - 1};
  CHECK(run_queries(*crowd.engine, job) == Status::kBadOutput);
  job.surface_points = {nullptr, points.size()};
  CHECK(run_queries(*crowd.engine, job) == Status::kBadOutput);
  job.surface_points = {};
  job.exact = Exact::kConvex;
  CHECK(run_queries(*crowd.engine, job) == Status::kSkinNotTaken);
  job.exact = Exact::kFcl;
  CHECK(run_queries(*crowd.engine, job) == Status::kExactNotBuilt);
}

}  // namespace cab::tests
