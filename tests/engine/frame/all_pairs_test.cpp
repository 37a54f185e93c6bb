// run_all_pairs: every leaf pair that may be tested, by the exact test alone, with the outputs of run_frame.
#include "engine/frame/all_pairs.h"

#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::least_count;
using tests::rounds;

// Characters and, mostly, sequences, sparse enough that some touch nothing. Some have layers, a margin or masked
// instances, and some sequences have one frame.
World any_world(Random& random) {
  World world;
  for (int m = 0; m < 2; ++m)
    world.members.push_back(
        any_member(random, 6, BatchKind::kCharacters, {random.uniform(0.5, 3), random.chance(0.5), true, {}}, 6));
  pair_all(world, 1, 2);
  if (random.chance(0.7)) add_frames(random, world, 5);
  if (random.chance(0.5)) add_layers(random, world);
  if (random.chance(0.5)) world.margin = 0.1f;
  for (Member& member : world.members)
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
      if (random.chance(0.1)) member.poses.pose(i, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  return world;
}

bool is_ignored(const Rig& rig, std::uint32_t a, std::uint32_t b) {
  return a == b || std::any_of(rig.ignored.begin(), rig.ignored.end(),
                               [=](const LinkPair& pair) { return std::minmax(pair.a, pair.b) == std::minmax(a, b); });
}

// All leaf pairs that may be tested, sorted, of each two links the lowest. *count: how many leaf pairs there are.
std::vector<Hit> all_hits(const World& world, const Outcome& outcome, std::uint64_t* count) {
  std::vector<Hit> out;
  const auto add = [&](std::uint32_t ma, std::uint32_t ia, std::uint32_t mb, std::uint32_t ib) {
    const Member &a = world.members[ma], &b = world.members[mb];
    const bool within = ma == mb && ia == ib;
    if (outcome.flags[ma][ia] != kInstanceOk || outcome.flags[mb][ib] != kInstanceOk) return;
    if (!within && !(sees(a, ia, b, ib) && sees(b, ib, a, ia))) return;
    for (std::size_t la = 0; la < a.rig.leaves.size(); ++la)
      for (std::size_t lb = within ? la + 1 : 0; lb < b.rig.leaves.size(); ++lb) {
        const auto narrow = [](std::size_t index) { return static_cast<std::uint16_t>(index); };
        const std::uint32_t link_a = a.rig.leaves[la].link, link_b = b.rig.leaves[lb].link;
        if (within && is_ignored(a.rig, link_a, link_b)) continue;
        Hit hit = {{ma + 1}, ia, {mb + 1}, ib, narrow(link_a), narrow(link_b), narrow(la), narrow(lb)};
        if (within && link_b < link_a) std::swap(hit.link_a, hit.link_b), std::swap(hit.leaf_a, hit.leaf_b);
        out.push_back(hit);
      }
  };
  for (const PairRule& rule : world.rules) {
    const std::uint32_t a = static_cast<std::uint32_t>(std::min(rule.a.value, rule.b.value)) - 1,
                        b = static_cast<std::uint32_t>(std::max(rule.a.value, rule.b.value)) - 1;
    const std::uint32_t of_a = world.members[a].poses.instance_count, of_b = world.members[b].poses.instance_count;
    if (rule.pairing == Pairing::kWithin) {
      for (std::uint32_t i = 0; i < of_a; ++i) add(a, i, a, i);
    } else if (world.members[a].kind == BatchKind::kSequence) {
      for (std::uint32_t i = 0; i < std::max(of_a, of_b); ++i) add(a, of_a == 1 ? 0 : i, b, of_b == 1 ? 0 : i);
    } else {
      for (std::uint32_t i = 0; i < of_a; ++i)
        for (std::uint32_t j = a == b ? i + 1 : 0; j < of_b; ++j) add(a, i, b, j);
    }
  }
  std::sort(out.begin(), out.end(), [](const Hit& x, const Hit& y) {
    return std::tuple_cat(link_key(x), leaf_key(x)) < std::tuple_cat(link_key(y), leaf_key(y));
  });
  *count = out.size();
  out.erase(std::unique(out.begin(), out.end(), [](const Hit& x, const Hit& y) { return link_key(x) == link_key(y); }),
            out.end());
  return out;
}

std::vector<Exact> exact_tests() {
  if (build_info().fcl) return {Exact::kConvex, Exact::kFcl};
  MESSAGE("FCL is left out: this build lacks it");
  return {Exact::kConvex};
}

Policies by(Exact exact, Strategy strategy = Strategy::kAuto) { return {Refit::kCab, strategy, exact}; }

bool same_contacts(const Outcome& a, const Outcome& b) {
  return a.contacts.size() == b.contacts.size() &&
         (a.contacts.empty() ||
          std::memcmp(a.contacts.data(), b.contacts.data(), a.contacts.size() * sizeof(Contact)) == 0);
}

}  // namespace

TEST_CASE("without an exact test all leaf pairs touch that layers, masks and ignored links leave, by every strategy") {
  std::size_t hits = 0, masked = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = any_world(random);
    const EnginePtr engine = make_engine_for(world);
    const Outcome frame = run_on(*engine, world, {});
    std::uint64_t leaf_pairs = 0;
    const std::vector<Hit> expected = all_hits(world, frame, &leaf_pairs);
    for (const Strategy strategy : {Strategy::kAuto, Strategy::kTree, Strategy::kLinks, Strategy::kBrute}) {
      const Outcome found = run_on(*engine, world, by(Exact::kNone, strategy), run_all_pairs);
      CHECK(same_hits(found.hits, expected));
      CHECK(found.flags == frame.flags);
      CHECK(found.in_contact == in_contact_by(world, expected));
      CHECK(found.stats.leaf_pairs == leaf_pairs);
      CHECK(found.stats.instances_masked == frame.stats.instances_masked);
      CHECK(found.stats.box_tests == 0);
    }
    CHECK(missing_from(frame.hits, expected) == 0);
    hits += expected.size();
    masked += frame.stats.instances_masked;
  }
  CHECK(hits >= least_count(10000, 20));
  CHECK(masked >= least_count(20, 20));
}

TEST_CASE("an exact test has the hits and contacts of frames with boxes, and is asked about every leaf pair") {
  std::size_t hits = 0, contacts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = any_world(random);
    const EnginePtr engine = make_engine_for(world);
    const std::uint64_t leaf_pairs = run_on(*engine, world, {}, run_all_pairs).stats.leaf_pairs;
    for (const Exact exact : exact_tests())
      for (const bool deep : {false, true}) {
        CAPTURE(static_cast<int>(exact));
        world.contacts = true;
        world.min_depth = deep ? 0.02f : 0;
        const Outcome frame = run_on(*engine, world, by(exact, Strategy::kBrute)),
                      found = run_on(*engine, world, by(exact), run_all_pairs);
        CHECK(same_hits(found.hits, frame.hits));
        CHECK(same_contacts(found, frame));
        CHECK(found.in_contact == frame.in_contact);
        CHECK(found.stats.leaf_pairs == leaf_pairs);
        CHECK(found.stats.exact_tests <= leaf_pairs);
        if (exact == Exact::kConvex) CHECK(found.stats.exact_tests == leaf_pairs);
        CHECK(found.stats.seconds_query > 0);
        const Outcome nearest = run_on(*engine, world, by(exact), run_all_pairs, Report::kDistances),
                      other = run_on(*engine, world, by(exact), run_frame, Report::kDistances);
        CHECK(same_hits(nearest.hits, other.hits));
        CHECK(same_contacts(nearest, other));
        hits += frame.hits.size();
        contacts += nearest.contacts.size();
      }
  }
  CHECK(hits >= least_count(400, 10));
  CHECK(contacts >= least_count(100, 10));
}

TEST_CASE("kInContact names the instances of the hits, and tests nothing that no batch asks about") {
  std::size_t yes = 0;
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = any_world(random);
    const EnginePtr engine = make_engine_for(world);
    for (const Exact exact : {Exact::kNone, Exact::kConvex}) {
      const Outcome all = run_on(*engine, world, by(exact), run_all_pairs);
      const Outcome alone = run_on(*engine, world, by(exact), run_all_pairs, Report::kInContact);
      CHECK(alone.in_contact == all.in_contact);
      CHECK(alone.hits.empty());
      yes += all.hits.size();
    }
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < world.members.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    job.policies = by(Exact::kConvex);
    job.report = Report::kInContact;
    CHECK(run_all_pairs(*engine, job) == Status::kOk);
    CHECK(job.stats.exact_tests == 0);
  }
  CHECK(yes >= least_count(1000, 10));
}

TEST_CASE("a sequence of one frame is tested in every frame, and in none if it is masked") {
  Random random(4);
  World world;
  for (const std::uint32_t instances : {1u, 33u, 33u})
    world.members.push_back(any_member(random, instances, BatchKind::kSequence, {0.1, false, false, {}}, 8));
  pair_all(world, 1, 3);
  const auto hits_with_first = [&] {
    const std::vector<Hit> hits = run_on(*make_engine_for(world), world, {}, run_all_pairs).hits;
    return std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return hit.batch_a.value == 1; });
  };
  CHECK(hits_with_first() >= 66);
  world.members[0].poses.pose(0, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  CHECK(hits_with_first() == 0);
}

TEST_CASE("instances that are not listed take no part") {
  Random random(5);
  World world;
  world.members.push_back(any_member(random, 40, BatchKind::kCharacters, {1, false, true, {}}, 6));
  const EnginePtr engine = make_engine_for(world);
  const std::vector<std::uint32_t> listed = {0, 3, 17, 18, 39};
  BatchInput input = world.members[0].poses.input({1});
  input.instances = listed;
  const PairRule rule = {{1}, {1}, Pairing::kBetween};
  std::vector<Hit> hits(10000);
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.hits = hits;
  REQUIRE(run_all_pairs(*engine, job) == Status::kOk);
  const std::size_t leaves = world.members[0].rig.leaves.size();
  CHECK(job.stats.leaf_pairs == 10 * leaves * leaves);
  REQUIRE(job.hit_count > 0);
  for (std::size_t i = 0; i < job.hit_count; ++i) {
    CHECK(std::binary_search(listed.begin(), listed.end(), hits[i].instance_a));
    CHECK(std::binary_search(listed.begin(), listed.end(), hits[i].instance_b));
  }
}

TEST_CASE("a buffer that is too small gets no hits, and the job says how many there are") {
  Random random(6);
  World world = any_world(random);
  const EnginePtr engine = make_engine_for(world);
  const Outcome all = run_on(*engine, world, {}, run_all_pairs);
  REQUIRE(all.hits.size() > 1);
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs.back().layers = world.members[m].layers;
    inputs.back().layer_masks = world.members[m].layer_masks;
  }
  std::vector<Hit> hits(all.hits.size() - 1, Hit{{7}, 7, {7}, 7, 7, 7, 7, 7});
  const std::vector<Hit> before = hits;
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.hits = hits;
  CHECK(run_all_pairs(*engine, job) == Status::kHitsOverflow);
  CHECK(job.hit_count == 0);
  CHECK(job.hits_needed == all.hits.size());
  CHECK(same_hits(hits, before));
}

TEST_CASE("a job that run_frame refuses is refused by the same status, and changes nothing") {
  Random random(7);
  World world;
  for (int m = 0; m < 2; ++m)
    world.members.push_back(any_member(random, 5, BatchKind::kCharacters, {1, false, true, {}}, 4));
  const EnginePtr engine = make_engine_for(world);
  std::vector<std::uint8_t> flags(5);
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  FrameJob job;
  const auto check = [&](Status expected, const auto& break_job) {
    inputs = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
    std::fill(flags.begin(), flags.end(), std::uint8_t{0xee});
    inputs[0].flags = flags;
    rules = {{{1}, {2}, Pairing::kBetween}};
    job = {};
    break_job();
    job.inputs = inputs;
    job.rules = rules;
    CHECK(run_frame(*engine, job) == expected);
    CHECK(run_all_pairs(*engine, job) == expected);
    CHECK(std::count(flags.begin(), flags.end(), std::uint8_t{0xee}) == 5);
  };
  check(Status::kUnknownBatch, [&] { inputs[1].batch = {9}; });
  check(Status::kBatchGivenTwice, [&] { inputs[1].batch = {1}; });
  check(Status::kBadPoses, [&] { inputs[0].poses.data = nullptr; });
  check(Status::kBadPairRule, [&] { rules[0].pairing = Pairing::kWithin; });
  check(Status::kPairRuleGivenTwice, [&] { rules.push_back(rules[0]); });
  check(Status::kBadPolicy, [&] { job.policies.strategy = static_cast<Strategy>(kStrategyCount); });
  check(Status::kBadMargin, [&] { job.margin = -1; });
  check(Status::kContactsNeedExact, [&] { job.min_depth = 1; });
}

TEST_CASE("the next frame takes all instances for moved") {
  Random random(8);
  World world;
  world.members.push_back(any_member(random, 20, BatchKind::kCharacters, {1, false, true, {}}, 4));
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  const std::vector<std::uint8_t> moved(20, 0);
  BatchInput input = world.members[0].poses.input({1});
  input.moved = moved;
  std::vector<Hit> hits(10000);
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.hits = hits;
  const auto resting = [&](decltype(&run_frame) frame) {
    REQUIRE(frame(*engine, job) == Status::kOk);
    return job.stats.instances_resting;
  };
  CHECK(resting(run_frame) == 0);
  CHECK(resting(run_frame) == 20);
  CHECK(resting(run_all_pairs) == 0);
  CHECK(resting(run_frame) == 0);
  CHECK(resting(run_frame) == 20);
}
