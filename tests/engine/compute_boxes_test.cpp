// compute_boxes: a leaf box contains the exactly posed one, an inner box all boxes below it. Bits do not vary.
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using namespace cab;
using namespace cab::oracle;
using oracle::Quad;
using tests::rounds;

bool is_oriented(const Policies& policies) { return policies.refit < Refit::kAabbHull; }

std::vector<Box> boxes_of(Engine& engine, std::uint32_t batch, const Member& member, const Policies& policies = {}) {
  std::vector<Box> boxes(std::size_t{member.poses.instance_count} * member.rig.node_count());
  std::vector<std::uint8_t> flags(member.poses.instance_count, 0xee);
  BatchInput input = member.poses.input({batch});
  input.flags = flags;
  REQUIRE(compute_boxes(engine, input, policies, boxes) == Status::kOk);
  for (const std::uint8_t flag : flags) CHECK(flag == kInstanceOk);
  return boxes;
}

oracle::OracleBox<float> oracle_box(const Box& box) {
  oracle::OracleBox<float> out;
  static_assert(sizeof(out) == sizeof(box));
  std::memcpy(&out, &box, sizeof(out));
  return out;
}

// The leaves below each node, by the public merge steps.
std::vector<std::vector<std::uint32_t>> leaves_below(const Engine& engine, ArticulationId id,
                                                     std::uint32_t leaf_count) {
  std::vector<MergeStep> steps(leaf_count - 1);
  REQUIRE(merge_steps(engine, id, steps) == Status::kOk);
  std::vector<std::vector<std::uint32_t>> out;
  for (std::uint32_t leaf = 0; leaf < leaf_count; ++leaf) out.push_back({leaf});
  for (const MergeStep& step : steps) {
    out.push_back(out[step.left]);
    out.back().insert(out.back().end(), out[step.right].begin(), out[step.right].end());
  }
  return out;
}

}  // namespace

TEST_CASE("boxes are those without a margin, whatever margins their instances have of their own") {
  Random random(5);
  World world;
  world.members.push_back(any_member(random, 20, BatchKind::kCharacters, any_pose_range(random, false, {}, 1), 12));
  const Member& member = world.members[0];
  const EnginePtr engine = make_engine_for(world);
  for (const Policies& policies : all_refits()) {
    const std::vector<Box> expected = boxes_of(*engine, 1, member, policies);
    for (const float margin : {0.0f, 10.0f, kMaxCoordinate}) {
      CAPTURE(margin);
      const std::vector<float> margins(member.poses.instance_count, margin);
      BatchInput input = member.poses.input({1});
      input.margins = margins;
      std::vector<Box> boxes(expected.size());
      std::vector<std::uint8_t> flags(member.poses.instance_count, 0xee);
      input.flags = flags;
      REQUIRE(compute_boxes(*engine, input, policies, boxes) == Status::kOk);
      CHECK(same_bits(boxes.data(), expected.data(), boxes.size()));
      CHECK(std::all_of(flags.begin(), flags.end(), [](std::uint8_t flag) { return flag == kInstanceOk; }));
    }
  }
}

TEST_CASE("every box contains every exactly posed leaf box below it, and the engine's own leaf boxes") {
  double worst = -1e30;  // how far a corner sticks out at most, in ulps of size; measured -2.7
  std::size_t judged = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const BatchKind kind = seed % 2 ? BatchKind::kCharacters : BatchKind::kSequence;
    World world;
    const double size =
        random.log_uniform(0.1, 1e4);  // far from the origin of the instance boxes are wider, but contain
    const PoseRange range = any_pose_range(random, false, {}, size);
    const std::uint32_t instances = kInstanceCounts[random.index(6)];
    world.members.push_back(any_member(random, instances, kind, range, 64));
    const Member& member = world.members[0];
    const EnginePtr engine = make_engine_for(world);
    const std::uint32_t nodes = member.rig.node_count(), leaves = member.rig.leaf_count();
    const auto below = leaves_below(*engine, {1}, leaves);
    const std::vector<Box> posed = boxes_of(*engine, 1, member);  // leaves first
    for (const Policies& policies : all_refits()) {
      CAPTURE(static_cast<int>(policies.refit));
      CAPTURE(static_cast<int>(policies.extents));
      const std::vector<Box> boxes = boxes_of(*engine, 1, member, policies);
      for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
        const std::vector<ExactBox> exact = exact_leaf_boxes(member.rig, member.poses, i);
        const Box* const of = boxes.data() + std::size_t{i} * nodes;
        for (std::uint32_t node = 0; node < nodes; ++node) {
          const auto parent = oracle_box(of[node]);
          for (const std::uint32_t leaf : below[node]) {
            if (node < leaves || random.chance(0.1)) {  // Quad is slow; the float judge below checks every pair
              const auto verdict = oracle::judge_containment_exactly(parent, oracle::convert<Quad>(exact[leaf]));
              CHECK(verdict.inside);
              worst = std::max(worst, verdict.excess_ulps);
              ++judged;
            }
            if (policies.refit == Refit::kAabbVertices) continue;  // fitted to the shapes, not to the posed boxes
            CHECK(oracle::judge_containment(parent, oracle_box(posed[std::size_t{i} * nodes + leaf])).inside);
          }
        }
      }
    }
  }
  CHECK(judged > 20000);
  CAPTURE(worst);
  CHECK(worst < 0);
}

TEST_CASE("axes of boxes err no more than derived, halves are not negative, and axis-aligned boxes are") {
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    world.members.push_back(any_member(random, 17, BatchKind::kCharacters, any_pose_range(random, false, {}, 100), 64));
    const EnginePtr engine = make_engine_for(world);
    for (const Policies& policies : all_refits()) {
      for (const Box& box : boxes_of(*engine, 1, world.members[0], policies)) {
        worst = std::max(worst, oracle::frame_error(oracle_box(box)));
        for (int k = 0; k < 3; ++k) {
          CHECK(box.half[k] >= 0);
          for (int c = 0; c < 3 && !is_oriented(policies); ++c) CHECK(box.axis[k][c] == (k == c ? 1.0f : 0.0f));
        }
      }
    }
  }
  CHECK(worst <= 1);
}

TEST_CASE("merging child bounds and refitting from the leaves below give the same axis-aligned boxes, bit for bit") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    world.members.push_back(any_member(random, 17, BatchKind::kSequence, any_pose_range(random, false, {}, 100), 64));
    const EnginePtr engine = make_engine_for(world);
    const auto merged = boxes_of(*engine, 1, world.members[0], {Refit::kAabbHull, {}, {}, Extents::kChildren});
    const auto refitted = boxes_of(*engine, 1, world.members[0], {Refit::kAabbHull, {}, {}, Extents::kLeaves});
    CHECK(std::memcmp(merged.data(), refitted.data(), merged.size() * sizeof(Box)) == 0);
  }
}

TEST_CASE("boxes have the same bits on every instruction set, for every kind of batch and any neighbours") {
  for (std::uint64_t seed = 1; seed <= rounds(12); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    world.members.push_back(any_member(random, 33, BatchKind::kCharacters, any_pose_range(random, false, {}, 10), 64));
    const Member& member = world.members[0];
    const std::uint32_t nodes = member.rig.node_count();
    World frames = world;
    frames.members[0].kind = BatchKind::kSequence;
    EngineDesc scalar;
    scalar.isa = Isa::kScalar;
    for (const Policies& policies : all_refits()) {
      CAPTURE(static_cast<int>(policies.refit));
      CAPTURE(static_cast<int>(policies.extents));
      const std::vector<Box> expected = boxes_of(*make_engine_for(world, scalar), 1, member, policies);
      const auto same = [&](const std::vector<Box>& got) {
        return std::memcmp(expected.data(), got.data(), got.size() * sizeof(Box)) == 0;
      };
      for (const Isa isa : available_isas()) {
        CAPTURE(to_string(isa));
        EngineDesc desc;
        desc.isa = isa;
        CHECK(same(boxes_of(*make_engine_for(world, desc), 1, member, policies)));
        CHECK(same(boxes_of(*make_engine_for(frames, desc), 1, member, policies)));
      }
      for (const std::uint32_t who : {0u, 15u, 16u, 31u, 32u}) {  // alone in its tile
        World alone = world;
        Poses& poses = alone.members[0].poses;
        poses.instance_count = 1;
        const std::size_t floats = poses.floats_per_pose() * poses.link_count;
        poses.data.assign(member.poses.pose(who, 0), member.poses.pose(who, 0) + floats);
        if (!poses.origins.empty()) poses.origins.resize(3);
        if (!poses.orientations.empty())
          poses.orientations.assign(member.poses.orientations.data() + 4 * who,
                                    member.poses.orientations.data() + 4 * who + 4);
        const std::vector<Box> got = boxes_of(*make_engine_for(alone), 1, alone.members[0], policies);
        CHECK(std::memcmp(&expected[who * nodes], got.data(), nodes * sizeof(Box)) == 0);
      }
    }
  }
}

TEST_CASE("a star of a thousand links keeps its root near its own size, whatever the refit") {
  constexpr std::uint32_t kLinks = 1024;
  Random random(5);
  std::vector<std::int32_t> parents(kLinks, 0);
  std::vector<Leaf> leaves(kLinks);
  std::vector<float> poses;
  parents[0] = -1;
  for (std::uint32_t link = 0; link < kLinks; ++link) {
    leaves[link].link = link;
    leaves[link].box = {{.5f, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .17f, .17f}};
    double q[4], n = 0;
    for (double& v : q) {
      v = random.normal();
      n += v * v;
    }
    for (const double v : q) poses.push_back(static_cast<float>(v / std::sqrt(n)));
    poses.insert(poses.end(), 3, 0.0f);
  }
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = leaves;
  Engine* made = nullptr;
  REQUIRE(create_engine({}, &made) == Status::kOk);
  const EnginePtr engine(made);
  ArticulationId id;
  BatchInput input;
  REQUIRE(add_articulation(*engine, desc, &id) == Status::kOk);
  REQUIRE(add_batch(*engine, {id, 1, BatchKind::kCharacters}, &input.batch) == Status::kOk);
  input.poses.data = poses.data();
  for (const Policies& policies : all_refits()) {
    CAPTURE(static_cast<int>(policies.refit));
    std::vector<Box> boxes(2 * kLinks - 1);
    REQUIRE(compute_boxes(*engine, input, policies, boxes) == Status::kOk);
    for (const float half : boxes.back().half) CHECK(half < 3);  // every link lies within 1.03 of the hub
  }
}

TEST_CASE("boxes do not depend on origins") {
  Random random(77);
  World world;
  world.members.push_back(any_member(random, 17, BatchKind::kCharacters, {2, true, false, {}}, 16));
  const EnginePtr engine = make_engine_for(world);
  const std::vector<Box> near_by = boxes_of(*engine, 1, world.members[0]);
  for (int i = 0; i < 51; ++i) world.members[0].poses.origins.push_back(random.uniform(-1e12, 1e12));
  const std::vector<Box> far = boxes_of(*engine, 1, world.members[0]);
  CHECK(std::memcmp(near_by.data(), far.data(), far.size() * sizeof(Box)) == 0);
}

TEST_CASE("leaf boxes whose axes were mended at the boundary still hold the box as it was given") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    Member member = any_member(random, 16, BatchKind::kCharacters, any_pose_range(random, false, {}, 1), 8);
    for (Leaf& leaf : member.rig.leaves)
      for (auto& axis : leaf.box.axis)
        for (float& v : axis) v += static_cast<float>(random.uniform(-2.5e-6, 2.5e-6));
    world.members.push_back(member);
    const EnginePtr engine = make_engine_for(world);
    const std::vector<Box> boxes = boxes_of(*engine, 1, member);
    for (std::uint32_t i = 0; i < 16; ++i) {
      const std::vector<ExactBox> exact = exact_leaf_boxes(member.rig, member.poses, i);
      for (std::uint32_t leaf = 0; leaf < exact.size(); ++leaf)
        CHECK(oracle::judge_containment_exactly(oracle_box(boxes[i * member.rig.node_count() + leaf]),
                                                oracle::convert<Quad>(exact[leaf]))
                  .inside);
    }
  }
}
