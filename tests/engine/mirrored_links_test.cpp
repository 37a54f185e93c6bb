// Links with mirrored poses: a body whose link is mirrored across its plane of x and y touches what the same body with
// mirrored leaves touches.
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <list>
#include <set>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// The vertices of mirrored hulls and the lists of mirrored parts, which outlive the rigs.
struct Kept {
  std::list<std::vector<float>> vertices;
  std::list<std::vector<ConvexPart>> parts;
};

// A box mirrored across z = 0. Its third axis is turned round, so that its axes are right-handed.
Box mirrored(Box box) {
  box.center[2] = -box.center[2];
  for (int k = 0; k < 3; ++k) box.axis[k][2] = -box.axis[k][2];
  for (float& component : box.axis[2]) component = -component;
  return box;
}

ConvexPart mirrored(ConvexPart part, Kept& kept) {
  part.position[2] = -part.position[2];
  // F R F of the reflection F is the rotation by the opposite angle about the mirrored axis.
  float* const q = part.rotation;
  q[0] = -q[0];
  q[1] = -q[1];
  if (part.kind == ShapeKind::kHalfSpace) {                 // F R F takes z to the opposite of the mirrored normal
    const float half_turn[4] = {-q[2], q[3], q[0], -q[1]};  // q times the half turn about y
    std::copy_n(half_turn, 4, q);
  }
  if (part.kind != ShapeKind::kConvexHull) return part;
  kept.vertices.emplace_back(part.vertices.begin(), part.vertices.end());
  for (std::size_t v = 2; v < kept.vertices.back().size(); v += 3) kept.vertices.back()[v] *= -1;
  part.vertices = {kept.vertices.back().data(), kept.vertices.back().size()};
  return part;
}

// Mirrors what belongs to some links of a rig.
Rig mirrored(Rig rig, const std::set<std::uint32_t>& links, Kept& kept) {
  for (const std::uint32_t link : links)
    if (!rig.joints.empty()) rig.joints[3 * link + 2] = -rig.joints[3 * link + 2];
  for (Leaf& leaf : rig.leaves) {
    if (links.count(leaf.link) == 0) continue;
    leaf.box = mirrored(leaf.box);
    kept.parts.emplace_back();
    for (const ConvexPart& part : leaf.parts) kept.parts.back().push_back(mirrored(part, kept));
    leaf.parts = {kept.parts.back().data(), kept.parts.back().size()};
  }
  return rig;
}

// Turns the third column of the matrices of some links round, in all instances.
void mirror_poses(Poses& poses, const std::set<std::uint32_t>& links) {
  for (std::uint32_t i = 0; i < poses.instance_count; ++i)
    for (const std::uint32_t link : links)
      for (std::size_t c = 0; c < 3; ++c) {
        float& entry = poses.pose(i, link)[poses.format == PoseFormat::kMatrix3x4Rows ? 4 * c + 2 : 8 + c];
        entry = -entry;
      }
}

// A world with mirrored links, and the same with mirrored leaves.
struct Worlds {
  World links, leaves;
};

Worlds mirror(const World& world, Random& random, Kept& kept) {
  Worlds out = {world, world};
  for (std::size_t m = 0; m < world.members.size(); ++m) {
    std::set<std::uint32_t> links;
    for (std::uint32_t link = 0; link < world.members[m].rig.link_count(); ++link)
      if (random.chance(0.5)) links.insert(link);
    mirror_poses(out.links.members[m].poses, links);
    out.leaves.members[m].rig = mirrored(world.members[m].rig, links, kept);
  }
  return out;
}

World crowd_of_matrices(Random& random, unsigned most_leaves) {
  World world;
  for (const PoseFormat format : {PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    Member member;
    member.rig = random_rig(random, Topology::kTree, 6, most_leaves);
    member.poses = random_poses(random, member.rig, 20, format, {0.5, random.chance(0.5), random.chance(0.5), {}});
    world.members.push_back(member);
  }
  world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {2}, Pairing::kBetween}, {{2}, {2}, Pairing::kWithin}};
  return world;
}

}  // namespace

TEST_CASE("a mirrored link has the boxes and hits of mirrored leaves, by every strategy and refit, bit for bit") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(8); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Kept kept;
    const Worlds worlds = mirror(crowd_of_matrices(random, 3), random, kept);
    for (const Isa isa : available_isas()) {
      EngineDesc desc;
      desc.isa = isa;
      for (const Strategy strategy : {Strategy::kRows, Strategy::kLinks, Strategy::kTree, Strategy::kBrute})
        for (const Refit refit : {Refit::kCab, Refit::kBest3, Refit::kAabbHull}) {
          const Policies policies = {refit, strategy};
          const Outcome links = run_world(worlds.links, policies, desc),
                        leaves = run_world(worlds.leaves, policies, desc);
          CHECK(links.stats.instances_masked == 0);
          CHECK(same_hits(links.hits, leaves.hits));
          hits += links.hits.size();
        }
    }
    for (const Policies& policies : all_refits()) {
      if (policies.refit == Refit::kAabbVertices) continue;  // a box about vertices is rounded another way
      CAPTURE(static_cast<int>(policies.refit));
      const std::size_t count = std::size_t{20} * worlds.links.members[0].rig.node_count();
      std::vector<Box> by_links(count), by_leaves(count);
      REQUIRE(compute_boxes(*make_engine_for(worlds.links), worlds.links.members[0].poses.input({1}), policies,
                            {by_links.data(), count}) == Status::kOk);
      REQUIRE(compute_boxes(*make_engine_for(worlds.leaves), worlds.leaves.members[0].poses.input({1}), policies,
                            {by_leaves.data(), count}) == Status::kOk);
      std::size_t different = 0;
      for (std::size_t n = 0; n < count; ++n)
        for (int c = 0; c < 3; ++c)
          different += by_links[n].center[c] != by_leaves[n].center[c] || by_links[n].half[c] != by_leaves[n].half[c];
      CHECK(different == 0);
    }
  }
  CHECK(hits >= least_count(10000, 8));
}

TEST_CASE("no frame with mirrored links loses a pair that the judge finds") {
  std::size_t judged = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Kept kept;
    const World world = mirror(crowd_of_matrices(random, 2), random, kept).links;
    const std::vector<Hit> exact = judge_world(world, 0, [](std::size_t, std::uint32_t) { return false; });
    const Outcome outcome = run_world(world);
    CHECK(missing_from(exact, outcome.hits) == 0);
    judged += exact.size();
  }
  CHECK(judged >= least_count(2000, 20));
}

TEST_CASE("shapes of every kind are mirrored with their link, for both exact tests") {
  std::size_t hits = 0, contacts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(12); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Kept kept;
    World world;
    std::list<std::vector<ConvexPart>> lists;
    std::list<std::vector<float>> vertices;
    for (int m = 0; m < 2; ++m) {
      Rig rig;
      for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kEllipsoid, ShapeKind::kCapsule, ShapeKind::kConvexHull,
                                   ShapeKind::kSphere, ShapeKind::kCylinder, ShapeKind::kHalfSpace}) {
        ConvexPart part;
        part.kind = kind;
        for (float& size : part.size) size = static_cast<float>(random.uniform(0.05, 0.3));
        for (float& at : part.position) at = static_cast<float>(random.uniform(-0.3, 0.3));
        double q[4];
        random_turn(random, q);
        for (std::size_t c = 0; c < 4; ++c) part.rotation[c] = static_cast<float>(q[c]);
        if (kind == ShapeKind::kConvexHull) {
          vertices.emplace_back();
          for (int v = 0; v < 3 * 12; ++v) vertices.back().push_back(static_cast<float>(random.uniform(-0.25, 0.25)));
          part.vertices = {vertices.back().data(), vertices.back().size()};
        }
        lists.push_back({part});
        const auto link = static_cast<std::uint32_t>(rig.parents.size());
        rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
        rig.parent_offset.push_back({{0.2, 0, 0}});
        rig.leaves.push_back(
            {link, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1.2f, 1.2f, 1.2f}}, {lists.back().data(), 1}});
      }
      world.members.push_back({rig, random_poses(random, rig, 4, PoseFormat::kMatrix3x4Rows, {0.6, false, false, {}})});
    }
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    world.contacts = true;
    const Worlds worlds = mirror(world, random, kept);
    for (const Exact exact : {Exact::kConvex, Exact::kFcl}) {
      if (exact == Exact::kFcl && !build_info().fcl) {
        MESSAGE("skipped: this build lacks FCL");
        continue;
      }
      CAPTURE(static_cast<int>(exact));
      const Policies policies = {Refit::kCab, Strategy::kBrute, exact};
      const Outcome links = run_world(worlds.links, policies), leaves = run_world(worlds.leaves, policies);
      CHECK(links.stats.instances_masked == 0);
      CHECK(same_hits(links.hits, leaves.hits));
      hits += links.hits.size();
      REQUIRE(links.hits.size() == leaves.hits.size());
      for (std::size_t h = 0; h < links.hits.size() && exact == Exact::kConvex; ++h) {
        const double depth = static_cast<double>(leaves.contacts[h].depth);
        CHECK(static_cast<double>(links.contacts[h].depth) == doctest::Approx(depth).epsilon(0.02));
        ++contacts;
      }
    }
  }
  CHECK(hits >= least_count(1000, 12));
  CHECK(contacts >= least_count(500, 12));
}

TEST_CASE("what touches does not depend on which links are roots") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(12); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World tree = crowd_of_matrices(random, 2);
    World forest = tree;
    for (Member& member : forest.members)
      for (std::size_t link = 1; link < member.rig.parents.size(); ++link)
        if (random.chance(0.4)) member.rig.parents[link] = -1;
    for (const Strategy strategy : {Strategy::kRows, Strategy::kLinks, Strategy::kTree, Strategy::kBrute})
      for (const Policies& refit : all_refits()) {
        Policies policies = refit;
        policies.strategy = strategy;
        const Outcome by_tree = run_world(tree, policies), by_forest = run_world(forest, policies);
        CHECK(same_hits(by_tree.hits, by_forest.hits));
        hits += by_forest.hits.size();
      }
  }
  CHECK(hits >= least_count(10000, 12));
}

}  // namespace cab::tests
