// Queries of targets that are made by hand: distances that a hand calculates, counts, masked targets and limits.
#include "perf/tools/query/measure.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/tools/query/aimed_rays.h"
#include "perf/tools/query/targets.h"
#include "scenes/scene_list.h"

namespace cab::tests {
namespace {

using namespace cab::perf;

constexpr std::uint32_t kRoom = 16;

// Metres: boxes some 20 m out are padded. Measured: 2.0e-5.
constexpr double kTolerance = 4e-5;

bool is_near(float value, double expected) { return std::fabs(static_cast<double>(value) - expected) <= kTolerance; }

// One box of half extents 1, 2 and 3, which a quarter turn about z takes to 2, 1 and 3, at x = 10 and then at x = 20.
scenes::Scene one_box() {
  scenes::Scene scene;
  scene.frame_count = 2;
  scenes::Character& character = scene.characters.emplace_back();
  character.name = "box";
  character.link_names = {"only"};
  character.link_parents = {-1};
  scenes::BodyLeaf leaf;
  leaf.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 2, 3}};
  character.leaves.push_back(leaf);
  const float half_turn = std::sqrt(.5f);
  character.poses = {0, 0, half_turn, half_turn, 10, 0, 0, 0, 0, half_turn, half_turn, 10, 0, 0};
  character.origins = {0, 0, 0, 10, 0, 0};
  return scene;
}

Query ray_along_x(double x, float length) {
  Query ray;
  ray.position[0] = x;
  ray.direction[0] = 5;
  ray.length = length;
  return ray;
}

// The hits of all frames.
std::vector<QueryHit> ask(const scenes::Scene& scene, const AskedQueries& asked, const QuerySessionOptions& options,
                          QueryFigures* figures = nullptr) {
  Targets targets(scene, {}, kRoom);
  std::vector<QueryHit> hits;
  const QueryFigures measured = measure_queries(targets, asked, options, [&](const QueryAnswers& answers) {
    hits.insert(hits.end(), answers.hits.begin(), answers.hits.end());
  });
  if (figures) *figures = measured;
  return hits;
}

}  // namespace

TEST_CASE("a ray meets the one box where a hand calculates it, in every frame") {
  const scenes::Scene scene = one_box();
  AskedQueries asked;
  asked.add("rays", QueryKind::kRay, {ray_along_x(0, 100), ray_along_x(0, 7)});
  QueryFigures figures;
  const std::vector<QueryHit> hits = ask(scene, asked, {Exact::kNone, {0, 2}, 2}, &figures);
  REQUIRE(hits.size() == 2);  // the second ray ends before the box, in both frames
  CHECK(hits[0].query == 0);
  CHECK(is_near(hits[0].distance, 10 - 2));
  CHECK(is_near(hits[1].distance, 20 - 2));
  CHECK(is_near(hits[0].point[0], 8));
  CHECK(is_near(hits[0].normal[0], -1));
  CHECK(!hits[0].inside);
  REQUIRE(figures.counts.size() == 1);
  CHECK(figures.counts[0].found == 2);
  CHECK(figures.counts[0].hits == 2);
  CHECK(figures.rounds.size() == 2);
  CHECK(!figures.first_masked);
}

TEST_CASE("spheres, boxes and points measure what a hand calculates") {
  const scenes::Scene scene = one_box();
  Query sphere;
  sphere.kind = QueryKind::kSphere;
  sphere.with_depth = true;
  sphere.position[0] = 7.5;
  sphere.radius = 1;  // reaches 8.5, the box begins at 8
  Query box = sphere;
  box.kind = QueryKind::kBox;
  for (float& half : box.half) half = .75f;  // reaches 8.25
  Query point;
  point.kind = QueryKind::kPoint;
  point.position[1] = 5;
  point.position[0] = 10;
  point.length = std::numeric_limits<float>::infinity();
  AskedQueries asked;
  asked.add("spheres", QueryKind::kSphere, {sphere});
  asked.add("boxes", QueryKind::kBox, {box});
  asked.add("points", QueryKind::kPoint, {point});
  const std::vector<QueryHit> hits = ask(scene, asked, {});
  REQUIRE(hits.size() == 3);
  CHECK(is_near(hits[0].distance, -.5));
  CHECK(is_near(hits[1].distance, -.25));
  CHECK(is_near(hits[2].distance, 4));
}

TEST_CASE("hits beyond the first room are asked for again, up to a limit") {
  const scenes::Crowd crowd = scenes::make_crowd("uniform", 50);
  Query all;
  all.kind = QueryKind::kSphere;
  all.want = QueryWant::kAll;
  all.radius = 1e6f;
  AskedQueries asked;
  asked.add("spheres", QueryKind::kSphere, {all, all});
  Targets targets(crowd, {}, kRoom);
  const QueryFigures figures = measure_queries(targets, asked, {}, [](const QueryAnswers&) {});
  CHECK(figures.counts[0].found == 2);
  CHECK(figures.counts[0].hits == 2 * 50 * 16);
  CHECK_THROWS_WITH_AS(
      measure_queries(targets, asked, {Exact::kNone, {0, 1}, 1, 1599}, [](const QueryAnswers&) {}),
      "the queries have 1600 hits, more than the 1599 that are kept; ask for fewer with --max-hits or --want closest, "
      "or give fewer queries",
      std::runtime_error);
}

TEST_CASE("a target that is masked is named with its frame and its reason") {
  scenes::Scene scene = one_box();
  scene.characters[0].poses[7 + 4] = std::numeric_limits<float>::quiet_NaN();
  AskedQueries asked;
  asked.add("rays", QueryKind::kRay, {ray_along_x(0, 100)});
  QueryFigures figures;
  CHECK(ask(scene, asked, {Exact::kNone, {0, 2}, 1}, &figures).size() == 1);
  CHECK(figures.stats.instances_masked == 1);
  REQUIRE(figures.first_masked.has_value());
  CHECK(figures.first_masked->frame == 1);
  CHECK(figures.first_masked->group == 0);
  CHECK(figures.first_masked->instance == 0);
  CHECK(figures.first_masked->reason.cause == MaskCause::kPoseNumber);
}

TEST_CASE("a query that the engine refuses is named by its source and row") {
  const scenes::Scene scene = one_box();
  AskedQueries asked;
  asked.add("good.csv", QueryKind::kRay, {ray_along_x(0, 1)});
  asked.add("bad.csv", QueryKind::kRay, {ray_along_x(0, 1), ray_along_x(0, -1)});
  CHECK_THROWS_WITH_AS(ask(scene, asked, {}), doctest::Contains("bad.csv: row 1: "), std::runtime_error);
}

TEST_CASE("aimed rays all meet something, and ray i does not depend on how many there are") {
  for (const char* name : {"mixed", "giant", "level"}) {
    CAPTURE(std::string(name));
    const scenes::Crowd crowd = scenes::make_crowd(name, 40);
    Targets targets(crowd, {}, kRoom);
    targets.pose(3);
    AskedQueries asked;
    asked.add("random", QueryKind::kRay, aimed_rays(targets, 500, 7));
    const std::vector<Query> fewer = aimed_rays(targets, 5, 7), others = aimed_rays(targets, 5, 8);
    for (std::size_t i = 0; i < fewer.size(); ++i) {
      CHECK(fewer[i].position[0] == asked.queries[i].position[0]);
      CHECK(fewer[i].position[0] != others[i].position[0]);
    }
    const QueryFigures figures = measure_queries(targets, asked, {Exact::kNone, {3, 4}, 1}, [](const QueryAnswers&) {});
    CHECK(figures.counts[0].found == 500);
  }
}

}  // namespace cab::tests
