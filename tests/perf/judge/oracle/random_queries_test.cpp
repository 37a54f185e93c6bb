// Random queries are valid, and meet about as often as they should.
#include "perf/judge/oracle/random_queries.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>

#include "tests/rounds.h"

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::least_count;
using cab::tests::rounds;

bool is_length(float v) { return v >= 0 && v <= kMaxCoordinate; }

template <class T>
bool are_finite(const T (&v)[3]) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

// Whether the API takes all numbers of a query, those included that its kind does not name.
bool is_valid(const Query& query, const std::vector<QueryPlane>& planes) {
  if (static_cast<std::uint32_t>(query.kind) >= kQueryKindCount) return false;
  if (static_cast<std::uint32_t>(query.want) >= kQueryWantCount || query.max_hits == 0) return false;
  for (const double c : query.position)
    if (!(std::fabs(c) <= kMaxQueryCoordinate)) return false;
  const bool is_zero = query.direction[0] == 0 && query.direction[1] == 0 && query.direction[2] == 0;
  if (!are_finite(query.direction)) return false;
  if (query.kind == QueryKind::kRay && is_zero && query.length > 0) return false;
  if (!(query.length >= 0) || !is_length(query.radius)) return false;
  if (!is_length(query.half[0]) || !is_length(query.half[1]) || !is_length(query.half[2])) return false;
  double square = 0;
  for (const float c : query.orientation) square += static_cast<double>(c) * static_cast<double>(c);
  if (!(square >= 1e-6 && square <= 1e6)) return false;
  if (query.first_plane + query.plane_count > planes.size()) return false;
  for (std::uint32_t i = 0; i < query.plane_count; ++i) {
    const QueryPlane& plane = planes[query.first_plane + i];
    if (!are_finite(plane.normal) || !std::isfinite(plane.offset)) return false;
    if (plane.normal[0] == 0 && plane.normal[1] == 0 && plane.normal[2] == 0) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("random queries of every regime and kind are valid, and some meet a leaf and some do not") {
  for (std::uint32_t regime = 0; regime < kQueryRegimeCount; ++regime)
    for (std::uint32_t kind = 0; kind < kQueryKindCount; ++kind) {
      CAPTURE(regime);
      CAPTURE(kind);
      std::size_t asked = 0, met = 0;
      for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
        CAPTURE(seed);
        Random random(seed);
        Rig rig = random_rig(random, Topology::kChain, 3, 2);
        if (random.chance(0.3)) flatten_leaves(random, rig);
        Poses poses = random_poses(random, rig, 2, PoseFormat::kMatrix3x4Rows, {1, true, true, {}});
        if (random.chance(0.3)) resize(random.log_uniform(1e-20, 1e15), rig, poses);
        QueryScene scene;
        for (std::uint32_t i = 0; i < 2; ++i) scene.push_back(query_instance({1}, rig, poses, i));
        RandomQueries queries;
        for (int i = 0; i < 4; ++i)
          add_query(random, scene, static_cast<QueryRegime>(regime), static_cast<QueryKind>(kind), queries);
        for (Query query : queries.queries) {
          CHECK(is_valid(query, queries.planes));
          query.layer_mask = ~0u;
          query.ignored_batch = {};
          ++asked;
          met += !judge_query(scene, query, queries.planes, Exact::kNone).empty();
        }
      }
      // Shapes that are far away meet nothing, and what is anywhere meets little.
      const bool is_far = static_cast<QueryRegime>(regime) == QueryRegime::kFar;
      if (!is_far && static_cast<QueryRegime>(regime) != QueryRegime::kNowhere) CHECK(met >= least_count(10, 20));
      CHECK(asked >= met);
    }
}

TEST_CASE("parallel shapes have the axes of their leaf, mirrored or not") {
  std::size_t mirrored = 0, aligned = 0;
  for (std::uint64_t seed = 1; seed <= rounds(200); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Rig rig = random_rig(random, Topology::kChain, 1, 1);
    Poses poses = random_poses(random, rig, 1, PoseFormat::kMatrix3x4Rows, {1, true, true, {}});
    mirror_links(random, poses);
    const QueryScene scene = {query_instance({1}, rig, poses, 0)};
    const ExactBox& box = scene[0].leaves[0].box.box;
    mirrored += dot(axis_of(box, 0), cross(axis_of(box, 1), axis_of(box, 2))) < 0;
    RandomQueries about;
    add_query(random, scene, QueryRegime::kParallel, QueryKind::kBox, about);
    const Query& query = about.queries[0];
    CHECK(is_valid(query, about.planes));
    const float* const q = query.orientation;
    const Real turn[4] = {q[0], q[1], q[2], q[3]};
    Real column[3][3];
    quaternion_matrix(turn, column);
    bool is_aligned = true;
    for (std::size_t k = 0; k < 3; ++k)
      is_aligned = is_aligned && std::fabs(dot(to_vec3(column[k]), axis_of(box, k))) > 0.999999L;
    aligned += is_aligned;
  }
  CHECK(mirrored >= least_count(50, 200));
  CHECK(aligned >= least_count(195, 200));  // but for those that are turned by about half a turn
}

TEST_CASE("parts of random rigs are within their leaves' boxes") {
  std::size_t parts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    KeptParts kept;
    Rig rig = random_rig(random, Topology::kTree, 6, 3);
    flatten_leaves(random, rig);
    add_parts(random, rig, kept);
    const Poses poses = random_poses(random, rig, 1, PoseFormat::kQuaternionTranslation, {});
    for (const QueryLeaf& leaf : query_instance({1}, rig, poses, 0).leaves)
      for (const QueryBody& part : leaf.parts) {
        ++parts;
        for (std::size_t k = 0; k < 3; ++k)
          for (const Real sign : {Real{-1}, Real{1}}) {
            const Point d = sign * axis_of(leaf.box.box, k);
            const Real far = part.kind == JudgeKind::kHalfSpace ? dot(part.at, d) : support_of(part, d);
            CHECK(far <= support_of(leaf.box, d));
          }
      }
  }
  CHECK(parts >= least_count(100, 20));
}
