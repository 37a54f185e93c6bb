// find_touching_moments: which links touch between two frames, and when first.
#include "engine/between/link_path.h"

#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr Policies kConvex = {Refit::kCab, Strategy::kAuto, Exact::kConvex};

// Two crowds that all meet.
World two_crowds(Random& random) {
  World world;
  for (const std::uint32_t count : {6u, 9u}) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 3, 2);
    member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation,
                                {0.8, random.chance(0.5), true, {}});
    if (random.chance(0.5))
      for (std::uint32_t i = 0; i < count; ++i)
        member.poses.scales.push_back(static_cast<float>(random.uniform(0.7, 1.4)));
    world.members.push_back(std::move(member));
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  return world;
}

// The quaternion between two, on a straight line by the shorter way.
void blend(const float* from, const float* to, double t, float* out) {
  double dot = 0, sum_from = 0, sum_to = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    const double p = from[c], q = to[c];
    dot += p * q, sum_from += p * p, sum_to += q * q;
  }
  const double sign = dot < 0 ? -1 : 1;
  for (std::size_t c = 0; c < 4; ++c)
    out[c] = static_cast<float>((1 - t) * static_cast<double>(from[c]) / std::sqrt(sum_from) +
                                sign * t * static_cast<double>(to[c]) / std::sqrt(sum_to));
}

// A world whose instances have no orientation, so that a link's pose says where it is turned to.
World at_moment(const World& from, const World& to, double t) {
  World out = from;
  for (std::size_t m = 0; m < from.members.size(); ++m) {
    const Poses &a = from.members[m].poses, &b = to.members[m].poses;
    Poses& poses = out.members[m].poses;
    for (std::size_t i = 0; i < poses.origins.size(); ++i) poses.origins[i] += t * (b.origins[i] - a.origins[i]);
    for (std::size_t at = 0; at < poses.data.size(); at += 7) {
      blend(a.data.data() + at, b.data.data() + at, t, poses.data.data() + at);
      for (std::size_t c = 4; c < 7; ++c)
        poses.data[at + c] =
            static_cast<float>((1 - t) * static_cast<double>(a.data[at + c]) + t * static_cast<double>(b.data[at + c]));
    }
  }
  return out;
}

std::vector<BatchInput> inputs_of(const World& world) {
  std::vector<BatchInput> out;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) out.push_back(world.members[m].poses.input({m + 1}));
  return out;
}

// Every link of the first member with every link of the second.
std::vector<Hit> all_pairs(const World& world) {
  std::vector<Hit> out;
  for (std::uint32_t i = 0; i < world.members[0].poses.instance_count; ++i)
    for (std::uint32_t j = 0; j < world.members[1].poses.instance_count; ++j)
      for (std::uint16_t a = 0; a < world.members[0].rig.link_count(); ++a)
        for (std::uint16_t b = 0; b < world.members[1].rig.link_count(); ++b)
          if (std::any_of(world.members[0].rig.leaves.begin(), world.members[0].rig.leaves.end(),
                          [a](const Leaf& leaf) { return leaf.link == a; }) &&
              std::any_of(world.members[1].rig.leaves.begin(), world.members[1].rig.leaves.end(),
                          [b](const Leaf& leaf) { return leaf.link == b; }))
            out.push_back({{1}, i, {2}, j, a, b, 0, 0});
  return out;
}

std::vector<float> moments_of(Engine& engine, const World& last, const World& now, std::uint32_t steps,
                              const std::vector<Hit>& pairs) {
  const std::vector<BatchInput> from = inputs_of(last), to = inputs_of(now);
  std::vector<float> out(pairs.size(), -1);
  REQUIRE(find_touching_moments(engine, from, to, steps, pairs, out) == Status::kOk);
  return out;
}

}  // namespace

TEST_CASE("a moment is the first at which a frame of that moment's poses reports the links") {
  std::size_t in_between = 0, never = 0;
  for (std::uint32_t seed = 1; seed <= rounds(8); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World last = two_crowds(random);
    for (Member& member : last.members) member.poses.orientations.clear(), member.poses.scales.clear();
    World now = last;
    for (Member& member : now.members) {
      const Poses other = random_poses(random, member.rig, member.poses.instance_count,
                                       PoseFormat::kQuaternionTranslation, {0.8, false, true, {}});
      member.poses = other;
    }
    const std::uint32_t steps = 1 + random.index(40);
    const EnginePtr engine = make_engine_for(last);
    const std::vector<Hit> pairs = all_pairs(last);
    const std::vector<float> moments = moments_of(*engine, last, now, steps, pairs);
    // Rounding may decide otherwise where the shapes are within this of touching.
    constexpr float kNear = 1e-4f;
    std::vector<std::uint32_t> earliest(pairs.size(), steps + 1), latest(pairs.size(), steps + 1);
    for (std::uint32_t k = 0; k <= steps; ++k) {
      World moment = at_moment(last, now, static_cast<double>(k) / steps);
      moment.contacts = true;
      moment.margin = kNear;
      const Outcome found = run_on(*engine, moment, kConvex);
      for (std::size_t h = 0; h < found.hits.size(); ++h) {
        const auto at = static_cast<std::size_t>(
            std::lower_bound(pairs.begin(), pairs.end(), found.hits[h], link_less) - pairs.begin());
        REQUIRE(at < pairs.size());
        earliest[at] = std::min(earliest[at], k);
        if (found.contacts[h].depth > kNear) latest[at] = std::min(latest[at], k);
      }
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      CAPTURE(i);
      const auto as_moment = [steps](std::uint32_t k) {
        return k > steps ? kNeverTouch : static_cast<float>(k) / static_cast<float>(steps);
      };
      CHECK(moments[i] >= as_moment(earliest[i]));
      CHECK(moments[i] <= as_moment(latest[i]));
      in_between += moments[i] > 0 && moments[i] < 1;
      never += moments[i] == kNeverTouch;
    }
  }
  CHECK(in_between >= least_count(200, 8));
  CHECK(never >= least_count(200, 8));
}

TEST_CASE("moments are the same on every instruction set and number of threads, with orientations and scales") {
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  Random random(50);
  const World last = two_crowds(random);
  World now = last;
  for (std::size_t m = 0; m < 2; ++m)
    now.members[m].poses = random_poses(random, now.members[m].rig, now.members[m].poses.instance_count,
                                        PoseFormat::kMatrix4x4Columns, {0.8, true, true, {}});
  const std::vector<Hit> pairs = all_pairs(last);
  const std::vector<float> expected = moments_of(*make_engine_for(last), last, now, 20, pairs);
  for (const Isa isa : available_isas())
    for (const bool threads : {false, true}) {
      EngineDesc desc;
      desc.isa = isa;
      if (threads) desc.scheduler = &scheduler;
      const std::vector<float> found = moments_of(*make_engine_for(last, desc), last, now, 20, pairs);
      CHECK(std::memcmp(found.data(), expected.data(), found.size() * sizeof(float)) == 0);
    }
  // With orientations and scales both ends are the frames' poses.
  const EnginePtr engine = make_engine_for(last);
  std::vector<float> ends = moments_of(*engine, last, now, 1, pairs);
  const std::vector<Hit> at_start = run_on(*engine, last, kConvex).hits, at_end = run_on(*engine, now, kConvex).hits;
  std::size_t starts = 0, stops = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool starting = std::binary_search(at_start.begin(), at_start.end(), pairs[i], link_less),
               ending = std::binary_search(at_end.begin(), at_end.end(), pairs[i], link_less);
    CHECK(ends[i] == (starting ? 0.0f : ending ? 1.0f : kNeverTouch));
    starts += starting;
    stops += ending && !starting;
  }
  CHECK(starts > 3);
  CHECK(stops > 3);
}

TEST_CASE("rods that pass through each other touch half way, and rods that pass beside each other never") {
  const Box rod = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 0.05f, 0.05f}};
  World last;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, rod, {}}};
    member.poses.link_count = 1;
    member.poses.instance_count = 2;
    // The second rod of each batch is a metre higher in the second batch.
    member.poses.data = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
    const double side = m == 0 ? -1 : 1;
    member.poses.origins = {0, side, 0, 100, side, m == 0 ? 0.0 : 1.0};
    last.members.push_back(member);
  }
  World now = last;
  for (Member& member : now.members)
    for (const std::size_t y : {std::size_t{1}, std::size_t{4}}) member.poses.origins[y] = -member.poses.origins[y];
  const EnginePtr engine = make_engine_for(last);
  const std::vector<Hit> pairs = {{{1}, 0, {2}, 0, 0, 0, 0, 0}, {{1}, 1, {2}, 1, 0, 0, 0, 0}};
  CHECK(moments_of(*engine, last, now, 64, pairs) == std::vector<float>{31 / 64.0f, kNeverTouch});
  CHECK(moments_of(*engine, last, now, 2, pairs) == std::vector<float>{0.5f, kNeverTouch});
  CHECK(moments_of(*engine, last, now, 1, pairs) == std::vector<float>{kNeverTouch, kNeverTouch});
}

TEST_CASE("a link that the earlier frame does not have is where it is now, and one that is not valid never touches") {
  Random random(60);
  World last = two_crowds(random);
  for (Member& member : last.members) member.poses.orientations.clear(), member.poses.scales.clear();
  World now = last;
  for (Member& member : now.members)
    member.poses = random_poses(random, member.rig, member.poses.instance_count, PoseFormat::kQuaternionTranslation,
                                {0.8, false, true, {}});
  const EnginePtr engine = make_engine_for(last);
  const std::vector<Hit> pairs = all_pairs(last);
  std::fill(last.members[0].poses.data.begin(), last.members[0].poses.data.end(), NAN);
  std::fill(last.members[1].poses.data.begin(), last.members[1].poses.data.end(), NAN);
  const std::vector<Hit> at_end = run_on(*engine, now, kConvex).hits;
  std::vector<float> moments = moments_of(*engine, last, now, 8, pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    CHECK(moments[i] == (std::binary_search(at_end.begin(), at_end.end(), pairs[i], link_less) ? 0.0f : kNeverTouch));
  std::fill_n(now.members[0].poses.pose(0, 0), 7, NAN);
  moments = moments_of(*engine, last, now, 8, pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (pairs[i].instance_a == 0 && pairs[i].link_a == 0) CHECK(moments[i] == kNeverTouch);
}

TEST_CASE("a link that is mirrored in one frame alone is at all moments where it is now, its origin too") {
  const Box cube = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}};
  World last;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, cube, {}}};
    member.poses.format = PoseFormat::kMatrix3x4Rows;
    member.poses.link_count = member.poses.instance_count = 1;
    member.poses.data = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    member.poses.origins = {0, 0, 0};
    last.members.push_back(member);
  }
  const World now = last;
  last.members[0].poses.data[10] = -1;
  last.members[0].poses.origins[0] = -8;
  const EnginePtr engine = make_engine_for(last);
  const std::vector<Hit> pairs = {{{1}, 0, {2}, 0, 0, 0, 0, 0}};
  CHECK(moments_of(*engine, last, now, 8, pairs) == std::vector<float>{0});
}

TEST_CASE("moments of bad pairs, steps and outputs are refused") {
  Random random(70);
  const World world = two_crowds(random);
  const EnginePtr engine = make_engine_for(world);
  const std::vector<BatchInput> inputs = inputs_of(world);
  const std::vector<Hit> pairs = {all_pairs(world).front()};
  std::vector<float> moments(1, -1);
  const auto find = [&](std::size_t last, std::size_t now, std::uint32_t steps, Span<const Hit> of, Span<float> to) {
    return find_touching_moments(*engine, {inputs.data(), last}, {inputs.data(), now}, steps, of, to);
  };
  const Span<const Hit> good = {pairs.data(), 1};
  const Span<float> room = {moments.data(), 1};
  CHECK(find(2, 2, 0, good, room) == Status::kBadSteps);
  CHECK(find(2, 2, kMaxSteps + 1, good, room) == Status::kBadSteps);
  CHECK(find(1, 2, 4, good, room) == Status::kBadPairs);
  CHECK(find(2, 1, 4, good, room) == Status::kBadPairs);
  CHECK(find(2, 2, 4, {nullptr, 1}, room) == Status::kBadPairs);
  CHECK(find(2, 2, 4, good, {moments.data(), 0}) == Status::kBadOutput);
  CHECK(find(2, 2, 4, good, {nullptr, 1}) == Status::kBadOutput);
  BatchInput twice[] = {inputs[0], inputs[0]};
  CHECK(find_touching_moments(*engine, {twice, 2}, {inputs.data(), 2}, 4, good, room) == Status::kBatchGivenTwice);
  CHECK(find_touching_moments(*engine, {inputs.data(), 2}, {twice, 2}, 4, good, room) == Status::kBatchGivenTwice);
  CHECK(moments[0] == -1);
  CHECK(find(2, 2, kMaxSteps, good, room) == Status::kOk);
  CHECK(find(2, 2, 1, {}, {}) == Status::kOk);
  CHECK(run_on(*engine, world, kConvex).stats.candidates > 0);  // nothing is left bound
}

}  // namespace cab::tests
