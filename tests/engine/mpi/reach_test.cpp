// How far characters reach: cubes that hold their boxes.
#include "engine/mpi/reach.h"

#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <cab/cab.h>

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kInstances = 20;

Member any_sized_member(Random& random) {
  Member member = any_member(random, kInstances, BatchKind::kCharacters, {2, true, true, {}}, 10);
  Poses& poses = member.poses;
  if (random.chance(0.5)) {
    for (std::uint32_t i = 0; i < kInstances; ++i)
      poses.scales.push_back(static_cast<float>(random.log_uniform(0.01, 100)));
  } else if (poses.format != PoseFormat::kQuaternionTranslation) {
    poses.has_scale = true;
    for (std::uint32_t i = 0; i < kInstances; ++i)
      for (std::uint32_t link = 0; link < poses.link_count; ++link)
        scale_matrix(poses.format, static_cast<float>(random.log_uniform(0.01, 100)), poses.pose(i, link));
  }
  return member;
}

}  // namespace

TEST_CASE("the cube of a character's reach holds its leaf boxes, in every format and at every scale") {
  for (std::uint64_t seed = 1; seed <= rounds(50); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Member member = any_sized_member(random);
    const EnginePtr engine = make_engine();
    const BatchId batch = add_instances(*engine, add_rig(*engine, member.rig), kInstances);
    std::vector<Box> boxes(std::size_t{kInstances} * member.rig.node_count());
    const BatchInput input = member.poses.input(batch);
    REQUIRE(compute_boxes(*engine, input, {}, boxes) == Status::kOk);
    const std::vector<mpi::LinkReach> links = mpi::link_reaches(member.rig.leaves);
    for (std::uint32_t i = 0; i < kInstances; ++i) {
      const mpi::RelativeBounds cube = mpi::reach_of(links, member.rig.link_count(), input, i);
      REQUIRE(!cube.none());
      for (std::uint32_t leaf = 0; leaf < member.rig.leaf_count(); ++leaf) {
        const Box& box = boxes[std::size_t{i} * member.rig.node_count() + leaf];
        for (std::size_t c = 0; c < 3; ++c) {
          double reach = std::fabs(static_cast<double>(box.center[c]));
          for (std::size_t k = 0; k < 3; ++k)
            reach += std::fabs(static_cast<double>(box.axis[k][c])) * static_cast<double>(box.half[k]);
          CHECK(reach <= static_cast<double>(cube.hi[c]));
        }
      }
    }
  }
}

TEST_CASE("a character with a number that is not finite has no bounds, and a margin widens them") {
  Random random(1);
  Member member = any_member(random, kInstances, BatchKind::kCharacters, {2, true, true, {}}, 10);
  const std::vector<mpi::LinkReach> links = mpi::link_reaches(member.rig.leaves);
  BatchInput input = member.poses.input({1});
  const float narrow = mpi::reach_of(links, member.rig.link_count(), input, 0).hi[0];
  const std::vector<float> margins(kInstances, 1);
  input.margins = margins;
  CHECK(mpi::reach_of(links, member.rig.link_count(), input, 0).hi[0] > narrow + 1.7f);

  const std::size_t last = member.poses.format == PoseFormat::kQuaternionTranslation ? 6
                           : member.poses.format == PoseFormat::kMatrix3x4Rows       ? 11
                                                                                     : 14;
  member.poses.pose(0, links[0].link)[last] = std::numeric_limits<float>::quiet_NaN();
  CHECK(mpi::reach_of(links, member.rig.link_count(), input, 0).none());
  CHECK(!mpi::reach_of(links, member.rig.link_count(), input, 1).none());
}

}  // namespace cab::tests
