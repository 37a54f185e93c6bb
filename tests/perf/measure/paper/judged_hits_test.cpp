// Hits of one exact test alone: found in two lists, judged by the shapes, and told one by one.
#include "perf/measure/paper/judged_hits.h"

#include <doctest/doctest.h>

#include <string>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::perf;

// Leaves that reach from -1 to 1 along x. A hull is a cube.
scenes::BodyLeaf made_leaf(ShapeKind kind) {
  scenes::BodyLeaf leaf;
  leaf.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};
  leaf.parts.emplace_back();
  ConvexPart& part = leaf.parts.back().shape;
  part.kind = kind;
  for (float& size : part.size) size = 1;
  if (kind == ShapeKind::kCapsule) part.size[0] = part.size[1] = 0.5f;
  // A quarter of a turn about y, by which the axis of the capsule comes to lie along x.
  part.rotation[1] = part.rotation[3] = 0.70710678f;
  for (const float x : {-1.0f, 1.0f})
    for (const float y : {-1.0f, 1.0f})
      for (const float z : {-1.0f, 1.0f})
        if (kind == ShapeKind::kConvexHull)
          leaf.parts.back().vertices.insert(leaf.parts.back().vertices.end(), {x, y, z});
  return leaf;
}

// Two characters of one link whose leaves have a gap along x of the given length in frame 1, and are far from each
// other in frame 0. The second character has two leaves; the first of them is out of reach.
scenes::Scene made_scene(const scenes::BodyLeaf& leaf, float gap) {
  scenes::Scene scene;
  scene.frame_count = 2;
  for (const char* name : {"anna", "bert"}) {
    scenes::Character character;
    character.name = name;
    character.link_names = {"hand"};
    character.link_parents = {-1};
    character.leaves = {leaf};
    scene.characters.push_back(character);
  }
  scenes::Character &anna = scene.characters[0], &bert = scene.characters[1];
  anna.poses = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  anna.origins = {100, 0, 0, 0, 0, 0};
  bert.poses = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 2 + gap, 0, 0};
  bert.origins = {0, 0, 0, 0, 0, 0};
  bert.leaves.insert(bert.leaves.begin(), leaf);
  bert.leaves[0].box.center[1] = 50;
  for (scenes::ShapePart& part : bert.leaves[0].parts) part.shape.position[1] = 50;
  return scene;
}

const Touch kTouch = {1, 0, 0, 1, 0, {}};

JudgedHit judged(const scenes::Scene& scene, bool by_convex) {
  const std::vector<JudgedHit> hits =
      by_convex ? judge_differences(scene, {}, {kTouch}) : judge_differences(scene, {kTouch}, {});
  REQUIRE(hits.size() == 1);
  CHECK(hits[0].by_convex == by_convex);
  CHECK(hits[0].leaf_a == 0);
  CHECK(hits[0].leaf_b == 1);
  return hits[0];
}

}  // namespace

TEST_CASE("the judge finds the gap of two links of every kind, and which test is right about it") {
  std::vector<scenes::BodyLeaf> leaves = {made_leaf(ShapeKind::kBox)};
  leaves[0].parts.clear();  // the leaf's box is its shape
  for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kEllipsoid, ShapeKind::kCapsule, ShapeKind::kConvexHull})
    leaves.push_back(made_leaf(kind));
  for (std::size_t l = 0; l < leaves.size(); ++l)
    for (const float gap : {-0.01f, 0.01f}) {
      CAPTURE(l);
      CAPTURE(gap);
      const scenes::Scene scene = made_scene(leaves[l], gap);
      const JudgedHit convex = judged(scene, true), fcl = judged(scene, false);
      // The rotation of a part is good to 6e-8.
      CHECK(convex.gap == doctest::Approx(static_cast<double>(gap)).epsilon(1e-4));
      CHECK(convex.gap == fcl.gap);
      CHECK(convex.convex_is_right == (gap < 0));
      CHECK(fcl.convex_is_right == (gap > 0));
    }
}

TEST_CASE("hits of one test alone are told one by one, and fail the gate where convex is wrong") {
  const scenes::Scene scene = made_scene(made_leaf(ShapeKind::kEllipsoid), 0.01f);
  const Gate same = convex_gate(7, judge_differences(scene, {kTouch}, {kTouch}));
  CHECK(same.passed);
  CHECK(same.text == "true hits by convex 7 are those by FCL");
  const Gate right = convex_gate(6, judge_differences(scene, {kTouch}, {}));
  CHECK(right.passed);
  CHECK(right.text.find("frame 1, anna hand and bert hand, leaves 0 and 1, by FCL alone; by the judge apart by 0.0") !=
        std::string::npos);
  const Gate wrong = convex_gate(8, judge_differences(scene, {}, {kTouch}));
  CHECK(!wrong.passed);
  CHECK(wrong.text.find("by convex alone") != std::string::npos);
  CHECK(wrong.text.find("convex is wrong") != std::string::npos);
}

TEST_CASE("a difference of hits is what only one list has") {
  const Touch later = {2, 0, 0, 1, 0, {}}, other_link = {1, 0, 0, 1, 3, {}};
  const HitDifference difference = difference_of({kTouch, later}, {kTouch, other_link});
  REQUIRE(difference.only_first.size() == 1);
  CHECK(difference.only_first[0].frame == 2);
  REQUIRE(difference.only_second.size() == 1);
  CHECK(difference.only_second[0].link_b == 3);
}

}  // namespace cab::tests
