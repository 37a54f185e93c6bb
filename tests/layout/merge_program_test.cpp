// The merge program: children come first, every node is used once, and each cut is at a joint.
#include "layout/merge_program.h"

#include "layout/arena.h"
#include "perf/judge/oracle/random.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace {

using namespace cab;
using oracle::Random;

// Parents and leaf links, as an articulation gives them to the builder.
struct Topology {
  std::vector<std::int32_t> parents;
  std::vector<std::uint16_t> leaf_links;

  MergeProgram program(Arena& arena) const { return build_merge_program(parents, leaf_links, arena); }
};

Topology chain(std::uint32_t links) {
  Topology out;
  for (std::uint32_t link = 0; link < links; ++link) {
    out.parents.push_back(static_cast<std::int32_t>(link) - 1);
    out.leaf_links.push_back(static_cast<std::uint16_t>(link));
  }
  return out;
}

Topology star(std::uint32_t links) {
  Topology out = chain(links);
  for (std::uint32_t link = 1; link < links; ++link) out.parents[link] = 0;
  return out;
}

// A random tree with 0 to 4 leaves per link, in random order, and at least one leaf in all.
Topology random_tree(Random& random) {
  Topology out;
  const unsigned links = 1 + random.index(64);
  for (unsigned link = 0; link < links; ++link) {
    out.parents.push_back(link == 0 ? -1 : static_cast<std::int32_t>(random.index(link)));
    for (unsigned leaf = random.index(5); leaf > 0; --leaf) out.leaf_links.push_back(static_cast<std::uint16_t>(link));
  }
  if (out.leaf_links.empty()) out.leaf_links.push_back(static_cast<std::uint16_t>(random.index(links)));
  for (std::size_t i = out.leaf_links.size(); i > 1; --i)
    std::swap(out.leaf_links[i - 1], out.leaf_links[random.index(static_cast<unsigned>(i))]);
  return out;
}

// Checks everything that a program promises. Replaying the steps gives the leaves below each node.
void check_program(const Topology& topology, const MergeProgram& program) {
  const std::size_t leaf_count = topology.leaf_links.size();
  REQUIRE(program.steps.size == leaf_count - 1);
  REQUIRE(program.node_leaf_count.size == 2 * leaf_count - 1);
  std::vector<std::set<std::size_t>> leaves(leaf_count);
  std::vector<std::uint32_t> depth(leaf_count, 0);
  std::vector<int> used(2 * leaf_count - 1, 0);
  for (std::size_t leaf = 0; leaf < leaf_count; ++leaf) leaves[leaf].insert(leaf);

  const auto links_of = [&](std::size_t node) {
    std::set<std::int32_t> links;
    for (const std::size_t leaf : leaves[node]) links.insert(topology.leaf_links[leaf]);
    return links;
  };
  const auto root_of = [&](std::int32_t link) {
    while (topology.parents[static_cast<std::size_t>(link)] >= 0)
      link = topology.parents[static_cast<std::size_t>(link)];
    return link;
  };
  const auto share_a_root = [&](const std::set<std::int32_t>& one, const std::set<std::int32_t>& other) {
    return std::any_of(one.begin(), one.end(), [&](std::int32_t a) {
      return std::any_of(other.begin(), other.end(), [&](std::int32_t b) { return root_of(a) == root_of(b); });
    });
  };
  const auto below = [&](std::int32_t link, std::int32_t ancestor) {
    while (link > ancestor) link = topology.parents[static_cast<std::size_t>(link)];
    return link == ancestor;
  };

  for (std::size_t s = 0; s < program.steps.size; ++s) {
    const MergeStep step = program.steps[s];
    const std::size_t node = leaf_count + s;
    REQUIRE(step.left < node);  // children first
    REQUIRE(step.right < node);
    ++used[step.left];
    ++used[step.right];
    const std::set<std::int32_t> left = links_of(step.left), right = links_of(step.right);
    if (step.joint_link == kNoJoint) {  // leaves of one link, or of different trees
      const bool one_link = left.size() == 1 && left == right;
      CHECK((one_link || !share_a_root(left, right)));
    } else {  // the joint separates the two sides: one is all below the joint's link, no leaf of the other is
      CHECK(share_a_root(left, right));
      const std::int32_t joint = step.joint_link;
      REQUIRE(joint > 0);
      REQUIRE(static_cast<std::size_t>(joint) < topology.parents.size());
      CHECK(std::all_of(right.begin(), right.end(), [&](std::int32_t link) { return below(link, joint); }));
      CHECK(std::none_of(left.begin(), left.end(), [&](std::int32_t link) { return below(link, joint); }));
    }
    leaves.push_back(leaves[step.left]);
    leaves.back().insert(leaves[step.right].begin(), leaves[step.right].end());
    depth.push_back(1 + std::max(depth[step.left], depth[step.right]));
  }

  for (std::size_t node = 0; node + 1 < used.size(); ++node) CHECK(used[node] == 1);
  CHECK(used.back() == 0);  // the root is last
  CHECK(leaves.back().size() == leaf_count);
  CHECK(program.depth == depth.back());
  for (std::size_t node = 0; node < leaves.size(); ++node) CHECK(program.node_leaf_count[node] == leaves[node].size());
}

std::uint32_t ceil_log2(std::uint32_t n) {
  std::uint32_t bits = 0;
  while ((1u << bits) < n) ++bits;
  return bits;
}

}  // namespace

TEST_CASE("a single leaf needs no merge") {
  Arena arena(default_allocator());
  const Topology one = {{-1, 0, 1}, {2}};
  const MergeProgram program = one.program(arena);
  CHECK(program.depth == 0);
  check_program(one, program);
}

TEST_CASE("programs of random trees merge children first, use every node once, and part at the joint they name") {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Topology topology = random_tree(random);
    Arena arena(default_allocator());
    check_program(topology, topology.program(arena));
  }
}

TEST_CASE("trees of one articulation are merged one by one, and then with each other without a joint") {
  std::size_t forests = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Topology topology = random_tree(random);
    for (std::size_t link = 1; link < topology.parents.size(); ++link)
      if (random.chance(0.25)) {
        topology.parents[link] = -1;
        ++forests;
      }
    Arena arena(default_allocator());
    check_program(topology, topology.program(arena));
  }
  CHECK(forests > 300);
}

TEST_CASE("where every link carries a leaf, the joint's link is on one side and its parent on the other") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Topology topology = random_tree(random);
    topology.leaf_links.clear();
    for (std::size_t link = 0; link < topology.parents.size(); ++link)
      topology.leaf_links.push_back(static_cast<std::uint16_t>(link));
    Arena arena(default_allocator());
    const MergeProgram program = topology.program(arena);
    check_program(topology, program);
    std::vector<std::set<int>> links;
    for (std::size_t link = 0; link < topology.parents.size(); ++link) links.push_back({static_cast<int>(link)});
    for (const MergeStep& step : program.steps) {
      REQUIRE(step.joint_link != kNoJoint);
      CHECK(links[step.right].count(step.joint_link) == 1);
      CHECK(links[step.left].count(topology.parents[step.joint_link]) == 1);
      links.push_back(links[step.left]);
      links.back().insert(links[step.right].begin(), links[step.right].end());
    }
  }
}

TEST_CASE("a chain of n links is balanced: depth is the logarithm of n, rounded up") {
  for (const std::uint32_t n : {1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 15u, 16u, 17u, 33u, 100u, 511u, 1023u, 1024u}) {
    CAPTURE(n);
    Arena arena(default_allocator());
    const Topology topology = chain(n);
    const MergeProgram program = topology.program(arena);
    CHECK(program.depth == ceil_log2(n));
    if (n <= 100) check_program(topology, program);
  }
}

TEST_CASE("a star of 1024 links builds and is 1023 deep, since each of its joints parts one leaf from the rest") {
  Arena arena(default_allocator());
  const MergeProgram program = star(1024).program(arena);
  CHECK(program.steps.size == 1023);
  CHECK(program.depth == 1023);
  Arena small_arena(default_allocator());
  const Topology small = star(40);
  check_program(small, small.program(small_arena));
}

TEST_CASE("leaves of one link are merged first, in halves, without a joint") {
  Arena arena(default_allocator());
  Topology topology = chain(2);
  topology.leaf_links = {0, 1, 0, 1, 0, 1, 0, 1, 0};  // five on link 0, four on link 1
  const MergeProgram program = topology.program(arena);
  check_program(topology, program);
  for (std::size_t s = 0; s + 1 < program.steps.size; ++s) CHECK(program.steps[s].joint_link == kNoJoint);
  CHECK(program.steps[program.steps.size - 1].joint_link == 1);
  CHECK(program.depth == 1 + ceil_log2(5));
}

TEST_CASE("1024 leaves of one link make a balanced program") {
  Arena arena(default_allocator());
  const Topology topology = {{-1}, std::vector<std::uint16_t>(1024, 0)};
  CHECK(topology.program(arena).depth == 10);
}

TEST_CASE("links without leaves cost no merge") {
  Arena arena(default_allocator());
  Topology topology = chain(9);
  topology.leaf_links = {8, 0};  // seven links without leaves between
  const MergeProgram program = topology.program(arena);
  check_program(topology, program);
  REQUIRE(program.steps.size == 1);
  CHECK(program.depth == 1);
  CHECK(program.steps[0].left == 1);  // the leaf of link 0
  CHECK(program.steps[0].right == 0);
}

TEST_CASE("the cut halves the leaves, not the links") {
  Arena arena(default_allocator());
  Topology topology = chain(4);
  topology.leaf_links = {0, 1, 2, 3, 3, 3, 3, 3};
  const MergeProgram program = topology.program(arena);
  check_program(topology, program);
  CHECK(program.steps[program.steps.size - 1].joint_link == 3);  // 3 leaves against 5; cutting at 2 gives 2 against 6
}

TEST_CASE("the same topology gives the same program") {
  Random random(5);
  const Topology topology = random_tree(random);
  Arena first_arena(default_allocator()), second_arena(default_allocator());
  const MergeProgram first = topology.program(first_arena), second = topology.program(second_arena);
  REQUIRE(first.steps.size == second.steps.size);
  for (std::size_t s = 0; s < first.steps.size; ++s) {
    CHECK(first.steps[s].left == second.steps[s].left);
    CHECK(first.steps[s].right == second.steps[s].right);
    CHECK(first.steps[s].joint_link == second.steps[s].joint_link);
  }
}
