// The judge of `cab peers`, on bodies of several kinds.
#include "perf/measure/peers/judge.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "scenes/scene_list.h"

namespace cab::tests {
namespace {

using perf::Differences;
using perf::LeafPair;
using perf::LeafVerdict;
using perf::Pairs;

}  // namespace

TEST_CASE("the judge of peers counts misses and false positives of every two groups of a crowd") {
  const scenes::Crowd crowd = scenes::make_crowd("mixed", 60);
  std::vector<scenes::PosedGroup> posed;
  scenes::pose_crowd(crowd, 0, posed);
  const perf::JudgedCrowd judge(crowd, posed);
  const perf::CrowdLeaves leaves(crowd);
  const auto group_of = [&](std::uint32_t leaf) { return leaves.character(leaves.character_of(leaf)).group; };
  const auto groups_of = [&](const LeafPair& pair) { return std::make_pair(group_of(pair.a), group_of(pair.b)); };
  const Pairs touching = judge.touching_pairs();
  std::set<std::pair<std::uint32_t, std::uint32_t>> met;
  for (const LeafPair& pair : touching) met.insert(groups_of(pair));
  CHECK(met.size() == 10);  // two of four groups, or a group and itself
  for (const auto& groups : met) {
    CAPTURE(groups.first);
    CAPTURE(groups.second);
    Pairs others, pairs_of_both;
    std::partition_copy(touching.begin(), touching.end(), std::back_inserter(pairs_of_both), std::back_inserter(others),
                        [&](const LeafPair& pair) { return groups_of(pair) == groups; });
    Differences left_out, added;
    add_differences(judge, others, touching, left_out, nullptr);
    CHECK(left_out.misses + left_out.threshold == pairs_of_both.size());
    CHECK(left_out.misses > 0);
    CHECK(left_out.false_positives == 0);

    // The first pair of leaves of these groups that is apart.
    Pairs more = touching;
    for (std::uint32_t a = 0; more.size() == touching.size(); ++a)
      for (std::uint32_t b = leaves.end_leaf(leaves.character_of(a)); b < leaves.leaf_count(); ++b)
        if (groups_of({a, b}) == groups && judge.verdict({a, b}) == LeafVerdict::kApart) {
          more.push_back({a, b});
          break;
        }
    std::sort(more.begin(), more.end());
    add_differences(judge, more, touching, added, nullptr);
    CHECK(added.misses == 0);
    CHECK(added.false_positives == 1);
  }
}

}  // namespace cab::tests
