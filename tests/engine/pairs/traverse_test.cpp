// One leaf predicate: pairs at the very edge of the overlap test's slack get the same answer from every strategy.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;

// What the overlap test adds: to half extents by the sizes of both boxes, and to an edge by the second box's size.
// Posing adds to a half extent by the size of the box and by its distance from the origin (layout/error_bounds.h).
constexpr double kSlackGrow = 0x1.8p-20, kSlackEdge = 0x1p-20;
constexpr double kPosePadSize = 0x1p-19, kPosePadPlace = 0x1p-22;

// The projected radius of a box along a unit direction, when each half extent is larger by `pad`.
Real projected_radius(const ExactBox& box, const Point& direction, Real pad) {
  Real out = 0;
  for (std::size_t k = 0; k < 3; ++k) out += (box.half[k] + pad) * std::fabs(dot(axis_of(box, k), direction));
  return out;
}

// Turns link 1 at random. Puts it where one axis alone, a face normal of link 0's box or a cross of edges, separates
// the two, by about the slack.
void place_at_edge(Random& random, const Rig& rig, Poses& poses, std::uint32_t i) {
  for (;;) {
    double q[4];
    random_turn(random, q);
    write_pose(poses.format, q, {}, poses.pose(i, 1));
    const std::vector<ExactBox> boxes = exact_leaf_boxes(rig, poses, i);
    const ExactBox &b = boxes[0], &a = boxes[1];
    const bool edge = random.chance(0.75);
    Point axis = axis_of(a, random.index(3));
    if (edge) axis = cross(axis, axis_of(b, random.index(3)));
    const Real length = std::sqrt(dot(axis, axis));
    if (length < 0.3L) continue;
    const Point direction = (1 / length) * axis;
    const Real sizes = half_sum(a) + half_sum(b);
    const Real touching = projected_radius(a, direction, 0) + projected_radius(b, direction, 0);
    if (!exactly_overlap(a, b, (touching - sizes * 1e-3L) * direction)) continue;
    const Real far = touching * norm_max(direction);
    const Real pad_a = kPosePadSize * half_sum(a), pad_b = kPosePadSize * half_sum(b) + kPosePadPlace * far;
    const auto reached = [&](Real grow) {
      return projected_radius(a, direction, pad_a + grow) + projected_radius(b, direction, pad_b + grow);
    };
    const Real slack = reached(kSlackGrow * sizes) - reached(0) + (edge ? kSlackEdge / length * half_sum(a) : Real(0));
    const Point at = (reached(0) + slack * static_cast<Real>(random.uniform(0.96, 1.06))) * direction;
    write_pose(poses.format, q, oracle::convert<double>(at), poses.pose(i, 1));
    return;
  }
}

// n instances of two links with one box each. The leaf of link 1 comes first, so leaves are not in the order of links.
Member edge_member(Random& random, std::uint32_t n, BatchKind kind) {
  Member out;
  out.kind = kind;
  out.rig.parents = {-1, 0};
  out.rig.parent_offset.resize(2);
  out.rig.leaves = {{1, random_box(random, {}, 0.5, 1), {}}, {0, random_box(random, {}, 0.5, 1), {}}};
  out.poses = random_poses(random, out.rig, n, PoseFormat::kQuaternionTranslation, {0, false, false, {}});
  for (std::uint32_t i = 0; i < n; ++i) place_at_edge(random, out.rig, out.poses, i);
  return out;
}

}  // namespace

TEST_CASE("pairs at the edge of the slack: tree and brute, characters and frames, and every ISA say the same") {
  std::size_t hits = 0, asked = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    world.members.push_back(edge_member(random, 200, BatchKind::kCharacters));
    world.rules = {{{1}, {1}, Pairing::kWithin}};
    const Outcome expected = run_world(world);
    hits += expected.hits.size();
    asked += 200;
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      EngineDesc desc;
      desc.isa = isa;
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
          world.members[0].kind = kind;
          const Outcome got = run_world(world, {Refit::kCab, strategy, Exact::kNone}, desc);
          CHECK(same_hits(got.hits, expected.hits));
          CHECK(got.stats.box_tests == 200);
        }
      }
    }
  }
  CHECK(hits > asked / 10);  // the edge is tested from both sides
  CHECK(hits < asked * 9 / 10);
}

TEST_CASE("a tree opens fewer pairs than brute where bodies are apart, and both count every test") {
  Random random(3);
  World world;
  Member member;
  member.rig = random_rig(random, Topology::kChain, 32, 1);
  const std::uint32_t leaves = member.rig.leaf_count();
  member.poses = random_poses(random, member.rig, 2, PoseFormat::kMatrix3x4Rows, {1.5, false, false, {}});
  member.kind = BatchKind::kSequence;
  world.members = {member, member};
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  std::rotate(world.members[1].poses.data.begin(),
              world.members[1].poses.data.begin() + static_cast<std::ptrdiff_t>(world.members[1].poses.data.size() / 2),
              world.members[1].poses.data.end());  // each frame against the pose of the other sequence
  const Outcome tree = run_world(world, {Refit::kCab, Strategy::kTree}),
                brute = run_world(world, {Refit::kCab, Strategy::kBrute, Exact::kNone});
  CHECK(brute.stats.box_tests == 2 * std::uint64_t{leaves} * leaves);
  CHECK(tree.stats.box_tests < brute.stats.box_tests / 2);
  CHECK(tree.stats.box_tests >= 2);
}

TEST_CASE(
    "bodies of 1, a few and hundreds of leaves in one spot: tree and rows find what brute finds, each pair once") {
  Random random(31);
  World world;
  for (const std::uint32_t instances : {2u, 30u, 400u}) {
    const unsigned links = instances == 2 ? 300 : instances == 30 ? 12 : 1;
    Member member;
    member.rig = random_rig(random, Topology::kTree, links, 1);
    member.poses = random_poses(random, member.rig, instances, PoseFormat::kMatrix3x4Rows, {0.3, true, true, {}});
    world.members.push_back(member);
  }
  pair_all(world, 1, 3);
  const Outcome brute = run_world(world, {Refit::kCab, Strategy::kBrute, Exact::kNone});
  CHECK(brute.hits.size() > 10'000);
  CHECK(missing_from(judge_world(world), brute.hits) == 0);
  for (const Strategy strategy : {Strategy::kTree, Strategy::kRows})
    for (const std::uint32_t threads : {1u, 2u}) {
      EngineDesc desc;
      desc.thread_count = threads;
      const Outcome outcome = run_world(world, {Refit::kCab, strategy, Exact::kNone}, desc);
      CHECK(same_hits(outcome.hits, brute.hits));
      CHECK(outcome.stats.leaf_pairs == brute.stats.leaf_pairs);
      CHECK(outcome.stats.candidates == brute.stats.candidates);
    }
}
