// Link bounds: one box around all leaves of a link, with the room that posing and slack need.
#include "layout/link_bounds.h"

#include "perf/judge/oracle/box_tile.h"
#include "tests/layout/random_links.h"

#include <doctest/doctest.h>

#include <cstring>

namespace cab::tests {

TEST_CASE("a link's box contains its leaves' boxes and what is near them, of every size, shape and place") {
  oracle::Random random(61);
  long double worst = -1;
  std::size_t judged = 0;
  for (int round = 0; round < 400; ++round) {
    CAPTURE(round);
    const double size = random.chance(0.3) ? random.log_uniform(1e-30, 1e17) : 1;
    const double away = size > 1e13 || random.chance(0.5) ? 5 : 1e4;
    const LinkRig rig = random_links(random, random.chance(0.5) ? 40 : 3, size, away);
    const Articulation& links = rig.link_bounds.links;
    REQUIRE(links.leaf_count == rig.link_bounds.leaves.size);
    for (std::uint32_t i = 0; i < links.leaf_count; ++i) {
      const LinkLeaves& leaves = rig.link_bounds.leaves[i];
      for (std::uint32_t n = 0; n < leaves.leaf_count; ++n) {
        const Box& leaf = rig.articulation.leaf_box[rig.articulation.leaf_order[leaves.first_leaf + n]];
        const auto inner = oracle_box(leaf);
        const long double by = sticking_out(oracle_box(links.leaf_box[i]), inner, kLeafSlack * oracle::half_sum(inner));
        CHECK(by <= 0);
        worst = std::max(worst, by);
        ++judged;
      }
    }
  }
  MESSAGE(judged << " leaf boxes; the nearest left " << static_cast<double>(-worst) << " of its link's box");
  CHECK(judged > 10'000);
}

TEST_CASE("link bounds list each leaf once, under its own link, and tiles hold the same boxes, the last one repeated") {
  oracle::Random random(62);
  std::size_t empty = 0, several = 0;
  for (int round = 0; round < 100; ++round) {
    CAPTURE(round);
    const LinkRig rig = random_links(random, round % 4 == 0 ? 1 : 40, 1, 5);
    const Articulation &links = rig.link_bounds.links, &all = rig.articulation;
    std::vector<unsigned> seen(all.leaf_count);
    bool has_several_leaves = false;
    for (std::uint32_t i = 0; i < links.leaf_count; ++i) {
      const LinkLeaves& leaves = rig.link_bounds.leaves[i];
      CHECK(leaves.link == links.leaf_link[i]);
      CHECK((i == 0 || rig.link_bounds.leaves[i - 1].link < leaves.link));
      CHECK(leaves.leaf_count > 0);
      has_several_leaves = has_several_leaves || leaves.leaf_count > 1;
      for (std::uint32_t lane = 0; lane < tile_count(leaves.leaf_count) * kLanes; ++lane) {
        const std::uint32_t n = std::min<std::uint32_t>(lane, leaves.leaf_count - 1u);
        const std::uint16_t leaf = all.leaf_order[leaves.first_leaf + n];
        CHECK(all.leaf_link[leaf] == leaves.link);
        if (lane == n) ++seen[leaf];
        const auto in_tile = oracle::get(rig.link_bounds.tiles[leaves.first_tile + lane / kLanes], lane % kLanes);
        const auto expected = oracle_box(all.leaf_box[leaf]);
        CHECK(std::memcmp(&in_tile, &expected, sizeof(expected)) == 0);
        // Leaves are in order, so that the first that touches is the lowest.
        if (lane == n && n > 0) CHECK(all.leaf_order[leaves.first_leaf + n - 1] < leaf);
      }
    }
    CHECK(std::all_of(seen.begin(), seen.end(), [](unsigned times) { return times == 1; }));
    CHECK(rig.link_bounds.has_several_leaves == has_several_leaves);
    several += has_several_leaves;
    empty += links.link_count - links.leaf_count;
    // The same links are posed as those of the articulation, with joints where merges need them.
    REQUIRE(links.posed_links.size == all.posed_links.size);
    for (std::size_t p = 0; p < links.posed_links.size; ++p) {
      CHECK(links.posed_links[p].link == all.posed_links[p].link);
      CHECK(links.posed_links[p].needs_joint == all.posed_links[p].needs_joint);
      const std::uint32_t boxes = links.posed_links[p].leaf_end - links.posed_links[p].leaf_begin;
      CHECK(boxes == (all.posed_links[p].leaf_end > all.posed_links[p].leaf_begin ? 1 : 0));
      if (boxes) CHECK(links.leaf_link[links.leaf_order[links.posed_links[p].leaf_begin]] == links.posed_links[p].link);
    }
  }
  CHECK(empty > 20);
  CHECK(several > 50);
}

TEST_CASE("a link of one leaf has that leaf's box, no more than slack and padding larger") {
  oracle::Random random(63);
  for (int round = 0; round < 50; ++round) {
    const LinkRig rig = random_links(random, 1, 1, 5);
    for (std::uint32_t i = 0; i < rig.link_bounds.links.leaf_count; ++i) {
      const Box &link = rig.link_bounds.links.leaf_box[i],
                &leaf = rig.articulation.leaf_box[rig.articulation.leaf_order[rig.link_bounds.leaves[i].first_leaf]];
      const auto area = [](const Box& box, float wider) {
        const float x = box.half[0] + wider, y = box.half[1] + wider, z = box.half[2] + wider;
        return x * y + y * z + z * x;
      };
      const float size = leaf.half[0] + leaf.half[1] + leaf.half[2];
      const float away = std::fabs(leaf.center[0]) + std::fabs(leaf.center[1]) + std::fabs(leaf.center[2]);
      CHECK(area(link, 0) <= area(leaf, 0.01f * size + 0.001f * away));
    }
  }
}

}  // namespace cab::tests
