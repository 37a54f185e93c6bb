// BatchInput::margins and sweep_margins: what may have touched between two frames.
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

namespace cab::tests {
namespace {

using namespace cab::oracle;

using Margins = std::vector<std::vector<float>>;  // of each member

// A frame of a world in which instances have margins of their own.
Outcome run_with(Engine& engine, const World& world, const Margins& margins, const Policies& policies = {}) {
  Outcome out;
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs[m].margins = margins[m];
  }
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.policies = policies;
  job.margin = world.margin;
  out.hits.resize(60000);
  out.contacts.resize(world.contacts ? out.hits.size() : 0);
  job.hits = out.hits;
  job.contacts = out.contacts;
  REQUIRE(run_frame(engine, job) == Status::kOk);
  out.hits.resize(job.hit_count);
  out.contacts.resize(world.contacts ? job.hit_count : 0);
  out.stats = job.stats;
  return out;
}

Margins all_margins(const World& world, const std::function<float()>& margin) {
  Margins out;
  for (const Member& member : world.members) {
    out.emplace_back(member.poses.instance_count);
    for (float& one : out.back()) one = margin();
  }
  return out;
}

World two_crowds(Random& random, double spread) {
  World world;
  for (const std::uint32_t count : {20u, 33u})
    world.members.push_back(
        any_member(random, count, BatchKind::kCharacters, any_pose_range(random, true, {}, spread), 8));
  pair_all(world, 1, 2);
  return world;
}

Policies policies_of(Refit refit, Strategy strategy, Exact exact) {
  Policies out;
  out.refit = refit;
  out.strategy = strategy;
  out.exact = exact;
  return out;
}

// ------------------------------------------------------------------------------- the judge of what touches in between

// Poses of single rods: one quaternion, one translation and one origin per instance.
Poses rod_poses(Random& random, const Rig& rig, std::uint32_t count, double spread) {
  return random_poses(random, rig, count, PoseFormat::kQuaternionTranslation, {spread, false, true, {}});
}

Member rods(Random& random, std::uint32_t count, double spread) {
  Member out;
  out.rig.parents = {-1, 0};
  out.rig.parent_offset = {{}, {{0.4, 0, 0}}};
  for (std::uint32_t link = 0; link < 2; ++link)
    out.rig.leaves.push_back({link, {{0.2f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.2f, 0.02f, 0.02f}}, {}});
  out.poses = rod_poses(random, out.rig, count, spread);
  return out;
}

// The same rods after a step: every origin and every link's place moved by up to `step`, all turned.
Poses after_step(Random& random, const Member& member, double step, double turn) {
  Poses out = member.poses;
  for (double& at : out.origins) at += random.uniform(-step, step);
  for (std::uint32_t i = 0; i < out.instance_count; ++i)
    for (std::uint32_t link = 0; link < out.link_count; ++link) {
      float* const pose = out.pose(i, link);
      double by[4];
      quaternion_about(random.unit_vector(), random.uniform(-turn, turn), by);
      const double q[4] = {pose[0], pose[1], pose[2], pose[3]};
      // by * q
      const double x = by[3] * q[0] + by[0] * q[3] + by[1] * q[2] - by[2] * q[1],
                   y = by[3] * q[1] - by[0] * q[2] + by[1] * q[3] + by[2] * q[0],
                   z = by[3] * q[2] + by[0] * q[1] - by[1] * q[0] + by[2] * q[3],
                   w = by[3] * q[3] - by[0] * q[0] - by[1] * q[1] - by[2] * q[2];
      const double turned[4] = {x, y, z, w};
      for (std::size_t c = 0; c < 4; ++c) pose[c] = static_cast<float>(turned[c]);
      for (std::size_t c = 4; c < 7; ++c) pose[c] += static_cast<float>(random.uniform(-step / 4, step / 4));
    }
  return out;
}

// The poses of a moment between two frames: places on straight lines, rotations by slerp the shorter way.
Poses between(const Poses& from, const Poses& to, double t) {
  Poses out = from;
  for (std::size_t i = 0; i < out.origins.size(); ++i) out.origins[i] += t * (to.origins[i] - from.origins[i]);
  for (std::size_t at = 0; at < out.data.size(); at += 7) {
    double dot = 0, sum_from = 0, sum_to = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      const double p = from.data[at + c], q = to.data[at + c];
      dot += p * q, sum_from += p * p, sum_to += q * q;
    }
    const double lengths = std::sqrt(sum_from * sum_to), sign = dot < 0 ? -1 : 1;
    const double angle = std::acos(std::min(1.0, std::fabs(dot) / lengths)), whole = std::sin(angle);
    const double a = whole < 1e-6 ? 1 - t : std::sin((1 - t) * angle) / whole,
                 b = whole < 1e-6 ? t : std::sin(t * angle) / whole;
    for (std::size_t c = 0; c < 4; ++c)
      out.data[at + c] = static_cast<float>(a * static_cast<double>(from.data[at + c]) / std::sqrt(sum_from) +
                                            sign * b * static_cast<double>(to.data[at + c]) / std::sqrt(sum_to));
    for (std::size_t c = 4; c < 7; ++c)
      out.data[at + c] = static_cast<float>((1 - t) * static_cast<double>(from.data[at + c]) +
                                            t * static_cast<double>(to.data[at + c]));
  }
  return out;
}

std::vector<float> margins_between(Engine& engine, const Poses& last, const Poses& now, BatchId batch) {
  std::vector<float> out(now.instance_count, -1);
  REQUIRE(sweep_margins(engine, last.input(batch), now.input(batch), out) == Status::kOk);
  return out;
}

}  // namespace

TEST_CASE("margins of 0 change no bit, and equal margins are the frame's margin, by every strategy and refit") {
  std::size_t hits = 0;
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    Random random(seed);
    World world = two_crowds(random, 2);
    world.contacts = true;
    for (const Exact exact : {Exact::kNone, Exact::kConvex}) {
      world.contacts = exact == Exact::kConvex;
      for (const Refit refit : {Refit::kCab, Refit::kAabbHull, Refit::kAabbVertices})
        for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks}) {
          CAPTURE(seed);
          CAPTURE(static_cast<int>(refit));
          CAPTURE(static_cast<int>(strategy));
          const Policies policies = policies_of(refit, strategy, exact);
          const EnginePtr engine = make_engine_for(world);
          for (const float own : {0.0f, 0.05f}) {
            World wide = world;
            wide.margin = 2 * own;
            const Outcome expected = run_on(*engine, wide, policies);
            const Outcome found = run_with(*engine, world, all_margins(world, [own] { return own; }), policies);
            CHECK(same_hits(found.hits, expected.hits));
            CHECK(same_counts(found.stats, expected.stats));
            CHECK(found.stats.candidates == expected.stats.candidates);
            REQUIRE(found.contacts.size() == expected.contacts.size());
            CHECK((found.contacts.empty() || std::memcmp(found.contacts.data(), expected.contacts.data(),
                                                         found.contacts.size() * sizeof(Contact)) == 0));
            hits += found.hits.size();
          }
        }
    }
  }
  CHECK(hits >= least_count(1000, 6));
}

TEST_CASE("links are reported that are no farther apart than the frame's margin and both instances' own") {
  std::size_t near = 0, beyond = 0;
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(50 + seed);
    World world = two_crowds(random, 3);
    world.margin = random.chance(0.5) ? 0.1f : 0;
    const Margins margins = all_margins(
        world, [&random] { return random.chance(0.3) ? 0.0f : static_cast<float>(random.uniform(0, 0.3)); });
    // All links that are at most the largest possible margin apart, by the judge.
    World wide = world;
    wide.margin = world.margin + 0.6f;
    std::vector<Hit> due;
    for (const Hit& hit : judge_world(wide)) {
      const Member &a = world.members[hit.batch_a.value - 1], &b = world.members[hit.batch_b.value - 1];
      const std::vector<ExactBox> of_a = exact_leaf_boxes(a.rig, a.poses, hit.instance_a),
                                  of_b = exact_leaf_boxes(b.rig, b.poses, hit.instance_b);
      const Point shift = exact_origin(b.poses, hit.instance_b) - exact_origin(a.poses, hit.instance_a);
      Real least = 1e30L;
      for (std::size_t x = 0; x < of_a.size(); ++x)
        for (std::size_t y = 0; y < of_b.size(); ++y)
          if (a.rig.leaves[x].link == hit.link_a && b.rig.leaves[y].link == hit.link_b)
            least = std::min(least, box_distance(of_a[x], of_b[y], shift + (center_of(of_b[y]) - center_of(of_a[x]))));
      const float own = margins[hit.batch_a.value - 1][hit.instance_a] + margins[hit.batch_b.value - 1][hit.instance_b];
      if (least <= static_cast<Real>(world.margin) + static_cast<Real>(own)) due.push_back(hit);
      ++(least <= static_cast<Real>(world.margin) + static_cast<Real>(own) ? near : beyond);
    }
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      const EnginePtr engine = make_engine_for(world, desc);
      for (const Refit refit : {Refit::kCab, Refit::kAabbVertices}) {
        const Outcome found = run_with(*engine, world, margins, policies_of(refit, Strategy::kAuto, Exact::kNone));
        CHECK(missing_from(due, found.hits) == 0);
      }
    }
  }
  CHECK(near >= least_count(500, 6));
  CHECK(beyond >= least_count(500, 6));
}

TEST_CASE("exact shapes decide at the margin of each pair, whatever pairs share its block") {
  std::size_t near = 0, beyond = 0;
  for (std::uint32_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(80 + seed);
    World world = two_crowds(random, 2);
    const Margins margins = all_margins(
        world, [&random] { return random.chance(0.4) ? 0.0f : static_cast<float>(random.uniform(0, 0.2)); });
    const Policies policies = policies_of(Refit::kCab, Strategy::kAuto, Exact::kConvex);
    const EnginePtr engine = make_engine_for(world);
    const Outcome found = run_with(*engine, world, margins, policies);
    World wide = world;
    wide.margin = 0.5f;
    wide.contacts = true;
    const Outcome all = run_on(*engine, wide, policies);
    for (std::size_t i = 0; i < all.hits.size(); ++i) {
      const Hit& hit = all.hits[i];
      const float gap = -all.contacts[i].depth, margin = margins[hit.batch_a.value - 1][hit.instance_a] +
                                                         margins[hit.batch_b.value - 1][hit.instance_b];
      const bool is_found = std::binary_search(found.hits.begin(), found.hits.end(), hit, link_less);
      if (gap <= margin - 1e-4f) CHECK(is_found);
      if (gap >= margin + 1e-4f && gap > 0) CHECK_FALSE(is_found);
      ++(gap <= margin ? near : beyond);
    }
    if (build_info().fcl) {
      const Outcome by_fcl = run_with(*engine, world, margins, policies_of(Refit::kCab, Strategy::kAuto, Exact::kFcl));
      CHECK(missing_from(found.hits, by_fcl.hits) <= found.hits.size() / 100);
      CHECK(missing_from(by_fcl.hits, found.hits) <= found.hits.size() / 100);
    }
  }
  CHECK(near >= least_count(300, 6));
  CHECK(beyond >= least_count(300, 6));
}

TEST_CASE("no crossing between two frames is lost, and not everything is reported") {
  constexpr int kMoments = 24;
  std::size_t crossings = 0, in_between = 0, reported = 0, all = 0;
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint32_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(500 + seed);
    World world;
    for (const std::uint32_t count : {17u, 40u}) world.members.push_back(rods(random, count, 1));
    world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {2}, Pairing::kBetween}, {{2}, {2}, Pairing::kBetween}};
    EngineDesc desc;
    if (random.chance(0.5)) desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    const double step = random.log_uniform(0.02, 0.5), turn = random.log_uniform(0.1, 3.1);
    World later = world;
    Margins margins;
    for (std::uint32_t m = 0; m < 2; ++m) {
      later.members[m].poses = after_step(random, world.members[m], step, turn);
      margins.push_back(margins_between(*engine, world.members[m].poses, later.members[m].poses, {m + 1}));
    }
    const std::vector<Hit> found = run_with(*engine, later, margins).hits;
    const std::vector<Hit> at_end = judge_world(later);
    for (int k = 0; k <= kMoments; ++k) {
      World moment = world;
      for (std::size_t m = 0; m < 2; ++m)
        moment.members[m].poses =
            between(world.members[m].poses, later.members[m].poses, static_cast<double>(k) / kMoments);
      const std::vector<Hit> touching = judge_world(moment);
      CHECK(missing_from(touching, found) == 0);
      crossings += touching.size();
      in_between += missing_from(touching, at_end);
    }
    reported += found.size();
    all += 57 * 56 / 2 * 4;  // links of two rods each
  }
  CHECK(crossings >= least_count(1000, 10));
  CHECK(in_between >= least_count(300, 10));
  CHECK(reported * 4 < all * 3);
  MESSAGE(crossings << " links touch in a moment, " << in_between << " of them not in the end; " << reported << " of "
                    << all << " are reported");
}

TEST_CASE("two rods that pass through each other between two frames are reported") {
  Random random(1);
  World world;
  for (int m = 0; m < 2; ++m) {
    world.members.push_back(rods(random, 1, 1));
    Poses& poses = world.members[static_cast<std::size_t>(m)].poses;
    poses.data = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0.4f, 0, 0};
    poses.origins = {0, m == 0 ? -0.5 : 0.5, 0};
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  World later = world;
  std::swap(later.members[0].poses.origins, later.members[1].poses.origins);
  const EnginePtr engine = make_engine_for(world);
  CHECK(run_on(*engine, world, {}).hits.empty());
  CHECK(run_on(*engine, later, {}).hits.empty());
  Margins margins;
  for (std::uint32_t m = 0; m < 2; ++m) {
    margins.push_back(margins_between(*engine, world.members[m].poses, later.members[m].poses, {m + 1}));
    CHECK(margins[m][0] >= 1);
    CHECK(margins[m][0] <= 1.001f);  // no more than they moved
  }
  CHECK(run_with(*engine, later, margins).hits.size() == 4);
}

TEST_CASE("a sweep is the same in every pose format, with orientations and scales, on every instruction set") {
  Random random(3);
  const Rig rig = any_rig(random, 10);
  std::vector<float> expected;
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns})
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      const EnginePtr engine = make_engine(desc);
      const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 37);
      Random same(4);  // the same draws in every format
      Poses last = random_poses(same, rig, 37, format, {1, true, true, {}});
      Poses now = random_poses(same, rig, 37, format, {1, true, true, {}});
      for (Poses* const poses : {&last, &now})
        for (int i = 0; i < 37; ++i) poses->scales.push_back(static_cast<float>(same.uniform(0.5, 2)));
      const std::vector<float> margins = margins_between(*engine, last, now, batch);
      if (expected.empty()) expected = margins;
      for (std::size_t i = 0; i < 37; ++i)
        CHECK(margins[i] == doctest::Approx(static_cast<double>(expected[i])).epsilon(1e-4));
      if (isa == available_isas().front()) continue;
      desc.isa = available_isas().front();
      const EnginePtr first = make_engine(desc);
      const BatchId batch_of_first = add_instances(*first, add_rig(*first, rig), 37);
      const std::vector<float> by_first = margins_between(*first, last, now, batch_of_first);
      CHECK(std::memcmp(margins.data(), by_first.data(), 37 * sizeof(float)) == 0);
    }
}

TEST_CASE("a leaf far from its link's origin moves as far as the scale of its instance takes it") {
  World world;
  Member member;
  member.rig.parents = {-1};
  member.rig.leaves = {{0, {{10, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.1f, 0.1f, 0.1f}}, {}}};
  member.poses.link_count = member.poses.instance_count = 1;
  member.poses.data = {0, 0, 0, 1, 0, 0, 0};
  member.poses.scales = {1};
  world.members = {member};
  const EnginePtr engine = make_engine_for(world);
  Poses now = member.poses;
  now.scales = {2};
  const float margin = margins_between(*engine, member.poses, now, {1})[0];
  CHECK(margin >= 10.101f);  // of a corner
  CHECK(margin <= 10.18f);
}

TEST_CASE("instances that are masked or missing in one of two frames have no margin") {
  Random random(5);
  const Rig rig = any_rig(random, 6);
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 40);
  const PoseRange range = {1, false, true, {}};
  Poses last = random_poses(random, rig, 40, PoseFormat::kQuaternionTranslation, range),
        now = random_poses(random, rig, 40, PoseFormat::kQuaternionTranslation, range);
  last.pose(3, 0)[4] = NAN;
  now.pose(7, 0)[0] = now.pose(7, 0)[1] = now.pose(7, 0)[2] = now.pose(7, 0)[3] = 0;
  std::vector<std::uint32_t> listed;
  for (std::uint32_t i = 0; i < 40; i += 1 + i % 3) listed.push_back(i);
  BatchInput from = last.input(batch), to = now.input(batch);
  from.instances = listed;
  to.count = 35;
  std::vector<float> margins(40, -1);
  REQUIRE(sweep_margins(*engine, from, to, margins) == Status::kOk);
  for (std::uint32_t i = 0; i < 40; ++i) {
    CAPTURE(i);
    const bool in_both = i < 35 && std::binary_search(listed.begin(), listed.end(), i) && i != 3 && i != 7;
    CHECK((margins[i] > 0) == in_both);
    CHECK((margins[i] == -1) == (i >= 35));
  }
}

TEST_CASE("margins out of range are refused, and so is a sweep of anything but one batch of characters") {
  Random random(6);
  World world = two_crowds(random, 2);
  const EnginePtr engine = make_engine_for(world);
  const Poses& poses = world.members[0].poses;
  std::vector<float> margins(20, 0.1f);
  const auto status = [&](Span<const float> given) {
    BatchInput input = poses.input({1});
    input.margins = given;
    FrameJob job;
    job.inputs = {&input, 1};
    return run_frame(*engine, job);
  };
  CHECK(status({margins.data(), 20}) == Status::kOk);
  CHECK(status({margins.data(), 19}) == Status::kBadMargins);
  CHECK(status({nullptr, 20}) == Status::kBadMargins);
  for (const float bad : {-1.0f, NAN, HUGE_VALF, 2 * kMaxCoordinate}) {
    margins[19] = bad;
    CHECK(status({margins.data(), 20}) == Status::kBadMargins);
  }
  margins[19] = kMaxCoordinate;
  CHECK(status({margins.data(), 20}) == Status::kOk);

  const auto sweep = [&](const BatchInput& last, const BatchInput& now, Span<float> out) {
    return sweep_margins(*engine, last, now, out);
  };
  const BatchInput first = poses.input({1}), second = world.members[1].poses.input({2});
  std::vector<float> out(40);
  CHECK(sweep(first, first, {out.data(), 20}) == Status::kOk);
  CHECK(sweep(first, second, {out.data(), 40}) == Status::kBadBatchKind);
  CHECK(sweep(first, first, {out.data(), 19}) == Status::kBadOutput);
  CHECK(sweep(first, first, {nullptr, 20}) == Status::kBadOutput);
  CHECK(sweep({}, first, {out.data(), 20}) == Status::kUnknownBatch);
  CHECK(sweep(first, {}, {out.data(), 20}) == Status::kUnknownBatch);
  const BatchId frames = add_instances(*engine, {1}, 20, BatchKind::kSequence);
  BatchInput sequence = first;
  sequence.batch = frames;
  CHECK(sweep(sequence, sequence, {out.data(), 20}) == Status::kBadBatchKind);
  sequence.margins = {margins.data(), 20};
  FrameJob job;
  job.inputs = {&sequence, 1};
  CHECK(run_frame(*engine, job) == Status::kBadMargins);
}

}  // namespace cab::tests
