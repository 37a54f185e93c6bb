// A random world of characters with queries, for the verification of queries.
#include "perf/judge/verify/query_world.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "perf/base/report.h"
#include "perf/harness/random_world.h"

namespace cab::perf {
namespace {

constexpr unsigned kMostLinks = 12;
constexpr std::uint32_t kMostInstances = 12;

// How many queries the engine answers in one chunk: there are several chunks.
constexpr std::uint32_t kQueriesPerChunk = 48;

// Whether two calls have answered the same bits.
bool same_answers(const QueryAnswer& a, const QueryAnswer& b) {
  static_assert(offsetof(QueryHit, inside) == 44, "no padding to compare before the last member");
  const auto same = [](const QueryHit& x, const QueryHit& y) {
    return std::memcmp(&x, &y, offsetof(QueryHit, inside)) == 0 && x.inside == y.inside;
  };
  return a.found == b.found && std::equal(a.hits.data(), a.hits.data() + a.job.hit_count, b.hits.data(),
                                          b.hits.data() + b.job.hit_count, same);
}

}  // namespace

QueryWorld::QueryWorld(oracle::Random& random, bool with_shapes) {
  const bool far = random.chance(0.3);
  const double away = far ? random.log_uniform(1e3, 1e9) : 0;
  const oracle::Vec3<double> about_point = away * random.unit_vector();
  const double factor = random.chance(0.2) ? random.log_uniform(1e-20, 1e14) : 1;
  const double spread = random.uniform(0.3, 4);
  for (std::uint32_t left = 1 + random.index(3); left > 0; --left) {
    oracle::Member& member = world.members.emplace_back();
    member.rig = oracle::any_rig(random, kMostLinks);
    if (random.chance(0.3)) oracle::flatten_leaves(random, member.rig);
    const std::uint32_t count = 1 + random.index(kMostInstances);
    const auto format = static_cast<PoseFormat>(random.index(3));
    member.poses = oracle::random_poses(random, member.rig, count, format,
                                        oracle::any_pose_range(random, far, about_point, spread));
    if (random.chance(0.3)) oracle::mirror_links(random, member.poses);
    oracle::resize(factor, member.rig, member.poses);
    if (with_shapes) oracle::add_parts(random, member.rig, kept);
    if (random.chance(0.3))
      for (std::uint32_t i = 0; i < count; ++i)
        member.poses.scales.push_back(static_cast<float>(random.log_uniform(0.01, 100)));
    if (random.chance(0.4))
      for (std::uint32_t i = 0; i < count; ++i) member.layers.push_back(1u << random.index(4));
    const auto batch = static_cast<std::uint32_t>(world.members.size());
    for (std::uint32_t i = 0; i < count; ++i)
      scene.push_back(
          oracle::query_instance({batch}, member.rig, member.poses, i, member.layers.empty() ? ~0u : member.layers[i]));
  }
}

Span<const QueryHit> QueryAnswer::hits_of(std::size_t query, std::size_t& begin) const {
  std::size_t end = begin;
  while (end < job.hit_count && hits[end].query == query) ++end;
  const Span<const QueryHit> out = {hits.data() + begin, end - begin};
  begin = end;
  return out;
}

void ask_queries(const Task& task, Isa isa, const QueryWorld& made, Exact exact, QueryAnswer& out) {
  const oracle::EnginePtr engine = oracle::make_engine_for(made.world, {.isa = isa});
  ReserveDesc room;
  room.queries = kQueriesPerChunk;
  oracle::require(reserve(*engine, room));
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < made.world.members.size(); ++m) {
    const oracle::Member& member = made.world.members[m];
    inputs.push_back(member.poses.input({m + 1}));
    inputs.back().layers = member.layers;
  }
  QueryJob& job = out.job;
  job.inputs = inputs;
  job.queries = made.about.queries;
  job.planes = made.about.planes;
  job.exact = exact;
  out.hits.resize(4 * job.queries.size);
  out.found.assign(job.queries.size, 0);
  job.found = out.found;
  Status status = Status::kHitsOverflow;
  for (int attempt = 0; attempt < 2 && status == Status::kHitsOverflow; ++attempt) {
    if (attempt > 0) out.hits.resize(job.hits_needed);
    job.hits = out.hits;
    status = task.subject->run_queries(*engine, job);
  }
  oracle::require(status);
  job.inputs = {};
}

void compare_isas(Task& task, std::size_t method, const QueryWorld& made, Exact exact, const QueryAnswer& answer) {
  const Isa isa = task.subject->kernels->isa;
  for (const Isa other : oracle::available_isas()) {
    if (other == isa) continue;
    QueryAnswer others;
    ask_queries(task, other, made, exact, others);
    if (same_answers(answer, others)) continue;
    ++task.tallies[method].differing;
    task.violation(method, std::string(to_string(other)) + " answers otherwise than " + to_string(isa));
  }
}

std::string to_text(const Query& query) {
  static constexpr const char* kKinds[] = {"ray", "sphere", "box", "capsule", "point", "region"};
  static constexpr const char* kWants[] = {"any", "closest", "all"};
  const auto list = [](const auto* values, std::size_t count) {
    std::string out;
    for (std::size_t i = 0; i < count; ++i) out += (i == 0 ? "(" : " ") + shortest(values[i]);
    return out + ")";
  };
  std::string out = std::string(kKinds[static_cast<std::size_t>(query.kind)]) + ", wants " +
                    kWants[static_cast<std::size_t>(query.want)];
  if (query.want == QueryWant::kAll) out += " up to " + std::to_string(query.max_hits);
  if (query.with_depth) out += ", with depth";
  out += ", position " + list(query.position, 3) + " direction " + list(query.direction, 3) + " length " +
         shortest(query.length) + " radius " + shortest(query.radius) + " half " + list(query.half, 3) +
         " orientation " + list(query.orientation, 4) + ", " + std::to_string(query.plane_count) + " planes";
  return out;
}

}  // namespace cab::perf
