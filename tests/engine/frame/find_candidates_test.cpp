// Candidates from the caller's bounds, and frames of those that are in a pair.
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// The bounds of the leaf boxes of every instance of a member, six floats each, rounded outwards.
std::vector<float> bounds_of(Engine& engine, const World& world, std::uint32_t m) {
  const Member& member = world.members[m];
  const std::size_t nodes = member.rig.node_count(), leaves = member.rig.leaf_count();
  std::vector<Box> boxes(nodes * member.poses.instance_count);
  REQUIRE(compute_boxes(engine, member.poses.input({m + 1}), {}, boxes) == Status::kOk);
  std::vector<float> out;
  for (std::size_t i = 0; i < member.poses.instance_count; ++i) {
    double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
    for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
      const Box& box = boxes[i * nodes + leaf];
      for (std::size_t c = 0; c < 3; ++c) {
        double reach = 0;
        for (std::size_t k = 0; k < 3; ++k) reach += std::fabs(double{box.axis[k][c]}) * double{box.half[k]};
        lo[c] = std::min(lo[c], double{box.center[c]} - reach);
        hi[c] = std::max(hi[c], double{box.center[c]} + reach);
      }
    }
    const float infinity = std::numeric_limits<float>::infinity();
    for (const double at : lo) out.push_back(std::nextafter(static_cast<float>(at), -infinity));
    for (const double at : hi) out.push_back(std::nextafter(static_cast<float>(at), infinity));
  }
  return out;
}

// Several batches of characters, with layers, rules between some of them, and perhaps a margin.
World crowd(Random& random) {
  World world;
  for (const std::uint32_t count : {70u, 45u, 20u}) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 5, 2);
    member.poses = random_poses(random, member.rig, count, PoseFormat::kMatrix3x4Rows,
                                {random.uniform(1.5, 6), random.chance(0.5), true, {}});
    world.members.push_back(member);
  }
  add_layers(random, world);
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {2}, Pairing::kBetween}, {{3}, {2}, Pairing::kBetween}};
  if (random.chance(0.5)) world.margin = static_cast<float>(random.uniform(0.01, 0.3));
  return world;
}

BatchInput input_of(const World& world, std::uint32_t m) {
  const Member& member = world.members[m];
  BatchInput input = member.poses.input({m + 1});
  input.layers = member.layers;
  input.layer_masks = member.layer_masks;
  return input;
}

// What find_candidates takes and gives for a world.
struct Search {
  std::vector<std::vector<float>> bounds;
  std::vector<std::vector<std::uint8_t>> in_pair;
  std::vector<BatchInput> inputs;
  FrameJob job;
  std::vector<InstancePair> pairs;
  CandidateList list;

  // Poses are not given at all.
  Search(Engine& engine, const World& world, std::size_t capacity) {
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      bounds.push_back(bounds_of(engine, world, m));
      in_pair.emplace_back(world.members[m].poses.instance_count, std::uint8_t{0xee});
    }
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      BatchInput input = input_of(world, m);
      input.poses.data = nullptr;
      input.bounds = bounds[m];
      input.in_contact = in_pair[m];
      inputs.push_back(input);
    }
    job.inputs = inputs;
    job.rules = world.rules;
    job.margin = world.margin;
    pairs.resize(capacity);
    list.pairs = pairs;
  }
};

auto key_of(const InstancePair& pair) {
  return std::make_tuple(pair.batch_a.value, pair.instance_a, pair.batch_b.value, pair.instance_b);
}

}  // namespace

TEST_CASE("a frame of the instances that are in a pair has the hits of a frame of all") {
  std::size_t hits = 0, given = 0, all = 0;
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = crowd(random);
    EngineDesc desc;
    if (seed % 2) desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    Search search(*engine, world, 20000);
    REQUIRE(find_candidates(*engine, search.job, search.list) == Status::kOk);
    CHECK(search.list.pair_count == search.list.pairs_needed);
    search.pairs.resize(search.list.pair_count);

    // In order, each once, the lower instance first, and in_contact says who is in a pair.
    std::vector<std::vector<std::uint8_t>> in_pair;
    for (const Member& member : world.members) in_pair.emplace_back(member.poses.instance_count, std::uint8_t{0});
    for (std::size_t p = 0; p < search.pairs.size(); ++p) {
      const InstancePair& pair = search.pairs[p];
      if (p > 0) CHECK(key_of(search.pairs[p - 1]) < key_of(pair));
      CHECK(std::make_tuple(pair.batch_a.value, pair.instance_a) <
            std::make_tuple(pair.batch_b.value, pair.instance_b));
      const Member &a = world.members[pair.batch_a.value - 1], &b = world.members[pair.batch_b.value - 1];
      CHECK((sees(a, pair.instance_a, b, pair.instance_b) && sees(b, pair.instance_b, a, pair.instance_a)));
      in_pair[pair.batch_a.value - 1][pair.instance_a] = in_pair[pair.batch_b.value - 1][pair.instance_b] = 1;
    }
    CHECK(search.in_pair == in_pair);

    // No pair is far apart, and every hit is in a pair.
    const auto apart = [&](const InstancePair& pair) {
      double most = -1e300;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto side = [&](BatchSlot slot, std::uint32_t instance, std::size_t at) {
          return world.members[slot.value - 1].poses.origins[3 * instance + c] +
                 double{search.bounds[slot.value - 1][6 * instance + at + c]};
        };
        most = std::max({most, side(pair.batch_a, pair.instance_a, 0) - side(pair.batch_b, pair.instance_b, 3),
                         side(pair.batch_b, pair.instance_b, 0) - side(pair.batch_a, pair.instance_a, 3)});
      }
      return most;
    };
    for (const InstancePair& pair : search.pairs) CHECK(apart(pair) < 1.751 * double{world.margin} + 0.01);

    const Outcome expected = run_world(world);
    std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>> found;
    for (const InstancePair& pair : search.pairs) found.insert(key_of(pair));
    for (const Hit& hit : expected.hits)
      CHECK(found.count(std::make_tuple(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b)) == 1);

    // The frame of those in a pair.
    std::vector<std::vector<std::uint32_t>> lists(world.members.size());
    std::vector<BatchInput> inputs;
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      for (std::uint32_t i = 0; i < in_pair[m].size(); ++i)
        if (in_pair[m][i]) lists[m].push_back(i);
      BatchInput input = input_of(world, m);
      input.bounds = search.inputs[m].bounds;
      input.instances = lists[m];
      if (lists[m].empty()) input.count = 0;
      inputs.push_back(input);
      given += lists[m].size();
      all += in_pair[m].size();
    }
    std::vector<Hit> buffer(20000);
    FrameJob job = search.job;
    job.inputs = inputs;
    job.hits = buffer;
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    buffer.resize(job.hit_count);
    CHECK(same_hits(buffer, expected.hits));
    CHECK(job.stats.instances_beyond_bounds == 0);
    hits += buffer.size();
  }
  MESSAGE(given << " of " << all << " instances are in a pair");
  CHECK(hits >= least_count(3000, 40));
  CHECK(given < all);
}

TEST_CASE("instances that leave their bounds are counted by the frame") {
  Random random(3);
  World world = crowd(random);
  world.margin = 0.1f;
  const EnginePtr engine = make_engine_for(world);
  Search search(*engine, world, 20000);
  for (std::uint32_t m = 0; m < world.members.size(); ++m)
    search.inputs[m].poses.data = world.members[m].poses.data.data();
  std::vector<Hit> hits(20000);
  search.job.hits = hits;
  REQUIRE(run_frame(*engine, search.job) == Status::kOk);
  CHECK(search.job.stats.instances_beyond_bounds == 0);
  search.bounds[0][6 * 5] += 0.5f;                                                         // a lower side
  search.bounds[1][6 * 9 + 4] -= 0.5f;                                                     // an upper side
  for (int c = 0; c < 6; ++c) search.bounds[2][6 * 19 + static_cast<std::size_t>(c)] = 0;  // a point
  REQUIRE(run_frame(*engine, search.job) == Status::kOk);
  CHECK(search.job.stats.instances_beyond_bounds == 3);
}

TEST_CASE("too little room for pairs is a status with the needed number") {
  Random random(4);
  const World world = crowd(random);
  const EnginePtr engine = make_engine_for(world);
  Search all(*engine, world, 20000);
  REQUIRE(find_candidates(*engine, all.job, all.list) == Status::kOk);
  REQUIRE(all.list.pair_count > 10);
  for (const std::size_t room : {std::size_t{0}, std::size_t{1}, all.list.pairs_needed - 1}) {
    Search few(*engine, world, room);
    CHECK(find_candidates(*engine, few.job, few.list) == Status::kPairsOverflow);
    CHECK(few.list.pair_count == 0);
    CHECK(few.list.pairs_needed == all.list.pairs_needed);
    CHECK(few.in_pair == all.in_pair);
  }
  Search enough(*engine, world, all.list.pairs_needed);
  CHECK(find_candidates(*engine, enough.job, enough.list) == Status::kOk);
}

TEST_CASE("candidates need sound bounds, and a frame refuses bad ones too") {
  Random random(5);
  const World world = crowd(random);
  const EnginePtr engine = make_engine_for(world);
  const auto status = [&](auto&& spoil) {
    Search search(*engine, world, 20000);
    spoil(search);
    return find_candidates(*engine, search.job, search.list);
  };
  CHECK(status([](Search&) {}) == Status::kOk);
  CHECK(status([](Search& s) { s.inputs[1].bounds = {}; }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.inputs[1].bounds.size -= 1; }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.inputs[1].bounds.data = nullptr; }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.bounds[0][7] = std::nanf(""); }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.bounds[0][11] = std::numeric_limits<float>::infinity(); }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.bounds[0][6] = s.bounds[0][9] + 1; }) == Status::kBadBounds);
  CHECK(status([](Search& s) { s.list.pairs.data = nullptr; }) == Status::kBadOutput);
  CHECK(status([](Search& s) { s.job.margin = -1; }) == Status::kBadMargin);
  CHECK(status([](Search& s) { s.inputs[2].batch = {9}; }) == Status::kUnknownBatch);
  Search search(*engine, world, 20000);
  for (std::uint32_t m = 0; m < world.members.size(); ++m)
    search.inputs[m].poses.data = world.members[m].poses.data.data();
  search.bounds[0][7] = std::nanf("");
  CHECK(run_frame(*engine, search.job) == Status::kBadBounds);
}

}  // namespace cab::tests
