// The frame of a crowd finds what a test of all leaf pairs finds, whatever the crowd looks like and looked like before.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/exact_pose.h"
#include "tests/engine/small_store.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::has_grown;
using cab::tests::least_count;
using cab::tests::rounds;
using cab::tests::shrink_store;

constexpr Policies kByRows = {Refit::kCab, Strategy::kRows, Exact::kNone};

// A policy that needs neither bounds of leaves nor strips for the same hits.
Policies by_all_pairs(Policies policies) {
  policies.strategy = Strategy::kBrute;
  return policies;
}

void add_rules(World& world) {
  for (std::uint32_t a = 1; a <= world.members.size(); ++a)
    for (std::uint32_t b = a; b <= world.members.size(); ++b) world.rules.push_back({{b}, {a}, Pairing::kBetween});
}

// Poses that the frame of a crowd takes: quaternions, some with orientations and scales.
Member crowd_member(Random& random, std::uint32_t instances, unsigned most_links, PoseRange range) {
  Member member;
  member.rig = any_rig(random, most_links);
  if (random.chance(0.5)) {  // one leaf per link, in the order of links: leaf pairs are link pairs
    const auto links = static_cast<unsigned>(random.log_uniform(2, most_links + 0.999));
    member.rig = random_rig(random, static_cast<Topology>(random.index(3)), links, 1);
    std::sort(member.rig.leaves.begin(), member.rig.leaves.end(),
              [](const Leaf& x, const Leaf& y) { return x.link < y.link; });
  }
  member.poses = random_poses(random, member.rig, instances, PoseFormat::kQuaternionTranslation, range);
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < instances; ++i)
      member.poses.scales.push_back(static_cast<float>(random.chance(0.2) ? 1 : random.log_uniform(0.3, 3)));
  return member;
}

World crowd_world(Random& random, unsigned most_links) {
  World world;
  const bool far = random.chance(0.3);
  const oracle::Vec3<double> about = (far ? random.log_uniform(1e6, 1e9) : 0) * random.unit_vector();
  const std::uint32_t members = 1 + random.index(3);
  const double spread = random.uniform(0.5, 4);
  for (std::uint32_t m = 0; m < members; ++m)
    world.members.push_back(
        crowd_member(random, 1 + random.index(70), most_links, any_pose_range(random, far, about, spread)));
  add_rules(world);
  return world;
}

// Whether all candidates of the last frame were tested by words.
bool was_crowd(const Engine& engine) { return engine.crowd.only_words; }

void check_same_counts(const FrameStats& a, const FrameStats& b) {
  CHECK(a.candidates == b.candidates);
  CHECK(a.candidates_apart == b.candidates_apart);
  CHECK(a.box_tests == b.box_tests);
  CHECK(a.leaf_pairs == b.leaf_pairs);
  CHECK(a.exact_tests == b.exact_tests);
  CHECK(a.false_positives == b.false_positives);
  CHECK(a.instances_masked == b.instances_masked);
}

// Runs a frame, and counts those that go by bands and their strays.
std::size_t frames_by_bands = 0, strays_of_bands = 0;
Status run_and_count(Engine& engine, FrameJob& job) noexcept {
  const Status status = run_frame(engine, job);
  frames_by_bands += engine.crowd.by_bands;
  strays_of_bands += engine.crowd.by_bands ? engine.crowd.bands.strays : 0;
  return status;
}

// Asks for the candidates of bounds that lie elsewhere than those of any frame. This overwrites the crowd's strips.
void ask_for_candidates(Random& random, Engine& engine, const World& world) {
  const Poses& poses = world.members[0].poses;
  std::vector<float> bounds;
  for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
    for (int c = 0; c < 3; ++c) bounds.push_back(static_cast<float>(random.uniform(-300, 300)));
    for (int c = 0; c < 3; ++c) bounds.push_back(bounds[bounds.size() - 3] + 4);
  }
  BatchInput input = poses.input({1});
  input.bounds = bounds;
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  std::vector<InstancePair> pairs(10000);
  CandidateList list;
  list.pairs = pairs;
  REQUIRE(find_candidates(engine, job, list) == Status::kOk);
}

// Runs a frame in which all instances of one batch have margins of their own.
std::vector<float> margins_of_all;
Status run_with_margins(Engine& engine, FrameJob& job) noexcept {
  BatchInput input = job.inputs[0];
  input.margins = margins_of_all;
  FrameJob with = job;
  with.inputs = {&input, 1};
  const Status status = run_frame(engine, with);
  with.inputs = job.inputs;
  job = with;
  return status;
}

// Spoils some instances so that they are masked, or nearly are.
void spoil_some(Random& random, Poses& poses) {
  const std::size_t link_floats = poses.floats_per_pose();
  for (std::uint32_t i = 0; i < poses.instance_count; ++i) {
    if (!random.chance(0.1)) continue;
    float* const pose = poses.pose(i, random.index(static_cast<unsigned>(poses.link_count)));
    switch (random.index(5)) {
      case 0: pose[random.index(static_cast<unsigned>(link_floats))] = std::numeric_limits<float>::quiet_NaN(); break;
      case 1: std::fill_n(pose, 4, 0.0f); break;
      case 2: std::fill_n(pose, 4, 1e4f); break;
      case 3: pose[4 + random.index(3)] = 5e17f; break;
      default: pose[4 + random.index(3)] = 2e18f;
    }
  }
}

}  // namespace

TEST_CASE("a crowd has the hits of all leaf pairs, and loses no touching pair") {
  std::size_t hits = 0, crowds = 0;
  Random random(101);
  for (std::uint64_t round = 0; round < rounds(60); ++round) {
    CAPTURE(round);
    World world = crowd_world(random, round % 4 == 0 ? 60 : 16);
    if (random.chance(0.3)) add_layers(random, world);
    if (random.chance(0.3)) world.margin = static_cast<float>(random.log_uniform(1e-4, 0.3));
    const bool spoiled = random.chance(0.3);
    if (spoiled)
      for (Member& member : world.members) spoil_some(random, member.poses);
    Policies policies = kByRows;
    if (random.chance(0.3)) policies.sat = Sat::kFaces6;
    if (random.chance(0.3)) policies.exact = Exact::kConvex;
    const EnginePtr engine = make_engine_for(world);
    const Outcome all = run_on(*engine, world, by_all_pairs(policies));
    const Outcome got = run_on(*engine, world, policies);
    crowds += was_crowd(*engine);
    CHECK(same_hits(got.hits, all.hits));
    CHECK(std::is_sorted(got.hits.begin(), got.hits.end(), link_less));
    CHECK(got.flags == all.flags);
    CHECK(got.in_contact == all.in_contact);
    CHECK(got.stats.leaf_pairs == all.stats.leaf_pairs);
    CHECK(got.stats.instances_masked == all.stats.instances_masked);
    if (!spoiled) CHECK(missing_from(judge_world(world), got.hits) == 0);
    hits += got.hits.size();
  }
  CHECK(crowds > rounds(60) * 9 / 10);
  CHECK(hits >= least_count(5000, 60));
}

TEST_CASE("placed boxes at the edge of touching have the hits of all leaf pairs") {
  const std::uint64_t usual = 200;
  const std::uint32_t count = 64;
  std::size_t hits = 0, pairs = 0;
  Random random(109);
  for (std::uint64_t round = 0; round < rounds(usual); ++round) {
    CAPTURE(round);
    Rig rig;
    rig.parents = {-1};
    rig.parent_offset = {{}};
    rig.leaves = {{0, random_box(random, random.uniform(0, 1) * random.unit_vector(), 0.1, 0.5), {}}};
    Member member = {rig, random_poses(random, rig, count, PoseFormat::kQuaternionTranslation, {1, true, true, {}}),
                     BatchKind::kCharacters};
    Poses& poses = member.poses;
    const bool scaled = random.chance(0.5), has_margins = random.chance(0.5);
    std::vector<float> margins;
    // The second of each two instances is like the first, but moved along an axis of its box by about a length of it.
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t first = i & ~1u;
      if (scaled)
        poses.scales.push_back(i == first ? static_cast<float>(random.log_uniform(1e-2, 1e2)) : poses.scales[first]);
      if (has_margins) margins.push_back(i == first ? static_cast<float>(random.log_uniform(1e-3, 1)) : margins[first]);
      for (std::size_t c = 0; c < 3; ++c) poses.origins[3 * i + c] = 1e3 * i * (c == 0) + 0.1 * (c == 1);
      if (i == first) continue;
      std::copy_n(poses.pose(first, 0), 7, poses.pose(i, 0));
      std::copy_n(&poses.orientations[4 * first], 4, &poses.orientations[4 * i]);
      const ExactBox box = exact_leaf_boxes(rig, poses, first)[0];
      const std::uint32_t k = random.index(3);
      const Point axis = axis_of(box, k);
      const Real grown = has_margins ? Real{margins[i]} : 0;  // half of the margin of two such instances
      const Real by =
          2 * (box.half[k] + grown) * (1 + Real{random.uniform(-60, 400)} * 0x1p-24L) / std::sqrt(dot(axis, axis));
      for (std::size_t c = 0; c < 3; ++c)
        poses.origins[3 * i + c] = poses.origins[3 * first + c] + static_cast<double>(by * axis[c]);
    }
    World world;
    world.members = {member};
    add_rules(world);
    const EnginePtr engine = make_engine_for(world);
    margins_of_all = margins;
    const Outcome all = run_on(*engine, world, by_all_pairs(kByRows), run_with_margins),
                  got = run_on(*engine, world, kByRows, run_with_margins);
    CHECK(was_crowd(*engine));
    CHECK(same_hits(got.hits, all.hits));
    hits += got.hits.size();
    pairs += count / 2;
  }
  CHECK(hits > pairs / 20);
  CHECK(hits < pairs * 19 / 20);
}

TEST_CASE("where some have words and some have none, by any rules and reports, hits are those of all leaf pairs") {
  std::size_t hits = 0, mixed = 0, touching = 0;
  Random random(108);
  for (std::uint64_t round = 0; round < rounds(60); ++round) {
    CAPTURE(round);
    World world = crowd_world(random, 16);
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      Member& member = world.members[m];
      const std::uint32_t count = member.poses.instance_count;
      if (random.chance(0.4)) {
        const PoseFormat format = random.chance(0.5) ? PoseFormat::kMatrix3x4Rows : PoseFormat::kQuaternionTranslation;
        member.poses = random_poses(random, member.rig, count, format, {2, random.chance(0.7), true, {}});
      }
      if (random.chance(0.4)) world.rules.push_back({{m + 1}, {m + 1}, Pairing::kWithin});
      if (random.chance(0.3)) spoil_some(random, member.poses);
    }
    if (random.chance(0.3)) add_layers(random, world);
    Policies policies = kByRows;
    if (random.chance(0.3)) policies.strategy = Strategy::kAuto;
    if (random.chance(0.3)) policies.exact = Exact::kConvex;
    const EnginePtr engine = make_engine_for(world);
    const Outcome all = run_on(*engine, world, by_all_pairs(policies));
    const Outcome got = run_on(*engine, world, policies);
    mixed += !was_crowd(*engine);
    CHECK(same_hits(got.hits, all.hits));
    CHECK(got.flags == all.flags);
    CHECK(got.in_contact == all.in_contact);
    CHECK(run_on(*engine, world, policies, run_frame, Report::kInContact).in_contact == all.in_contact);
    hits += got.hits.size();
    touching += !got.hits.empty();
  }
  CHECK(hits >= least_count(5000, 60));
  CHECK(mixed >= least_count(20, 60));
  CHECK(touching >= least_count(30, 60));
}

TEST_CASE("hits and counts of a crowd are the same on every instruction set, and by any number of threads") {
  Random random(102);
  for (std::uint64_t round = 0; round < rounds(20); ++round) {
    CAPTURE(round);
    World world = crowd_world(random, 40);
    for (Member& member : world.members) spoil_some(random, member.poses);
    const EnginePtr first = make_engine_for(world);
    const Outcome expected = run_on(*first, world, kByRows);
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 2u}) {
        EngineDesc desc;
        desc.isa = isa;
        desc.thread_count = threads;
        CAPTURE(static_cast<int>(isa));
        CAPTURE(threads);
        const EnginePtr engine = make_engine_for(world, desc);
        for (int frame = 0; frame < 2; ++frame) {
          const Outcome got = run_on(*engine, world, kByRows);
          CHECK(same_hits(got.hits, expected.hits));
          CHECK(got.flags == expected.flags);
          check_same_counts(got.stats, expected.stats);
        }
      }
  }
}

TEST_CASE("what a crowd was in earlier frames changes neither hits nor counts nor boxes' bounds") {
  Random random(103);
  std::size_t hits = 0;
  for (std::uint64_t round = 0; round < rounds(12); ++round) {
    CAPTURE(round);
    World world = crowd_world(random, 20);
    const EnginePtr engine = make_engine_for(world);
    for (int frame = 0; frame < 6; ++frame) {
      CAPTURE(frame);
      for (Member& member : world.members) {
        const double part = random.index(3) == 0 ? 1.0 : 0.1;  // of the instances that move elsewhere
        const Poses other = random_poses(random, member.rig, member.poses.instance_count,
                                         PoseFormat::kQuaternionTranslation, {3, false, false, {}});
        const std::size_t floats = member.poses.link_count * member.poses.floats_per_pose();
        for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
          if (random.chance(part)) std::copy_n(&other.data[i * floats], floats, &member.poses.data[i * floats]);
        if (random.chance(0.3)) spoil_some(random, member.poses);
      }
      world.margin = random.chance(0.3) ? 0.05f : 0;
      const EnginePtr fresh = make_engine_for(world);
      const Outcome expected = run_on(*fresh, world, kByRows), got = run_on(*engine, world, kByRows);
      CHECK(same_hits(got.hits, expected.hits));
      CHECK(got.flags == expected.flags);
      check_same_counts(got.stats, expected.stats);
      for (std::size_t m = 0; m < world.members.size(); ++m) {
        const Span<const InstanceBounds> a = engine->batches[m]->batch.bounds, b = fresh->batches[m]->batch.bounds;
        bool same = true;
        for (std::uint32_t i = 0; i < world.members[m].poses.instance_count; ++i)
          if (engine->batches[m]->batch.live[i / kLanes] >> i % kLanes & 1)
            same = same && std::memcmp(&a[i], &b[i], sizeof a[i]) == 0;
        CHECK(same);
      }
      hits += got.hits.size();
    }
  }
  CHECK(hits >= least_count(1000, 12));
}

TEST_CASE("a crowd in one line, in towers, in one spot, far apart, or with giants has the hits of all leaf pairs") {
  Random random(104);
  enum Shape { kLine, kTowers, kSpot, kDense, kApart, kGiants, kManySizes, kBeyondFloats, kShapeCount };
  for (int shape = 0; shape < kShapeCount; ++shape)
    for (std::uint64_t round = 0; round < rounds(3); ++round) {
      CAPTURE(shape);
      CAPTURE(round);
      constexpr std::uint32_t kCount = 150;
      World world;
      world.members.push_back(crowd_member(random, kCount, 6, {0.1, false, true, {}}));
      add_rules(world);
      Poses& poses = world.members[0].poses;
      poses.origins.assign(3 * kCount, 0.0);
      const std::size_t floats = poses.link_count * poses.floats_per_pose();
      const std::uint32_t axis = random.index(3);
      for (std::uint32_t i = 0; i < kCount; ++i) {
        double* const origin = &poses.origins[3 * i];
        double size = 1;
        for (std::uint32_t c = 0; c < 3; ++c) origin[c] = random.uniform(-3, 3);
        if (shape == kLine)
          for (std::uint32_t c = 0; c < 3; ++c) origin[c] = c == axis ? 0.3 * i : 0.0;
        if (shape == kTowers)
          for (std::uint32_t c = 0; c < 3; ++c) origin[c] = c == axis ? 0.2 * (i / 5) : 9.0 * (i % 5);
        if (shape == kSpot) std::fill_n(origin, 3, 0.0);
        if (shape == kDense)  // strips are as low as the extent of a character lets them be
          for (std::uint32_t c = 0; c < 3; ++c) origin[c] *= 0.7;
        if (shape == kApart)
          for (std::uint32_t c = 0; c < 3; ++c) origin[c] = random.uniform(0, 2) + 1e7 * random.index(3);
        if (shape == kGiants && i % 50 == 7) size = 40;
        if (shape == kBeyondFloats && i < 2) origin[axis] = round == 0 ? 1e39 : round == 1 ? -1e39 : 1e300;
        if (shape == kBeyondFloats && i == 1) std::copy_n(&poses.origins[0], 3, origin);
        if (shape == kManySizes) size = random.log_uniform(1e-3, 1e2);
        if (shape == kManySizes)
          for (std::uint32_t c = 0; c < 3; ++c) origin[c] *= size;
        for (std::size_t f = 0; f < floats; ++f)
          if (f % poses.floats_per_pose() >= 4) poses.data[i * floats + f] *= static_cast<float>(size);
      }
      const EnginePtr engine = make_engine_for(world);
      const Outcome all = run_on(*engine, world, by_all_pairs(kByRows));
      for (int frame = 0; frame < 2; ++frame) {
        const Outcome got = run_on(*engine, world, kByRows);
        CHECK(same_hits(got.hits, all.hits));
        CHECK(got.in_contact == all.in_contact);
      }
      CHECK(!all.hits.empty());
      CHECK(was_crowd(*engine));
    }
}

TEST_CASE("a crowd that moves goes by bands, with strays, and has the hits and counts of a fresh engine") {
  constexpr std::uint32_t kCount = 700;
  for (const std::uint32_t threads : {1u, 2u}) {
    Random random(106);
    EngineDesc desc;
    desc.thread_count = threads;
    CAPTURE(threads);
    World world;
    world.members.push_back(crowd_member(random, kCount, 5, {0.3, false, true, {}}));
    add_rules(world);
    Poses& poses = world.members[0].poses;
    poses.origins.assign(3 * kCount, 0.0);
    for (std::uint32_t i = 0; i < kCount; ++i)
      for (std::uint32_t c = 0; c < 2; ++c) poses.origins[3 * i + c] = random.uniform(-25, 25);
    const EnginePtr engine = make_engine_for(world, desc);
    frames_by_bands = strays_of_bands = 0;
    std::size_t hits = 0;
    for (int frame = 0; frame < 40; ++frame) {
      CAPTURE(frame);
      for (std::uint32_t i = 0; i < kCount; ++i) {
        double* const origin = &poses.origins[3 * i];
        for (std::uint32_t c = 0; c < 2; ++c) origin[c] += random.uniform(-0.1, 0.1);
        const bool elsewhere = frame == 20 || (frame % 3 == 0 && random.chance(0.02));
        for (std::uint32_t c = 0; c < 2 && elsewhere; ++c) origin[c] = random.uniform(-27, 27);
        origin[2] = random.chance(0.01) ? std::numeric_limits<double>::max() / 4 : 0;
        if (frame < 30) origin[2] = 0;
      }
      if (frame % 7 == 5) poses.pose(random.index(kCount), 0)[0] = std::numeric_limits<float>::quiet_NaN();
      if (frame % 10 == 9)
        for (int f = 4; f < 7; ++f) poses.pose(random.index(kCount), 0)[f] *= 50;
      if (frame == 15) world.margin = 0.1f;
      if (frame == 12 || frame == 28) ask_for_candidates(random, *engine, world);
      const EnginePtr fresh = make_engine_for(world, desc);
      const Outcome got = run_on(*engine, world, kByRows, run_and_count), expected = run_on(*fresh, world, kByRows);
      const Outcome all = run_on(*fresh, world, by_all_pairs(kByRows));
      CHECK(same_hits(got.hits, expected.hits));
      CHECK(same_hits(got.hits, all.hits));
      CHECK(got.flags == expected.flags);
      CHECK(got.in_contact == expected.in_contact);
      check_same_counts(got.stats, expected.stats);
      hits += got.hits.size();
    }
    CHECK(frames_by_bands > 40);
    CHECK(strays_of_bands > 100);
    CHECK(hits > 1000);
  }
}

TEST_CASE("a crowd with more hits than ever before has all of them, and the store grows") {
  Random random(105);
  constexpr std::uint32_t kCount = 1200;
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kChain, 12, 1);
  member.poses = random_poses(random, member.rig, kCount, PoseFormat::kQuaternionTranslation, {0.02, false, false, {}});
  world.members.push_back(member);
  add_rules(world);
  const EnginePtr engine = make_engine_for(world);
  const Outcome all = run_on(*engine, world, by_all_pairs(kByRows));
  shrink_store(*engine);
  const Outcome got = run_on(*engine, world, kByRows);
  CHECK(was_crowd(*engine));
  CHECK(has_grown(*engine));
  CHECK(same_hits(got.hits, all.hits));
  CHECK(got.in_contact == all.in_contact);
  CHECK(got.stats.leaf_pairs == all.stats.leaf_pairs);
}

TEST_CASE("an empty list of instances that points somewhere lists nobody, and all are given") {
  Random random(109);
  World world;
  world.members.push_back(crowd_member(random, 40, 6, {0.5, false, false, {}}));
  add_rules(world);
  const EnginePtr engine = make_engine_for(world);
  const Outcome expected = run_on(*engine, world, kByRows);
  const std::uint32_t nobody[40] = {1000, 2000, 3000};
  BatchInput input = world.members[0].poses.input({1});
  input.instances = {nobody, 0};
  std::vector<Hit> hits(expected.hits.size());
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.policies = kByRows;
  job.hits = hits;
  const EnginePtr other = make_engine_for(world);
  REQUIRE(run_frame(*other, job) == Status::kOk);
  CHECK(was_crowd(*other));
  CHECK(same_hits(hits, expected.hits));
  CHECK(!hits.empty());
}

TEST_CASE("a frame that is given up in its first step leaves nothing behind, whoever rested") {
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const std::uint32_t count = 400 + random.index(800);
    World world;
    world.members.push_back({random_rig(random, Topology::kChain, 3, 1), {}, BatchKind::kCharacters});
    Poses& poses = world.members[0].poses;
    poses = random_poses(random, world.members[0].rig, count, PoseFormat::kQuaternionTranslation, {5, false, true, {}});
    add_rules(world);
    const EnginePtr engine = make_engine_for(world);
    std::vector<std::uint8_t> moved(count, 1);
    std::vector<Hit> hits(500000);
    for (int frame = 0; frame < 8; ++frame) {
      CAPTURE(frame);
      BatchInput input = poses.input({1});
      if (frame < 3) input.moved = moved;
      FrameJob job;
      job.inputs = {&input, 1};
      job.rules = world.rules;
      job.policies = kByRows;
      job.hits = hits;
      if (frame == 2) {  // all rest
        REQUIRE(begin_frame(*engine, job) == Status::kOk);
        std::uint32_t tasks = 0;
        REQUIRE(next_tasks(*engine, &tasks) == Status::kOk);
        for (std::uint32_t t = 0; t < tasks; ++t) REQUIRE(run_task(*engine, t, 0) == Status::kOk);
        CHECK(end_frame(*engine) == Status::kTasksLeft);
        continue;
      }
      REQUIRE(run_frame(*engine, job) == Status::kOk);
      if (frame > 2)
        CHECK(same_hits({hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(job.hit_count)},
                        run_world(world, by_all_pairs(kByRows)).hits));
      moved.assign(count, 0);
      if (frame > 2)
        for (double& origin : poses.origins) origin += random.uniform(-0.02, 0.02);
    }
  }
}

TEST_CASE("strips have room where instances of all sizes rest and some of them move again") {
  for (const std::uint32_t count : {40u, 80u, 160u, 320u}) {
    CAPTURE(count);
    Random random(count);
    World world;
    Member member;
    member.rig = random_rig(random, Topology::kChain, 2, 1);
    member.poses = random_poses(random, member.rig, count, PoseFormat::kQuaternionTranslation, {1, false, true, {}});
    world.members.push_back(member);
    add_rules(world);
    Poses& poses = world.members[0].poses;
    const auto place = [&](std::uint32_t i) {
      for (int c = 0; c < 3; ++c)
        poses.origins[3 * i + static_cast<std::size_t>(c)] = c == 1 ? random.uniform(-1e4, 1e4) : 0;
      poses.pose(i, 1)[4] = -std::pow(4.0f, static_cast<float>(i % 5 < 2 ? i / 5 % 15 : 0));
    };
    for (std::uint32_t i = 0; i < count; ++i) place(i);
    const EnginePtr engine = make_engine_for(world);
    std::vector<std::uint8_t> moved(count, 1);
    std::vector<Hit> hits(100000);
    for (int frame = 0; frame < 6; ++frame) {
      CAPTURE(frame);
      if (frame > 0) moved.assign(count, 0);
      for (std::uint32_t i = 0; frame == 3 && i < std::min(count, count / 16 + 64); ++i) {
        moved[i] = 1;
        place(i);
      }
      BatchInput input = poses.input({1});
      input.moved = moved;
      FrameJob job;
      job.inputs = {&input, 1};
      job.rules = world.rules;
      job.policies = kByRows;
      job.hits = hits;
      REQUIRE(run_frame(*engine, job) == Status::kOk);
      const Crowd& crowd = engine->crowd;
      CHECK(std::max(crowd.kept.end_strip, crowd.classes.end_strip) <= crowd.strip_begin.size);
      CHECK(crowd.classes.of[0].strips < crowd.strip_first.size);
      CHECK(same_hits({hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(job.hit_count)},
                      run_world(world, by_all_pairs(kByRows)).hits));
    }
  }
}

TEST_CASE("find_candidates of other batches leaves the bounds of a crowd's last frame to those who ask") {
  Random random(110);
  World world;
  world.members = {crowd_member(random, 1000, 4, {5, false, true, {}}),
                   crowd_member(random, 20, 4, {5, false, true, {}})};
  add_rules(world);
  const EnginePtr engine = make_engine_for(world), other = make_engine_for(world);
  std::vector<std::uint32_t> expected(20), order(20);
  for (const EnginePtr* const of : {&engine, &other}) {
    std::vector<BatchInput> inputs = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
    inputs[0].count = 10;
    std::vector<Hit> hits(100000);
    FrameJob job;
    job.inputs = inputs;
    job.rules = world.rules;
    job.policies = kByRows;
    job.hits = hits;
    REQUIRE(run_frame(**of, job) == Status::kOk);
    CHECK(was_crowd(**of));
  }
  std::vector<float> bounds;
  for (int i = 0; i < 1000; ++i) bounds.insert(bounds.end(), {-1, -1, -1, 1, 1, 1});
  BatchInput only = world.members[0].poses.input({1});
  only.bounds = bounds;
  const PairRule rule = {{1}, {1}};
  std::vector<InstancePair> pairs(1000000);
  FrameJob job;
  job.inputs = {&only, 1};
  job.rules = {&rule, 1};
  CandidateList list;
  list.pairs = pairs;
  REQUIRE(find_candidates(*engine, job, list) == Status::kOk);
  REQUIRE(spatial_order(*engine, {2}, order) == Status::kOk);
  REQUIRE(spatial_order(*other, {2}, expected) == Status::kOk);
  CHECK(order == expected);
}

TEST_CASE("characters beyond all floats meet those without words, and themselves") {
  Random random(3);
  for (const double origin : {0.0, 1e38, 1e39, 1e300, 3e300, -3e300, 1e307}) {
    CAPTURE(origin);
    World world;
    for (const PoseFormat format : {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows}) {
      Member member;
      member.rig = random_rig(random, Topology::kTree, 5, 2);
      member.poses = random_poses(random, member.rig, 8, format, {0.3, false, true, {}});
      for (std::size_t i = 0; i < 8; ++i) member.poses.origins[3 * i] = origin;
      world.members.push_back(member);
    }
    world.rules = {{{1}, {2}}, {{1}, {1}}, {{1}, {1}, Pairing::kWithin}};
    const Outcome got = run_world(world, kByRows);
    CHECK(same_hits(got.hits, run_world(world, by_all_pairs(kByRows)).hits));
    CHECK(got.hits.size() > 100);
  }
}

TEST_CASE("batches come and go between the frames of a crowd") {
  Random random(107);
  World world;
  for (int m = 0; m < 3; ++m) world.members.push_back(crowd_member(random, 40, 6, {0.5, false, false, {}}));
  add_rules(world);
  const EnginePtr engine = make_engine_for(world);
  run_on(*engine, world, kByRows);
  REQUIRE(was_crowd(*engine));
  require(remove_batch(*engine, {3}));
  world.members.pop_back();
  world.rules.clear();
  add_rules(world);
  const Outcome got = run_on(*engine, world, kByRows), expected = run_on(*make_engine_for(world), world, kByRows);
  CHECK(same_hits(got.hits, expected.hits));
  CHECK(!got.hits.empty());
  ReserveDesc more;
  more.characters = 500;
  more.batches = 8;
  require(reserve(*engine, more));
  CHECK(same_hits(run_on(*engine, world, kByRows).hits, expected.hits));
}

TEST_CASE("a crowd that leaves its strips gets others") {
  Random random(108);
  constexpr std::uint32_t kCount = 600;
  World world;
  world.members.push_back(crowd_member(random, kCount, 3, {0.2, false, true, {}}));
  add_rules(world);
  Poses& poses = world.members[0].poses;
  poses.origins.assign(3 * kCount, 0.0);
  for (std::uint32_t i = 0; i < kCount; ++i)
    for (std::uint32_t c = 0; c < 2; ++c) poses.origins[3 * i + c] = random.uniform(0, c == 0 ? 40 : 20);
  const EnginePtr engine = make_engine_for(world);
  std::uint32_t most = 0;
  for (int frame = 0; frame < 60; ++frame) {
    for (std::uint32_t i = 0; i < kCount; ++i) poses.origins[3 * i + 1] += 0.4;
    const Outcome got = run_on(*engine, world, kByRows);
    if (frame % 10 == 9) CHECK(same_hits(got.hits, run_on(*make_engine_for(world), world, kByRows).hits));
    const Crowd& crowd = engine->crowd;
    for (std::uint32_t s = 0; s < crowd.classes.of[0].strips; ++s)
      most = std::max(most, crowd.strip_first[s + 1] - crowd.strip_first[s]);
  }
  CHECK(most < kCount / 2);
}
