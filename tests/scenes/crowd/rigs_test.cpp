// Rigs of many links: which links there are, and that their boxes cut up those of the body that they are made of.
#include "scenes/crowd/rigs.h"

#include "scenes/crowd/humanoid.h"
#include "scenes/scene_list.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <stdexcept>

namespace cab::tests {
namespace {

using scenes::Chosen;
using scenes::CrowdGroup;
using scenes::PosedGroup;

CrowdGroup two_humanoids() { return scenes::make_crowd("uniform", 2).groups[0]; }

float volume(const std::vector<scenes::BodyLeaf>& leaves) {
  float sum = 0;
  for (const scenes::BodyLeaf& leaf : leaves) sum += 8 * leaf.box.half[0] * leaf.box.half[1] * leaf.box.half[2];
  return sum;
}

}  // namespace

TEST_CASE("a rig has as many links as asked for, in parent order, and the first links have one piece more") {
  const CrowdGroup rig = scenes::with_links(two_humanoids(), 35);
  const scenes::Character& figure = rig.figure;
  CHECK(figure.link_parents.size() == 35);
  CHECK(figure.leaves.size() == 35);
  for (std::size_t link = 0; link < 35; ++link) {
    CHECK(figure.link_parents[link] < static_cast<std::int32_t>(link));
    CHECK(figure.leaves[link].link == link);
  }
  // Pelvis, abdomen and chest have three links each, all others two. The head goes on from the chest's last.
  CHECK(figure.link_names[8] == "chest 3");
  CHECK(figure.link_names[9] == "head 1");
  CHECK(figure.link_parents[9] == 8);
  CHECK(figure.link_parents[10] == 9);
}

TEST_CASE("the boxes of a rig are slices of the body's boxes, and move with them") {
  const CrowdGroup body = two_humanoids(), rig = scenes::with_links(body, 48);
  CHECK(volume(rig.figure.leaves) == doctest::Approx(volume(body.figure.leaves)));
  PosedGroup of_body, of_rig;
  body.pose(1.5, Chosen::all(body.count), of_body);
  rig.pose(1.5, Chosen::all(rig.count), of_rig);
  REQUIRE(of_rig.poses.size() == 2 * 48 * 7);
  CHECK(of_rig.origins == of_body.origins);
  for (std::size_t link = 0; link < of_body.poses.size() / 7; ++link) {
    const float* const one = of_body.poses.data() + 7 * link;
    for (std::size_t piece = 3 * link; piece < 3 * link + 3; ++piece)
      CHECK(std::equal(one, one + 7, of_rig.poses.data() + 7 * piece));
  }
  const Box &whole = body.figure.leaves[10].box, &first = rig.figure.leaves[30].box, &last = rig.figure.leaves[32].box;
  CHECK(first.center[2] - first.half[2] == doctest::Approx(whole.center[2] - whole.half[2]));
  CHECK(last.center[2] + last.half[2] == doctest::Approx(whole.center[2] + whole.half[2]));
  CHECK(first.half[0] == whole.half[0]);
}

TEST_CASE("a rig has no fewer links than the body, and no more than an articulation") {
  CHECK_THROWS_AS(scenes::with_links(two_humanoids(), scenes::kHumanoidLinks - 1), std::invalid_argument);
  CHECK_THROWS_AS(scenes::with_links(two_humanoids(), kMaxLinks + 1), std::invalid_argument);
  CHECK(scenes::with_links(two_humanoids(), kMaxLinks).figure.leaves.size() == kMaxLinks);
}

TEST_CASE("an enlarged body is larger in its boxes and its poses, and stands where it stood") {
  const CrowdGroup body = two_humanoids(), giant = scenes::enlarged(body, 4);
  PosedGroup of_body, of_giant;
  body.pose(0, Chosen::all(body.count), of_body);
  giant.pose(0, Chosen::all(giant.count), of_giant);
  CHECK(of_giant.origins == of_body.origins);
  CHECK(giant.figure.leaves[3].box.half[1] == 4 * body.figure.leaves[3].box.half[1]);
  CHECK(of_giant.poses[7 * 3 + 6] == 4 * of_body.poses[7 * 3 + 6]);
  CHECK(of_giant.poses[7 * 3 + 2] == of_body.poses[7 * 3 + 2]);
}

}  // namespace cab::tests
