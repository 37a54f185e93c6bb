// The quick judge of queries: where doubles are certain, the judge in long double says the same, and
// planted faults are found.
#include "perf/judge/oracle/quick_queries.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/rounds.h"

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::least_count;
using cab::tests::rounds;

// How far bounds of the distance of a point may be off, as a share of its leaf's padding; at worst 0.027.
constexpr double kLooseShare = 0.1;

// How few of a thousand pairs doubles may be certain of; at worst 993, of points.
constexpr std::size_t kLeastCertain = 980;

// The same of boxes and capsules about to touch; at worst 880, of boxes.
constexpr std::size_t kLeastNear = 850;

bool has_distance(QueryKind kind) { return kind == QueryKind::kRay || kind == QueryKind::kPoint; }

// A scene of one or two articulations, near or far, large or small.
QueryScene any_scene(Random& random, Rig& rig, Poses& poses) {
  const bool far = random.chance(0.3);
  const Vec3<double> about = (far ? random.log_uniform(1e3, 1e9) : 0) * random.unit_vector();
  rig = random_rig(random, static_cast<Topology>(random.index(3)), 2 + random.index(5), 1 + random.index(3));
  if (random.chance(0.3)) flatten_leaves(random, rig);
  const PoseRange range = {2, random.chance(0.5), far || random.chance(0.5), about};
  poses = random_poses(random, rig, 4, static_cast<PoseFormat>(random.index(3)), range);
  if (random.chance(0.3)) mirror_links(random, poses);
  if (random.chance(0.3)) resize(random.log_uniform(1e-15, 1e12), rig, poses);
  QueryScene out;
  for (std::uint32_t i = 0; i < 4; ++i) out.push_back(query_instance({1}, rig, poses, i, 1u << (i % 2)));
  return out;
}

// A box with half extents 1 2 3 along the world's axes.
QueryScene leaf_at(double x) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 2, 3}}, {}}};
  Poses poses;
  poses.link_count = poses.instance_count = 1;
  poses.data = {0, 0, 0, 1, 0, 0, 0};
  poses.origins = {x, 0, 0};
  return {query_instance({1}, rig, poses, 0)};
}

RandomQueries any_queries(Random& random, const QueryScene& scene, QueryKind kind, std::uint32_t count) {
  RandomQueries out;
  for (std::uint32_t i = 0; i < count; ++i) {
    add_query(random, scene, static_cast<QueryRegime>(i % kQueryRegimeCount), kind, out);
    Query& query = out.queries.back();
    if (kind == QueryKind::kRay) query.radius = 0;
    query.with_depth = false;
  }
  return out;
}

// What of a scene is of the link of a hit.
QueryScene link_alone(const QueryScene& scene, const QueryHit& hit) {
  QueryScene out = {scene[hit.instance]};
  std::vector<QueryLeaf> of_link;
  for (const QueryLeaf& leaf : scene[hit.instance].leaves)
    if (leaf.link == hit.link) of_link.push_back(leaf);
  out[0].leaves = of_link;
  return out;
}

// What a right engine might answer: all links that must be found, at the distances of their leaves as given.
std::vector<QueryHit> right_hits(const QueryScene& scene, const Query& query, Span<const QueryPlane> planes) {
  std::vector<QueryHit> out;
  for (const JudgedLink& link : judge_query(scene, query, planes, Exact::kNone)) {
    if (!link.must) continue;
    const auto leaf = std::find_if(link.leaves.begin(), link.leaves.end(),
                                   [&](const JudgedLeaf& one) { return one.must && one.most == link.most; });
    QueryHit hit = {};
    hit.batch = link.instance->batch;
    hit.instance = link.instance->instance;
    hit.link = link.link;
    hit.leaf = leaf->leaf->leaf;
    hit.distance = static_cast<float>(link.most);
    out.push_back(hit);
  }
  std::sort(out.begin(), out.end(), [](const QueryHit& a, const QueryHit& b) {
    return std::make_tuple(a.distance, a.instance, a.link) < std::make_tuple(b.distance, b.instance, b.link);
  });
  return out;
}

struct Job {
  std::vector<Query> queries;
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  Span<const QueryPlane> planes;

  Job(const Query& query, std::vector<QueryHit> of, Span<const QueryPlane> of_job = {})
      : queries{query}, hits(std::move(of)), found{!hits.empty()}, planes(of_job) {}
  QuickCounts counts(const QuickQueries& judge) {
    QueryJob job;
    job.queries = {queries.data(), 1};
    job.planes = planes;
    job.found = {found.data(), 1};
    return judge.count(job, 0, hits);
  }
};

}  // namespace

TEST_CASE("quick queries: what doubles are certain of, long double says too") {
  Random random(91);
  std::size_t pairs[kQueryKindCount] = {}, certain[kQueryKindCount] = {}, must[kQueryKindCount] = {};
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    Rig rig;
    Poses poses;
    const QueryScene scene = any_scene(random, rig, poses);
    const QuickQueries judge(scene);
    std::vector<double> lengths;
    for (const QueryInstance& instance : scene)
      for (const QueryLeaf& leaf : instance.leaves) lengths.push_back(static_cast<double>(leaf.lengths));
    for (std::size_t kind = 0; kind < kQueryKindCount; ++kind) {
      const RandomQueries about = any_queries(random, scene, static_cast<QueryKind>(kind), 20);
      for (Query query : about.queries) {
        query.layer_mask = ~0u;  // a touch is not asked who is looked at
        query.ignored_batch = {};
        const QuickAsked asked(query, about.planes);
        for (std::size_t leaf = 0; leaf < judge.leaf_count(); ++leaf) {
          ++pairs[kind];
          const QuickTouch quick = judge.touch(asked, leaf);
          if (!quick.certain) continue;
          ++certain[kind];
          const QuickTouch exact = judge.exact_touch(asked, leaf);
          CAPTURE(round);
          CAPTURE(kind);
          CHECK(quick.may == exact.may);
          CHECK(quick.must == exact.must);
          if (!quick.must) continue;
          ++must[kind];
          CHECK(quick.least <= exact.least);
          CHECK(quick.most >= exact.most);
          if (exact.may_inside) CHECK(quick.may_inside);
          if (quick.at_zero) CHECK(exact.at_zero);
          if (query.kind == QueryKind::kRay) continue;
          const double loose = kLooseShare * 0x1p-17 * lengths[leaf] + 0x1p-44 * exact.most;
          CHECK(quick.least >= exact.least - loose);
          CHECK(quick.most <= exact.most + loose);
        }
      }
    }
  }
  for (std::size_t kind = 0; kind < kQueryKindCount; ++kind) {
    MESSAGE("pairs: ", pairs[kind], ", certain: ", certain[kind], ", met: ", must[kind]);
    CHECK(certain[kind] >= pairs[kind] * kLeastCertain / 1000);
    CHECK(must[kind] >= least_count(3000, 300));
  }
}

TEST_CASE("quick queries: bounds of a distance are tight where a query is near") {
  const QueryScene scene = leaf_at(10);
  const QuickQueries judge(scene);
  Query ray;
  ray.direction[0] = 1;
  ray.length = 100;
  const QuickTouch touch = judge.touch(QuickAsked(ray), 0);
  CHECK(touch.certain);
  CHECK(touch.must);
  CHECK(!touch.may_inside);
  CHECK(touch.most == doctest::Approx(9).epsilon(1e-12));
  CHECK(touch.least == doctest::Approx(9).epsilon(1e-4));
  CHECK(touch.least < 9);
  ray.length = 8.9f;
  CHECK(judge.touch(QuickAsked(ray), 0).certain);
  CHECK(!judge.touch(QuickAsked(ray), 0).may);
  ray.length = 9;  // doubles cannot tell
  CHECK(!judge.touch(QuickAsked(ray), 0).certain);
  CHECK(judge.exact_touch(QuickAsked(ray), 0).must);
  ray.position[0] = 10.5;
  CHECK(judge.touch(QuickAsked(ray), 0).may_inside);
  CHECK(judge.touch(QuickAsked(ray), 0).least == 0);

  Query point, sphere;
  point.kind = QueryKind::kPoint;
  sphere.kind = QueryKind::kSphere;
  point.position[0] = sphere.position[0] = 10 + 1 + 3;
  point.position[1] = sphere.position[1] = 2 + 4;  // 5 from an edge
  const auto judged = [&](Query& ball, float reach) {
    ball.length = ball.radius = reach;
    return judge.touch(QuickAsked(ball), 0);
  };
  const QuickTouch near = judged(point, 100);
  CHECK(near.certain);
  CHECK(near.must);
  CHECK(!near.may_inside);
  CHECK(near.most == doctest::Approx(5).epsilon(1e-12));
  CHECK(near.least == doctest::Approx(5).epsilon(1e-4));
  CHECK(near.least < 5);
  for (Query* ball : {&point, &sphere}) {
    CHECK(judged(*ball, 4.99f).certain);
    CHECK(!judged(*ball, 4.99f).may);
    CHECK(judged(*ball, 5.01f).must);
    CHECK(judged(*ball, 5.01f).at_zero == (ball == &sphere));
    CHECK(!judged(*ball, 5).certain);  // doubles cannot tell
    CHECK(judge.exact_touch(QuickAsked(*ball), 0).must);
    ball->position[0] = 10;
    ball->position[1] = 0;
    CHECK(judged(*ball, 0).must);
    CHECK(judged(*ball, 0).at_zero);
    CHECK(judged(*ball, 0).most == 0);
  }

  // What is met only once it has grown is no farther than the query goes.
  point.position[0] = 14;
  point.position[1] = 6 + 1e-6;
  point.length = 5;
  point.want = QueryWant::kAll;
  QueryHit hit = {};
  hit.batch = {1};
  hit.distance = 5;
  CHECK(Job(point, {hit}).counts(judge).fault == "");
  hit.distance = 5.00001f;
  CHECK(Job(point, {hit}).counts(judge).fault.find("distance") != std::string::npos);
}

TEST_CASE("quick queries: capsules, boxes and regions are decided as soon as they are apart, or meet") {
  const QueryScene scene = leaf_at(10);
  const QuickQueries judge(scene);
  const auto is_apart = [](const QuickTouch& touch) { return touch.certain && !touch.may; };
  const auto is_met = [](const QuickTouch& touch) { return touch.certain && touch.must && touch.at_zero; };
  const double cosine = std::sqrt(0.5);

  // Along 0.8 -0.6, and 3 away from the edge at 11 2, to which a point beside its middle is nearest.
  Query capsule;
  capsule.kind = QueryKind::kCapsule;
  capsule.half[2] = 5;
  const auto set = [](std::initializer_list<double> from, auto& to) {
    std::transform(from.begin(), from.end(), to, [](double v) { return static_cast<std::decay_t<decltype(*to)>>(v); });
  };
  const auto touch_beside = [&](double along, double radius) {
    set({11 + 3 * 0.6 + along * 0.8, 2 + 3 * 0.8 - along * 0.6, 1}, capsule.position);
    capsule.radius = static_cast<float>(radius);
    return judge.touch(QuickAsked(capsule), 0);
  };
  set({0.6 * cosine, 0.8 * cosine, 0, cosine}, capsule.orientation);
  CHECK(is_apart(touch_beside(2, 3 - 2e-4)));
  CHECK(is_met(touch_beside(2, 3 + 1e-6)));
  CHECK(is_apart(touch_beside(8, std::sqrt(18) - 2e-4)));  // an end is nearest
  CHECK(is_met(touch_beside(8, std::sqrt(18) + 2e-6)));
  capsule.radius = 0;  // a segment through a corner
  set({11 - 0.06, 2 - 0.08, 3 - 1e-6}, capsule.position);
  CHECK(is_met(judge.touch(QuickAsked(capsule), 0)));

  // An edge of the box towards the face at 11.
  Query box;
  box.kind = QueryKind::kBox;
  set({1, 1, 1}, box.half);
  const double eighth = std::acos(-1.0) / 8;
  const auto touch_at = [&](double x, double y) {
    set({x, y, 0}, box.position);
    return judge.touch(QuickAsked(box), 0);
  };
  set({0, 0, std::sin(eighth), std::cos(eighth)}, box.orientation);
  CHECK(is_apart(touch_at(11 + std::sqrt(2.0) + 2e-4, 0)));
  CHECK(is_met(touch_at(11 + std::sqrt(2.0) - 1e-6, 0)));
  const QuickTouch grown = touch_at(11 + std::sqrt(2.0) + 1e-6, 0);
  CHECK(grown.certain);
  CHECK(grown.may);
  CHECK(!grown.must);
  // Its edge along x - y crosses the edge at 11 2.
  set({cosine / 2, cosine / 2 - 0.5, -cosine / 2, cosine / 2 + 0.5}, box.orientation);
  const auto touch_across = [&](double gap) { return touch_at(12 + gap * cosine, 3 + gap * cosine); };
  CHECK(is_apart(touch_across(2e-4)));
  CHECK(is_met(touch_across(-1e-6)));

  Query region;
  region.kind = QueryKind::kRegion;
  std::vector<QueryPlane> planes;
  const auto touch_region = [&] {
    region.plane_count = static_cast<std::uint32_t>(planes.size());
    return judge.touch(QuickAsked(region, planes), 0);
  };
  CHECK(is_met(touch_region()));
  planes = {{{2, 0, 0}, 2 * 9.0001f}};
  CHECK(is_met(touch_region()));
  planes[0].offset = 2 * 8.9999f;
  CHECK(is_apart(touch_region()));
  planes[0].offset = 2 * 9;  // doubles cannot tell
  CHECK(!touch_region().certain);
  CHECK(judge.exact_touch(QuickAsked(region, planes), 0).must);
  planes = {{{1, 0, 0}, 20}, {{0, -1, 0}, -1.9999f}};
  CHECK(is_met(touch_region()));
  planes[1].offset = -2.0001f;
  CHECK(is_apart(touch_region()));
}

TEST_CASE("quick queries: what meets a leaf from too far away to be sure is left to long double") {
  const QueryScene scene = leaf_at(10);
  const QuickQueries judge(scene);
  for (const QueryKind kind : {QueryKind::kCapsule, QueryKind::kBox}) {
    Query query;
    query.kind = kind;
    query.position[0] = 10;
    query.position[2] = 1e12;
    query.half[1] = 1;
    query.half[2] = 2e12f;
    CHECK(!judge.touch(QuickAsked(query), 0).certain);
    CHECK(!judge.exact_touch(QuickAsked(query), 0).must);
    query.radius = query.half[0] = 1;
    CHECK(judge.touch(QuickAsked(query), 0).must);
    CHECK(judge.exact_touch(QuickAsked(query), 0).must);
  }
}

TEST_CASE("quick queries: a right answer has no fault, and every planted fault is found") {
  // But for queries from so far that doubles cannot tell, and rays along a face, which enter the padding early.
  std::size_t hits[kQueryKindCount] = {}, farther[kQueryKindCount] = {}, noticed[kQueryKindCount] = {};
  std::size_t early_noticed[kQueryKindCount] = {}, lower[kQueryKindCount] = {};
  Random random(92);
  for (std::uint64_t round = rounds(60); round > 0; --round) {
    Rig rig;
    Poses poses;
    const QueryScene scene = any_scene(random, rig, poses);
    const QuickQueries judge(scene);
    for (std::size_t kind = 0; kind < kQueryKindCount; ++kind) {
      const RandomQueries about = any_queries(random, scene, static_cast<QueryKind>(kind), 20);
      const Span<const QueryPlane> planes = about.planes;
      for (Query query : about.queries) {
        query.want = QueryWant::kAll;
        query.max_hits = ~0u;
        query.ignored_batch = {};
        const std::vector<QueryHit> right = right_hits(scene, query, planes);
        CAPTURE(round);
        CAPTURE(kind);
        const QuickCounts counts = Job(query, right, planes).counts(judge);
        CHECK(counts.fault == "");
        CHECK(counts.must == right.size());
        if (right.empty()) continue;
        ++hits[kind];
        const std::size_t at = random.index(static_cast<std::uint32_t>(right.size()));
        Job lost(query, right, planes), extra = lost, twice = lost, turned = lost, closest = lost;
        lost.hits.erase(lost.hits.begin() + static_cast<std::ptrdiff_t>(at));
        CHECK(lost.counts(judge).lost == 1);
        extra.hits[at].instance = 17;
        CHECK(extra.counts(judge).extra == 1);
        CHECK(extra.counts(judge).lost == 1);
        twice.hits.push_back(twice.hits.back());
        CHECK(twice.counts(judge).fault != "");
        twice.hits.back().distance += 1e-37f;
        CHECK(twice.counts(judge).extra == 1);

        const QueryScene alone = link_alone(scene, right[at]);
        const QuickQueries judge_alone(alone);
        Job late(query, {right[at]}, planes), early = late;
        CHECK(late.counts(judge_alone).fault == "");
        const auto by = 0.01f * static_cast<float>(alone[0].leaves[0].lengths);
        late.hits[0].distance += 0.01f * late.hits[0].distance + by;
        early.hits[0].distance -= 0.01f * early.hits[0].distance + by;
        CHECK(late.counts(judge_alone).fault.find("distance") != std::string::npos);
        early_noticed[kind] += early.counts(judge_alone).fault.find("distance") != std::string::npos;
        if (!has_distance(query.kind)) {
          Job leaf(query, {right[at]}, planes);
          const auto judged = judge_query(alone, query, planes, Exact::kNone);
          for (const JudgedLeaf& one : judged[0].leaves)
            if (one.must) leaf.hits[0].leaf = one.leaf->leaf;
          if (leaf.hits[0].leaf > right[at].leaf) {
            CHECK(leaf.counts(judge_alone).fault.find("lower leaf") != std::string::npos);
            ++lower[kind];
          }
        }

        closest.queries[0].want = QueryWant::kAny;
        closest.hits.clear();
        CHECK(closest.counts(judge).fault == "");
        closest.found[0] = 0;
        CHECK(closest.counts(judge).lost == 1);
        if (right.size() < 2) continue;
        std::swap(turned.hits[0], turned.hits[1]);
        CHECK(turned.counts(judge).fault.find("behind") != std::string::npos);
        closest.found[0] = 1;
        closest.queries[0].want = QueryWant::kClosest;
        closest.hits = {right[0]};
        CHECK(closest.counts(judge).fault == "");
        // Without a distance all are as near, and the order is that of keys.
        if (has_distance(query.kind) && right[0].distance * 1.001f >= right.back().distance) continue;
        closest.hits = {right.back()};
        ++farther[kind];
        noticed[kind] += closest.counts(judge).lost > 0;
      }
    }
  }
  for (std::size_t kind = 0; kind < kQueryKindCount; ++kind) {
    const bool by_distance = has_distance(static_cast<QueryKind>(kind));
    MESSAGE("met: ", hits[kind], ", too early: ", early_noticed[kind], ", farther: ", farther[kind],
            ", noticed: ", noticed[kind], ", lower leaves: ", lower[kind]);
    CHECK(hits[kind] >= least_count(300, 60));
    CHECK(early_noticed[kind] >= hits[kind] * (static_cast<QueryKind>(kind) == QueryKind::kRay ? 9 : 10) / 10);
    CHECK(farther[kind] >= least_count(30, 60));
    CHECK(noticed[kind] >= farther[kind] * (by_distance ? 9 : 10) / 10);
    if (!by_distance) CHECK(lower[kind] >= least_count(10, 60));
  }
}

TEST_CASE(
    "quick queries: edges and segments that are almost parallel to those of a leaf are decided as in long double") {
  const QueryScene scene = leaf_at(0);
  const QuickQueries judge(scene);
  Random random(93);
  std::size_t pairs[2] = {}, certain[2] = {}, met[2] = {}, grown[2] = {};
  for (std::uint64_t round = rounds(20000); round > 0; --round) {
    const bool is_box = random.chance(0.5);
    Query query;
    query.kind = is_box ? QueryKind::kBox : QueryKind::kCapsule;
    query.radius = random.chance(0.5) ? 0 : static_cast<float>(random.log_uniform(1e-6, 1));
    const double size = random.chance(0.5) ? 10 : 1e6;
    for (float& half : query.half)
      half = random.chance(0.2) ? 0 : static_cast<float>(random.log_uniform(1 / size, size));
    const double turn = random.log_uniform(1e-12, 1e-2);
    for (std::size_t c = 0; c < 3; ++c)
      if (random.chance(0.7)) query.orientation[c] = static_cast<float>(turn * random.uniform(-1, 1));
    // Beside a face, an edge or a corner, about as far as the query reaches there.
    const double own[3] = {is_box ? double{query.half[0]} : double{query.radius},
                           is_box ? double{query.half[1]} : double{query.radius},
                           is_box ? double{query.half[2]} : double{query.radius} + double{query.half[2]}};
    const std::uint32_t first = random.index(3), sides = 1 + random.index(3);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const double side = random.sign(), most = 1.0 + k + own[k];
      // Where what is turned matters, or not.
      const double share =
          random.chance(0.5) ? turn * random.log_uniform(0.01, 10) : random.log_uniform(0x1p-40, 0x1p-10);
      const double off = random.sign() * share * most;
      query.position[k] = (k + 3 - first) % 3 < sides ? side * most + off : side * random.uniform(0, most);
    }
    const QuickAsked asked(query);
    const QuickTouch quick = judge.touch(asked, 0), exact = judge.exact_touch(asked, 0);
    ++pairs[is_box];
    if (!quick.certain) continue;
    ++certain[is_box];
    met[is_box] += quick.must;
    grown[is_box] += quick.may && !quick.must;
    CAPTURE(round);
    CHECK(quick.may == exact.may);
    CHECK(quick.must == exact.must);
  }
  for (const bool is_box : {false, true}) {
    MESSAGE("pairs: ", pairs[is_box], ", certain: ", certain[is_box], ", met: ", met[is_box],
            ", grown: ", grown[is_box]);
    CHECK(met[is_box] >= least_count(1000, 20000));
    CHECK(certain[is_box] >= pairs[is_box] * kLeastNear / 1000);
  }
  CHECK(grown[true] >= least_count(100, 20000));
}
