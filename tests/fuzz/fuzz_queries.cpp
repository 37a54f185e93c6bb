// Turns bytes into a small world and queries of any bits. A job with a query that is not valid is refused, and nothing
// is written. Else all instruction sets answer the same bits, however queries are divided among calls and however few
// hits there is room for, and a judge finds no fault of boxes where numbers are moderate.
#include "perf/harness/world.h"
#include "perf/judge/oracle/query_judge.h"
#include "tests/fuzz/bytes.h"

#include <cstddef>

namespace {

using namespace cab;
using namespace cab::oracle;

// What the judge takes: not so far, so large or so small that it would need more digits, or minutes.
constexpr double kModerate = 1e6;
constexpr float kLeastSize = 1e-6f;

World world_of(fuzz::Bytes& bytes) {
  World world;
  const std::uint32_t counts[] = {1, 2, 3, 17};
  for (std::uint32_t m = bytes.below(3) + 1; m > 0; --m) {
    Member member;
    member.rig = bytes.rig(4);
    const std::uint32_t count = counts[bytes.below(m == 1 ? 4 : 3)];
    member.poses = bytes.poses(member.rig.link_count(), count);
    if (bytes.below(4) == 0)
      for (std::uint32_t i = 0; i < count; ++i) member.layers.push_back(bytes.raw<std::uint32_t>());
    world.members.push_back(std::move(member));
  }
  return world;
}

// A length that is mostly valid.
float length_of(fuzz::Bytes& bytes) { return bytes.rarely() ? bytes.raw<float>() : std::fabs(bytes.number()); }

double coordinate(fuzz::Bytes& bytes) {
  return bytes.rarely() ? bytes.raw<double>() : static_cast<double>(bytes.number());
}

// The most queries of an input. More than 64 make an index that is sorted.
constexpr std::size_t kMostQueries = 80;

struct Asked {
  std::vector<Query> queries;
  std::vector<QueryPlane> planes;
  Exact exact;
};

// batches: how many there are.
Asked asked_of(fuzz::Bytes& bytes, std::uint32_t batches) {
  Asked out;
  out.exact = bytes.below(2) == 0 ? Exact::kNone : Exact::kConvex;
  for (std::uint32_t left = bytes.below(6); left > 0; --left) {
    QueryPlane plane;
    for (float& c : plane.normal) c = bytes.number();
    plane.offset = bytes.number();
    out.planes.push_back(plane);
  }
  const std::uint32_t times = bytes.rarely() ? 9 : 1;
  while (!bytes.empty() && out.queries.size() * times < kMostQueries) {
    Query query;
    query.kind = static_cast<QueryKind>(bytes.rarely() ? bytes.raw<std::uint8_t>() : bytes.below(kQueryKindCount));
    query.want = static_cast<QueryWant>(bytes.rarely() ? bytes.raw<std::uint8_t>() : bytes.below(kQueryWantCount));
    query.with_depth = bytes.below(2) == 1;
    query.max_hits = bytes.below(3) == 0 ? bytes.raw<std::uint8_t>() : ~0u;
    query.layer_mask = bytes.below(4) == 0 ? bytes.raw<std::uint32_t>() : ~0u;
    query.ignored_batch = {bytes.rarely() ? bytes.raw<std::uint64_t>() : bytes.below(batches + 1)};
    query.ignored_instance = bytes.below(4);
    for (double& c : query.position) c = coordinate(bytes);
    for (float& c : query.direction) c = bytes.number();
    query.length = length_of(bytes);
    query.radius = length_of(bytes);
    for (float& c : query.half) c = length_of(bytes);
    for (float& c : query.orientation) c = bytes.number();
    if (!out.planes.empty()) {
      query.first_plane = bytes.below(static_cast<std::uint32_t>(out.planes.size()));
      query.plane_count = bytes.below(static_cast<std::uint32_t>(out.planes.size() - query.first_plane) + 1);
    }
    if (bytes.rarely()) query.first_plane = bytes.raw<std::uint32_t>();
    if (bytes.rarely()) query.plane_count = bytes.raw<std::uint32_t>();
    out.queries.push_back(query);
  }
  const std::size_t once = out.queries.size();
  for (std::uint32_t time = 1; time < times; ++time)
    for (std::size_t q = 0; q < once; ++q) out.queries.push_back(out.queries[q]);
  return out;
}

// ---------------------------------------------------------------------------------------------------------- calls

struct Answer {
  Status status = Status::kOk;
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  QueryJob job;  // as the call left it; its spans are of the caller
};

constexpr std::uint8_t kUntouched = 0xee;

std::vector<BatchInput> inputs_of(const World& world) {
  std::vector<BatchInput> out;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    out.push_back(world.members[m].poses.input({m + 1}));
    out.back().layers = world.members[m].layers;
  }
  return out;
}

Answer ask(Engine& engine, const World& world, const Asked& asked, Span<const Query> queries, std::size_t room) {
  const std::vector<BatchInput> inputs = inputs_of(world);
  Answer out;
  out.hits.resize(room);
  if (room > 0) std::memset(static_cast<void*>(out.hits.data()), kUntouched, room * sizeof(QueryHit));
  out.found.assign(queries.size, kUntouched);
  QueryJob& job = out.job;
  job.inputs = inputs;
  job.queries = queries;
  job.planes = asked.planes;
  job.exact = asked.exact;
  job.hits = out.hits;
  job.found = out.found;
  job.hit_count = job.hits_needed = job.bad_query = 12345;
  out.status = run_queries(engine, job);
  return out;
}

// Whether a status is about one query: all inputs are of batches that are there.
bool names_query(Status status) { return status == Status::kBadQuery || status == Status::kUnknownBatch; }

// A refused job is as it was.
void check_refusal(const Answer& refused) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(refused.hits.data());
  const auto is_untouched = [](std::uint8_t byte) { return byte == kUntouched; };
  FUZZ_CHECK(std::all_of(bytes, bytes + refused.hits.size() * sizeof(QueryHit), is_untouched));
  FUZZ_CHECK(std::all_of(refused.found.begin(), refused.found.end(), is_untouched));
  FUZZ_CHECK(refused.job.hit_count == 12345 && refused.job.hits_needed == 12345);
  FUZZ_CHECK(names_query(refused.status) == (refused.job.bad_query != 12345));
}

// With room for all hits.
Answer ask_all(Engine& engine, const World& world, const Asked& asked, Span<const Query> queries) {
  Answer out = ask(engine, world, asked, queries, 64);
  if (out.status != Status::kHitsOverflow) return out;
  FUZZ_CHECK(out.job.hit_count == 0 && out.job.hits_needed > 64);
  const std::vector<std::uint8_t> found = out.found;
  const std::size_t needed = out.job.hits_needed;
  out = ask(engine, world, asked, queries, needed);
  FUZZ_CHECK(out.status == Status::kOk && out.job.hit_count == needed && out.found == found);
  return out;
}

bool same(const QueryHit& a, const QueryHit& b) {
  return std::memcmp(&a.batch, &b.batch, offsetof(QueryHit, inside) - offsetof(QueryHit, batch)) == 0 &&
         a.inside == b.inside;
}

void check_same(const Answer& a, const Answer& b) {
  FUZZ_CHECK(a.status == b.status && a.found == b.found && a.job.hit_count == b.job.hit_count);
  if (a.status != Status::kOk) return;
  FUZZ_CHECK(a.job.stats.nodes == b.job.stats.nodes && a.job.stats.leaf_tests == b.job.stats.leaf_tests);
  for (std::size_t h = 0; h < a.job.hit_count; ++h)
    FUZZ_CHECK(a.hits[h].query == b.hits[h].query && same(a.hits[h], b.hits[h]));
}

// Every query alone is answered as among the others.
void check_alone(Engine& engine, const World& world, const Asked& asked, const Answer& all) {
  std::size_t at = 0;
  for (std::size_t q = 0; q < asked.queries.size(); ++q) {
    const Answer alone = ask_all(engine, world, asked, {&asked.queries[q], 1});
    FUZZ_CHECK(alone.status == Status::kOk && alone.found[0] == all.found[q]);
    for (std::size_t h = 0; h < alone.job.hit_count; ++h, ++at)
      FUZZ_CHECK(at < all.job.hit_count && all.hits[at].query == q && same(all.hits[at], alone.hits[h]));
  }
  FUZZ_CHECK(at == all.job.hit_count);
}

// ---------------------------------------------------------------------------------------------------------- judge

bool is_moderate(float v) {
  return v == 0 || (std::fabs(v) >= kLeastSize && std::fabs(v) <= static_cast<float>(kModerate));
}

bool is_moderate(const World& world) {
  for (const Member& member : world.members) {
    for (const Leaf& leaf : member.rig.leaves)
      for (int c = 0; c < 3; ++c)
        if (!is_moderate(leaf.box.center[c]) || !is_moderate(leaf.box.half[c])) return false;
    for (const float v : member.poses.data)
      if (!is_moderate(v)) return false;
    for (const double v : member.poses.origins)
      if (!(std::fabs(v) <= kModerate)) return false;
  }
  return true;
}

bool is_moderate(const Query& query) {
  for (const double v : query.position)
    if (!(std::fabs(v) <= kModerate)) return false;
  for (const float v : {query.length, query.radius, query.half[0], query.half[1], query.half[2]})
    if (!is_moderate(v) && v != std::numeric_limits<float>::infinity()) return false;
  return true;
}

void check_by_judge(const World& world, const Asked& asked, const Answer& answer) {
  if (!is_moderate(world) ||
      !std::all_of(asked.queries.begin(), asked.queries.end(), [](const Query& query) { return is_moderate(query); }))
    return;
  for (const QueryPlane& plane : asked.planes)
    for (const float v : {plane.normal[0], plane.normal[1], plane.normal[2], plane.offset})
      if (!is_moderate(v)) return;
  QueryScene scene;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    const Member& member = world.members[m];
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      scene.push_back(
          query_instance({m + 1}, member.rig, member.poses, i, member.layers.empty() ? ~0u : member.layers[i]));
  }
  QueryJob job = answer.job;
  job.hits = {const_cast<QueryHit*>(answer.hits.data()), answer.hits.size()};
  job.found = {const_cast<std::uint8_t*>(answer.found.data()), answer.found.size()};
  const std::string fault = fault_of(scene, job);
  if (!fault.empty()) std::fprintf(stderr, "%s\n", fault.c_str());
  FUZZ_CHECK(fault.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const World world = world_of(bytes);
  const std::uint32_t room = 1 + bytes.below(40);
  const Asked asked = asked_of(bytes, static_cast<std::uint32_t>(world.members.size()));
  const auto make = [&](Isa isa) {
    EnginePtr engine = make_engine_for(world, {isa});
    require(reserve(*engine, {0, 0, room}));
    return engine;
  };
  EnginePtr scalar;
  try {
    scalar = make(Isa::kScalar);
  } catch (const std::runtime_error&) { return 0; }  // refused by a status
  const Span<const Query> queries = asked.queries;
  const Answer first = ask_all(*scalar, world, asked, queries);
  for (const Isa isa : available_isas()) {
    if (isa == Isa::kScalar) continue;
    const EnginePtr engine = make(isa);
    check_same(ask_all(*engine, world, asked, queries), first);
  }
  if (first.status != Status::kOk) {
    check_refusal(first);
    // The first query at fault is named: those before it are answered.
    if (names_query(first.status)) {
      FUZZ_CHECK(first.job.bad_query < queries.size);
      FUZZ_CHECK(ask_all(*scalar, world, asked, {queries.data, first.job.bad_query}).status == Status::kOk);
      const Answer bad = ask(*scalar, world, asked, {queries.data + first.job.bad_query, 1}, 8);
      FUZZ_CHECK(bad.status == first.status && bad.job.bad_query == 0);
    }
    return 0;
  }
  FUZZ_CHECK(std::all_of(first.found.begin(), first.found.end(), [](std::uint8_t byte) { return byte <= 1; }));
  check_alone(*scalar, world, asked, first);
  // Shapes are judged by cab verify, at more length than a fuzzer has.
  if (first.job.exact == Exact::kNone && first.job.stats.instances_masked == 0) check_by_judge(world, asked, first);
  return 0;
}
