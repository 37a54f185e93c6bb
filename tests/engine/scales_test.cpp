// BatchInput::scales and PoseView::has_scale: instances, or links, of other sizes than those that were added.
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <list>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// The vertices of scaled hulls and the lists of scaled parts, which outlive the rigs.
struct Kept {
  std::list<std::vector<float>> vertices;
  std::list<std::vector<ConvexPart>> parts;
};

// A rig all of whose lengths are multiplied by a factor.
Rig scaled(Rig rig, float factor, Kept& kept) {
  for (float& at : rig.joints) at *= factor;
  for (Leaf& leaf : rig.leaves) {
    for (int c = 0; c < 3; ++c) {
      leaf.box.center[c] *= factor;
      leaf.box.half[c] *= factor;
    }
    kept.parts.emplace_back(leaf.parts.begin(), leaf.parts.end());
    for (ConvexPart& part : kept.parts.back()) {
      for (float& at : part.position) at *= factor;
      for (float& size : part.size) size *= factor;
      kept.vertices.emplace_back(part.vertices.begin(), part.vertices.end());
      for (float& at : kept.vertices.back()) at *= factor;
      part.vertices = {kept.vertices.back().data(), kept.vertices.back().size()};
    }
    leaf.parts = {kept.parts.back().data(), kept.parts.back().size()};
  }
  return rig;
}

// Multiplies the translations of all poses.
void scale_translations(Poses& poses, float factor) {
  for (std::uint32_t i = 0; i < poses.instance_count; ++i)
    for (std::uint32_t link = 0; link < poses.link_count; ++link)
      for (std::size_t c = 0; c < 3; ++c)
        poses.pose(i, link)[poses.format == PoseFormat::kQuaternionTranslation ? 4 + c
                            : poses.format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                               : 12 + c] *= factor;
}

// A number with few digits, so that its product with 3/4 is exact.
float short_number(Random& random, double lo, double hi) {
  return static_cast<float>(std::ldexp(std::floor(random.uniform(lo, hi) * 4096), -12));
}

// Two bodies of seven links, with one shape of every kind, and `count` instances of each.
World world_of_shapes(Random& random, std::uint32_t count, PoseFormat format, Kept& kept) {
  World world;
  for (int m = 0; m < 2; ++m) {
    Rig rig;
    for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kEllipsoid, ShapeKind::kCapsule, ShapeKind::kConvexHull,
                                 ShapeKind::kSphere, ShapeKind::kCylinder, ShapeKind::kHalfSpace}) {
      ConvexPart part;
      part.kind = kind;
      for (float& size : part.size) size = short_number(random, 0.05, 0.3);
      for (float& at : part.position) at = short_number(random, -0.3, 0.3);
      double q[4];
      random_turn(random, q);
      for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
      if (kind == ShapeKind::kConvexHull) {
        kept.vertices.emplace_back();
        for (int v = 0; v < 3 * 12; ++v) kept.vertices.back().push_back(short_number(random, -0.25, 0.25));
        part.vertices = {kept.vertices.back().data(), kept.vertices.back().size()};
      }
      kept.parts.push_back({part});
      const auto link = static_cast<std::uint32_t>(rig.parents.size());
      rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
      rig.parent_offset.push_back({{0.2, 0, 0}});
      rig.leaves.push_back(
          {link, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1.25f, 1.25f, 1.25f}}, {kept.parts.back().data(), 1}});
    }
    Member member = {rig, random_poses(random, rig, count, format, {0.6, random.chance(0.5), false, {}})};
    for (std::uint32_t i = 0; i < count; ++i)
      for (std::uint32_t link = 0; link < rig.link_count(); ++link)
        for (std::size_t c = 0; c < 3; ++c) {
          float& at = member.poses.pose(i, link)[format == PoseFormat::kQuaternionTranslation ? 4 + c
                                                 : format == PoseFormat::kMatrix3x4Rows       ? 4 * c + 3
                                                                                              : 12 + c];
          at = static_cast<float>(std::ldexp(std::floor(static_cast<double>(at) * 4096), -12));
        }
    world.members.push_back(member);
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
  return world;
}

World random_crowd(Random& random, double least, double most) {
  World world;
  for (const PoseFormat format : {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                  PoseFormat::kMatrix4x4Columns, PoseFormat::kMatrix3x4Rows}) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 5, 3);
    member.poses = random_poses(random, member.rig, 18, format, {1, random.chance(0.5), random.chance(0.7), {}});
    Poses& poses = member.poses;
    const auto factor = [&] { return static_cast<float>(random.log_uniform(least, most)); };
    if (format != PoseFormat::kQuaternionTranslation && random.chance(0.6)) {
      poses.has_scale = true;
      for (std::uint32_t i = 0; i < poses.instance_count; ++i)
        for (std::uint32_t link = 0; link < poses.link_count; ++link)
          scale_matrix(format, factor(), poses.pose(i, link));
    } else if (random.chance(0.8)) {
      for (std::uint32_t i = 0; i < poses.instance_count; ++i) poses.scales.push_back(factor());
    }
    world.members.push_back(member);
  }
  for (std::uint32_t a = 1; a <= 4; ++a)
    for (std::uint32_t b = a; b <= 4; ++b) world.rules.push_back({{a}, {b}, Pairing::kBetween});
  world.rules.push_back({{2}, {2}, Pairing::kWithin});
  return world;
}

std::vector<Box> boxes_of(const World& world, std::size_t member, const Policies& policies, Isa isa) {
  EngineDesc desc;
  desc.isa = isa;
  const Member& of = world.members[member];
  std::vector<Box> boxes(std::size_t{of.poses.instance_count} * of.rig.node_count());
  REQUIRE(compute_boxes(*make_engine_for(world, desc), of.poses.input({static_cast<std::uint32_t>(member) + 1}),
                        policies, boxes) == Status::kOk);
  return boxes;
}

}  // namespace

TEST_CASE("a body at half its size has the boxes, hits and contacts of a rig of half the lengths, bit for bit") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Kept kept;
    World whole = world_of_shapes(random, 6, static_cast<PoseFormat>(random.index(3)), kept), half = whole;
    for (std::size_t m = 0; m < 2; ++m) {
      const float factor = m == 0 ? 0.5f : 2.0f;
      whole.members[m].poses.scales.assign(6, factor);
      half.members[m].rig = scaled(half.members[m].rig, factor, kept);
      scale_translations(half.members[m].poses, factor);
      for (const Policies& policies : all_refits())
        for (const Isa isa : available_isas()) {
          const std::vector<Box> a = boxes_of(whole, m, policies, isa), b = boxes_of(half, m, policies, isa);
          CHECK(same_bits(a.data(), b.data(), a.size()));
        }
    }
    for (const Exact exact : {Exact::kNone, Exact::kConvex, Exact::kFcl})
      for (const Strategy strategy : {Strategy::kRows, Strategy::kLinks, Strategy::kTree}) {
        if (exact == Exact::kFcl && !build_info().fcl) {
          MESSAGE("skipped: this build lacks FCL");
          continue;
        }
        const Policies policies = {Refit::kCab, strategy, exact};
        whole.contacts = half.contacts = exact != Exact::kNone;
        const Outcome a = run_world(whole, policies), b = run_world(half, policies);
        CHECK(a.stats.instances_masked == 0);
        CHECK(same_hits(a.hits, b.hits));
        REQUIRE(a.contacts.size() == b.contacts.size());
        CHECK((a.contacts.empty() ||
               std::memcmp(a.contacts.data(), b.contacts.data(), a.contacts.size() * sizeof(Contact)) == 0));
        hits += a.hits.size();
      }
  }
  CHECK(hits >= least_count(2000, 6));
}

TEST_CASE("shapes are scaled by any factor, as a whole or by the matrix of each link, for both exact tests") {
  std::size_t hits = 0, contacts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Kept kept;
    World by_scale = world_of_shapes(random, 5, PoseFormat::kMatrix3x4Rows, kept), by_rig = by_scale;
    for (std::size_t m = 0; m < 2; ++m) {
      Poses& poses = by_scale.members[m].poses;
      by_rig.members[m].rig = scaled(by_rig.members[m].rig, 0.75f, kept);
      scale_translations(by_rig.members[m].poses, 0.75f);
      if (m == 0) {
        poses.scales.assign(5, 0.75f);
        continue;
      }
      poses = by_rig.members[m].poses;  // translations hold the scale already
      poses.has_scale = true;
      for (std::uint32_t i = 0; i < 5; ++i)
        for (std::uint32_t link = 0; link < poses.link_count; ++link)
          scale_matrix(PoseFormat::kMatrix3x4Rows, 0.75f, poses.pose(i, link));
    }
    for (const Exact exact : {Exact::kConvex, Exact::kFcl}) {
      if (exact == Exact::kFcl && !build_info().fcl) {
        MESSAGE("skipped: this build lacks FCL");
        continue;
      }
      by_scale.contacts = by_rig.contacts = true;
      const Policies policies = {Refit::kCab, Strategy::kRows, exact};
      const Outcome a = run_world(by_scale, policies), b = run_world(by_rig, policies);
      CHECK(same_hits(a.hits, b.hits));  // the rotations differ in their last bits; no pair is that close
      REQUIRE(a.hits.size() == b.hits.size());
      hits += a.hits.size();
      for (std::size_t h = 0; h < a.hits.size() && exact == Exact::kConvex; ++h) {
        const double depth = static_cast<double>(b.contacts[h].depth);
        CHECK(static_cast<double>(a.contacts[h].depth) == doctest::Approx(depth).epsilon(0.02));
        ++contacts;
      }
    }
  }
  CHECK(hits >= least_count(400, 10));
  CHECK(contacts >= least_count(200, 10));
}

TEST_CASE("no frame of scaled bodies loses a pair that the judge finds, and it invents few") {
  constexpr double kInvented = 1e-3;
  std::size_t judged = 0;
  for (std::uint64_t seed = 1; seed <= rounds(8); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const bool extreme = seed % 4 == 0;
    const World world = random_crowd(random, extreme ? 1.001e-3 : 0.5, extreme ? 999 : 2);
    const std::vector<Hit> touching = judge_world(world), near = judge_world(world, kInvented);
    judged += touching.size();
    for (const Strategy strategy : {Strategy::kRows, Strategy::kLinks, Strategy::kTree, Strategy::kBrute})
      for (const Isa isa : available_isas()) {
        EngineDesc desc;
        desc.isa = isa;
        const Outcome found = run_world(world, {Refit::kCab, strategy}, desc);
        CHECK(found.stats.instances_masked == 0);
        CHECK(missing_from(touching, found.hits) == 0);
        if (!extreme) CHECK(missing_from(found.hits, near) == 0);
      }
    for (const Policies& policies : all_refits())
      for (std::size_t m = 0; m < world.members.size(); ++m) {
        const std::vector<Box> scalar = boxes_of(world, m, policies, Isa::kScalar);
        for (const Isa isa : available_isas()) {
          const std::vector<Box> other = boxes_of(world, m, policies, isa);
          CHECK(same_bits(scalar.data(), other.data(), scalar.size()));
        }
      }
  }
  CHECK(judged >= least_count(1000, 8));
}

TEST_CASE("a scale out of range masks its instance, and why_masked says so") {
  Random random(4);
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kChain, 3, 1);
  member.poses = random_poses(random, member.rig, 8, PoseFormat::kMatrix3x4Rows, {0.2, false, false, {}});
  member.poses.scales = {
      1, 0, 9e-4f, 1001, -1, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1};
  world.members.push_back(member);
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const auto bad = static_cast<std::uint8_t>(kInstanceNotRigid);
  const Outcome outcome = run_world(world);
  CHECK(outcome.flags[0] == std::vector<std::uint8_t>{0, bad, bad, bad, bad, bad, bad, 0});
  for (const Hit& hit : outcome.hits) CHECK((hit.instance_a == 0 && hit.instance_b == 7));
  const EnginePtr engine = make_engine_for(world);
  MaskReason reason;
  REQUIRE(why_masked(*engine, world.members[0].poses.input({1}), 3, &reason) == Status::kOk);
  CHECK(reason.cause == MaskCause::kScale);
  CHECK(reason.value == 1001);
  CHECK(reason.limit == kMaxScale);

  world.members[0].poses.scales.clear();
  world.members[0].poses.has_scale = true;
  scale_matrix(PoseFormat::kMatrix3x4Rows, 5e-4f, world.members[0].poses.pose(2, 1));
  for (std::size_t c = 0; c < 3; ++c) world.members[0].poses.pose(5, 0)[4 * c + 1] *= 1.01f;  // no longer uniform
  CHECK(run_world(world).flags[0] == std::vector<std::uint8_t>{0, 0, bad, 0, 0, bad, 0, 0});
  REQUIRE(why_masked(*engine, world.members[0].poses.input({1}), 2, &reason) == Status::kOk);
  CHECK(reason.cause == MaskCause::kScale);
  CHECK(reason.link == 1);
  CHECK(reason.value == doctest::Approx(5e-4));
  REQUIRE(why_masked(*engine, world.members[0].poses.input({1}), 5, &reason) == Status::kOk);
  CHECK(reason.cause == MaskCause::kMatrix);
}

TEST_CASE("scales of the wrong number, or given in two ways, are refused") {
  Random random(5);
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kChain, 3, 1);
  member.poses = random_poses(random, member.rig, 8, PoseFormat::kMatrix4x4Columns, {0.2, false, false, {}});
  world.members.push_back(member);
  const EnginePtr engine = make_engine_for(world);
  std::vector<Box> boxes(8 * member.rig.node_count());
  const auto status = [&](const BatchInput& input) { return compute_boxes(*engine, input, {}, boxes); };
  const std::vector<float> ones(9, 1.0f);
  BatchInput input = member.poses.input({1});
  input.scales = {ones.data(), 8};
  CHECK(status(input) == Status::kOk);
  input.scales = {ones.data(), 9};
  CHECK(status(input) == Status::kBadScales);
  input.scales = {ones.data(), 7};
  CHECK(status(input) == Status::kBadScales);
  input.scales = {nullptr, 8};
  CHECK(status(input) == Status::kBadScales);
  input.scales = {ones.data(), 8};
  input.poses.has_scale = true;
  CHECK(status(input) == Status::kBadScales);
  input.scales = {};
  CHECK(status(input) == Status::kOk);
  input.poses.format = PoseFormat::kQuaternionTranslation;
  CHECK(status(input) == Status::kBadPoses);
}

}  // namespace cab::tests
