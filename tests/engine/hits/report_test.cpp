// The caller's hit buffer: sorted, exact counts, and what happens when it is too small.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "tests/engine/small_store.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// A job over a whole world, and the storage it points to.
struct Prepared {
  std::vector<BatchInput> inputs;
  std::vector<Hit> hits;
  FrameJob job;

  Prepared(const World& world, std::size_t capacity) : hits(capacity) {
    for (std::uint32_t m = 0; m < world.members.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    job.inputs = inputs;
    job.rules = world.rules;
    job.hits = hits;
  }
};

World crowded_world(std::uint64_t seed) {
  Random random(seed);
  World world;
  add_characters(random, world, 12);
  add_frames(random, world, 12);
  return world;
}

// A caller's scheduler that runs on the calling thread alone: the last task first, with any worker number.
const Scheduler kBackwards = {
    nullptr, 3, [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
      for (std::uint32_t t = count; t-- > 0;) task(context, t, t % 3);
    }};

// Two batches of characters, and a batch of bodies with one link and one leaf. `spread` multiplies their origins.
World gathering(double spread) {
  Random random(21);
  World world;
  for (const std::uint32_t instances : {70u, 33u})
    world.members.push_back(any_member(random, instances, BatchKind::kCharacters, {1, true, true, {}}, 10));
  Rig body;
  body.parents = {-1};
  body.leaves = {{0, random_box(random, {}, 0.1, 0.2), {}}};
  world.members.push_back(
      {body, random_poses(random, body, 50, PoseFormat::kMatrix3x4Rows, {1, false, true, {}}), BatchKind::kCharacters});
  add_layers(random, world);
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{2}, {1}, Pairing::kBetween}, {{1}, {3}, Pairing::kBetween},
                 {{3}, {2}, Pairing::kBetween}, {{2}, {2}, Pairing::kWithin},  {{3}, {3}, Pairing::kWithin}};
  for (Member& member : world.members) {
    for (double& at : member.poses.origins) at *= spread;
    const std::size_t floats = member.poses.data.size() / member.poses.instance_count;
    std::fill_n(member.poses.data.begin(), floats, std::nanf(""));  // the first instance is masked
  }
  return world;
}

// Runs one frame of a world with a hit buffer of the given size.
struct Frame {
  std::vector<Hit> hits;
  std::vector<std::vector<std::uint8_t>> in_contact;
  FrameJob job;
  Status status;

  Frame(Engine& engine, const World& world, const Policies& policies, Report report, std::size_t capacity)
      : hits(capacity) {
    std::vector<BatchInput> inputs;
    for (const Member& member : world.members) in_contact.emplace_back(member.poses.instance_count, std::uint8_t{0xee});
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      const Member& member = world.members[m];
      inputs.push_back(member.poses.input({m + 1}));
      inputs.back().layers = member.layers;
      inputs.back().layer_masks = member.layer_masks;
      inputs.back().in_contact = in_contact[m];
    }
    job.inputs = inputs;
    job.rules = world.rules;
    job.policies = policies;
    job.report = report;
    job.hits = hits;
    status = run_frame(engine, job);
  }
};

// A box of one link at a point, identity pose.
Rig boxes_rig(std::initializer_list<Leaf> leaves, std::uint32_t links) {
  Rig rig;
  for (std::uint32_t link = 0; link < links; ++link) rig.parents.push_back(link == 0 ? -1 : 0);
  rig.leaves = leaves;
  return rig;
}

Leaf box_at(std::uint32_t link, float x) {
  return {link, {{x, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.6f, 0.6f, 0.6f}}, {}};
}

// Identity poses.
Poses still_poses(const Rig& rig, std::uint32_t instances) {
  Poses poses;
  poses.link_count = rig.link_count();
  poses.instance_count = instances;
  poses.data.resize(7 * std::size_t{instances} * poses.link_count, 0.0f);
  for (std::size_t i = 3; i < poses.data.size(); i += 7) poses.data[i] = 1;
  return poses;
}

}  // namespace

TEST_CASE("a buffer that is too small overflows with the exact count, and the retry succeeds") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    const World world = crowded_world(seed);
    const EnginePtr engine = make_engine_for(world);
    const Outcome expected = run_on(*engine, world, {});
    const std::size_t n = expected.hits.size();
    REQUIRE(n >= 2);
    for (const std::size_t capacity : {std::size_t{0}, std::size_t{1}, n / 2, n - 1}) {
      CAPTURE(capacity);
      Prepared small(world, capacity);
      CHECK(run_frame(*engine, small.job) == Status::kHitsOverflow);
      CHECK(small.job.hits_needed == n);
      CHECK(small.job.hit_count == 0);
      CHECK(same_counts(small.job.stats, expected.stats));
    }
    for (const std::size_t capacity : {n, n + 1, 2 * n}) {
      CAPTURE(capacity);
      Prepared enough(world, capacity);
      for (Hit& hit : enough.hits) hit.link_a = 0xabcd;
      REQUIRE(run_frame(*engine, enough.job) == Status::kOk);
      CHECK(enough.job.hit_count == n);
      CHECK(enough.job.hits_needed == n);
      for (std::size_t i = n; i < capacity; ++i) CHECK(enough.hits[i].link_a == 0xabcd);  // the rest is not written
      enough.hits.resize(n);
      CHECK(same_hits(enough.hits, expected.hits));
    }
  }
}

TEST_CASE(
    "crowds in one spot and thin ones in turn have the same hits, counts and in_contact, however the store grows") {
  constexpr double kInvented = 1e-4;  // as in frame_test
  const World dense = gathering(0.02), thin = gathering(3);
  std::vector<const World*> frames(40, &thin);
  for (const int at : {0, 1, 2, 9, 16, 22, 23, 39}) frames[static_cast<std::size_t>(at)] = &dense;
  ThreadPool pool(3);
  const Scheduler threads = pool.scheduler();
  EngineDesc descs[4];
  descs[1].thread_count = 2;
  descs[2].scheduler = &threads;
  descs[3].scheduler = &kBackwards;
  struct Judged {
    std::vector<Hit> touching, near, brute;
  };
  Judged judged[2];
  for (const World* world : {&dense, &thin}) {
    const auto masked = [](std::size_t, std::uint32_t i) { return i == 0; };
    judged[world == &thin] = {judge_world(*world, 0, masked), judge_world(*world, kInvented, masked),
                              run_world(*world, {Refit::kCab, Strategy::kBrute, Exact::kNone}).hits};
  }
  for (const Strategy strategy : {Strategy::kBrute, Strategy::kTree, Strategy::kRows, Strategy::kLinks}) {
    CAPTURE(static_cast<int>(strategy));
    if (strategy == Strategy::kBrute && tests::runs_fewer_rounds()) {
      MESSAGE("skipped with one in several rounds: brute takes a minute");
      continue;
    }
    const Policies policies = {Refit::kCab, strategy, Exact::kNone};
    Outcome expected[2];
    for (const World* world : {&dense, &thin}) {
      Outcome& of = expected[world == &thin];
      of = run_world(*world, policies);
      const Judged& judge = judged[world == &thin];
      CHECK(missing_from(judge.touching, of.hits) == 0);
      CHECK(missing_from(of.hits, judge.near) == 0);
      CHECK(of.in_contact == in_contact_by(*world, of.hits));
      CHECK(of.stats.instances_masked == 3);
      CHECK(same_hits(of.hits, judge.brute));
    }
    CHECK(expected[0].hits.size() > std::size_t{40} * 153);
    CHECK(expected[1].hits.size() > 50);
    CHECK(expected[1].hits.size() < std::size_t{5} * 153);
    for (const EngineDesc& desc : descs) {
      const EnginePtr engine = make_engine_for(dense, desc);
      shrink_store(*engine);
      bool grown = false;
      for (std::size_t f = 0; f < frames.size(); ++f) {
        CAPTURE(f);
        const Outcome& of = expected[frames[f] == &thin];
        const std::size_t n = of.hits.size(), capacity = f % 3 == 2 ? n / 2 : n;
        Frame frame(*engine, *frames[f], policies, Report::kHits, capacity);
        grown = grown || has_grown(*engine);
        if (f % 10 == 9) shrink_store(*engine);
        CHECK(frame.status == (capacity < n ? Status::kHitsOverflow : Status::kOk));
        CHECK(frame.job.hits_needed == n);
        CHECK(frame.job.hit_count == (capacity < n ? 0 : n));
        if (capacity == n) CHECK(same_hits(frame.hits, of.hits));
        CHECK(frame.in_contact == of.in_contact);
        CHECK(same_counts(frame.job.stats, of.stats));
        CHECK(frame.job.stats.candidates == of.stats.candidates);
      }
      CHECK(grown);
      for (const World* world : {&dense, &thin})
        CHECK(Frame(*engine, *world, policies, Report::kInContact, 0).in_contact ==
              expected[world == &thin].in_contact);
    }
  }
}

TEST_CASE("a frame with no hit needs no buffer") {
  World world;
  Random random(1);
  world.members.push_back({random_rig(random, Topology::kChain, 3, 1), {}, BatchKind::kCharacters});
  Member& member = world.members[0];
  member.poses = still_poses(member.rig, 2);
  member.poses.origins = {0, 0, 0, 100, 0, 0};
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  Prepared prepared(world, 0);
  CHECK(run_frame(*engine, prepared.job) == Status::kOk);
  CHECK(prepared.job.hit_count == 0);
}

TEST_CASE("one hit per link pair, with the lowest leaves that touch") {
  World world;
  // Link 0 carries leaves 1, 3, 4, link 1 leaves 0, 2, 5. Boxes are 1.2 wide.
  Rig rig =
      boxes_rig({box_at(1, 9), box_at(0, -9), box_at(1, 4), box_at(0, 4.5f), box_at(0, 9.5f), box_at(1, 4.6f)}, 2);
  world.members.push_back({rig, still_poses(rig, 1), BatchKind::kCharacters});
  world.rules = {{{1}, {1}, Pairing::kWithin}};
  for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
    const Outcome outcome = run_world(world, {Refit::kCab, strategy, Exact::kNone});
    REQUIRE(outcome.hits.size() == 1);
    const Hit hit = outcome.hits[0];
    CHECK(hit.link_a == 0);
    CHECK(hit.link_b == 1);
    CHECK(hit.leaf_a == 3);  // 3-2, 3-5 and 4-0 touch; leaves 1-anything do not
    CHECK(hit.leaf_b == 2);
    CHECK(outcome.stats.leaf_pairs == 3);
  }
}

TEST_CASE("an ignored pair is never reported within an instance, and still between instances") {
  World world;
  Rig rig = boxes_rig({box_at(0, 0), box_at(1, 0.5f), box_at(2, 1.0f)}, 3);
  rig.ignored = {{1, 0}};
  world.members.push_back({rig, still_poses(rig, 2), BatchKind::kCharacters});
  world.rules = {{{1}, {1}, Pairing::kWithin}, {{1}, {1}, Pairing::kBetween}};
  for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
    const Outcome outcome = run_world(world, {Refit::kCab, strategy, Exact::kNone});
    std::size_t within = 0, between = 0;
    for (const Hit& hit : outcome.hits) {
      if (hit.instance_a == hit.instance_b) {
        ++within;
        CHECK_FALSE((hit.link_a == 0 && hit.link_b == 1));
      } else {
        ++between;
      }
    }
    CHECK(within == 4);   // 0-2 and 1-2 in each instance
    CHECK(between == 9);  // every link of one with every link of the other
  }
}

TEST_CASE("sides of a hit are ordered by batch, instance and link, whatever the order of rules and inputs") {
  const World world = crowded_world(9);
  const EnginePtr engine = make_engine_for(world);
  const Outcome expected = run_on(*engine, world, {});
  Prepared rotated(world, expected.hits.size());
  std::reverse(rotated.inputs.begin(), rotated.inputs.end());
  std::vector<PairRule> rules(world.rules.rbegin(), world.rules.rend());
  for (PairRule& rule : rules) std::swap(rule.a, rule.b);
  rotated.job.rules = rules;
  REQUIRE(run_frame(*engine, rotated.job) == Status::kOk);
  CHECK(same_hits(rotated.hits, expected.hits));
  CHECK(same_counts(rotated.job.stats, expected.stats));
  for (const Hit& hit : expected.hits) {
    const auto a = std::make_tuple(hit.batch_a.value, hit.instance_a, hit.link_a);
    CHECK(a < std::make_tuple(hit.batch_b.value, hit.instance_b, hit.link_b));
  }
}

TEST_CASE("two instances with far more hits than a worker keeps at a time have them all, in order") {
  constexpr std::uint32_t kLinksEach = 600;
  static_assert(kLinksEach * kLinksEach > 20 * kBlockWords);
  World world;
  Member member;
  Random random(1);
  for (std::uint32_t link = 0; link < kLinksEach; ++link) {
    member.rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    member.rig.parent_offset.push_back({});
    member.rig.leaves.push_back({link, random_box(random, {}, 0.5, 1), {}});
  }
  member.poses = random_poses(random, member.rig, 2, PoseFormat::kMatrix3x4Rows, {0.01, false, false, {}});
  world.members = {member};
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  for (int frame = 0; frame < 2; ++frame) {  // the second begins in the order of hits
    CAPTURE(frame);
    const Outcome outcome = run_on(*engine, world, {Refit::kCab, Strategy::kRows});
    REQUIRE(outcome.hits.size() == kLinksEach * kLinksEach);
    std::size_t wrong = 0;
    for (std::uint32_t h = 0; h < outcome.hits.size(); ++h)
      wrong += outcome.hits[h].link_a != h / kLinksEach || outcome.hits[h].link_b != h % kLinksEach;
    CHECK(wrong == 0);
  }
}
