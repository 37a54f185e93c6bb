// BatchInput::count and instances: frames with some of a batch's instances.
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>

namespace cab::tests {
namespace {

using namespace cab::oracle;

World two_batches(Random& random) {
  World world;
  for (const std::uint32_t count : {40u, 25u}) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 4, 2);
    member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation,
                                {1.2, random.chance(0.5), true, {}});
    world.members.push_back(member);
  }
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {2}, Pairing::kBetween}, {{2}, {2}, Pairing::kWithin}};
  return world;
}

// The first `count` instances of a member.
Member first_of(Member member, std::uint32_t count) {
  Poses& poses = member.poses;
  poses.instance_count = count;
  poses.data.resize(std::size_t{count} * poses.link_count * poses.floats_per_pose());
  poses.origins.resize(std::min<std::size_t>(poses.origins.size(), std::size_t{3} * count));
  poses.orientations.resize(std::min<std::size_t>(poses.orientations.size(), std::size_t{4} * count));
  return member;
}

struct Frame {
  std::vector<Hit> hits = std::vector<Hit>(20000);
  FrameStats stats;
};

// Runs a frame of an engine that holds the whole world, with counts, and the arrays cut to `cut` of the rest.
Frame run_counts(Engine& engine, const World& world, const std::uint32_t (&counts)[2], const Policies& policies) {
  Frame out;
  std::vector<BatchInput> inputs;
  std::vector<std::uint8_t> flags[2];
  for (std::uint32_t m = 0; m < 2; ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs[m].count = counts[m];
    flags[m].assign(world.members[m].poses.instance_count, 0xee);
    inputs[m].flags = flags[m];
    inputs[m].origins.size = 3 * counts[m];
    if (!inputs[m].orientations.empty()) inputs[m].orientations.size = 4 * counts[m];
    if (counts[m] == 0) inputs[m].origins = {}, inputs[m].orientations = {};
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = policies;
  job.hits = out.hits;
  REQUIRE(run_frame(engine, job) == Status::kOk);
  out.hits.resize(job.hit_count);
  out.stats = job.stats;
  for (std::uint32_t m = 0; m < 2; ++m)
    for (std::uint32_t i = 0; i < flags[m].size(); ++i) CHECK(flags[m][i] == (i < counts[m] ? kInstanceOk : 0xee));
  return out;
}

}  // namespace

TEST_CASE("a frame of the first instances has the hits of batches of that many, whatever frames came before") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = two_batches(random);
    for (const Strategy strategy : {Strategy::kAuto, Strategy::kTree, Strategy::kLinks, Strategy::kBrute}) {
      const Policies policies = {Refit::kCab, strategy};
      const EnginePtr engine = make_engine_for(world);
      for (int frame = 0; frame < 6; ++frame) {
        const std::uint32_t counts[2] = {1 + random.index(40), 1 + random.index(25)};
        CAPTURE(counts[0]);
        CAPTURE(counts[1]);
        World part = world;
        for (std::size_t m = 0; m < 2; ++m) part.members[m] = first_of(world.members[m], counts[m]);
        const Outcome expected = run_world(part, policies);
        const Frame found = run_counts(*engine, world, counts, policies);
        CHECK(same_hits(found.hits, expected.hits));
        CHECK(found.stats.leaf_pairs == expected.stats.leaf_pairs);
        hits += found.hits.size();
      }
    }
  }
  CHECK(hits >= least_count(2000, 20));
}

TEST_CASE("a frame of the first moments of sequences has the hits of sequences of that many") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world = two_batches(random);
    for (Member& member : world.members) member.kind = BatchKind::kSequence;
    world.rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
    for (const Exact exact : {Exact::kNone, Exact::kConvex}) {
      const Policies policies = {Refit::kCab, Strategy::kAuto, exact};
      const EnginePtr engine = make_engine_for(world);
      const std::uint32_t n = 1 + random.index(25);
      const std::uint32_t all_counts[][2] = {{n, n}, {n, 1}, {1, n}, {0, 0}, {n, n}, {0, 1}, {0, n}, {n, 0}, {1, 0}};
      for (const std::uint32_t(&counts)[2] : all_counts) {
        CAPTURE(counts[0]);
        CAPTURE(counts[1]);
        const Frame found = run_counts(*engine, world, counts, policies);
        if (counts[0] == 0) {
          CHECK(found.hits.empty());
          continue;
        }
        World part = world;
        for (std::size_t m = 0; m < 2; ++m) part.members[m] = first_of(world.members[m], std::max(counts[m], 1u));
        if (counts[1] == 0) part.rules = {{{1}, {1}, Pairing::kWithin}};
        CHECK(same_hits(found.hits, run_world(part, policies).hits));
        hits += found.hits.size();
      }
    }
  }
  CHECK(hits >= least_count(400, 20));
}

TEST_CASE("a batch may have no instance in a frame") {
  Random random(5);
  const World world = two_batches(random);
  const EnginePtr engine = make_engine_for(world);
  CHECK(run_counts(*engine, world, {40, 25}, {}).hits.size() > 0);
  CHECK(run_counts(*engine, world, {0, 0}, {}).hits.empty());
  for (const Hit& hit : run_counts(*engine, world, {0, 25}, {}).hits) CHECK(hit.batch_a.value == 2);
  CHECK(same_hits(run_counts(*engine, world, {40, 25}, {}).hits, run_world(world).hits));
}

TEST_CASE("instances beyond the count keep no place in the spatial order") {
  Random random(6);
  const World world = two_batches(random);
  const EnginePtr engine = make_engine_for(world);
  run_counts(*engine, world, {40, 25}, {});
  run_counts(*engine, world, {7, 25}, {});
  std::vector<std::uint32_t> order(40);
  REQUIRE(spatial_order(*engine, {1}, order) == Status::kOk);
  for (std::uint32_t i = 7; i < 40; ++i) CHECK(order[i] == i);
  std::sort(order.begin(), order.begin() + 7);
  for (std::uint32_t i = 0; i < 7; ++i) CHECK(order[i] == i);
}

TEST_CASE("a count above the batch's is refused, and arrays fit the count") {
  Random random(7);
  World world = two_batches(random);
  world.members[1].kind = BatchKind::kSequence;
  const EnginePtr engine = make_engine_for(world);
  std::vector<Box> boxes(std::size_t{40} * world.members[0].rig.node_count());
  const auto status = [&](const BatchInput& input) { return compute_boxes(*engine, input, {}, boxes); };
  BatchInput input = world.members[0].poses.input({1});
  input.count = 41;
  CHECK(status(input) == Status::kBadCount);
  input.count = 40;
  CHECK(status(input) == Status::kOk);
  input.count = 10;
  CHECK(status(input) == Status::kOk);  // arrays may be longer
  input.origins.size = 29;
  CHECK(status(input) == Status::kBadOrigins);
  input.origins.size = 30;
  CHECK(status(input) == Status::kOk);
  BatchInput sequence = world.members[1].poses.input({2});
  sequence.count = 25;
  CHECK(status(sequence) == Status::kOk);
  sequence.count = 24;
  CHECK(status(sequence) == Status::kOk);
  sequence.count = 26;
  CHECK(status(sequence) == Status::kBadCount);
}

namespace {

// A world and the lists of the instances that are given, one per member. All numbers of the others are NaN.
struct Listed {
  World world;
  std::vector<std::uint32_t> lists[2];

  Listed(Random& random, const World& all, double share) : world(all) {
    for (std::size_t m = 0; m < 2; ++m) {
      Poses& poses = world.members[m].poses;
      const std::size_t floats = poses.data.size() / poses.instance_count;
      for (std::uint32_t i = 0; i < poses.instance_count; ++i)
        if (random.chance(share))
          lists[m].push_back(i);
        else
          std::fill_n(poses.data.begin() + static_cast<std::ptrdiff_t>(i * floats), floats, std::nanf(""));
      if (lists[m].empty()) {
        lists[m].push_back(0);
        std::copy_n(all.members[m].poses.data.begin(), floats, poses.data.begin());
      }
    }
  }

  // Runs a frame with the lists. The origins of the others are NaN too.
  Outcome run(Engine& engine, const Policies& policies) const {
    Outcome out;
    World given = world;
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < 2; ++m) {
      std::vector<double>& origins = given.members[m].poses.origins;
      for (std::uint32_t i = 0; i < origins.size() / 3; ++i)
        if (!std::binary_search(lists[m].begin(), lists[m].end(), i))
          std::fill_n(origins.begin() + 3 * std::ptrdiff_t{i}, 3, std::nan(""));
      out.flags.emplace_back(given.members[m].poses.instance_count, std::uint8_t{0xee});
      out.in_contact.emplace_back(given.members[m].poses.instance_count, std::uint8_t{0xee});
    }
    for (std::uint32_t m = 0; m < 2; ++m) {
      inputs.push_back(given.members[m].poses.input({m + 1}));
      inputs[m].instances = lists[m];
      inputs[m].flags = out.flags[m];
      inputs[m].in_contact = out.in_contact[m];
    }
    out.hits.resize(20000);
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    job.policies = policies;
    job.hits = out.hits;
    REQUIRE(run_frame(engine, job) == Status::kOk);
    out.hits.resize(job.hit_count);
    out.stats = job.stats;
    return out;
  }
};

}  // namespace

TEST_CASE("a frame of listed instances has the hits of a frame in which the others are masked, under their numbers") {
  std::size_t hits = 0;
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World all = two_batches(random);
    for (Member& member : all.members) {  // more instances, so that tasks share words of live bits
      member.poses =
          random_poses(random, member.rig, 150, PoseFormat::kMatrix3x4Rows, {2.5, random.chance(0.5), true, {}});
    }
    const Listed some(random, all, random.uniform(0.05, 0.95)), others(random, all, 0.5);
    for (const Strategy strategy : {Strategy::kAuto, Strategy::kTree, Strategy::kLinks, Strategy::kBrute})
      for (const bool threads : {false, true}) {
        const Policies policies = {Refit::kCab, strategy, Exact::kNone};
        EngineDesc desc;
        if (threads) desc.scheduler = &scheduler;
        const EnginePtr engine = make_engine_for(all, desc);
        for (const Listed* listed : {&some, &others, &some}) {
          const Outcome expected = run_world(listed->world, policies), found = listed->run(*engine, policies);
          CHECK(same_hits(found.hits, expected.hits));
          CHECK(found.in_contact == expected.in_contact);
          CHECK(found.stats.instances_masked == 0);
          for (std::uint32_t m = 0; m < 2; ++m)
            for (std::uint32_t i = 0; i < 150; ++i) {
              const bool given = std::binary_search(listed->lists[m].begin(), listed->lists[m].end(), i);
              CHECK(found.flags[m][i] == (given ? kInstanceOk : 0xee));
            }
          // Which instances the engine takes for live shows in its order: these come first.
          const std::vector<std::uint32_t>& list = listed->lists[0];
          std::vector<std::uint32_t> order(150);
          REQUIRE(spatial_order(*engine, {1}, order) == Status::kOk);
          std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(list.size()));
          CHECK(std::equal(list.begin(), list.end(), order.begin()));
          hits += found.hits.size();
        }
      }
  }
  CHECK(hits >= least_count(4000, 6));
}

TEST_CASE("boxes of listed instances are written at their places, and no others") {
  Random random(3);
  const World world = two_batches(random);
  const EnginePtr engine = make_engine_for(world);
  const std::size_t nodes = world.members[0].rig.node_count();
  std::vector<Box> all(40 * nodes), listed(40 * nodes, Box{});
  REQUIRE(compute_boxes(*engine, world.members[0].poses.input({1}), {}, all) == Status::kOk);
  BatchInput input = world.members[0].poses.input({1});
  const std::uint32_t list[] = {0, 3, 4, 17, 38, 39};
  input.instances = {list, 6};
  REQUIRE(compute_boxes(*engine, input, {}, listed) == Status::kOk);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const std::vector<Box> none(nodes, Box{});
    const Box* const expected = std::binary_search(list, list + 6, i) ? &all[i * nodes] : none.data();
    CHECK(same_bits(&listed[i * nodes], expected, nodes));
  }
}

TEST_CASE("lists that do not ascend, name no instance of the batch, or are of a sequence, are refused") {
  Random random(4);
  World world = two_batches(random);
  world.members[1].kind = BatchKind::kSequence;
  const EnginePtr engine = make_engine_for(world);
  std::vector<Box> boxes(40 * world.members[0].rig.node_count());
  const auto status = [&](std::uint32_t batch, std::vector<std::uint32_t> list, std::uint32_t count) {
    BatchInput input = world.members[batch - 1].poses.input({batch});
    input.instances = list;
    input.count = count;
    return compute_boxes(*engine, input, {}, boxes);
  };
  CHECK(status(1, {0, 39}, kAllInstances) == Status::kOk);
  CHECK(status(1, {0, 40}, kAllInstances) == Status::kBadInstances);
  CHECK(status(1, {0, 20}, 20) == Status::kBadInstances);
  CHECK(status(1, {0, 19}, 20) == Status::kOk);
  CHECK(status(1, {3, 3}, kAllInstances) == Status::kBadInstances);
  CHECK(status(1, {4, 3}, kAllInstances) == Status::kBadInstances);
  CHECK(status(2, {0, 1}, kAllInstances) == Status::kBadInstances);
  BatchInput input = world.members[0].poses.input({1});
  input.instances = {nullptr, 2};
  CHECK(compute_boxes(*engine, input, {}, boxes) == Status::kBadInstances);

  // A question about an instance that is not given.
  const std::uint32_t list[] = {1, 5};
  input.instances = {list, 2};
  MaskReason reason;
  CHECK(why_masked(*engine, input, 5, &reason) == Status::kOk);
  CHECK(why_masked(*engine, input, 4, &reason) == Status::kBadInstance);
  const std::uint32_t link = world.members[0].rig.leaves[0].link;
  Hit pair = {{1}, 1, {1}, 5, static_cast<std::uint16_t>(link), static_cast<std::uint16_t>(link), 0, 0};
  Contact contact;
  CHECK(compute_contacts(*engine, {&input, 1}, {&pair, 1}, {&contact, 1}) == Status::kOk);
  pair.instance_b = 4;
  CHECK(compute_contacts(*engine, {&input, 1}, {&pair, 1}, {&contact, 1}) == Status::kBadPairs);
}

}  // namespace cab::tests
