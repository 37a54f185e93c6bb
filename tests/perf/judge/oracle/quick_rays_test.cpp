// The quick judge of rays: where doubles are certain, the judge in long double says the same, and planted faults are
// found.
#include "perf/judge/oracle/quick_rays.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/rounds.h"

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::least_count;
using cab::tests::rounds;

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

std::vector<Query> any_rays(Random& random, const QueryScene& scene, std::uint32_t count) {
  RandomQueries out;
  for (std::uint32_t i = 0; i < count; ++i) {
    add_query(random, scene, static_cast<QueryRegime>(i % kQueryRegimeCount), QueryKind::kRay, out);
    out.queries.back().radius = 0;
  }
  return out.queries;
}

// What a right engine might answer: all links that must be found, at the distances of their leaves as given.
std::vector<QueryHit> right_hits(const QueryScene& scene, const Query& ray) {
  std::vector<QueryHit> out;
  for (const JudgedLink& link : judge_query(scene, ray, {}, Exact::kNone)) {
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

  Job(const Query& ray, std::vector<QueryHit> of) : queries{ray}, hits(std::move(of)), found{!hits.empty()} {}
  RayCounts counts(const QuickRays& judge) {
    QueryJob job;
    job.queries = {queries.data(), 1};
    job.found = {found.data(), 1};
    return judge.count(job, 0, hits);
  }
};

}  // namespace

TEST_CASE("quick rays: what doubles are certain of, long double says too") {
  std::size_t pairs = 0, certain = 0, must = 0;
  Random random(91);
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    Rig rig;
    Poses poses;
    const QueryScene scene = any_scene(random, rig, poses);
    const QuickRays judge(scene);
    for (Query ray : any_rays(random, scene, 20)) {
      ray.layer_mask = ~0u;  // a touch is not asked who is looked at
      ray.ignored_batch = {};
      for (std::size_t leaf = 0; leaf < judge.leaf_count(); ++leaf) {
        ++pairs;
        const QuickTouch quick = judge.touch(ray, quick_direction(ray), leaf);
        if (!quick.certain) continue;
        ++certain;
        const QuickTouch exact = judge.exact_touch(ray, leaf);
        CAPTURE(round);
        CHECK(quick.may == exact.may);
        CHECK(quick.must == exact.must);
        if (!quick.must) continue;
        ++must;
        CHECK(quick.least <= exact.least);
        CHECK(quick.most >= exact.most);
        if (exact.may_inside) CHECK(quick.may_inside);
      }
    }
  }
  MESSAGE("pairs: ", pairs, ", certain: ", certain, ", met: ", must);
  CHECK(certain > pairs * 9 / 10);
  CHECK(must >= least_count(3000, 300));
}

TEST_CASE("quick rays: bounds of a distance are tight where a ray is near") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 2, 3}}, {}}};
  Poses poses;
  poses.link_count = poses.instance_count = 1;
  poses.data = {0, 0, 0, 1, 0, 0, 0};
  poses.origins = {10, 0, 0};
  const QueryScene scene = {query_instance({1}, rig, poses, 0)};
  const QuickRays judge(scene);
  Query ray;
  ray.direction[0] = 1;
  ray.length = 100;
  const QuickTouch touch = judge.touch(ray, quick_direction(ray), 0);
  CHECK(touch.certain);
  CHECK(touch.must);
  CHECK(!touch.may_inside);
  CHECK(touch.most == doctest::Approx(9).epsilon(1e-12));
  CHECK(touch.least == doctest::Approx(9).epsilon(1e-4));
  CHECK(touch.least < 9);
  ray.length = 8.9f;
  CHECK(judge.touch(ray, quick_direction(ray), 0).certain);
  CHECK(!judge.touch(ray, quick_direction(ray), 0).may);
  ray.length = 9;  // doubles cannot tell
  CHECK(!judge.touch(ray, quick_direction(ray), 0).certain);
  CHECK(judge.exact_touch(ray, 0).must);
  ray.position[0] = 10.5;
  CHECK(judge.touch(ray, quick_direction(ray), 0).may_inside);
  CHECK(judge.touch(ray, quick_direction(ray), 0).least == 0);
}

TEST_CASE("quick rays: a right answer has no fault, and every planted fault is found") {
  std::size_t hits = 0, farther = 0, noticed = 0;  // but for rays from so far that doubles cannot tell
  Random random(92);
  for (std::uint64_t round = rounds(60); round > 0; --round) {
    Rig rig;
    Poses poses;
    const QueryScene scene = any_scene(random, rig, poses);
    const QuickRays judge(scene);
    for (Query ray : any_rays(random, scene, 20)) {
      ray.want = QueryWant::kAll;
      ray.max_hits = ~0u;
      ray.ignored_batch = {};
      const std::vector<QueryHit> right = right_hits(scene, ray);
      CAPTURE(round);
      const RayCounts counts = Job(ray, right).counts(judge);
      CHECK(counts.fault == "");
      CHECK(counts.must == right.size());
      if (right.empty()) continue;
      hits += right.size();
      const std::size_t at = random.index(static_cast<std::uint32_t>(right.size()));
      Job lost(ray, right), extra(ray, right), late(ray, right), twice(ray, right), closest(ray, right);
      lost.hits.erase(lost.hits.begin() + static_cast<std::ptrdiff_t>(at));
      CHECK(lost.counts(judge).lost == 1);
      extra.hits[at].instance = 17;
      CHECK(extra.counts(judge).extra == 1);
      CHECK(extra.counts(judge).lost == 1);
      late.hits[at].distance = late.hits[at].distance * 1.01f + 0.01f * static_cast<float>(scene[0].leaves[0].lengths);
      late.hits.erase(late.hits.begin() + static_cast<std::ptrdiff_t>(at) + 1, late.hits.end());
      CHECK(late.counts(judge).fault != "");
      twice.hits.push_back(twice.hits.back());
      CHECK(twice.counts(judge).fault != "");
      closest.queries[0].want = QueryWant::kAny;
      closest.hits.clear();
      CHECK(closest.counts(judge).fault == "");
      closest.found[0] = 0;
      CHECK(closest.counts(judge).lost == 1);
      if (right.size() < 2 || right[0].distance * 1.001f >= right.back().distance) continue;
      closest.found[0] = 1;
      closest.queries[0].want = QueryWant::kClosest;
      closest.hits = {right.back()};  // not the closest
      ++farther;
      noticed += closest.counts(judge).lost > 0;
    }
  }
  CHECK(hits >= least_count(500, 60));
  CHECK(noticed >= farther * 9 / 10);
}
