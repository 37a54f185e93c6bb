// Frames against a judge: no pair is lost or invented, for any strategy, kind of batch and range of numbers.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;

// How much wider than exact the boxes of a reported pair may have to be made to touch: poses and slack together (some
// 100 u of the sizes and distances), with room for edges that are nearly parallel.
constexpr double kInvented = 1e-4;

constexpr Policies kCabTree = {Refit::kCab, Strategy::kTree, Exact::kNone};
constexpr Policies kCabBrute = {Refit::kCab, Strategy::kBrute, Exact::kNone};
constexpr Policies kHullTree = {Refit::kAabbHull, Strategy::kTree, Exact::kNone};
constexpr Policies kHullBrute = {Refit::kAabbHull, Strategy::kBrute, Exact::kNone};

// Checks what holds for every frame of every world. Returns the number of its hits.
std::size_t check_world(const World& world) {
  const EnginePtr engine = make_engine_for(world);
  const Outcome tree = run_on(*engine, world, kCabTree);
  const Outcome brute = run_on(*engine, world, kCabBrute);
  CHECK(same_hits(tree.hits, brute.hits));
  CHECK(tree.stats.leaf_pairs == brute.stats.leaf_pairs);
  CHECK(tree.stats.instances_masked == 0);

  const Outcome hull_tree = run_on(*engine, world, kHullTree);
  const Outcome hull_brute = run_on(*engine, world, kHullBrute);
  CHECK(same_hits(hull_tree.hits, hull_brute.hits));
  CHECK(hull_tree.stats.leaf_pairs == hull_brute.stats.leaf_pairs);
  CHECK(hull_brute.stats.box_tests == brute.stats.box_tests);
  CHECK(missing_from(tree.hits, hull_tree.hits) == 0);

  const std::vector<Hit> touching = judge_world(world);
  CHECK(missing_from(touching, tree.hits) == 0);
  CHECK(missing_from(tree.hits, judge_world(world, kInvented)) == 0);

  std::size_t at = 0;
  for (const Hit& hit : tree.hits) {  // the lowest leaf pair of each link pair is kept
    const Rig &a = world.members[hit.batch_a.value - 1].rig, &b = world.members[hit.batch_b.value - 1].rig;
    CHECK(a.leaves[hit.leaf_a].link == hit.link_a);
    CHECK(b.leaves[hit.leaf_b].link == hit.link_b);
    while (at < touching.size() && link_less(touching[at], hit)) ++at;
    if (at < touching.size() && link_key(touching[at]) == link_key(hit)) CHECK(leaf_key(hit) <= leaf_key(touching[at]));
  }
  for (std::size_t i = 1; i < tree.hits.size(); ++i) CHECK(link_less(tree.hits[i - 1], tree.hits[i]));
  return tree.hits.size();
}

}  // namespace

TEST_CASE("characters: tree and brute report the same, lose no touching pair and invent none") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world);
    hits += check_world(world);
  }
  CHECK(hits > 10000);
}

TEST_CASE("sequences: tree and brute report the same, lose no touching pair and invent none") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_frames(random, world);
    hits += check_world(world);
  }
  CHECK(hits > 10000);
}

TEST_CASE("characters and sequences share a frame and are not paired with each other") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_frames(random, world, 8);
    add_characters(random, world, 8);
    add_frames(random, world, 8);
    check_world(world);
  }
}

TEST_CASE("a sequence of one frame has the hits and counts of the same instance among characters") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World frames;
    const PoseRange range = any_pose_range(random, seed % 2 == 0, {{1e7, -3e5, 2e8}}, 0.3);
    for (int m = 0; m < 3; ++m) frames.members.push_back(any_member(random, 1, BatchKind::kSequence, range, 32));
    pair_all(frames, 1, 3);
    World characters = frames;
    for (Member& member : characters.members) member.kind = BatchKind::kCharacters;
    for (const Policies& policies : {kCabTree, kCabBrute, kHullTree, kHullBrute}) {
      const Outcome by_lane = run_world(frames, policies), by_row = run_world(characters, policies);
      CHECK(same_hits(by_lane.hits, by_row.hits));
      CHECK(by_lane.stats.leaf_pairs == by_row.stats.leaf_pairs);
    }
    frames.rules = characters.rules = {{{2}, {2}, Pairing::kWithin}};  // neither has a broad phase, so all counts agree
    for (const Policies& policies : {kCabTree, kCabBrute, kHullTree, kHullBrute})
      CHECK(same_counts(run_world(frames, policies).stats, run_world(characters, policies).stats));
  }
}

TEST_CASE("a sequence of one frame is paired with every frame, as if it were given for each") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const std::uint32_t n = kInstanceCounts[random.index(6)];
    World once;
    const PoseRange range = any_pose_range(random, seed % 2 == 0, {{4e6, 1e6, -9e8}}, 0.4);
    once.members.push_back(any_member(random, 1, BatchKind::kSequence, range, 16));
    once.members.push_back(any_member(random, n, BatchKind::kSequence, range, 16));
    once.rules = {{{1}, {2}, Pairing::kBetween}};
    World repeated = once;
    Poses& poses = repeated.members[0].poses;
    const Poses table = poses;
    poses.instance_count = n;
    for (std::uint32_t i = 1; i < n; ++i) {
      poses.data.insert(poses.data.end(), table.data.begin(), table.data.end());
      poses.origins.insert(poses.origins.end(), table.origins.begin(), table.origins.end());
      poses.orientations.insert(poses.orientations.end(), table.orientations.begin(), table.orientations.end());
    }
    for (const Policies& policies : {kCabTree, kHullBrute}) {
      const Outcome of_once = run_world(once, policies);
      Outcome of_repeated = run_world(repeated, policies);
      CHECK(same_counts(of_once.stats, of_repeated.stats));
      for (Hit& hit : of_repeated.hits) hit.instance_a = 0;
      std::stable_sort(of_repeated.hits.begin(), of_repeated.hits.end(), link_less);
      CHECK(same_hits(of_once.hits, of_repeated.hits));
    }
  }
}

TEST_CASE("strides with gaps between links and instances change no bit") {
  Random random(11);
  World world;
  const PoseRange range = any_pose_range(random, false, {}, 0.5);
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    Member member;
    member.rig = any_rig(random, 16);
    member.poses = random_poses(random, member.rig, 17, format, range);
    world.members.push_back(member);
  }
  const EnginePtr engine = make_engine_for(world);
  for (std::uint32_t m = 0; m < 3; ++m) {
    CAPTURE(m);
    const Poses& poses = world.members[m].poses;
    const std::size_t floats = poses.floats_per_pose();
    const std::size_t link_stride = floats + 3, instance_stride = poses.link_count * link_stride + 5;
    std::vector<float> spaced(poses.instance_count * instance_stride, 1e30f);
    for (std::uint32_t i = 0; i < poses.instance_count; ++i)
      for (std::uint32_t l = 0; l < poses.link_count; ++l)
        std::copy_n(poses.pose(i, l), floats, spaced.data() + i * instance_stride + l * link_stride);
    std::vector<Box> dense_boxes(17 * world.members[m].rig.node_count()), spaced_boxes(dense_boxes.size());
    BatchInput input = poses.input({m + 1});
    REQUIRE(compute_boxes(*engine, input, {}, dense_boxes) == Status::kOk);
    input.poses.data = spaced.data();
    input.poses.link_stride = link_stride * sizeof(float);
    input.poses.instance_stride = instance_stride * sizeof(float);
    REQUIRE(compute_boxes(*engine, input, {}, spaced_boxes) == Status::kOk);
    CHECK(std::memcmp(dense_boxes.data(), spaced_boxes.data(), dense_boxes.size() * sizeof(Box)) == 0);
  }
}

TEST_CASE("frames without inputs, without rules, or with batches left out are empty or smaller, never wrong") {
  Random random(21);
  World world;
  add_characters(random, world, 8);
  add_frames(random, world, 8);
  const EnginePtr engine = make_engine_for(world);
  FrameJob empty;
  CHECK(run_frame(*engine, empty) == Status::kOk);
  CHECK(empty.hit_count == 0);
  CHECK(empty.hits_needed == 0);
  CHECK(empty.stats.box_tests == 0);

  World no_rules = world;
  no_rules.rules.clear();
  const Outcome posed_only = run_on(*engine, no_rules, {});
  CHECK(posed_only.hits.empty());
  CHECK(posed_only.stats.box_tests == 0);

  const EnginePtr bare = make_engine();
  FrameJob on_bare;
  CHECK(run_frame(*bare, on_bare) == Status::kOk);
}

TEST_CASE("an engine keeps nothing of a frame: the same frame after another one gives the same") {
  Random random(31);
  World world;
  add_characters(random, world, 16);
  add_frames(random, world, 16);
  World other = world;
  for (Member& member : other.members) {
    member.poses = random_poses(random, member.rig, member.poses.instance_count, PoseFormat::kMatrix3x4Rows,
                                {0.2, true, true, {{5, 5, 5}}});
    for (std::size_t i = 0; i < member.poses.data.size(); i += 7) member.poses.data[i] = 1e30f;
  }
  const EnginePtr engine = make_engine_for(world);
  const Outcome before = run_on(*engine, world, kCabTree);
  run_on(*engine, other, kHullBrute);
  run_on(*engine, other, kCabTree);
  const Outcome after = run_on(*engine, world, kCabTree);
  CHECK(before.hits.size() > 0);
  CHECK(same_hits(before.hits, after.hits));
  CHECK(same_counts(before.stats, after.stats));
}

TEST_CASE("a masked sequence of one frame takes no part in any frame, by every strategy") {
  Random random(4);
  World world;
  for (const std::uint32_t instances : {1u, 33u, 33u})  // a sequence of one frame is posed once for all frames
    world.members.push_back(any_member(random, instances, BatchKind::kSequence, {0.1, false, false, {}}, 8));
  pair_all(world, 1, 3);
  const auto hits_with_first = [&](const Policies& policies) {
    const std::vector<Hit> hits = run_world(world, policies).hits;
    return std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return hit.batch_a.value == 1; });
  };
  CHECK(hits_with_first(kCabTree) > 100);
  world.members[0].poses.pose(0, 0)[0] = std::numeric_limits<float>::quiet_NaN();
  for (const Refit refit : {Refit::kCab, Refit::kAabbHull})
    for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
      CAPTURE(static_cast<int>(refit));
      CAPTURE(static_cast<int>(strategy));
      CHECK(hits_with_first({refit, strategy, Exact::kNone}) == 0);
      const Outcome outcome = run_world(world, {refit, strategy, Exact::kNone});
      CHECK(outcome.hits.size() > 100);
      CHECK(outcome.stats.instances_masked == 1);
    }
}

// 150 candidates of 19 and 23 leaves have 65 550 leaf pairs, 14 more than a worker lists at a time. Rows write up to
// sixteen pairs past the last one.
TEST_CASE("candidates whose leaf pairs nearly fill a worker's list lose no pair and invent no pair") {
  World world;
  for (const auto& [leaves, instances] : {std::pair{19u, 10u}, std::pair{23u, 15u}}) {
    Rig rig;
    Random random(leaves);
    for (std::uint32_t link = 0; link < leaves; ++link) {
      rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
      rig.parent_offset.push_back({{0.01, 0, 0}});
      rig.leaves.push_back({link, random_box(random, {}, 1, 2), {}});
    }
    world.members.push_back(
        {rig, random_poses(random, rig, instances, PoseFormat::kMatrix3x4Rows, {0.1, false, true, {}})});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  const std::vector<Hit> expected = run_world(world, kCabBrute).hits;
  CHECK(expected.size() == 150 * 19 * 23);
  for (const Isa isa : available_isas())
    for (const Strategy strategy : {Strategy::kRows, Strategy::kTree}) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      CHECK(same_hits(run_world(world, {Refit::kCab, strategy, Exact::kNone}, desc).hits, expected));
    }
}
