// Queries over random worlds: right by the judge, the same bits however they are asked, and refused where they must be.
// Every world is made from one seed, which is printed where a check fails. CAB_TEST_SEED=N runs the world of that seed
// alone. CAB_TEST_ROUNDS says how many worlds run (tests/rounds.h).
#include "engine/frame/all_pairs.h"
#include "engine/queries/query_memory.h"
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/aligned_memory.h"
#include "tests/engine/thread_pool.h"
#include "tests/seeds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr Box kUnitBox = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

// ------------------------------------------------------------------------------------------------ worlds and calls

// Who of a member takes part.
struct Listed {
  std::uint32_t count = kAllInstances;
  std::vector<std::uint32_t> instances;
  std::vector<bool> masked;
};

// A world of characters and static bodies that queries are asked about. Batch m + 1 is that of member m, and the last
// one that of the bodies.
struct Asked {
  World world;
  std::vector<Listed> listed;  // by member
  std::vector<StaticBody> bodies;
  std::vector<std::uint32_t> body_layers;
  KeptParts kept;
  QueryScene scene;
  RandomQueries about;

  std::uint32_t body_batch() const { return static_cast<std::uint32_t>(world.members.size() + 1); }

  EnginePtr engine(const EngineDesc& desc = {}, std::uint32_t queries = 64, bool reserve_first = false) const {
    EnginePtr out = make_engine(desc);
    ReserveDesc room;
    room.queries = queries;
    if (reserve_first) require(reserve(*out, room));
    for (const Member& member : world.members)
      add_instances(*out, add_rig(*out, member.rig), member.poses.instance_count, member.kind);
    if (!bodies.empty()) {
      StaticDesc level;
      level.bodies = bodies;
      BatchId id;
      require(add_static_batch(*out, level, &id));
    }
    if (!reserve_first) require(reserve(*out, room));
    return out;
  }

  std::vector<BatchInput> inputs() const {
    std::vector<BatchInput> out;
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      BatchInput& input = out.emplace_back(world.members[m].poses.input({m + 1}));
      input.layers = world.members[m].layers;
      input.count = listed[m].count;
      input.instances = listed[m].instances;
    }
    if (bodies.empty()) return out;
    BatchInput& input = out.emplace_back();
    input.batch = {body_batch()};
    input.layers = body_layers;
    return out;
  }
};

// The scene of a world's members that take part and are not masked, and of its bodies.
void set_scene(Asked& out) {
  out.scene.clear();
  for (std::uint32_t m = 0; m < out.world.members.size(); ++m) {
    const Member& member = out.world.members[m];
    const Listed& listed = out.listed[m];
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
      if (i >= listed.count || listed.masked[i]) continue;
      if (!listed.instances.empty() && !std::count(listed.instances.begin(), listed.instances.end(), i)) continue;
      out.scene.push_back(
          query_instance({m + 1}, member.rig, member.poses, i, member.layers.empty() ? ~0u : member.layers[i]));
    }
  }
  for (std::uint32_t b = 0; b < out.bodies.size(); ++b) {
    const StaticBody& body = out.bodies[b];
    Rig rig;
    rig.parents = {-1};
    rig.leaves = {{0, body.box, body.parts}};
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {body.rotation[0], body.rotation[1], body.rotation[2], body.rotation[3], 0, 0, 0};
    poses.origins.assign(body.origin, body.origin + 3);
    out.scene.push_back(
        query_instance({out.body_batch()}, rig, poses, 0, out.body_layers.empty() ? ~0u : out.body_layers[b]));
    out.scene.back().instance = b;
  }
}

// Makes the pose of a link with a leaf one that masks its instance.
void break_pose(Random& random, const Member& member, std::uint32_t i, Poses& poses) {
  float* const pose = poses.pose(i, member.rig.leaves[random.index(member.rig.leaf_count())].link);
  switch (random.index(3)) {
    case 0: pose[random.index(3)] = kNan; break;
    case 1: pose[poses.format == PoseFormat::kMatrix3x4Rows ? 3 : poses.floats_per_pose() - 2] = kInfinity; break;
    default:
      std::fill_n(pose, 3, 0.0f);
      pose[poses.format == PoseFormat::kQuaternionTranslation ? 3 : 0] = 0;
      break;
  }
}

struct Shape {
  std::uint32_t queries = 40;
  unsigned most_links = 8;
  std::uint32_t most_instances = 17;
  bool with_bodies = true;
  bool with_extremes = true;  // sizes, distances, plates
};

std::unique_ptr<Asked> any_world(Random& random, const Shape& shape = {}) {
  auto out = std::make_unique<Asked>();
  const bool far = shape.with_extremes && random.chance(0.3);
  const double away = far ? random.log_uniform(1e3, 1e9) : 0;
  const Vec3<double> about = away * random.unit_vector();
  const double factor = shape.with_extremes && random.chance(0.2) ? random.log_uniform(1e-20, 1e14) : 1;
  const double spread = random.uniform(0.3, 4);
  for (std::uint32_t left = 1 + random.index(3); left > 0; --left) {
    Member& member = out->world.members.emplace_back();
    member.rig = any_rig(random, shape.most_links);
    if (shape.with_extremes && random.chance(0.3)) flatten_leaves(random, member.rig);
    const std::uint32_t count = random.chance(0.3) ? 1 : 1 + random.index(shape.most_instances);
    const auto format = static_cast<PoseFormat>(random.index(3));
    member.poses = random_poses(random, member.rig, count, format, any_pose_range(random, far, about, spread));
    if (random.chance(0.3)) mirror_links(random, member.poses);
    resize(factor, member.rig, member.poses);
    if (random.chance(0.7)) add_parts(random, member.rig, out->kept);
    if (random.chance(0.2) && format != PoseFormat::kQuaternionTranslation) {
      member.poses.has_scale = true;
      for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t link = 0; link < member.rig.link_count(); ++link)
          scale_matrix(format, static_cast<float>(random.log_uniform(0.01, 100)), member.poses.pose(i, link));
    } else if (random.chance(0.3)) {
      for (std::uint32_t i = 0; i < count; ++i)
        member.poses.scales.push_back(static_cast<float>(random.log_uniform(0.01, 100)));
    }
    if (random.chance(0.4))
      for (std::uint32_t i = 0; i < count; ++i) member.layers.push_back(1u << random.index(4));
    Listed& listed = out->listed.emplace_back();
    listed.masked.resize(count);
    if (random.chance(0.2)) listed.count = random.index(count + 1);
    if (random.chance(0.2))
      for (std::uint32_t i = 0; i < std::min(count, listed.count); ++i)
        if (random.chance(0.5)) listed.instances.push_back(i);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!random.chance(0.05)) continue;
      listed.masked[i] = true;
      break_pose(random, member, i, member.poses);
    }
  }
  const bool has_bodies = shape.with_bodies && factor == 1 && random.chance(0.5);
  for (std::uint32_t left = has_bodies ? 1 + random.index(20) : 0; left > 0; --left) {
    Rig rig;
    rig.leaves = {{0, random_box(random, 0.3 * random.unit_vector(), 0.02, 0.5), {}}};
    if (random.chance(0.5)) add_parts(random, rig, out->kept);
    StaticBody body;
    body.box = rig.leaves[0].box;
    body.parts = rig.leaves[0].parts;
    double q[4];
    random_turn(random, q);
    for (std::size_t c = 0; c < 4; ++c) body.rotation[c] = static_cast<float>(q[c]);
    for (std::size_t c = 0; c < 3; ++c) body.origin[c] = about[c] + random.uniform(-spread, spread);
    out->bodies.push_back(body);
    if (left == 1 && random.chance(0.5))
      for (std::size_t b = 0; b < out->bodies.size(); ++b) out->body_layers.push_back(1u << random.index(4));
  }
  set_scene(*out);
  if (std::any_of(out->scene.begin(), out->scene.end(), [](const auto& one) { return !one.leaves.empty(); }))
    add_queries(random, out->scene, shape.queries, out->about);
  return out;
}

// What a call answers.
struct Answer {
  Status status = Status::kOk;
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  QueryStats stats;
};

bool same_counts(const QueryStats& a, const QueryStats& b) {
  return a.nodes == b.nodes && a.instances == b.instances && a.leaf_tests == b.leaf_tests &&
         a.exact_tests == b.exact_tests && a.instances_masked == b.instances_masked;
}

// Checks that the short list of a job's hits and their counts are those of its hits in full.
void check_short_answers(Engine& engine, QueryJob job, const std::vector<QueryHit>& hits) {
  std::vector<QueryLink> links(hits.size());
  std::vector<std::uint32_t> counts(job.queries.size, 77), counted(job.queries.size, 88);
  job.found = {};
  job.hits = {};
  job.links = links;
  job.counts = counts;
  CHECK(run_queries(engine, job) == Status::kOk);
  CHECK(job.hit_count == hits.size());
  CHECK(
      std::equal(hits.begin(), hits.end(), links.begin(), links.end(), [](const QueryHit& hit, const QueryLink& link) {
        return hit.query == link.query && hit.batch == link.batch && hit.instance == link.instance &&
               hit.link == link.link && hit.leaf == link.leaf;
      }));
  const QueryStats of_links = job.stats;
  job.links = {};
  job.counts = counted;
  CHECK(run_queries(engine, job) == Status::kOk);
  CHECK(job.hits_needed == hits.size());
  CHECK(job.hit_count == 0);
  CHECK(counts == counted);
  if (!job.reuse_bounds) CHECK(same_counts(job.stats, of_links));
  std::vector<std::uint32_t> expected(job.queries.size);
  for (const QueryHit& hit : hits) ++expected[hit.query];
  CHECK(counts == expected);
  if (hits.empty()) return;
  links.pop_back();
  job.links = links;
  const Status short_of_one = links.empty() ? Status::kOk : Status::kHitsOverflow;  // without room they are counted
  CHECK(run_queries(engine, job) == short_of_one);
  CHECK(job.hits_needed == hits.size());
}

// Asks until there is room for all hits. room: for how many there is at first.
Answer ask(Engine& engine, const std::vector<BatchInput>& inputs, const std::vector<Query>& queries,
           const std::vector<QueryPlane>& planes, Exact exact, bool reuse_bounds = false, std::size_t room = 4096) {
  Answer out;
  out.hits.resize(room);
  out.found.assign(queries.size(), 0xee);
  QueryJob job;
  job.inputs = inputs;
  job.queries = queries;
  job.planes = planes;
  job.exact = exact;
  job.reuse_bounds = reuse_bounds;
  job.hits = out.hits;
  job.found = out.found;
  out.status = run_queries(engine, job);
  if (out.status == Status::kHitsOverflow) {
    CHECK(job.hit_count == 0);
    CHECK(job.hits_needed > room);
    const std::vector<std::uint8_t> found = out.found;
    out.found.assign(queries.size(), 0xee);
    out.hits.resize(job.hits_needed);
    job.hits = out.hits;
    out.status = run_queries(engine, job);
    CHECK(job.hits_needed == out.hits.size());
    CHECK(found == out.found);
  }
  CHECK(out.status == Status::kOk);
  CHECK(job.hit_count == job.hits_needed);
  out.hits.resize(job.hit_count);
  out.stats = job.stats;
  check_short_answers(engine, job, out.hits);
  return out;
}

Answer ask(Engine& engine, const Asked& world, Exact exact) {
  return ask(engine, world.inputs(), world.about.queries, world.about.planes, exact);
}

// The job that was answered, for the judge.
QueryJob answered(const Asked& world, Answer& answer, Exact exact, const std::vector<Query>& queries) {
  QueryJob job;
  job.queries = queries;
  job.planes = world.about.planes;
  job.exact = exact;
  job.hits = answer.hits;
  job.found = answer.found;
  job.hit_count = job.hits_needed = answer.hits.size();
  return job;
}

std::string judged(const Asked& world, Answer answer, Exact exact, const std::vector<Query>& queries,
                   const QueryTolerance& tolerance = {}) {
  return fault_of(world.scene, answered(world, answer, exact, queries), tolerance);
}

bool same_bits(const QueryHit& a, const QueryHit& b) {
  static_assert(offsetof(QueryHit, inside) == 44, "no padding to compare before the last member");
  return std::memcmp(&a, &b, offsetof(QueryHit, inside)) == 0 && a.inside == b.inside;
}

bool same_hits(const std::vector<QueryHit>& a, const std::vector<QueryHit>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const QueryHit& x, const QueryHit& y) { return same_bits(x, y); });
}

bool same(const Answer& a, const Answer& b) { return a.found == b.found && same_hits(a.hits, b.hits); }

constexpr Exact kBoth[] = {Exact::kNone, Exact::kConvex};

auto link_key(const QueryHit& hit) { return std::make_tuple(hit.batch.value, hit.instance, hit.link); }

// The hits of one query, named as those of query 0.
std::vector<QueryHit> hits_of(const std::vector<QueryHit>& hits, std::size_t query) {
  std::vector<QueryHit> out;
  for (const QueryHit& hit : hits)
    if (hit.query == query) {
      out.push_back(hit);
      out.back().query = 0;
    }
  return out;
}

}  // namespace

// ------------------------------------------------------------------------------------------------- right answers

TEST_CASE("queries: what is answered is right, by boxes and by shapes, on every instruction set with the same bits") {
  std::size_t hits = 0, queries = 0;
  std::map<QueryKind, std::size_t> by_kind;
  double growth[kExactCount] = {};  // measured in more rounds than usual
  for_seeds(120, [&](Random& random) {
    const auto world = any_world(random);
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      Answer first;
      for (const Isa isa : available_isas()) {
        CAPTURE(to_string(isa));
        const EnginePtr engine = world->engine({isa});
        const Answer answer = ask(*engine, *world, exact);
        if (isa == Isa::kScalar) {
          first = answer;
          CHECK(judged(*world, answer, exact, world->about.queries) == "");
          continue;
        }
        CHECK(same(answer, first));
        CHECK(same_counts(answer.stats, first.stats));
      }
      hits += first.hits.size();
      queries += world->about.queries.size();
      if (rounds(1) > 1)
        growth[static_cast<std::size_t>(exact)] =
            std::max(growth[static_cast<std::size_t>(exact)],
                     needed_growth(world->scene, answered(*world, first, exact, world->about.queries)));
      for (const QueryHit& hit : first.hits) ++by_kind[world->about.queries[hit.query].kind];
    }
  });
  MESSAGE("queries: ", queries, ", hits: ", hits);
  if (rounds(1) > 1)
    MESSAGE("growth needed in u: ", growth[0], " by boxes, ", growth[2], " by shapes, times QueryTolerance::shapes");
  if (!runs_all_seeds()) return;
  CHECK(hits >= least_count(3000, 120));
  for (std::uint8_t kind = 0; kind < kQueryKindCount; ++kind)
    CHECK(by_kind[static_cast<QueryKind>(kind)] >= least_count(100, 120));
}

TEST_CASE("queries: every regime of every kind is answered right") {
  for_seeds(6, [&](Random& random) {
    for (std::uint32_t regime = 0; regime < kQueryRegimeCount; ++regime) {
      CAPTURE(regime);
      const auto world = any_world(random, {0, 6, 6, false, true});
      if (world->scene.empty()) continue;
      for (std::uint32_t kind = 0; kind < kQueryKindCount; ++kind)
        for (int i = 0; i < 4; ++i)
          add_query(random, world->scene, static_cast<QueryRegime>(regime), static_cast<QueryKind>(kind), world->about);
      const EnginePtr engine = world->engine();
      for (const Exact exact : kBoth) {
        CAPTURE(static_cast<int>(exact));
        CHECK(judged(*world, ask(*engine, *world, exact), exact, world->about.queries) == "");
      }
    }
  });
}

TEST_CASE("queries: answers do not depend on threads, on the room that is reserved, or on the order of inputs") {
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for_seeds(20, [&](Random& random) {
    const auto world = any_world(random, {60, 12, 33, true, true});
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const Answer first = ask(*world->engine(), *world, exact);
      for (const std::uint32_t room : {1u, 7u, 4096u}) {
        CAPTURE(room);
        CHECK(same(ask(*world->engine({}, room, random.chance(0.5)), *world, exact), first));
      }
      EngineDesc threads;
      threads.thread_count = 3;
      const Answer by_threads = ask(*world->engine(threads), *world, exact);
      CHECK(same(by_threads, first));
      CHECK(same_counts(by_threads.stats, first.stats));
      threads.scheduler = &scheduler;
      for (const std::uint32_t room : {5u, 64u}) {
        CAPTURE(room);
        CHECK(same(ask(*world->engine(threads, room), *world, exact), first));
      }
      const EnginePtr engine = world->engine();
      std::vector<BatchInput> turned = world->inputs();
      std::reverse(turned.begin(), turned.end());
      CHECK(same(ask(*engine, turned, world->about.queries, world->about.planes, exact), first));
      CHECK(same(ask(*engine, *world, exact), first));  // again
    }
  });
}

TEST_CASE("queries: a query alone is answered as among others, and with too little room as with enough") {
  for_seeds(20, [&](Random& random) {
    const auto world = any_world(random, {30, 8, 17, true, true});
    const EnginePtr engine = world->engine({}, 16);
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const Answer first = ask(*engine, *world, exact);
      for (std::size_t q = 0; q < world->about.queries.size(); ++q) {
        CAPTURE(q);
        const Answer alone = ask(*engine, world->inputs(), {world->about.queries[q]}, world->about.planes, exact);
        CHECK(same_hits(alone.hits, hits_of(first.hits, q)));
        CHECK(alone.found[0] == first.found[q]);
      }
      for (const std::size_t room : {std::size_t{0}, first.hits.size() / 2, first.hits.size()}) {
        CAPTURE(room);
        if (room == first.hits.size() || !first.hits.empty())
          CHECK(same(ask(*engine, world->inputs(), world->about.queries, world->about.planes, exact, false, room),
                     first));
      }
      // In another order, and twice.
      std::vector<Query> turned = world->about.queries;
      std::reverse(turned.begin(), turned.end());
      turned.insert(turned.end(), world->about.queries.begin(), world->about.queries.end());
      const Answer both = ask(*engine, world->inputs(), turned, world->about.planes, exact);
      const std::size_t count = world->about.queries.size();
      for (std::size_t q = 0; q < count; ++q) {
        CHECK(same_hits(hits_of(both.hits, count - 1 - q), hits_of(first.hits, q)));
        CHECK(same_hits(hits_of(both.hits, count + q), hits_of(first.hits, q)));
      }
    }
  });
}

TEST_CASE("queries: the bounds of the last frame may be used again, and frames keep what they keep") {
  std::size_t resting = 0;
  for_seeds(20, [&](Random& random) {
    auto world = any_world(random, {30, 8, 17, true, true});
    for (std::uint32_t m = 1; m <= world->world.members.size(); ++m) world->world.rules.push_back({{m}, {m}});
    const EnginePtr engine = world->engine(), fresh = world->engine();
    std::vector<BatchInput> inputs = world->inputs();
    std::vector<Hit> hits(1 << 16);
    const auto frame = [&](Strategy strategy, decltype(&run_frame) run = run_frame) {
      FrameJob job;
      job.inputs = inputs;
      job.rules = world->world.rules;
      job.policies = {Refit::kCab, strategy, Exact::kNone};
      job.hits = hits;
      require(run(*engine, job));
      return job;
    };
    const std::pair<Strategy, decltype(&run_frame)> frames[] = {
        {Strategy::kAuto, run_frame}, {Strategy::kAuto, run_all_pairs}, {Strategy::kTree, run_frame}};
    for (const auto& each : frames) {
      const Strategy strategy = each.first;
      const auto run = each.second;
      CAPTURE(static_cast<int>(strategy));
      if (run == run_all_pairs && world->scene.size() > 20) continue;  // many hits
      frame(strategy, run);
      for (const Exact exact : kBoth) {
        CAPTURE(static_cast<int>(exact));
        const Answer first = ask(*fresh, *world, exact);
        for (int again = 0; again < 2; ++again)
          CHECK(same(ask(*engine, inputs, world->about.queries, world->about.planes, exact, true), first));
        // Few at a time, with the index and the boxes of calls before.
        Answer in_parts;
        for (std::size_t begin = 0, count = 0; begin < world->about.queries.size(); begin += count) {
          count =
              std::min<std::size_t>(1 + random.index(random.chance(0.5) ? 2 : 9), world->about.queries.size() - begin);
          const auto at = world->about.queries.begin() + static_cast<std::ptrdiff_t>(begin);
          const Answer part =
              ask(*engine, inputs, {at, at + static_cast<std::ptrdiff_t>(count)}, world->about.planes, exact, true);
          in_parts.found.insert(in_parts.found.end(), part.found.begin(), part.found.end());
          for (QueryHit hit : part.hits) {
            hit.query += static_cast<std::uint32_t>(begin);
            in_parts.hits.push_back(hit);
          }
        }
        CHECK(same(in_parts, first));
        CHECK(same(ask(*engine, *world, exact), first));
      }
    }
    // Everybody rests, before and after queries.
    std::vector<std::vector<std::uint8_t>> moved;
    for (const Member& member : world->world.members) moved.emplace_back(member.poses.instance_count);
    for (std::size_t m = 0; m < moved.size(); ++m) inputs[m].moved = moved[m];
    frame(Strategy::kTree);
    const FrameJob before = frame(Strategy::kTree);
    const std::vector<Hit> hits_before(hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(before.hit_count));
    CHECK(same(ask(*engine, inputs, world->about.queries, world->about.planes, Exact::kNone, random.chance(0.5)),
               ask(*fresh, *world, Exact::kNone)));
    const FrameJob after = frame(Strategy::kTree);
    CHECK(after.stats.instances_resting == before.stats.instances_resting);
    hits.resize(after.hit_count);
    CHECK(oracle::same_hits(hits, hits_before));
    resting += after.stats.instances_resting;
  });
  if (runs_all_seeds()) CHECK(resting >= least_count(100, 20));
}

TEST_CASE("queries: where no frame has stored the bounds of boxes, they are made whatever is stated") {
  for_seeds(20, [&](Random& random) {
    const auto world = any_world(random, {30, 8, 17, true, true});
    const EnginePtr engine = world->engine(), fresh = world->engine();
    const std::vector<BatchInput> inputs = world->inputs();
    const Answer first = ask(*fresh, *world, Exact::kNone);
    const auto again = [&] {
      return ask(*engine, inputs, world->about.queries, world->about.planes, Exact::kNone, true);
    };
    CHECK(same(again(), first));  // before any frame
    std::vector<PairRule> rules;
    for (std::uint32_t m = 1; m <= world->world.members.size(); ++m) rules.push_back({{m}, {m}});
    FrameJob job;
    job.inputs = inputs;
    job.rules = rules;
    job.policies.refit = Refit::kAabbVertices;  // its bounds are those of vertices
    std::vector<Hit> hits(1 << 16);
    job.hits = hits;
    require(run_frame(*engine, job));
    CHECK(same(again(), first));
    job.policies.refit = Refit::kCab;
    job.hits = {};
    if (run_frame(*engine, job) == Status::kHitsOverflow) CHECK(same(again(), first));
    job.hits = hits;
    require(run_frame(*engine, job));
    if (!world->bodies.empty()) return;
    // Bounds of the caller's, which hold nothing.
    std::vector<BatchInput> bounded = inputs;
    std::vector<std::vector<float>> nowhere;
    for (BatchInput& input : bounded) {
      nowhere.emplace_back(6 * 64, 0.0f);
      input.bounds = {nowhere.back().data(),
                      6 * std::size_t{world->world.members[slot_of(input.batch).value - 1].poses.instance_count}};
    }
    FrameJob early = job;
    early.inputs = bounded;
    CandidateList candidates;
    CHECK(find_candidates(*engine, early, candidates) != Status::kBadBounds);
    CHECK(same(again(), first));
  });
}

TEST_CASE("queries: what is wanted of a query changes how much of its hits is written, and nothing else") {
  for_seeds(20, [&](Random& random) {
    const auto world = any_world(random, {30, 8, 17, true, true});
    const EnginePtr engine = world->engine();
    std::vector<Query> queries = world->about.queries;
    for (Query& query : queries) {
      query.want = QueryWant::kAll;
      query.max_hits = ~0u;
    }
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const auto ask_for = [&](const std::function<void(Query&)>& change) {
        std::vector<Query> changed = queries;
        for (Query& query : changed) change(query);
        return ask(*engine, world->inputs(), changed, world->about.planes, exact);
      };
      const Answer all = ask_for([](Query&) {});
      CHECK(judged(*world, all, exact, queries) == "");
      const Answer any = ask_for([](Query& query) { query.want = QueryWant::kAny; });
      CHECK(any.hits.empty());
      CHECK(any.found == all.found);
      const Answer closest = ask_for([](Query& query) { query.want = QueryWant::kClosest; });
      CHECK(closest.found == all.found);
      const Answer few = ask_for([](Query& query) { query.max_hits = 3; });
      CHECK(few.found == all.found);
      const Answer other_depth = ask_for([](Query& query) { query.with_depth = !query.with_depth; });
      CHECK(other_depth.found == all.found);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        CAPTURE(q);
        std::vector<QueryHit> hits = hits_of(all.hits, q), other = hits_of(other_depth.hits, q);
        CHECK((all.found[q] == 1) == !hits.empty());
        const auto by_link = [](const QueryHit& a, const QueryHit& b) { return link_key(a) < link_key(b); };
        const auto same_link = [](const QueryHit& a, const QueryHit& b) { return link_key(a) == link_key(b); };
        std::vector<QueryHit> sorted = hits;
        std::sort(sorted.begin(), sorted.end(), by_link);
        std::sort(other.begin(), other.end(), by_link);
        CHECK(std::equal(sorted.begin(), sorted.end(), other.begin(), other.end(), same_link));
        hits.resize(std::min<std::size_t>(hits.size(), 3));
        CHECK(same_hits(hits_of(few.hits, q), hits));
        hits.resize(std::min<std::size_t>(hits.size(), 1));
        CHECK(same_hits(hits_of(closest.hits, q), hits));
      }
    }
  });
}

TEST_CASE("queries: of links that are equally near the first is the closest, wherever the search meets them") {
  for_seeds(20, [&](Random& random) {
    Asked asked;
    const Box box = random_box(random, {{0, 0, 0}}, 0.3, 1);
    const double size = random.log_uniform(1e-8, 1e8);
    for (int m = 0; m < 3; ++m) {
      Member& member = asked.world.members.emplace_back();
      member.rig.parents = {-1, 0, 0};
      member.rig.leaves = {{2, box, {}}, {0, box, {}}, {1, box, {}}, {0, box, {}}};
      member.poses.link_count = 3;
      member.poses.instance_count = 20;
      for (int i = 0; i < 60; ++i) member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0.5f, 0, 0});
      resize(size, member.rig, member.poses);
      asked.listed.emplace_back();
    }
    const EnginePtr engine = asked.engine();
    std::vector<Query> queries(40);
    for (Query& query : queries) {
      query.kind = random.chance(0.5) ? QueryKind::kRay : QueryKind::kPoint;
      const Vec3<double> at = (size * random.uniform(2, 5)) * random.unit_vector();
      for (std::size_t c = 0; c < 3; ++c) {
        query.position[c] = at[c];
        query.direction[c] = static_cast<float>((c == 0 ? 0.5 * size : 0) - at[c]);
      }
      query.length = kInfinity;
    }
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const Answer closest = ask(*engine, asked.inputs(), queries, {}, exact);
      REQUIRE(closest.hits.size() == queries.size());
      for (const QueryHit& hit : closest.hits) {
        CHECK(link_key(hit) == std::make_tuple(1u, 0u, 0));
        CHECK(hit.leaf == 1);
      }
    }
  });
}

TEST_CASE("queries: more hits than a worker keeps are found again, each once") {
  Random random(1);
  Asked asked;
  Member& member = asked.world.members.emplace_back();
  member.rig = any_rig(random, 4);
  member.poses =
      random_poses(random, member.rig, 20000, PoseFormat::kQuaternionTranslation, any_pose_range(random, false, {}, 4));
  asked.listed.emplace_back();
  std::set<std::uint32_t> links;
  for (const Leaf& leaf : member.rig.leaves) links.insert(leaf.link);
  std::vector<Query> queries(5);
  for (Query& query : queries) query.want = QueryWant::kAll;
  constexpr std::size_t kOfAll[] = {1, 2, 3};
  for (const std::size_t all : kOfAll) queries[all].kind = QueryKind::kRegion;  // the world
  queries[2].kind = QueryKind::kSphere;
  queries[2].radius = kMaxCoordinate;
  for (const std::uint32_t room : {1u, 64u}) {
    CAPTURE(room);
    const Answer answer = ask(*asked.engine({}, room), asked.inputs(), queries, {}, Exact::kNone, false, 0);
    for (const std::size_t all : kOfAll) {
      const std::vector<QueryHit> hits = hits_of(answer.hits, all);
      CHECK(hits.size() == 20000 * links.size());
      CHECK(hits.size() > 2 * room + kSpareHits);
      CHECK(std::adjacent_find(hits.begin(), hits.end(), [](const QueryHit& a, const QueryHit& b) {
              return link_key(a) >= link_key(b);
            }) == hits.end());
    }
  }
}

TEST_CASE("queries: an instance of many leaves that a ray meets counts once") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves.assign(64, {0, kUnitBox, {}});
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 1);
  require(reserve(*engine, {0, 0, 1}));
  const std::vector<float> pose = {0, 0, 0, 1, 0, 0, 0};
  std::vector<BatchInput> inputs(1);
  inputs[0].batch = batch;
  inputs[0].poses.data = pose.data();
  std::vector<Query> rays(1);
  rays[0].position[0] = -9;
  rays[0].direction[0] = 1;
  rays[0].length = 20;
  for (const QueryWant want : {QueryWant::kAny, QueryWant::kClosest, QueryWant::kAll})
    for (const Exact exact : kBoth) {
      rays[0].want = want;
      CHECK(ask(*engine, inputs, rays, {}, exact).stats.instances == 1);
    }
}

TEST_CASE("queries: large bodies are searched for by as few rays at a time as have room for what they meet") {
  constexpr std::uint32_t kLeaves = 1024, kFit = 200, kTooMany = 300;  // 64 tiles each, of 16384
  Random random(96);
  Rig rig;
  rig.parents = {-1};
  for (std::uint32_t leaf = 0; leaf < kLeaves; ++leaf)
    rig.leaves.push_back({0, random_box(random, random.unit_vector(), 0.02, 0.1), {}});
  PoseRange range;
  range.spread = 10;
  const Poses poses = random_poses(random, rig, kTooMany, PoseFormat::kQuaternionTranslation, range);
  std::vector<Query> rays(300);
  for (Query& ray : rays) {
    const Vec3<double> way = random.unit_vector();
    for (std::size_t c = 0; c < 3; ++c) {
      ray.position[c] = random.uniform(-10, 10);
      ray.direction[c] = static_cast<float>(way[c]);
    }
    ray.length = 50;
  }
  std::vector<Answer> answers;
  for (const std::uint32_t count : {kFit, kTooMany}) {
    const EnginePtr engine = make_engine();
    const BatchId batch = add_instances(*engine, add_rig(*engine, rig), count);
    require(reserve(*engine, {0, 0, 64}));
    CHECK(engine->readers[0]->queries->together == (count == kFit ? kLanes : 4));
    std::vector<BatchInput> inputs = {poses.input(batch)};
    inputs[0].count = kFit;
    answers.push_back(ask(*engine, inputs, rays, {}, Exact::kNone));
  }
  CHECK(answers[0].hits.size() > 30);
  CHECK(same(answers[0], answers[1]));
}

TEST_CASE("queries: hits that are found again are counted once") {
  for_seeds(4, [](Random& random) {
    const auto asked = any_world(random);
    for (Query& query : asked->about.queries) query.want = QueryWant::kAll, query.max_hits = ~0u;
    const EnginePtr enough = asked->engine(), few = asked->engine();
    for (const auto& worker : few->readers[0]->queries->workers)
      worker->hits.capacity = worker->overlapped.capacity = 2;
    for (const Exact exact : kBoth) {
      const Answer expected = ask(*enough, *asked, exact), found = ask(*few, *asked, exact);
      CHECK(same(found, expected));
      CHECK(same_counts(found.stats, expected.stats));
    }
  });
}

TEST_CASE("queries: links that a sphere overlaps are in the order of instances, as many as are wanted") {
  constexpr std::uint32_t kInstances = 200, kLinks = 20;  // two tiles of leaves
  Random random(95);
  Asked asked;
  for (int m = 0; m < 2; ++m) {
    Member& member = asked.world.members.emplace_back();
    for (std::uint32_t link = 0; link < kLinks; ++link) {
      member.rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
      Leaf& leaf = member.rig.leaves.emplace_back();
      leaf.link = link;
      for (float& half : leaf.box.half) half = 0.1f;
    }
    member.poses.link_count = kLinks;
    member.poses.instance_count = kInstances;
    for (std::uint32_t i = 0; i < kInstances * kLinks; ++i)
      member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, static_cast<float>(i % kLinks), 0, 0});
    for (std::uint32_t i = 0; i < 3 * kInstances; ++i) member.poses.origins.push_back(random.uniform(-20, 20));
    asked.listed.emplace_back();
  }
  std::vector<Query> queries(2);
  for (Query& query : queries) {
    query.kind = QueryKind::kSphere;
    query.want = QueryWant::kAll;
    query.radius = 100;
  }
  queries[1].max_hits = kInstances * kLinks + 3 * kLinks + 7;
  const Answer answer = ask(*asked.engine(), asked.inputs(), queries, {}, Exact::kNone);
  std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> wanted;
  for (std::uint32_t batch = 1; batch <= 2; ++batch)
    for (std::uint32_t i = 0; i < kInstances; ++i)
      for (std::uint32_t link = 0; link < kLinks; ++link) wanted.emplace_back(batch, i, link);
  for (std::size_t q = 0; q < 2; ++q) {
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> found;
    for (const QueryHit& hit : hits_of(answer.hits, q)) {
      found.emplace_back(hit.batch.value, hit.instance, hit.link);
      CHECK(hit.leaf == hit.link);
    }
    CHECK(found == wanted);
    wanted.resize(queries[1].max_hits);
  }
}

TEST_CASE("queries: a ray finds the links of many leaves of every instance, also where the last leaves are missed") {
  Asked asked;
  Member& member = asked.world.members.emplace_back();
  constexpr std::uint32_t kLeaves = 80, kMet = 32;
  member.rig.parents = {-1, 0};
  for (std::uint32_t leaf = 0; leaf < kLeaves; ++leaf) {
    Leaf& one = member.rig.leaves.emplace_back();
    one.link = leaf % 2;
    one.box.center[0] = 0.01f * static_cast<float>(leaf);
    one.box.center[1] = leaf < kMet ? 0 : 100;
    for (float& half : one.box.half) half = 0.3f;
  }
  member.poses.link_count = 2;
  member.poses.instance_count = 6;
  for (int i = 0; i < 12; ++i) member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
  for (int i = 0; i < 6; ++i) member.poses.origins.insert(member.poses.origins.end(), {10.0 * i, 0, 0});
  asked.listed.emplace_back();
  std::vector<Query> queries(2);
  for (Query& query : queries) {
    query.want = QueryWant::kAll;
    query.position[0] = -5;
    query.direction[0] = 1;
    query.length = kInfinity;
  }
  queries[1].max_hits = 7;
  for (const Exact exact : kBoth) {
    CAPTURE(static_cast<int>(exact));
    const Answer answer = ask(*asked.engine(), asked.inputs(), queries, {}, exact);
    for (std::size_t q = 0; q < 2; ++q) {
      const std::vector<QueryHit> hits = hits_of(answer.hits, q);
      REQUIRE(hits.size() == std::min<std::size_t>(12, queries[q].max_hits));
      for (std::uint32_t h = 0; h < hits.size(); ++h)
        CHECK(link_key(hits[h]) == std::make_tuple(1u, h / 2, static_cast<int>(h % 2)));
    }
  }
}

TEST_CASE("queries: an instance as far away as origins can be hides nobody") {
  Asked asked;
  Member& member = asked.world.members.emplace_back();
  member.rig.parents = {-1};
  member.rig.leaves.resize(1);
  for (float& half : member.rig.leaves[0].box.half) half = 1;
  member.poses.link_count = 1;
  member.poses.instance_count = 3;
  for (int i = 0; i < 3; ++i) member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
  asked.listed.emplace_back();
  std::vector<Query> queries(3);
  queries[0].position[0] = -10;
  queries[0].direction[0] = 1;
  queries[0].length = kInfinity;
  queries[1].kind = QueryKind::kPoint;
  queries[1].position[1] = 5;
  queries[1].length = kInfinity;
  queries[2].kind = QueryKind::kSphere;
  queries[2].radius = 3;
  for (const double far : {1e30, 1e100, 1e300, 1.7e308}) {
    CAPTURE(far);
    member.poses.origins = {far, -far, far, 0, 0, 0, -far, far, 0};
    const EnginePtr engine = asked.engine();
    const Answer answer = ask(*engine, asked.inputs(), queries, {}, Exact::kNone);
    REQUIRE(answer.hits.size() == 3);
    for (const QueryHit& hit : answer.hits) CHECK(hit.instance == 1);
    CHECK(answer.hits[0].distance == doctest::Approx(9));
    CHECK(answer.hits[1].distance == doctest::Approx(4));
  }
}

TEST_CASE("queries: a point finds what is so near that squares of distances are subnormal floats") {
  Asked asked;
  Member& member = asked.world.members.emplace_back();
  member.rig.parents = {-1};
  member.rig.leaves.resize(1);
  for (float& half : member.rig.leaves[0].box.half) half = 3e-20f;
  member.poses.link_count = member.poses.instance_count = 1;
  member.poses.data = {0, 0, 0, 1, 0, 0, 0};
  member.poses.origins = {0, 0, 0};
  asked.listed.emplace_back();
  std::vector<Query> queries;
  for (double apart = 1e-23; apart < 1e-20; apart *= 1.01)
    for (const QueryWant want : {QueryWant::kAny, QueryWant::kClosest}) {
      Query& query = queries.emplace_back();
      query.kind = QueryKind::kPoint;
      query.want = want;
      query.position[0] = static_cast<double>(3e-20f) + apart;
      query.length = static_cast<float>(1.0001 * apart);
    }
  const Answer answer = ask(*asked.engine(), asked.inputs(), queries, {}, Exact::kNone);
  CHECK(answer.hits.size() == queries.size() / 2);
  CHECK(std::count(answer.found.begin(), answer.found.end(), std::uint8_t{1}) ==
        static_cast<std::ptrdiff_t>(queries.size()));
}

TEST_CASE("queries: moving the whole world by what its origins can hold changes nothing") {
  for_seeds(20, [&](Random& random) {
    auto world = any_world(random, {0, 8, 17, false, false});
    for (Member& member : world->world.members) {  // 20 bits below 1 stay exact when up to 2^31 is added
      member.poses.origins.resize(3 * std::size_t{member.poses.instance_count});
      for (double& v : member.poses.origins) v = std::round(random.uniform(-1, 1) * 0x1p20) * 0x1p-20;
    }
    set_scene(*world);
    if (world->scene.empty()) return;
    add_queries(random, world->scene, 40, world->about);
    double by[3];
    for (double& v : by) v = std::round(random.log_uniform(1, 0x1p31) * 0x1p20) * 0x1p-20;
    for (double& v : by) v *= random.sign();
    std::vector<Query> here, there;
    for (Query query : world->about.queries) {
      for (double& c : query.position) c = std::round(c * 0x1p20) * 0x1p-20;
      if (std::max({std::fabs(query.position[0]), std::fabs(query.position[1]), std::fabs(query.position[2])}) > 1e9)
        continue;
      here.push_back(query);
      for (std::size_t c = 0; c < 3; ++c) query.position[c] += by[c];
      there.push_back(query);
    }
    const EnginePtr engine = world->engine();
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const Answer first = ask(*engine, world->inputs(), here, world->about.planes, exact);
      Asked moved = *world;
      for (Member& member : moved.world.members)
        for (std::size_t i = 0; i < member.poses.origins.size(); ++i) member.poses.origins[i] += by[i % 3];
      CHECK(same(ask(*engine, moved.inputs(), there, world->about.planes, exact), first));
    }
  });
}

// ------------------------------------------------------------------------------------------------ levels, triangles

TEST_CASE("queries: a level of boxes is answered by its boxes, and one of nodes finds what its links are found by") {
  std::size_t hits = 0;
  for_seeds(15, [&](Random& random) {
    World world;
    Member member;
    member.rig = any_rig(random, 8);
    member.rig.joints.clear();
    const std::uint32_t count = 1 + random.index(20);
    member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation,
                                any_pose_range(random, false, {}, 2));
    const EnginePtr engine = make_engine();
    require(reserve(*engine, {0, 0, 16}));
    const ArticulationId fine = add_rig(*engine, member.rig);
    const BatchId fine_batch = add_instances(*engine, fine, count);

    // One box on the first link, as large as all links can reach. Links are at most 0.4 apart, their leaves 0.5 long.
    std::vector<std::uint32_t> links;
    for (std::uint32_t link = 0; link < member.rig.link_count(); ++link) links.push_back(link);
    Rig coarse = member.rig;
    coarse.leaves = {{0, kUnitBox, {}}};
    for (float& half : coarse.leaves[0].box.half) half *= 0.5f * static_cast<float>(links.size()) + 1;
    const LodLeaf leaf = {0, coarse.leaves[0].box, links};
    LodDesc reach;
    reach.of = fine;
    reach.leaves = {&leaf, 1};
    reach.rest_poses.data = member.poses.data.data();
    ArticulationId reach_level, node_level;
    require(add_lod(*engine, reach, &reach_level));
    const BatchId reach_batch = add_instances(*engine, reach_level, count);
    LodDesc nodes;
    nodes.of = fine;
    nodes.kind = LodKind::kNodes;
    nodes.max_leaves = std::max(2u, member.rig.leaf_count() / 2);
    require(add_lod(*engine, nodes, &node_level));
    const BatchId node_batch = add_instances(*engine, node_level, count);
    std::vector<std::uint16_t> leaf_of_link(links.size());
    require(lod_leaves(*engine, node_level, leaf_of_link));

    Asked asked;
    for (std::uint32_t i = 0; i < count; ++i)
      asked.scene.push_back(query_instance(slot_of(reach_batch), coarse, member.poses, i));
    add_queries(random, asked.scene, 30, asked.about);
    QueryScene fine_scene;
    for (std::uint32_t i = 0; i < count; ++i)
      fine_scene.push_back(query_instance(slot_of(fine_batch), member.rig, member.poses, i));
    add_queries(random, fine_scene, 30, asked.about);
    for (Query& query : asked.about.queries) query.ignored_batch = {};
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      const Answer answer =
          ask(*engine, {member.poses.input(reach_batch)}, asked.about.queries, asked.about.planes, exact);
      QueryTolerance tolerance;
      tolerance.leaf *= 3;  // boxes of levels are padded like those of links
      CHECK(judged(asked, answer, exact, asked.about.queries, tolerance) == "");
      hits += answer.hits.size();
    }
    std::vector<Query> queries = asked.about.queries;
    for (Query& query : queries) {
      query.want = QueryWant::kAll;
      query.max_hits = ~0u;
    }
    // What the links are found by as given; the boxes of nodes hold their boxes.
    const Answer by_nodes = ask(*engine, {member.poses.input(node_batch)}, queries, asked.about.planes, Exact::kNone);
    std::size_t lost = 0;
    for (std::size_t q = 0; q < queries.size(); ++q)
      for (const JudgedLink& link : judge_query(fine_scene, queries[q], asked.about.planes, Exact::kNone))
        lost += link.must && std::none_of(by_nodes.hits.begin(), by_nodes.hits.end(), [&](const QueryHit& hit) {
                  return hit.query == q && hit.batch.value == slot_of(node_batch).value &&
                         hit.instance == link.instance->instance && hit.leaf == leaf_of_link[link.link];
                });
    CHECK(lost == 0);
    QueryJob job;
    const BatchInput input = member.poses.input(node_batch);
    job.inputs = {&input, 1};
    job.exact = Exact::kConvex;
    CHECK(run_queries(*engine, job) == Status::kLodWithoutShapes);
  });
  if (runs_all_seeds()) CHECK(hits >= least_count(200, 15));
}

TEST_CASE("queries: triangles of a level are met as triangles") {
  for_seeds(10, [&](Random& random) {
    std::vector<float> vertices;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t v = 0; v < 60; ++v) {
      for (int c = 0; c < 3; ++c) vertices.push_back(static_cast<float>(random.uniform(-2, 2)));
      triangles.push_back(v);
    }
    StaticDesc desc;
    desc.vertices = vertices;
    desc.triangles = triangles;
    for (double& c : desc.origin) c = random.uniform(-1e6, 1e6);
    const EnginePtr engine = make_engine();
    require(reserve(*engine, {0, 0, 16}));
    BatchId level;
    require(add_static_batch(*engine, desc, &level));
    BatchInput input;
    input.batch = level;
    std::vector<Box> boxes(20);
    require(compute_boxes(*engine, input, {}, boxes));

    // Boxes are relative to the origin of a body, which the vertices tell: a box is about its triangle's middle.
    Asked asked;
    for (std::uint32_t t = 0; t < 20; ++t) {
      QueryInstance instance{slot_of(level), t, ~0u, {{desc.origin[0], desc.origin[1], desc.origin[2]}}, {}};
      QueryLeaf leaf{0, 0, 10, {}, {}};
      QueryBody hull;
      hull.kind = JudgeKind::kHull;
      Point low{{9, 9, 9}}, high{{-9, -9, -9}};
      for (std::uint32_t v = 3 * t; v < 3 * t + 3; ++v) {
        const Point at = {{vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]}};
        hull.vertices.push_back(at);
        for (std::size_t c = 0; c < 3; ++c) {
          low[c] = std::fmin(low[c], at[c]);
          high[c] = std::fmax(high[c], at[c]);
        }
      }
      complete(hull);
      leaf.parts = {hull};
      for (std::size_t k = 0; k < 3; ++k) {
        leaf.box.box.axis[k][k] = 1;
        leaf.box.box.center[k] = (low[k] + high[k]) / 2;
        leaf.box.box.half[k] = (high[k] - low[k]) / 2;
      }
      complete(leaf.box);
      instance.leaves.push_back(std::move(leaf));
      asked.scene.push_back(std::move(instance));
    }
    while (asked.about.queries.size() < 40) {
      const auto kind = static_cast<QueryKind>(random.index(kQueryKindCount - 1));  // regions ask for boxes
      add_query(random, asked.scene, static_cast<QueryRegime>(random.index(4)), kind, asked.about);
    }
    const Answer answer = ask(*engine, {input}, asked.about.queries, asked.about.planes, Exact::kConvex);
    CHECK(judged(asked, answer, Exact::kConvex, asked.about.queries) == "");
  });
}

namespace {

// What the point's distance may be off, by each of 1 and the distance. Shapes are some 0.2 large; measured: 5e-7.
constexpr double kNearestPointOff = 2e-6;

}  // namespace

TEST_CASE("queries: the nearest point of a shape is as far away as the hit says, however near the shape is") {
  std::size_t close = 0;
  for_seeds(40, [&](Random& random) {
    Asked asked;
    Member& member = asked.world.members.emplace_back();
    member.rig = any_rig(random, 4);
    for (Leaf& leaf : member.rig.leaves)  // plates, segments and points
      for (float& half : leaf.box.half)
        if (random.chance(0.4)) half = 0;
    member.poses =
        random_poses(random, member.rig, 2, PoseFormat::kQuaternionTranslation, any_pose_range(random, false, {}, 2));
    if (random.chance(0.5)) add_parts(random, member.rig, asked.kept);
    asked.listed.push_back({kAllInstances, {}, {false, false}});
    set_scene(asked);
    for (int i = 0; i < 40; ++i) {
      const QueryInstance& instance = asked.scene[random.index(2)];
      const QueryLeaf& leaf = instance.leaves[random.index(static_cast<std::uint32_t>(instance.leaves.size()))];
      const QueryBody& body =
          leaf.parts.empty() ? leaf.box : leaf.parts[random.index(static_cast<std::uint32_t>(leaf.parts.size()))];
      Point at = nearest_point(body, convert<Real>(10.0 * random.unit_vector()));
      at = at + convert<Real>(random.log_uniform(1e-18, 1e-2) * random.unit_vector()) + instance.origin;
      Query query;
      query.kind = QueryKind::kPoint;
      query.want = QueryWant::kAll;
      query.length = 5;
      for (std::size_t c = 0; c < 3; ++c) query.position[c] = static_cast<double>(at[c]);
      asked.about.queries.push_back(query);
    }
    const Answer answer = ask(*asked.engine(), asked, Exact::kConvex);
    CHECK(judged(asked, answer, Exact::kConvex, asked.about.queries) == "");
    for (const QueryHit& hit : answer.hits) {
      if (hit.inside) continue;
      const auto distance = static_cast<double>(hit.distance);
      const double way = norm(
          {{static_cast<double>(hit.point[0]), static_cast<double>(hit.point[1]), static_cast<double>(hit.point[2])}});
      CAPTURE(distance);
      CHECK(std::fabs(way - distance) < kNearestPointOff * (1 + distance));
      close += distance < 1e-9;
    }
  });
  if (runs_all_seeds()) CHECK(close >= least_count(20, 40));
}

// ------------------------------------------------------------------------------------------------ room and refusals

TEST_CASE("queries: a call asks the caller's allocator for nothing") {
  struct Counter {
    std::uint64_t calls = 0;
    static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
      ++static_cast<Counter*>(user)->calls;
      return tests::allocate_aligned(bytes, alignment);
    }
    static void release(void*, void* memory, std::size_t, std::size_t) { tests::free_aligned(memory); }
  };
  for_seeds(4, [&](Random& random) {
    const auto world = any_world(random);
    Counter counter;
    const Allocator allocator = {&counter, Counter::allocate, Counter::release};
    EngineDesc desc;
    desc.allocator = &allocator;
    const EnginePtr engine = world->engine(desc, 7);
    const std::uint64_t before = counter.calls;
    CHECK(before > 0);
    for (const Exact exact : kBoth) ask(*engine, *world, exact);
    CHECK(counter.calls == before);
    EngineMemory memory;
    require(engine_memory(*engine, &memory));
    CHECK(memory.queries > 0);
    CHECK(memory.total >= memory.queries);
  });
}

TEST_CASE("queries: a call without inputs, or without queries, finds nothing") {
  Random random(1);
  const auto world = any_world(random);
  const EnginePtr engine = world->engine();
  for (const Exact exact : kBoth) {
    const Answer nobody = ask(*engine, {}, world->about.queries, world->about.planes, exact);
    CHECK(nobody.hits.empty());
    CHECK(nobody.found == std::vector<std::uint8_t>(world->about.queries.size(), 0));
    CHECK(ask(*engine, world->inputs(), {}, {}, exact).hits.empty());
  }
}

namespace {

// A small world of one instance of one box of half extents 1, and a job about it with sentinels in every output.
struct Refusal {
  EnginePtr engine;
  BatchId batch, sequence, level, node_batch;
  std::vector<float> pose = {0, 0, 0, 1, 0, 0, 0};
  std::vector<double> origin = {0, 0, 0};
  std::vector<float> orientation = {0, 0, 0, 1}, scale = {1};
  std::vector<std::uint32_t> layers = {1}, instances = {0};
  std::vector<BatchInput> inputs;
  std::vector<Query> queries = std::vector<Query>(3);
  std::vector<QueryPlane> planes = std::vector<QueryPlane>(2);
  std::vector<QueryHit> hits = std::vector<QueryHit>(8);
  std::vector<std::uint8_t> found = std::vector<std::uint8_t>(3, 0xee);
  std::vector<QueryLink> links = std::vector<QueryLink>(8);
  std::vector<std::uint32_t> counts = std::vector<std::uint32_t>(3, 0xee);
  QueryJob job;

  explicit Refusal(std::uint32_t room = 4) : engine(make_engine()) {
    Rig rig;
    rig.parents = {-1};
    rig.leaves = {{0, kUnitBox, {}}};
    const ArticulationId articulation = add_rig(*engine, rig);
    batch = add_instances(*engine, articulation, 1);
    sequence = add_instances(*engine, articulation, 1, BatchKind::kSequence);
    StaticBody body;
    body.box = kUnitBox;
    StaticDesc desc;
    desc.bodies = {&body, 1};
    require(add_static_batch(*engine, desc, &level));
    LodDesc nodes;
    nodes.of = articulation;
    nodes.kind = LodKind::kNodes;
    ArticulationId node_level;
    require(add_lod(*engine, nodes, &node_level));
    node_batch = add_instances(*engine, node_level, 1);
    if (room > 0) require(reserve(*engine, {0, 0, room}));
    inputs = {input_of(batch)};
    for (Query& query : queries) {
      query.position[0] = -9;
      query.direction[0] = 1;
      query.length = kInfinity;
      query.radius = query.half[0] = query.half[1] = query.half[2] = 0.5f;
    }
    for (QueryPlane& plane : planes) plane.normal[0] = 1;
    std::memset(static_cast<void*>(hits.data()), 0xee, hits.size() * sizeof(QueryHit));
    job.hit_count = 77;
    job.hits_needed = 88;
    job.bad_query = 99;
    job.stats.nodes = 111;
    job.stats.seconds_total = 222;
  }

  BatchInput input_of(BatchId id) {
    BatchInput out;
    out.batch = id;
    out.poses.data = pose.data();
    return out;
  }

  // The job as its lists now are; `change` may change it further.
  Status run(const std::function<void(QueryJob&)>& change = {}) {
    job.inputs = inputs;
    job.queries = queries;
    job.planes = planes;
    job.hits = hits;
    job.found = found;
    if (change) change(job);
    return run_queries(*engine, job);
  }

  bool is_untouched(std::size_t bad_query = 99) const {
    const auto* const bytes = reinterpret_cast<const unsigned char*>(hits.data());
    return std::all_of(bytes, bytes + hits.size() * sizeof(QueryHit), [](unsigned char c) { return c == 0xee; }) &&
           std::all_of(found.begin(), found.end(), [](std::uint8_t c) { return c == 0xee; }) &&
           std::all_of(counts.begin(), counts.end(), [](std::uint32_t c) { return c == 0xee; }) &&
           std::all_of(links.begin(), links.end(), [](const QueryLink& link) { return link.batch.value == 0; }) &&
           job.hit_count == 77 && job.hits_needed == 88 && job.bad_query == bad_query && job.stats.nodes == 111 &&
           job.stats.seconds_total == 222;
  }
};

}  // namespace

TEST_CASE("queries: every query with a number that it must not have is refused, and is named") {
  using Change = std::function<void(Refusal&, Query&)>;
  const auto of = [](QueryKind kind, const Change& change = {}) -> Change {
    return [=](Refusal& r, Query& query) {
      query.kind = kind;
      if (change) change(r, query);
    };
  };
  constexpr QueryKind kRay = QueryKind::kRay, kSphere = QueryKind::kSphere, kBox = QueryKind::kBox,
                      kCapsule = QueryKind::kCapsule, kPoint = QueryKind::kPoint, kRegion = QueryKind::kRegion;
  std::vector<std::pair<std::string, Change>> bad = {
      {"no kind", [](Refusal&, Query& q) { q.kind = static_cast<QueryKind>(kQueryKindCount); }},
      {"no want", [](Refusal&, Query& q) { q.want = static_cast<QueryWant>(kQueryWantCount); }},
      {"no hits", [](Refusal&, Query& q) { q.want = QueryWant::kAll, q.max_hits = 0; }},
      {"no direction", of(kRay, [](Refusal&, Query& q) { q.direction[0] = 0; })},
      {"a direction of NaN", of(kRay, [](Refusal&, Query& q) { q.direction[1] = kNan; })},
      {"an infinite direction", of(kRay, [](Refusal&, Query& q) { q.direction[2] = kInfinity; })},
      {"planes beyond", of(kRegion, [](Refusal&, Query& q) { q.first_plane = 1, q.plane_count = 2; })},
      {"planes from beyond", of(kRegion, [](Refusal&, Query& q) { q.first_plane = 3, q.plane_count = 1; })},
      {"planes all round", of(kRegion, [](Refusal&, Query& q) { q.first_plane = ~0u, q.plane_count = 2; })},
  };
  for (const QueryKind kind : {kRay, kSphere, kBox, kCapsule, kPoint, kRegion}) {
    const std::string name = " of kind " + std::to_string(static_cast<int>(kind));
    for (std::size_t c = 0; c < 3; ++c)
      for (const double v : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1.001e30, -1e200})
        bad.push_back(
            {"position " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.position[c] = v; })});
    for (const float v : {kNan, -1.0f, -1e-45f, -kInfinity}) {
      if (kind == kRay || kind == kPoint)
        bad.push_back({"length " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.length = v; })});
    }
    for (const float v : {kNan, -1.0f, -1e-45f, kInfinity, 1.001e18f}) {
      if (kind == kRay || kind == kSphere || kind == kCapsule)
        bad.push_back({"radius " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.radius = v; })});
      if (kind == kCapsule)
        bad.push_back({"half " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.half[2] = v; })});
      for (std::size_t k = 0; k < 3 && kind == kBox; ++k)
        bad.push_back({"half " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.half[k] = v; })});
    }
    if (kind == kBox || kind == kCapsule)
      for (const float v : {0.0f, 0.99e-3f, 1.01e3f, kNan, kInfinity, 1e30f})
        bad.push_back(
            {"quaternion " + std::to_string(v) + name, of(kind, [=](Refusal&, Query& q) { q.orientation[3] = v; })});
  }
  const auto of_plane = [&](const std::string& name, const std::function<void(QueryPlane&)>& change) {
    bad.push_back({name, of(kRegion, [=](Refusal& r, Query& q) {
                     q.plane_count = 2;
                     change(r.planes[1]);
                   })});
  };
  of_plane("a plane without a normal", [](QueryPlane& plane) { plane.normal[0] = 0; });
  of_plane("a normal of NaN", [](QueryPlane& plane) { plane.normal[1] = kNan; });
  of_plane("an infinite normal", [](QueryPlane& plane) { plane.normal[2] = -kInfinity; });
  of_plane("an offset of NaN", [](QueryPlane& plane) { plane.offset = kNan; });
  of_plane("an infinite offset", [](QueryPlane& plane) { plane.offset = kInfinity; });
  for (const auto& [words, change] : bad)
    for (const std::size_t at : {std::size_t{0}, std::size_t{2}}) {
      const std::string& name = words;
      CAPTURE(name);
      Refusal refusal;
      change(refusal, refusal.queries[at]);
      CHECK(refusal.run() == Status::kBadQuery);
      CHECK(refusal.is_untouched(at));
    }
  // The first of two is named.
  Refusal two;
  two.queries[1].length = two.queries[2].length = -1;
  CHECK(two.run() == Status::kBadQuery);
  CHECK(two.job.bad_query == 1);
}

TEST_CASE("queries: numbers at their limits are taken, and members that a kind does not name are not read") {
  using Change = std::function<void(Refusal&, Query&)>;
  const auto spoil = [](Query& q, bool direction, bool length, bool radius, bool half, bool orientation, bool planes) {
    if (direction) std::fill_n(q.direction, 3, kNan);
    if (length) q.length = kNan;
    if (radius) q.radius = -1;
    if (half) std::fill_n(q.half, 3, kNan);
    if (orientation) std::fill_n(q.orientation, 4, kNan);
    if (planes) q.first_plane = q.plane_count = ~0u;
    q.max_hits = 0;
  };
  const std::vector<std::pair<std::string, Change>> good = {
      {"far", [](Refusal&, Query& q) { q.position[0] = -kMaxQueryCoordinate; }},
      {"one hit", [](Refusal&, Query& q) { q.want = QueryWant::kAll, q.max_hits = 1; }},
      {"a short direction", [](Refusal&, Query& q) { q.direction[0] = 1e-45f; }},
      {"a long direction", [](Refusal&, Query& q) { std::fill_n(q.direction, 3, 3e38f); }},
      {"no length and no direction", [](Refusal&, Query& q) { q.length = q.direction[0] = 0; }},
      {"a large radius", [](Refusal&, Query& q) { q.radius = kMaxCoordinate; }},
      {"a large box", [](Refusal&, Query& q) { q.kind = QueryKind::kBox, q.half[1] = kMaxCoordinate; }},
      {"a short quaternion", [](Refusal&, Query& q) { q.kind = QueryKind::kBox, q.orientation[3] = 1.001e-3f; }},
      {"a long quaternion", [](Refusal&, Query& q) { q.kind = QueryKind::kCapsule, q.orientation[3] = 0.999e3f; }},
      {"no planes", [](Refusal&, Query& q) { q.kind = QueryKind::kRegion; }},
      {"no planes, behind all", [](Refusal&, Query& q) { q.kind = QueryKind::kRegion, q.first_plane = 2; }},
      {"an instance that is not there",
       [](Refusal& r, Query& q) { q.ignored_batch = r.level, q.ignored_instance = 9; }},
      {"a ray", [=](Refusal&, Query& q) { spoil(q, false, false, false, true, true, true); }},
      {"a sphere",
       [=](Refusal&, Query& q) { q.kind = QueryKind::kSphere, spoil(q, true, true, false, true, true, true); }},
      {"a box", [=](Refusal&, Query& q) { q.kind = QueryKind::kBox, spoil(q, true, true, true, false, false, true); }},
      {"a capsule",
       [=](Refusal&, Query& q) {
         q.kind = QueryKind::kCapsule, spoil(q, true, true, false, false, false, true), q.half[0] = kNan;
       }},
      {"a point",
       [=](Refusal&, Query& q) { q.kind = QueryKind::kPoint, spoil(q, true, false, true, true, true, true); }},
      {"a region",
       [=](Refusal&, Query& q) { q.kind = QueryKind::kRegion, spoil(q, true, true, true, true, true, false); }},
  };
  for (const auto& [words, change] : good) {
    const std::string& name = words;
    CAPTURE(name);
    Refusal taken;
    change(taken, taken.queries[1]);
    CHECK(taken.run() == Status::kOk);
    CHECK(taken.job.bad_query == 99);
    CHECK(std::all_of(taken.found.begin(), taken.found.end(), [](std::uint8_t c) { return c <= 1; }));
  }
}

TEST_CASE("queries: every other input that is bad is refused by its status, and nothing is written") {
  const double nowhere[3] = {std::nan(""), 0, 0};
  using Change = std::function<void(Refusal&, QueryJob&)>;
  const auto of_input = [](const std::function<void(Refusal&, BatchInput&)>& change) -> Change {
    return [=](Refusal& r, QueryJob& job) {
      change(r, r.inputs[0]);
      job.inputs = r.inputs;
    };
  };
  const std::vector<std::pair<Status, Change>> cases = {
      {Status::kUnknownBatch, of_input([](Refusal&, BatchInput& in) { in.batch = {77}; })},
      {Status::kUnknownBatch,
       [](Refusal&, QueryJob& job) {
         job.inputs = {nullptr, 1};
       }},
      {Status::kBadBatchKind, of_input([](Refusal& r, BatchInput& in) { in.batch = r.sequence; })},
      {Status::kBatchGivenTwice,
       [](Refusal& r, QueryJob& job) {
         r.inputs.push_back(r.inputs[0]);
         job.inputs = r.inputs;
       }},
      {Status::kStaticInput, of_input([](Refusal& r, BatchInput& in) { in.batch = r.level; })},  // it has poses
      {Status::kBadPoses, of_input([](Refusal&, BatchInput& in) { in.poses.data = nullptr; })},
      {Status::kBadPoses, of_input([](Refusal&, BatchInput& in) { in.poses.link_stride = 5; })},
      {Status::kBadCount, of_input([](Refusal&, BatchInput& in) { in.count = 2; })},
      {Status::kBadInstances, of_input([](Refusal& r, BatchInput& in) {
         r.instances[0] = 1;
         in.instances = {r.instances.data(), 1};
       })},
      {Status::kBadOrigins, of_input([&nowhere](Refusal&, BatchInput& in) {
         in.origins = {nowhere, 3};
       })},
      {Status::kBadOrigins, of_input([](Refusal& r, BatchInput& in) {
         in.origins = {r.origin.data(), 2};
       })},
      {Status::kBadOrientations, of_input([](Refusal& r, BatchInput& in) {
         in.orientations = {r.orientation.data(), 3};
       })},
      {Status::kBadScales, of_input([](Refusal& r, BatchInput& in) {
         in.scales = {r.scale.data(), 0}, in.scales.size = 2;
       })},
      {Status::kBadLayers, of_input([](Refusal& r, BatchInput& in) {
         in.layers = {r.layers.data(), 2};
       })},
      {Status::kExactNotBuilt, [](Refusal&, QueryJob& job) { job.exact = Exact::kFcl; }},
      {Status::kExactNotBuilt, [](Refusal&, QueryJob& job) { job.exact = static_cast<Exact>(kExactCount); }},
      {Status::kLodWithoutShapes,
       [](Refusal& r, QueryJob& job) {
         r.inputs[0].batch = r.node_batch;
         job.inputs = r.inputs;
         job.exact = Exact::kConvex;
       }},
      {Status::kBadHitBuffer, [](Refusal&, QueryJob& job) { job.hits.data = nullptr; }},
      {Status::kBadHitBuffer, [](Refusal& r, QueryJob& job) { job.links = r.links; }},
      {Status::kBadHitBuffer,
       [](Refusal&, QueryJob& job) {
         job.hits = {};
         job.links = {nullptr, 1};
       }},
      {Status::kBadOutput,
       [](Refusal& r, QueryJob& job) {
         job.counts = {r.counts.data(), 2};
       }},
      {Status::kBadOutput,
       [](Refusal&, QueryJob& job) {
         job.counts = {nullptr, 3};
       }},
      {Status::kBadOutput, [](Refusal&, QueryJob& job) { job.found.size = 2; }},
      {Status::kBadOutput,
       [](Refusal& r, QueryJob& job) {
         r.found.push_back(0xee);
         job.found = r.found;
       }},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CAPTURE(i);
    CAPTURE(to_string(cases[i].first));
    Refusal refusal;
    CHECK(refusal.run([&](QueryJob& job) { cases[i].second(refusal, job); }) == cases[i].first);
    CHECK(refusal.is_untouched());
  }
  Refusal no_room(0);
  CHECK(no_room.run() == Status::kNoQueryMemory);
  CHECK(no_room.is_untouched());

  // While a frame runs, the engine is busy.
  Refusal busy;
  FrameJob frame;
  require(begin_frame(*busy.engine, frame));
  CHECK(busy.run() == Status::kBusy);
  CHECK(busy.is_untouched());
  (void)end_frame(*busy.engine);
  CHECK(busy.run() == Status::kOk);
}

TEST_CASE("queries: an instance is left out by an id of this engine's batches alone, and not of one that was removed") {
  Refusal refusal;
  const EnginePtr other = make_engine();
  const BatchId old = refusal.inputs[0].batch;
  const auto ignoring = [&](BatchId id) {
    refusal.queries[1].ignored_batch = id;
    return refusal.run();
  };
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const BatchId foreign = add_instances(*other, add_rig(*other, rig), 1);
  CHECK(slot_of(foreign).value == slot_of(old).value);
  for (const BatchId bad :
       {foreign, BatchId{12345}, BatchId{std::uint64_t{1} << 32}, BatchId{old.value ^ 1ull << 40}}) {
    CHECK(ignoring(bad) == Status::kUnknownBatch);
    CHECK(refusal.is_untouched(1));
  }
  // A batch in the slot of one that was removed: its instance 0 is hit, and not left out by the old id.
  BatchInfo info;
  require(batch_info(*refusal.engine, old, &info));
  require(remove_batch(*refusal.engine, old));
  const BatchId next = add_instances(*refusal.engine, info.articulation, 1);
  REQUIRE(slot_of(next).value == slot_of(old).value);
  refusal.inputs[0].batch = next;
  CHECK(ignoring(old) == Status::kUnknownBatch);
  CHECK(refusal.is_untouched(1));
  for (const BatchId good : {BatchId{}, next, BatchId{slot_of(next).value}}) {
    CHECK(ignoring(good) == Status::kOk);
    CHECK(refusal.found[1] == (good.value == 0));
  }
}

TEST_CASE("queries: an index that could not be made is not used by the next call") {
  // Invents a task in one call, after it has run all that there are.
  struct Fickle {
    int calls_left = -1;
    static void parallel_for(void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t),
                             void* context) {
      for (std::uint32_t t = 0; t < count; ++t) task(context, t, 0);
      if (static_cast<Fickle*>(user)->calls_left-- == 0) task(context, count, 0);
    }
  } fickle;
  const Scheduler scheduler = {&fickle, 1, Fickle::parallel_for};
  EngineDesc desc;
  desc.scheduler = &scheduler;
  const EnginePtr engine = make_engine(desc);
  constexpr std::uint32_t kMany = 600;  // more than the calling thread works on alone
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), kMany);
  ReserveDesc room;
  room.queries = 4;
  require(reserve(*engine, room));
  Poses poses;
  poses.link_count = 1;
  poses.instance_count = kMany;
  for (std::uint32_t i = 0; i < kMany; ++i) {
    poses.data.insert(poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    poses.origins.insert(poses.origins.end(), {5.0 * i, 0, 0});
  }
  Poses elsewhere = poses;
  for (double& at : elsewhere.origins) at += 1e4;
  elsewhere.origins[0] = -1e7;  // other nodes, in the scale of the index too
  const BatchInput input = poses.input(batch), other = elsewhere.input(batch);
  FrameJob frame;
  frame.inputs = {&input, 1};
  require(run_frame(*engine, frame));
  Query query;
  query.position[2] = -9;
  query.position[0] = 5 * 500;
  query.direction[2] = 1;
  query.length = 100;
  const auto ask_of = [&](const BatchInput& one, bool reuse_bounds, std::uint8_t& found) {
    QueryHit hit;
    QueryJob job;
    job.inputs = {&one, 1};
    job.queries = {&query, 1};
    job.reuse_bounds = reuse_bounds;
    job.found = {&found, 1};
    job.hits = {&hit, 1};
    return run_queries(*engine, job);
  };
  for (int call = 0; call < 3; ++call) {
    CAPTURE(call);
    std::uint8_t found = 0xee;
    CHECK(ask_of(input, true, found) == Status::kOk);
    CHECK(found == 1);
    fickle.calls_left = call;
    const Status status = ask_of(other, false, found);
    CHECK((status == Status::kBadTask) == (fickle.calls_left < 0));
    fickle.calls_left = -1;
    CHECK(ask_of(input, true, found) == Status::kOk);
    CHECK(found == 1);

    // The same for an index of a frame, in the place of one that holds others.
    require(run_frame(*engine, frame));
    CHECK(ask_of(other, false, found) == Status::kOk);
    fickle.calls_left = call;
    const Status of_frame = ask_of(input, true, found);
    CHECK((of_frame == Status::kBadTask) == (fickle.calls_left < 0));
    fickle.calls_left = -1;
    CHECK(ask_of(input, true, found) == Status::kOk);
    CHECK(found == 1);
  }
}

TEST_CASE("queries: too little room for hits is answered by how much there must be, and the rest is complete") {
  Refusal refusal;
  refusal.inputs.push_back(refusal.input_of(refusal.node_batch));
  BatchInput level;
  level.batch = refusal.level;
  refusal.inputs.push_back(level);
  for (Query& query : refusal.queries) query.want = QueryWant::kAll;
  CHECK(refusal.run([](QueryJob& job) { job.hits.size = 8; }) == Status::kHitsOverflow);
  CHECK(refusal.job.hit_count == 0);
  CHECK(refusal.job.hits_needed == 9);
  CHECK(refusal.found == std::vector<std::uint8_t>(3, 1));
  refusal.hits.resize(9);
  CHECK(refusal.run() == Status::kOk);
  CHECK(refusal.job.hit_count == 9);
  CHECK(refusal.job.hits_needed == 9);
  CHECK(refusal.hits[0].distance == doctest::Approx(7.5).epsilon(1e-5));
  CHECK(refusal.run([](QueryJob& job) { job.hits = {}; }) == Status::kHitsOverflow);
  CHECK(refusal.job.hits_needed == 9);
}

}  // namespace cab::tests
