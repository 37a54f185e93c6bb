// Rays about the past of skins: as those of now where a moment was recorded, and by every triangle between two moments.
#include "engine/queries/past.h"

#include "engine/queries/history_memory.h"
#include "perf/harness/world.h"
#include "perf/judge/oracle/random_skins.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCount = 4, kTicks = 4;

// How far the poses of a judge, rounded to floats, may put a vertex off, of the numbers that place it. Most measured:
// 0.11 of it.
constexpr Real kOff = 0x1p-19L;

// Instances of a skin at several moments, the first of which is at time 0.
struct Past {
  SkinRig rig;
  std::vector<Poses> moments;
  EnginePtr engine;
  BatchId batch;
  HistoryId history;

  Past(const SkinRig& of, const std::vector<Poses>& at, const EngineDesc& desc = {})
      : rig(of), moments(at), engine(make_engine(desc)) {
    for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) rig.leaves[leaf].triangles = rig.triangles[leaf];
    ArticulationId articulation;
    require(add_articulation(*engine, rig.desc(), &articulation));
    batch = add_instances(*engine, articulation, moments[0].instance_count);
    ReserveDesc room;
    room.queries = 32;
    require(reserve(*engine, room));
    require(add_history(*engine, {batch, static_cast<std::uint32_t>(moments.size())}, &history));
    for (std::size_t m = 0; m < moments.size(); ++m)
      require(record_tick(*engine, history, moments[m].input(batch), static_cast<double>(m)));
  }
};

struct Answer {
  std::vector<QueryHit> hits;
  std::vector<SurfacePoint> points;
  std::vector<std::uint8_t> found;
};

// Answers by the history, or of now by the poses of a moment.
Answer ask(const Past& past, const std::vector<Query>& queries, const Poses* now = nullptr) {
  Answer out;
  out.hits.resize(2048);
  out.points.resize(out.hits.size());
  out.found.resize(queries.size());
  QueryJob job;
  BatchInput input;
  if (now) {
    input = now->input(past.batch);
    job.inputs = {&input, 1};
  } else {
    job.histories = {&past.history, 1};
  }
  job.queries = queries;
  job.exact = Exact::kSurface;
  job.hits = out.hits;
  job.surface_points = out.points;
  job.found = out.found;
  require(run_queries(*past.engine, job));
  out.hits.resize(job.hit_count);
  out.points.resize(job.hit_count);
  return out;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// What is between two moments, as docs/rewind.md says, rounded to floats.
Poses between(const Poses& from, const Poses& to, double part) {
  Poses out = from;
  const auto blend = [&](const float* a, const float* b, float* to_pose, std::size_t floats) {
    double length_a = 0, length_b = 0, cosine = 0, q[4], length = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      length_a += static_cast<double>(a[c]) * static_cast<double>(a[c]);
      length_b += static_cast<double>(b[c]) * static_cast<double>(b[c]);
      cosine += static_cast<double>(a[c]) * static_cast<double>(b[c]);
    }
    for (std::size_t c = 0; c < 4; ++c) {
      q[c] = (1 - part) * static_cast<double>(a[c]) / std::sqrt(length_a) +
             (cosine < 0 ? -part : part) * static_cast<double>(b[c]) / std::sqrt(length_b);
      length += q[c] * q[c];
    }
    for (std::size_t c = 0; c < 4; ++c) to_pose[c] = static_cast<float>(q[c] / std::sqrt(length));
    for (std::size_t c = 4; c < floats; ++c)
      to_pose[c] = static_cast<float>((1 - part) * static_cast<double>(a[c]) + part * static_cast<double>(b[c]));
  };
  for (std::uint32_t i = 0; i < out.instance_count; ++i) {
    for (std::uint32_t link = 0; link < out.link_count; ++link)
      blend(from.pose(i, link), to.pose(i, link), out.pose(i, link), 7);
    if (!out.orientations.empty())
      blend(from.orientations.data() + 4 * i, to.orientations.data() + 4 * i, out.orientations.data() + 4 * i, 4);
    if (!out.scales.empty())
      out.scales[i] = static_cast<float>((1 - part) * static_cast<double>(from.scales[i]) +
                                         part * static_cast<double>(to.scales[i]));
    for (std::size_t c = 3 * i; c < 3 * i + 3 && !out.origins.empty(); ++c)
      out.origins[c] = from.origins[c] + part * (to.origins[c] - from.origins[c]);
  }
  return out;
}

struct Placed {
  std::uint32_t instance, link;
  Triangle<Real> at;
};

std::vector<Placed> placed_triangles(const SkinRig& rig, const Poses& poses) {
  std::vector<Placed> out;
  const ArticulationDesc desc = rig.desc();
  for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
    const std::vector<ExactPose> exact = exact_poses(poses, i);
    for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf)
      for (std::size_t t = 0; t < rig.triangles[leaf].size(); t += 3) {
        Placed one = {i, static_cast<std::uint32_t>(rig.leaves[leaf].link), {}};
        for (std::size_t k = 0; k < 3; ++k) {
          one.at.corner[k] = skinned_vertex(desc.skin, exact, rig.triangles[leaf][t + k]);
          for (std::size_t c = 0; c < 3 && !poses.origins.empty(); ++c)
            one.at.corner[k][c] += Real{poses.origins[3 * std::size_t{i} + c]};
        }
        out.push_back(one);
      }
  }
  return out;
}

// Poses of a skin at all moments, which have orientations and scales alike. angle: of links, and of instances.
std::vector<Poses> random_moments(Random& random, const SkinRig& rig, double angle) {
  std::vector<Poses> out;
  const double away = random.chance(0.5) ? 0 : random.log_uniform(1, 1e5);
  while (out.size() < kTicks) {
    Poses poses = random_skin_poses(random, rig, kCount, PoseFormat::kQuaternionTranslation, angle, 0.3, 1);
    if (!out.empty() &&
        (poses.orientations.empty() != out[0].orientations.empty() || poses.scales.empty() != out[0].scales.empty()))
      continue;
    if (!poses.scales.empty())
      for (float& scale : poses.scales) scale = static_cast<float>(random.log_uniform(0.3, 3));
    for (std::size_t i = 0; i < 3 * std::size_t{kCount}; ++i)
      poses.origins.push_back(rig.size * (away + random.uniform(-2, 2)));
    out.push_back(poses);
  }
  return out;
}

// A thin moved sphere from some way off at the middle of a triangle. lengths: those of which numbers are sums.
Query query_at(Random& random, const Triangle<Real>& at, double size, double time) {
  Query out;
  out.time = time;
  out.want = QueryWant::kAll;
  const Point middle = (Real{1} / 3) * (at.corner[0] + at.corner[1] + at.corner[2]);
  const Vec3<double> direction = random.unit_vector();
  const double back = size * random.uniform(0.5, 20);
  for (std::size_t c = 0; c < 3; ++c) {
    out.direction[c] = static_cast<float>(direction[c]);
    out.position[c] = static_cast<double>(middle[c]) - back * direction[c];
  }
  out.length = static_cast<float>(back + size);
  return out;
}

}  // namespace

TEST_CASE("rays at a skin at a recorded moment are those of now with its poses, bit for bit, and name the same point") {
  Random random(431);
  std::size_t seen = 0;
  const std::uint64_t count = rounds(15);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinRig rig = random_skin(random, static_cast<SkinRegime>(round % kSkinRegimeCount), 0.2);
    const std::vector<Poses> moments = random_moments(random, rig, 1);
    std::vector<Query> queries;
    std::vector<std::size_t> moment_of_query;
    for (unsigned i = 0; i < 40; ++i) {
      const std::size_t m = random.index(kTicks);
      const std::vector<Placed> triangles = placed_triangles(rig, moments[m]);
      const Placed& one = triangles[random.index(static_cast<unsigned>(triangles.size()))];
      Query query = query_at(random, one.at, rig.size, static_cast<double>(m));
      if (random.chance(0.3)) query.radius = static_cast<float>(rig.size * random.log_uniform(1e-4, 0.1));
      query.want = static_cast<QueryWant>(random.index(3));
      queries.push_back(query);
      moment_of_query.push_back(m);
    }
    Answer first;
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 3u}) {
        EngineDesc desc;
        desc.isa = isa;
        desc.thread_count = threads;
        const Past past(rig, moments, desc);
        const Answer answer = ask(past, queries);
        if (first.found.empty()) {
          first = answer;
          seen += first.hits.size();
          for (std::size_t m = 0; m < kTicks; ++m) {
            std::vector<Query> own;
            std::vector<std::uint32_t> number;
            for (std::uint32_t q = 0; q < queries.size(); ++q) {
              if (moment_of_query[q] != m) continue;
              own.push_back(queries[q]);
              own.back().time = kNow;
              number.push_back(q);
            }
            Answer now = ask(past, own, &moments[m]);
            for (QueryHit& hit : now.hits) hit.query = number[hit.query];
            std::vector<QueryHit> hits;
            std::vector<SurfacePoint> points;
            for (std::size_t h = 0; h < first.hits.size(); ++h)
              if (moment_of_query[first.hits[h].query] == m) {
                hits.push_back(first.hits[h]);
                points.push_back(first.points[h]);
              }
            CHECK(same_bits(now.hits, hits));
            CHECK(same_bits(now.points, points));
            for (std::size_t q = 0; q < number.size(); ++q) CHECK(now.found[q] == first.found[number[q]]);
          }
        }
        CHECK(same_bits(answer.hits, first.hits));
        CHECK(same_bits(answer.points, first.points));
        CHECK(same_bits(answer.found, first.found));
      }
  }
  CHECK(seen >= least_count(300, 15));
}

TEST_CASE(
    "rays between two moments find every triangle of a skin where its links are then, and nothing where it is not") {
  Random random(432);
  std::size_t aimed = 0, apart = 0;
  Real most = 0;
  const std::uint64_t count = rounds(40);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinRig rig = random_skin(random, static_cast<SkinRegime>(round % kSkinRegimeCount), 0.2);
    const Past past(rig, random_moments(random, rig, round % 2 ? 3.1 : 0.5));
    for (unsigned i = 0; i < 10; ++i) {
      const std::size_t m = random.index(kTicks - 1);
      const double part = random.uniform(0, 1);
      const std::vector<Placed> triangles = placed_triangles(rig, between(past.moments[m], past.moments[m + 1], part));
      const Placed& one = triangles[random.index(static_cast<unsigned>(triangles.size()))];
      Real size = 0;  // of numbers about the instances' origins
      for (const Placed& other : triangles)
        for (const Point& corner : other.at.corner)
          for (std::size_t c = 0; c < 3; ++c)
            size = std::max(size, std::fabs(corner[c] - Real{past.moments[m].origins[3 * other.instance + c]}));
      const Real off = kOff * (size + 4 * Real{rig.size} * rig.link_count());
      Query query = query_at(random, one.at, static_cast<double>(size), static_cast<double>(m) + part);
      query.radius = static_cast<float>(2 * off);
      const Answer answer = ask(past, {query});
      const auto named = [&](const QueryHit& hit) { return hit.instance == one.instance && hit.link == one.link; };
      CHECK(std::any_of(answer.hits.begin(), answer.hits.end(), named));
      ++aimed;
      Point along{{query.direction[0], query.direction[1], query.direction[2]}}, from;
      along = (1 / length(along)) * along;
      for (std::size_t c = 0; c < 3; ++c) from[c] = query.position[c];
      for (const QueryHit& hit : answer.hits) {
        Real nearest = HUGE_VALL;
        const Point center = from + Real{hit.distance} * along;
        for (const Placed& other : triangles)
          if (other.instance == hit.instance && other.link == hit.link)
            nearest = std::min(nearest, distance(other.at, {{center, center, center}}));
        most = std::max(most, (nearest - Real{query.radius}) / off);
        CHECK(nearest <= Real{query.radius} + off);
        ++apart;
      }
    }
  }
  MESSAGE("off: " << static_cast<double>(most) << " of what is allowed");
  CHECK(aimed >= least_count(400, 40));
  CHECK(apart >= least_count(400, 40));
}

TEST_CASE("what links without leaves move is found all along its arc") {
  // The leaf is on link 0, which rests. Link 1 moves all of its corners but one, and turns by nearly half a turn.
  SkinRig rig;
  rig.parents = {-1, 0};
  rig.influence_count = 1;
  rig.vertices = {0, 0, 0, 2, -.1f, 0, 2, .1f, 0, 2, -.1f, .1f, 2, .1f, .1f, 2.1f, 0, .1f};
  rig.links = {0, 1, 1, 1, 1, 1};
  rig.weights = {1, 1, 1, 1, 1, 1};
  rig.leaves.resize(1);
  rig.triangles = {{0, 1, 2, 3, 4, 5}};
  const auto at_angle = [](double angle) {
    Poses out;
    out.link_count = 2;
    out.instance_count = 1;
    out.data = {
        0, 0, 0, 1, 0, 0, 0, 0, 0, static_cast<float>(std::sin(angle / 2)), static_cast<float>(std::cos(angle / 2)),
        0, 0, 0};
    return out;
  };
  const Past past(rig, {at_angle(0), at_angle(3.1)});
  std::size_t found = 0;
  for (double time = 0; time <= 1; time += 1.0 / 16) {
    const Poses poses = between(past.moments[0], past.moments[1], time);
    const Point at = placed_triangles(rig, poses)[1].at.corner[2];  // the outermost corner: the ray passes by its tip
    Query query;
    query.time = time;
    query.want = QueryWant::kAny;
    for (std::size_t c = 0; c < 3; ++c) query.position[c] = static_cast<double>(at[c]) * (c < 2 ? 0.999 : 1);
    query.position[2] += 1;
    query.direction[2] = -1;
    query.length = 3;
    found += ask(past, {query}).found[0];
  }
  CHECK(found == 17);
}

TEST_CASE("what was skinned for the past is not taken for that of another test") {
  // One instance of one triangle, which is far from where it was at every other moment.
  const auto rig_of_links = [](std::uint32_t links) {
    SkinRig rig;
    for (std::uint32_t link = 0; link < links; ++link) rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    rig.influence_count = 1;
    rig.vertices = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
    rig.links = {0, 0, 0};
    rig.weights = {1, 1, 1};
    rig.leaves.resize(1);
    rig.triangles = {{0, 1, 2}};
    return rig;
  };
  const auto at_place = [](std::uint32_t links, float x) {
    Poses out;
    out.link_count = links;
    out.instance_count = 1;
    for (std::uint32_t link = 0; link < links; ++link) out.data.insert(out.data.end(), {0, 0, 0, 1, x, 0, 0});
    return out;
  };
  EngineDesc desc;
  desc.thread_count = 1;
  const auto is_met = [](const Past& past, std::size_t moment) {
    Query query;
    query.time = static_cast<double>(moment);
    query.position[0] = static_cast<double>(past.moments[moment].data[4]);
    query.position[2] = 1;
    query.direction[2] = -1;
    query.length = 2;
    return ask(past, {query}).found[0] == 1;
  };
  const Past past(rig_of_links(1), {at_place(1, 0), at_place(1, 10), at_place(1, 20)}, desc);
  SUBCASE("where a history of more links takes the place of the memory") {
    std::vector<BatchId> longer;
    for (const std::uint32_t links : {4u, 8u}) {
      SkinRig rig = rig_of_links(links);
      rig.leaves[0].triangles = rig.triangles[0];
      ArticulationId articulation;
      require(add_articulation(*past.engine, rig.desc(), &articulation));
      longer.push_back(add_instances(*past.engine, articulation, 1));
    }
    CHECK(is_met(past, 0));
    for (std::size_t k = 0; k < 2; ++k) {
      HistoryId history;
      require(add_history(*past.engine, {longer[k], 1}, &history));
      CHECK(is_met(past, k + 1));
    }
  }
  SUBCASE("where the numbers of tests begin anew") {
    for (const std::uint32_t before : {6u, 5u}) {
      past.engine->readers[0]->past->workers[0]->test = (1u << 31) - before;
      for (std::size_t i = 0; i < 6; ++i) CHECK(is_met(past, 1 + i % 2));
    }
  }
}

TEST_CASE("the past of a skin answers rays at its triangles, and refuses other queries by name") {
  Random random(433);
  const SkinRig rig = random_skin(random, SkinRegime::kSmooth, 0.2);
  const Past past(rig, random_moments(random, rig, 1));
  QueryJob job;
  std::vector<QueryHit> hits(64);
  Query queries[2];
  queries[0].kind = QueryKind::kRay;
  queries[0].direction[0] = 1;
  queries[0].length = 1;
  queries[0].time = 1;
  queries[1] = queries[0];
  job.queries = queries;
  job.histories = {&past.history, 1};
  job.hits = hits;
  job.exact = Exact::kSurface;
  CHECK(run_queries(*past.engine, job) == Status::kOk);
  for (const QueryKind kind :
       {QueryKind::kSphere, QueryKind::kBox, QueryKind::kCapsule, QueryKind::kPoint, QueryKind::kRegion}) {
    queries[1].kind = kind;
    queries[1].radius = queries[1].half[0] = queries[1].half[1] = queries[1].half[2] = 1;
    queries[1].time = 1;
    job.bad_query = 7;
    CHECK(run_queries(*past.engine, job) == Status::kSkinNotTaken);
    CHECK(job.bad_query == 1);
    queries[1].time = kNow;
    CHECK(run_queries(*past.engine, job) == Status::kOk);
  }
  queries[1] = queries[0];
  for (const Exact exact : {Exact::kNone, Exact::kConvex}) {
    job.exact = exact;
    CHECK(run_queries(*past.engine, job) == Status::kSkinNotTaken);
    CHECK(job.bad_query == 0);
  }
}

}  // namespace cab::tests
