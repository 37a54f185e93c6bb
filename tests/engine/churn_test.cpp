// One engine whose batches come and go for as many frames as it is asked for: in every round it has the same worlds, so
// it must have the same answers, bit for bit, and on one thread the same memory after each round.
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/random_queries.h"
#include "perf/judge/oracle/random_skins.h"
#include "tests/engine/counted_memory.h"
#include "tests/engine/counted_new.h"
#include "tests/rounds.h"

#include <cab/query.h>

#include <doctest/doctest.h>

#include <map>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kWorlds = 10, kFrames = 5;

// A world, and what frames and queries of it are about. Frame f has the poses of each member at f.
struct Churned {
  World world;
  KeptParts parts;
  std::vector<std::vector<Poses>> at;
  SkinRig skin;
  Poses skin_poses;
  std::vector<StaticBody> bodies;
  std::vector<float> vertices;
  std::vector<std::uint32_t> triangles;
  RandomQueries queries;
  std::vector<Policies> policies;
};

Churned make_churned(Random& random) {
  Churned out;
  add_characters(random, out.world, 8);
  PoseRange range;
  range.spread = 2;
  range.origins = true;
  for (Member& member : out.world.members) {
    add_parts(random, member.rig, out.parts);
    const std::uint32_t count = member.poses.instance_count;
    out.at.emplace_back();
    for (std::uint32_t f = 0; f <= kFrames; ++f)
      out.at.back().push_back(random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation, range));
    member.poses = out.at.back()[0];
  }
  if (random.chance(0.5)) add_layers(random, out.world);
  if (random.chance(0.5)) out.world.margin = static_cast<float>(random.log_uniform(1e-3, 0.3));
  out.skin = random_skin(random, static_cast<SkinRegime>(random.index(kSkinRegimeCount)));
  out.skin_poses = random_skin_poses(random, out.skin, 3, PoseFormat::kQuaternionTranslation, 1, 0.1, 2);
  for (int i = 0; i < 10; ++i) {
    StaticBody body;
    body.box = random_box(random, 0.1 * random.unit_vector(), 0.1, 0.5);
    for (double& at : body.origin) at = random.uniform(-2, 2);
    out.bodies.push_back(body);
  }
  for (int i = 0; i < 9; ++i)
    for (int c = 0; c < 3; ++c) out.vertices.push_back(static_cast<float>(random.uniform(-2, 2)));
  out.triangles = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  QueryScene scene;
  for (std::uint32_t m = 0; m < out.world.members.size(); ++m)
    for (std::uint32_t i = 0; i < out.world.members[m].poses.instance_count; ++i)
      scene.push_back(query_instance({m + 1}, out.world.members[m].rig, out.at[m][0], i));
  add_queries(random, scene, 20, out.queries);
  for (Query& query : out.queries.queries) {
    query.ignored_batch = {};
    if (random.chance(0.5)) query.time = random.uniform(0, kFrames);
  }
  for (std::uint32_t f = 0; f < kFrames; ++f) {
    Policies policies;
    for (std::uint32_t field = 0; field < policy_table().size; ++field)
      policy_set(policies, field, policy_table()[field].values[random.index(policy_table()[field].value_count)].name);
    if (policies.exact == Exact::kFcl) policies.exact = Exact::kSurface;
    out.policies.push_back(policies);
  }
  return out;
}

// What an engine answered: a hash of all bits, with batches by their order in the world.
struct Answers {
  std::uint64_t hash = 0xcbf29ce484222325, hits = 0, refused = 0;
  void take(const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3;
  }
  template <class T>
  void take(T value) {
    take(&value, sizeof value);
  }
};

// Adds a world to an engine, runs its frames and queries, and removes it.
void run_churned(Engine& engine, const Churned& one, Answers& out) {
  std::vector<ArticulationId> articulations;
  std::vector<BatchId> batches;
  std::map<std::uint32_t, std::uint32_t> order;  // by slot
  const auto keep = [&](BatchId id) {
    order[slot_of(id).value] = static_cast<std::uint32_t>(batches.size());
    batches.push_back(id);
    return id;
  };
  const auto members = static_cast<std::uint32_t>(one.world.members.size());
  std::vector<HistoryId> histories;
  for (const Member& member : one.world.members) {
    articulations.push_back(add_rig(engine, member.rig));
    HistoryDesc ring;
    ring.batch = keep(add_instances(engine, articulations.back(), member.poses.instance_count));
    ring.ticks = 3;
    require(add_history(engine, ring, &histories.emplace_back()));
  }
  LodDesc level;
  level.of = articulations[0];
  level.rest_poses = one.at[0][0].input({}).poses;
  level.max_leaves = 2;
  ArticulationId coarse;
  require(add_lod(engine, level, &coarse));
  const BatchId at_level = keep(add_instances(engine, coarse, one.world.members[0].poses.instance_count));
  ArticulationId skin;
  require(add_articulation(engine, one.skin.desc(), &skin));
  const BatchId skins = keep(add_instances(engine, skin, one.skin_poses.instance_count));
  StaticDesc statics;
  statics.bodies = one.bodies;
  statics.vertices = one.vertices;
  statics.triangles = one.triangles;
  BatchId ground;
  require(add_static_batch(engine, statics, &ground));
  keep(ground);

  ReserveDesc room;
  room.queries = static_cast<std::uint32_t>(one.queries.queries.size());
  require(reserve(engine, room));

  const std::vector<std::uint8_t> none_moved(one.skin_poses.instance_count);
  std::vector<PairRule> rules;
  for (const PairRule& rule : one.world.rules)
    rules.push_back({batches[rule.a.value - 1], batches[rule.b.value - 1], rule.pairing});
  rules.push_back({batches[0], ground, Pairing::kBetween});
  rules.push_back({at_level, batches[members - 1], Pairing::kBetween});
  rules.push_back({skins, batches[0], Pairing::kBetween});
  rules.push_back({skins, skins, Pairing::kBetween});
  std::vector<BatchInput> last;
  for (std::uint32_t f = 0; f < kFrames; ++f) {
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < members; ++m) {
      inputs.push_back(one.at[m][f].input(batches[m]));
      inputs.back().layers = one.world.members[m].layers;
      inputs.back().layer_masks = one.world.members[m].layer_masks;
      require(record_tick(engine, histories[m], inputs.back(), f));
    }
    inputs.push_back(one.at[0][f].input(at_level));
    BatchInput of_ground;
    of_ground.batch = ground;
    inputs.push_back(of_ground);
    const bool takes_skins = one.policies[f].exact == Exact::kNone || one.policies[f].exact == Exact::kSurface;
    if (takes_skins) inputs.push_back(one.skin_poses.input(skins));
    if (takes_skins && f > 0) inputs.back().moved = none_moved;
    FrameJob job;
    job.inputs = inputs;
    job.rules = {rules.data(), rules.size() - (takes_skins ? 0 : 2)};
    job.policies = one.policies[f];
    job.margin = one.world.margin;
    // First what is refused.
    FrameJob bad = job;
    bad.margin = -1;
    out.refused += run_frame(engine, bad) != Status::kOk;
    std::vector<Hit> hits;
    Status status = run_frame(engine, job);
    if (status == Status::kHitsOverflow) {
      hits.resize(job.hits_needed);
      job.hits = hits;
      status = run_frame(engine, job);
    }
    require(status);
    hits.resize(job.hit_count);
    out.hits += hits.size();
    for (const Hit& hit : hits) {
      out.take(order.at(hit.batch_a.value));
      out.take(order.at(hit.batch_b.value));
      const std::uint32_t rest[] = {hit.instance_a, hit.instance_b, hit.link_a, hit.link_b, hit.leaf_a, hit.leaf_b};
      out.take(rest, sizeof rest);
    }
    std::vector<Hit> of_members;
    for (const Hit& hit : hits)
      if (order[hit.batch_a.value] < members && order[hit.batch_b.value] < members) of_members.push_back(hit);
    std::vector<Contact> contacts(of_members.size());
    const Span<const BatchInput> at_now = {inputs.data(), members};
    require(compute_contacts(engine, at_now, of_members, contacts));
    for (const Contact& contact : contacts) out.take(&contact.depth, sizeof contact.depth);
    if (!last.empty()) {
      std::vector<float> moments(of_members.size());
      require(find_touching_moments(engine, last, at_now, 1e-3f, of_members, moments));
      out.take(moments.data(), moments.size() * sizeof(float));
    }
    last.assign(inputs.begin(), inputs.begin() + members);

    QueryJob ask;
    ask.inputs = at_now;
    ask.histories = histories;
    ask.queries = one.queries.queries;
    ask.planes = one.queries.planes;
    ask.exact = f % 2 ? Exact::kConvex : Exact::kNone;
    std::vector<QueryHit> met;
    status = run_queries(engine, ask);
    if (status == Status::kHitsOverflow) {
      met.resize(ask.hits_needed);
      ask.hits = met;
      status = run_queries(engine, ask);
    }
    require(status);
    out.hits += ask.hit_count;
    for (std::size_t i = 0; i < ask.hit_count; ++i) {
      out.take(order.at(met[i].batch.value));
      out.take(met[i].instance);
      out.take(&met[i].distance, sizeof met[i].distance);
    }
  }
  for (const HistoryId id : histories) require(remove_history(engine, id));
  for (const BatchId id : batches) require(remove_batch(engine, id));
  out.refused += remove_batch(engine, batches[0]) != Status::kOk;
  require(remove_articulation(engine, coarse));
  require(remove_articulation(engine, skin));
  for (const ArticulationId id : articulations) require(remove_articulation(engine, id));
}

}  // namespace

TEST_CASE("an engine through which worlds come and go has the answers of new ones, and in the end as much memory") {
  Random random(2040);
  std::vector<Churned> worlds;
  for (std::uint32_t w = 0; w < kWorlds; ++w) worlds.push_back(make_churned(random));
  std::vector<std::uint64_t> expected;
  for (const Churned& one : worlds) {
    Answers answers;
    run_churned(*make_engine(), one, answers);
    CHECK(answers.refused == kFrames + 1);
    CHECK(answers.hits > 0);
    expected.push_back(answers.hash);
  }
  for (const std::uint32_t threads : {1u, 2u}) {
    CAPTURE(threads);
    CountedMemory memory;
    EngineDesc desc;
    desc.thread_count = threads;
    const Allocator allocator = memory.allocator();
    desc.allocator = &allocator;
    const EnginePtr engine = make_engine(desc);
    std::size_t first = 0, other = 0, differing = 0, kept = 0;
    std::int64_t held = 0;
    // The first round makes room for all that the worlds need.
    const std::uint64_t count = 1 + rounds(4);
    for (std::uint64_t round = 0; round < count; ++round) {
      for (std::uint32_t w = 0; w < kWorlds; ++w) {
        Answers answers;
        run_churned(*engine, worlds[w], answers);
        differing += answers.hash != expected[w];
        EngineMemory of;
        require(engine_memory(*engine, &of));
        kept += of.articulations + of.batches;
      }
      if (round == 0) first = memory.bytes, held = news_held;
      other += memory.bytes != first || news_held != held;
    }
    const std::uint64_t frames = count * kWorlds * kFrames;
    MESSAGE(frames << " frames on " << threads << " threads: " << first << " bytes after the first round, "
                   << memory.bytes << " at the end, " << memory.most << " at most");
    CHECK(differing == 0);
    CHECK(kept == 0);
    if (threads == 1) CHECK(other == 0);  // else it depends on which worker took which task
  }
}

}  // namespace cab::tests
