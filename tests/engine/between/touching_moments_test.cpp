// find_touching_moments: which links touch between two frames, and when first.
#include "engine/between/link_path.h"

#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

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

std::vector<float> moments_of(Engine& engine, const World& last, const World& now, float resolution,
                              const std::vector<Hit>& pairs) {
  const std::vector<BatchInput> from = inputs_of(last), to = inputs_of(now);
  std::vector<float> out(pairs.size(), -1);
  REQUIRE(find_touching_moments(engine, from, to, resolution, pairs, out) == Status::kOk);
  return out;
}

}  // namespace

TEST_CASE("before its moment no frame reports two links as touching, and from it on they come within the resolution") {
  // Rounding may decide otherwise where the shapes are within this of touching.
  constexpr float kNear = 1e-4f;
  std::size_t in_between = 0, never = 0, from_start = 0, samples_before = 0;
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
    const auto resolution = static_cast<float>(random.log_uniform(2e-3, 0.1));
    const EnginePtr engine = make_engine_for(last);
    const std::vector<Hit> pairs = all_pairs(last);
    const std::vector<float> moments = moments_of(*engine, last, now, resolution, pairs);
    const auto pair_of = [&](const Hit& hit) {
      const auto at =
          static_cast<std::size_t>(std::lower_bound(pairs.begin(), pairs.end(), hit, link_less) - pairs.begin());
      REQUIRE(at < pairs.size());
      return at;
    };
    constexpr int kSamples = 50;
    for (int k = 0; k <= kSamples; ++k) {
      const double t = static_cast<double>(k) / kSamples;
      World moment = at_moment(last, now, t);
      moment.contacts = true;
      const Outcome found = run_on(*engine, moment, kConvex);
      std::vector<bool> is_deep(pairs.size());
      for (std::size_t h = 0; h < found.hits.size(); ++h)
        if (found.contacts[h].depth > kNear) is_deep[pair_of(found.hits[h])] = true;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!(t < static_cast<double>(moments[i]))) continue;
        CAPTURE(i);
        CHECK(!is_deep[i]);
        ++samples_before;
      }
    }
    // The links are within the resolution at their moment: of a sample of the pairs, a frame each.
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      in_between += moments[i] > 0 && moments[i] < 1;
      from_start += moments[i] == 0;
      never += moments[i] == kNeverTouch;
      if (moments[i] == kNeverTouch || !random.chance(0.05)) continue;
      CAPTURE(i);
      World moment = at_moment(last, now, static_cast<double>(moments[i]));
      moment.contacts = true;
      moment.margin = 2 * resolution + kNear;
      const std::vector<Hit> hits = run_on(*engine, moment, kConvex).hits;
      CHECK(std::binary_search(hits.begin(), hits.end(), pairs[i], link_less));
    }
  }
  CHECK(in_between >= least_count(200, 8));
  CHECK(never >= least_count(200, 8));
  CHECK(from_start >= least_count(30, 8));
  CHECK(samples_before >= least_count(10000, 8));
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
  const std::vector<float> expected = moments_of(*make_engine_for(last), last, now, 0.01f, pairs);
  for (const Isa isa : available_isas())
    for (const bool threads : {false, true}) {
      EngineDesc desc;
      desc.isa = isa;
      if (threads) desc.scheduler = &scheduler;
      const std::vector<float> found = moments_of(*make_engine_for(last, desc), last, now, 0.01f, pairs);
      CHECK(std::memcmp(found.data(), expected.data(), found.size() * sizeof(float)) == 0);
    }
  // With orientations and scales both ends are the frames' poses.
  const EnginePtr engine = make_engine_for(last);
  const std::vector<float> fine = moments_of(*engine, last, now, 1e-4f, pairs);
  const std::vector<Hit> at_start = run_on(*engine, last, kConvex).hits, at_end = run_on(*engine, now, kConvex).hits;
  std::size_t starts = 0, stops = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool starting = std::binary_search(at_start.begin(), at_start.end(), pairs[i], link_less),
               ending = std::binary_search(at_end.begin(), at_end.end(), pairs[i], link_less);
    if (starting) CHECK(fine[i] == 0);
    if (ending) CHECK(fine[i] <= 1);
    CHECK(fine[i] >= expected[i]);  // what is not free at a finer resolution is not at a coarser one
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
  // They come nearer by 4 m and begin 2 m apart, and are 0.1 m thick.
  for (const float resolution : {0.1f, 0.01f, 1e-3f, 1e-5f}) {
    const std::vector<float> moments = moments_of(*engine, last, now, resolution, pairs);
    CHECK(moments[0] <= 1.9f / 4);
    CHECK(moments[0] >= (1.9f - 1.01f * resolution) / 4);
    CHECK(moments[1] == kNeverTouch);
  }
}

TEST_CASE("a ball that first passes closely by one part, then meets another, touches at the second") {
  const auto ball = [](double x, double y) {
    return Leaf{
        0,
        {{static_cast<float>(x), static_cast<float>(y), 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1f, 0.1f, 0.1f}},
        {}};
  };
  World last;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig.parents = {-1};
    // The second batch is a part 0.05 m off the way of the first, and one in its middle.
    if (m == 0) member.rig.leaves = {ball(0, 0)};
    if (m == 1) member.rig.leaves = {ball(-1, 0.25), ball(1, 0)};
    member.poses.link_count = 1;
    member.poses.instance_count = 1;
    member.poses.data = {0, 0, 0, 1, 0, 0, 0};
    member.poses.origins = {m == 0 ? -2.0 : 0.0, 0, 0};
    last.members.push_back(member);
  }
  World now = last;
  now.members[0].poses.origins[0] = 2;
  const EnginePtr engine = make_engine_for(last);
  const std::vector<Hit> pairs = {{{1}, 0, {2}, 0, 0, 0, 0, 0}};
  // It comes 4 m far, and touches after 2.8.
  for (const float resolution : {0.01f, 1e-3f, 1e-5f}) {
    const std::vector<float> moments = moments_of(*engine, last, now, resolution, pairs);
    CHECK(moments[0] <= 2.8f / 4);
    CHECK(moments[0] >= (2.8f - 1.01f * resolution) / 4);
  }
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
  std::vector<float> moments = moments_of(*engine, last, now, 1e-4f, pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    CHECK(moments[i] == (std::binary_search(at_end.begin(), at_end.end(), pairs[i], link_less) ? 0.0f : kNeverTouch));
  std::fill_n(now.members[0].poses.pose(0, 0), 7, NAN);
  moments = moments_of(*engine, last, now, 1e-4f, pairs);
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
  CHECK(moments_of(*engine, last, now, 1e-4f, pairs) == std::vector<float>{0});
}

TEST_CASE("a ball that a turning plate sweeps over is found, and one that a turning half space sinks into") {
  // A plate 4 m long about its end, by nearly half a turn; the ball stands where it passes half way.
  const ConvexPart ball = {ShapeKind::kSphere, {0, 0, 0}, {0, 0, 0, 1}, {0.1f, 0, 0}, {}};
  const ConvexPart plane = {ShapeKind::kHalfSpace, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, {}};
  const Box plate = {{2, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {2, 0.01f, 0.5f}};
  const Box about_ball = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1f, 0.1f, 0.1f}};
  const Box about_plane = {{0, 0, -50}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {100, 100, 50}};
  const auto member = [](const Leaf& leaf, std::vector<float> pose) {
    Member out;
    out.rig.parents = {-1};
    out.rig.leaves = {leaf};
    out.poses.link_count = out.poses.instance_count = 1;
    out.poses.data = std::move(pose);
    return out;
  };
  World last;
  last.members = {member({0, plate, {}}, {0, 0, -0.7f, 0.714f, 0, 0, 0}),
                  member({0, about_ball, {&ball, 1}}, {0, 0, 0, 1, 3.5f, 0, 0})};
  last.rules = {{{1}, {2}, Pairing::kBetween}};
  World now = last;
  now.members[0].poses.data = {0, 0, 0.7f, 0.714f, 0, 0, 0};
  const std::vector<Hit> pairs = {{{1}, 0, {2}, 0, 0, 0, 0, 0}};
  float moment = moments_of(*make_engine_for(last), last, now, 1e-3f, pairs)[0];
  CHECK(moment < 0.5f);
  CHECK(moment > 0.45f);

  // The plane turns about the x axis by 60 degrees; the ball is 30 m along y, 20 m above it at first.
  last.members[0] = member({0, about_plane, {&plane, 1}}, {0, 0, 0, 1, 0, 0, 0});
  last.members[1].poses.data = {0, 0, 0, 1, 0, 30, 20};
  now = last;
  now.members[0].poses.data = {0.5f, 0, 0, 0.8660254f, 0, 0, 0};
  moment = moments_of(*make_engine_for(last), last, now, 1e-3f, pairs)[0];
  // The ball touches at an angle of atan(20 / 30) less asin(0.1 / 36.06); the sine and cosine of half of it say when.
  const double angle = std::atan2(20.0, 30.0) - std::asin(0.1 / std::hypot(20.0, 30.0)), half = angle / 2;
  const double when = std::tan(half) / (0.5 + std::tan(half) * (1 - 0.8660254));
  CHECK(static_cast<double>(moment) == doctest::Approx(when).epsilon(1e-3));
}

TEST_CASE("moments are right far from the world's origin, and where an origin and a translation cancel") {
  const ConvexPart ball = {ShapeKind::kSphere, {0, 0, 0}, {0, 0, 0, 1}, {0.1f, 0, 0}, {}};
  const Box about = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1f, 0.1f, 0.1f}};
  World last;
  for (int m = 0; m < 2; ++m) {
    Member member;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, about, {&ball, 1}}};
    member.poses.link_count = member.poses.instance_count = 1;
    member.poses.data = {0, 0, 0, 1, 0, 0, 0};
    member.poses.origins = {1e9, 0, 0};
    last.members.push_back(member);
  }
  last.rules = {{{1}, {2}, Pairing::kBetween}};
  const std::vector<Hit> pairs = {{{1}, 0, {2}, 0, 0, 0, 0, 0}};
  // One passes the other at a distance, far away: origins are doubles, and lose nothing.
  last.members[1].poses.origins = {1e9 - 1, 0.3, 0};
  World now = last;
  now.members[1].poses.origins[0] = 1e9 + 1;
  CHECK(moments_of(*make_engine_for(last), last, now, 1e-3f, pairs)[0] == kNeverTouch);
  now.members[1].poses.origins[1] = last.members[1].poses.origins[1] = 0.1;
  CHECK(moments_of(*make_engine_for(last), last, now, 1e-3f, pairs)[0] == doctest::Approx(0.413).epsilon(2e-3));
  // From 1 to -3 through the other, by translations that floats have, and an origin that takes them back.
  last.members[0].poses.origins = {0, 0, 0};
  last.members[1].poses.origins = {33554433, 0, 0};
  last.members[1].poses.data[4] = -33554432;
  now = last;
  now.members[1].poses.data[4] = -33554436;
  CHECK(moments_of(*make_engine_for(last), last, now, 1e-3f, pairs)[0] <= 0.3f);
}

TEST_CASE("moments of bad pairs, resolutions and outputs are refused") {
  Random random(70);
  const World world = two_crowds(random);
  const EnginePtr engine = make_engine_for(world);
  const std::vector<BatchInput> inputs = inputs_of(world);
  const std::vector<Hit> pairs = {all_pairs(world).front()};
  std::vector<float> moments(1, -1);
  const auto find = [&](std::size_t last, std::size_t now, float resolution, Span<const Hit> of, Span<float> to) {
    return find_touching_moments(*engine, {inputs.data(), last}, {inputs.data(), now}, resolution, of, to);
  };
  const Span<const Hit> good = {pairs.data(), 1};
  const Span<float> room = {moments.data(), 1};
  for (const float bad : {0.0f, -1.0f, 2e18f, std::numeric_limits<float>::quiet_NaN()})
    CHECK(find(2, 2, bad, good, room) == Status::kBadResolution);
  CHECK(find(1, 2, 4, good, room) == Status::kBadPairs);
  CHECK(find(2, 1, 4, good, room) == Status::kBadPairs);
  CHECK(find(2, 2, 4, {nullptr, 1}, room) == Status::kBadPairs);
  CHECK(find(2, 2, 4, good, {moments.data(), 0}) == Status::kBadOutput);
  CHECK(find(2, 2, 4, good, {nullptr, 1}) == Status::kBadOutput);
  BatchInput twice[] = {inputs[0], inputs[0]};
  CHECK(find_touching_moments(*engine, {twice, 2}, {inputs.data(), 2}, 4, good, room) == Status::kBatchGivenTwice);
  CHECK(find_touching_moments(*engine, {inputs.data(), 2}, {twice, 2}, 4, good, room) == Status::kBatchGivenTwice);
  CHECK(moments[0] == -1);
  CHECK(find(2, 2, 1e-6f, good, room) == Status::kOk);
  CHECK(find(2, 2, 1, {}, {}) == Status::kOk);
  CHECK(run_on(*engine, world, kConvex).stats.candidates > 0);  // nothing is left bound
}

}  // namespace cab::tests
