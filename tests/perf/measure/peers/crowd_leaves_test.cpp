// The numbers of the leaves of a crowd.
#include "perf/measure/peers/crowd_leaves.h"

#include <doctest/doctest.h>

#include "scenes/scene_list.h"

namespace cab::tests {

TEST_CASE("the leaves of a crowd are numbered through, whatever the bodies of its groups are") {
  for (const char* scene : {"jitter", "mixed"}) {
    CAPTURE(std::string(scene));
    const scenes::Crowd crowd = scenes::make_crowd(scene, 45);
    const perf::CrowdLeaves leaves(crowd);
    REQUIRE(leaves.character_count() == 45);
    std::uint32_t number = 0, character = 0, first_kind = 0;
    for (std::uint32_t g = 0; g < crowd.groups.size(); ++g) {
      const auto count = static_cast<std::uint32_t>(crowd.groups[g].figure.leaves.size());
      for (std::uint32_t i = 0; i < crowd.groups[g].count; ++i, ++character) {
        CHECK(leaves.character(character).group == g);
        CHECK(leaves.character(character).instance == i);
        CHECK(leaves.character(character).first_leaf == number);
        for (std::uint32_t leaf = 0; leaf < count; ++leaf, ++number) {
          CHECK(leaves.number_of(g, i, leaf) == number);
          CHECK(leaves.character_of(number) == character);
          CHECK(leaves.kind_of(number) == first_kind + leaf);
        }
        CHECK(leaves.end_leaf(character) == number);
      }
      first_kind += count;
    }
    CHECK(leaves.leaf_count() == number);
  }
}

}  // namespace cab::tests
