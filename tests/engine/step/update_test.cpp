// Masked instances: which poses are refused, with which flag, and that other instances keep their bits.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

#include <functional>
#include <limits>
#include <string>

namespace {

using namespace cab;
using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// One way to spoil the pose of one link.
struct Spoiling {
  std::string name;
  InstanceFlag flag;
  bool matrices;  // true: for matrices; false: for quaternions
  std::function<void(float*, PoseFormat)> spoil;
};

// Entry of a matrix by row and column.
float& entry(float* pose, PoseFormat format, std::size_t row, std::size_t column) {
  return pose[format == PoseFormat::kMatrix3x4Rows ? 4 * row + column : 4 * column + row];
}

void scale_columns(float* pose, PoseFormat format, float x, float y, float z) {
  const float by[3] = {x, y, z};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) entry(pose, format, row, column) *= by[column];
}

void skew(float* pose, PoseFormat format, float by) {
  for (std::size_t row = 0; row < 3; ++row) entry(pose, format, row, 0) += by * entry(pose, format, row, 1);
}

std::vector<Spoiling> spoilings() {
  std::vector<Spoiling> out;
  for (const float bad : {kNan, -kNan, kInfinity, -kInfinity, 1e30f, -3e18f}) {
    const std::string name = std::to_string(bad);
    for (std::size_t i = 0; i < 7; ++i)
      out.push_back({name + " in float " + std::to_string(i), kInstanceNotFinite, false,
                     [=](float* pose, PoseFormat) { pose[i] = bad; }});
    for (std::size_t i = 0; i < 12; ++i)
      out.push_back({name + " in entry " + std::to_string(i), kInstanceNotFinite, true,
                     [=](float* pose, PoseFormat format) { entry(pose, format, i / 4, i % 4) = bad; }});
  }
  out.push_back(
      {"zero quaternion", kInstanceNotRigid, false, [](float* pose, PoseFormat) { std::fill_n(pose, 4, 0.0f); }});
  out.push_back({"tiny quaternion", kInstanceNotRigid, false, [](float* pose, PoseFormat) {
                   for (int i = 0; i < 4; ++i) pose[i] *= 1e-4f;
                 }});
  out.push_back({"huge quaternion", kInstanceNotRigid, false, [](float* pose, PoseFormat) {
                   for (int i = 0; i < 4; ++i) pose[i] *= 1e4f;
                 }});
  out.push_back({"zero matrix", kInstanceNotRigid, true, [](float* p, PoseFormat f) { scale_columns(p, f, 0, 0, 0); }});
  out.push_back(
      {"scaled up", kInstanceNotRigid, true, [](float* p, PoseFormat f) { scale_columns(p, f, 1.01f, 1.01f, 1.01f); }});
  out.push_back(
      {"scaled down", kInstanceNotRigid, true, [](float* p, PoseFormat f) { scale_columns(p, f, 1, 0.99f, 1); }});
  out.push_back({"mirrored and scaled", kInstanceNotRigid, true,
                 [](float* p, PoseFormat f) { scale_columns(p, f, 1, 1, -1.01f); }});
  out.push_back({"skewed", kInstanceNotRigid, true, [](float* p, PoseFormat f) { skew(p, f, 0.002f); }});
  out.push_back({"scaled by 1e17", kInstanceNotRigid, true,
                 [](float* p, PoseFormat f) { scale_columns(p, f, 1e17f, 1e17f, 1e17f); }});
  return out;
}

// A crowded world of one batch, which is paired with itself.
World one_batch(Random& random, std::uint32_t n, PoseFormat format, BatchKind kind = BatchKind::kCharacters) {
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kTree, 5, 2);
  member.poses = random_poses(random, member.rig, n, format, {0.4, random.chance(0.5), random.chance(0.5), {}});
  member.kind = kind;
  world.members.push_back(member);
  world.rules = {{{1}, {1}, Pairing::kWithin}};
  if (kind == BatchKind::kCharacters) world.rules.push_back({{1}, {1}, Pairing::kBetween});
  return world;
}

std::vector<Box> boxes_of(const World& world, Refit refit, const EngineDesc& desc = {}) {
  const EnginePtr engine = make_engine_for(world, desc);
  std::vector<Box> boxes(std::size_t{world.members[0].poses.instance_count} * world.members[0].rig.node_count());
  REQUIRE(compute_boxes(*engine, world.members[0].poses.input({1}), {refit, Strategy::kTree, Exact::kNone}, boxes) ==
          Status::kOk);
  return boxes;
}

// Checks that only instance `who` is masked in the spoilt world.
void check_masked(const World& sound, const World& spoilt, std::uint32_t who, InstanceFlag flag,
                  const EngineDesc& desc) {
  const std::uint32_t n = sound.members[0].poses.instance_count;
  const std::size_t nodes = sound.members[0].rig.node_count();
  for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks}) {
    const Policies policies = {Refit::kCab, strategy};
    const Outcome before = run_world(sound, policies, desc), after = run_world(spoilt, policies, desc);
    for (std::uint32_t i = 0; i < n; ++i) CHECK(after.flags[0][i] == (i == who ? flag : kInstanceOk));
    CHECK(after.stats.instances_masked == 1);
    std::vector<Hit> others;
    for (const Hit& hit : before.hits)
      if (hit.instance_a != who && hit.instance_b != who) others.push_back(hit);
    CHECK(same_hits(after.hits, others));
  }

  for (const Refit refit : {Refit::kCab, Refit::kAabbHull}) {
    const std::vector<Box> was = boxes_of(sound, refit, desc), is = boxes_of(spoilt, refit, desc);
    for (std::uint32_t i = 0; i < n; ++i)
      if (i != who) CHECK(same_bits(&was[i * nodes], &is[i * nodes], nodes));
    const Box zero = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    for (std::size_t node = 0; node < nodes; ++node) CHECK(same_bits(&is[who * nodes + node], &zero, 1));
  }
}

}  // namespace

TEST_CASE("a spoilt pose masks its own instance with the right flag, and changes no bit of any other") {
  const auto isas = available_isas();
  std::uint64_t seed = 0;
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    for (const Spoiling& spoiling : spoilings()) {
      if (spoiling.matrices != (format != PoseFormat::kQuaternionTranslation)) continue;
      CAPTURE(spoiling.name);
      ++seed;
      CAPTURE(seed);
      Random random(seed);
      const World sound = one_batch(random, 18, format);
      World spoilt = sound;
      const std::uint32_t who = random.index(18);
      // Link 0 has leaves in every rig. The poses of other links may not be read.
      spoiling.spoil(spoilt.members[0].poses.pose(who, 0), format);
      EngineDesc desc;
      desc.isa = isas[seed % isas.size()];
      check_masked(sound, spoilt, who, spoiling.flag, desc);
    }
  }
}

TEST_CASE("a spoilt orientation masks its own instance") {
  const float bad[][4] = {{kNan, 0, 0, 1}, {0, kInfinity, 0, 1}, {0, 0, 0, 0}, {1e-4f, 0, 0, 0}, {0, 0, 0, 1e4f}};
  const InstanceFlag flags[] = {kInstanceNotFinite, kInstanceNotFinite, kInstanceNotRigid, kInstanceNotRigid,
                                kInstanceNotRigid};
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World sound = one_batch(random, 17, PoseFormat::kMatrix3x4Rows);
    if (sound.members[0].poses.orientations.empty())
      for (std::uint32_t i = 0; i < 17; ++i)
        sound.members[0].poses.orientations.insert(sound.members[0].poses.orientations.end(), {0, 0.6f, 0, 0.8f});
    World spoilt = sound;
    const std::uint32_t who = random.index(17);
    std::copy_n(bad[seed], 4, spoilt.members[0].poses.orientations.data() + 4 * who);
    check_masked(sound, spoilt, who, flags[seed], {});
  }
}

TEST_CASE("a pose within range whose boxes leave it is masked") {
  Random random(4);
  const World sound = one_batch(random, 16, PoseFormat::kQuaternionTranslation);
  World spoilt = sound;
  spoilt.members[0].rig.leaves[0].box.center[0] = 9e17f;  // too far once the translation below is added
  for (Leaf& leaf : spoilt.members[0].rig.leaves) leaf.box.half[0] = 0.1f;
  for (std::uint32_t l = 0; l < 5; ++l) {
    float* const pose = spoilt.members[0].poses.pose(3, l);
    const float still[7] = {0, 0, 0, 1, 9e17f, 0, 0};
    std::copy_n(still, 7, pose);
  }
  const Outcome outcome = run_world(spoilt);
  CHECK(outcome.flags[0][3] == kInstanceNotFinite);
  CHECK(outcome.stats.instances_masked == 1);
}

TEST_CASE("rotations within tolerance are mended, not masked: any quaternion length, matrices off by 5e-4") {
  for (const float length : {2e-3f, 0.5f, 1.001f, 30.0f, 900.0f}) {
    CAPTURE(length);
    Random random(8);
    const World sound = one_batch(random, 16, PoseFormat::kQuaternionTranslation);
    World scaled = sound;
    for (std::uint32_t i = 0; i < 16; ++i)
      for (std::uint32_t l = 0; l < 5; ++l)
        for (int k = 0; k < 4; ++k) scaled.members[0].poses.pose(i, l)[k] *= length;
    const Outcome outcome = run_world(scaled);
    CHECK(outcome.stats.instances_masked == 0);
    CHECK(missing_from(judge_world(scaled), outcome.hits) == 0);
  }
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World drifted = one_batch(random, 33, seed % 2 ? PoseFormat::kMatrix3x4Rows : PoseFormat::kMatrix4x4Columns);
    Poses& poses = drifted.members[0].poses;
    for (std::uint32_t i = 0; i < 33; ++i)
      for (std::uint32_t l = 0; l < 5; ++l)
        for (std::size_t e = 0; e < 9; ++e)
          entry(poses.pose(i, l), poses.format, e / 3, e % 3) += static_cast<float>(random.uniform(-1.4e-4, 1.4e-4));
    const Outcome outcome = run_world(drifted);
    CHECK(outcome.stats.instances_masked == 0);
    CHECK(missing_from(judge_world(drifted), outcome.hits) == 0);
  }
}

TEST_CASE("when all are masked there are no hits, and when a table is masked it is counted once") {
  Random random(6);
  World world;
  add_frames(random, world, 6);
  add_characters(random, world, 6);
  std::uint64_t instances = 0;
  for (Member& member : world.members) {
    instances += member.poses.instance_count;
    std::fill(member.poses.data.begin(), member.poses.data.end(), kNan);
  }
  const Outcome none = run_world(world);
  CHECK(none.hits.empty());
  CHECK(none.stats.box_tests == 0);
  CHECK(none.stats.instances_masked == instances);

  for (const std::uint32_t frames : {1u, 16u, 17u, 100u}) {
    CAPTURE(frames);
    World table;
    for (const std::uint32_t n : {1u, frames})
      table.members.push_back(any_member(random, n, BatchKind::kSequence, {}, 4));
    table.rules = {{{1}, {2}, Pairing::kBetween}};
    table.members[0].poses.pose(0, 0)[4] = kNan;
    const Outcome outcome = run_world(table);
    CHECK(outcome.hits.empty());
    CHECK(outcome.flags[0][0] != kInstanceOk);
    CHECK(outcome.stats.instances_masked == 1);
  }
}

TEST_CASE("masked frames of a sequence are in no hit, and the other frames of the tile are as before") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World sound;
    for (int m = 0; m < 2; ++m)
      sound.members.push_back(any_member(random, 20, BatchKind::kSequence, {0.3, false, false, {}}, 8));
    pair_all(sound, 1, 2);
    World spoilt = sound;
    const std::uint32_t who = random.index(20);
    Poses& poses = spoilt.members[random.index(2)].poses;
    std::fill_n(poses.pose(who, 0), poses.floats_per_pose() * poses.link_count, kNan);
    const Outcome before = run_world(sound), after = run_world(spoilt);
    const std::uint32_t sick = &poses == &spoilt.members[0].poses ? 1 : 2;
    std::vector<Hit> others;
    for (const Hit& hit : before.hits)
      if (hit.instance_a != who || (hit.batch_a.value != sick && hit.batch_b.value != sick)) others.push_back(hit);
    CHECK(same_hits(after.hits, others));
    CHECK(after.stats.instances_masked == 1);
  }
}
