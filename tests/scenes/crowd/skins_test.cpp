// Humanoids with skins: their leaves, triangles and weights, and that nobody is near another.
#include "scenes/crowd/skins.h"

#include "perf/harness/engine_ptr.h"
#include "scenes/scene_list.h"

#include <cab/cab.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::tests {
namespace {

using scenes::SkinLeafKind;

scenes::Crowd crowd_of(std::uint32_t count, SkinLeafKind leaves) {
  scenes::CrowdSources sources;
  sources.skin_leaves = leaves;
  return scenes::make_crowd("skins", count, sources);
}

}  // namespace

TEST_CASE("a humanoid's skin has every triangle in one leaf of the link with most of its weight") {
  const scenes::Character grown = crowd_of(1, SkinLeafKind::kGrown).groups[0].figure,
                          rigid = crowd_of(1, SkinLeafKind::kRigid).groups[0].figure;
  REQUIRE(grown.leaves.size() == scenes::kSkinLeaves);
  REQUIRE(rigid.leaves.size() == scenes::kSkinLeaves);
  CHECK(rigid.skin.vertices.empty());
  const std::size_t width = grown.skin.influence_count;
  std::size_t triangles = 0, blended = 0;
  for (std::size_t n = 0; n < grown.leaves.size(); ++n) {
    const scenes::BodyLeaf &leaf = grown.leaves[n], &still = rigid.leaves[n];
    CHECK(leaf.link == still.link);
    CHECK(still.triangles.empty());
    triangles += leaf.triangles.size() / 3;
    for (const std::uint32_t v : leaf.triangles) {
      double sum = 0, own = 0, most = 0;
      for (std::size_t i = v * width; i < (v + 1) * width; ++i) {
        const double weight = grown.skin.influence_weights[i];
        CHECK(weight >= 0);
        sum += weight;
        most = std::max(most, weight);
        if (grown.skin.influence_links[i] == leaf.link) own += weight;
      }
      CHECK(sum == doctest::Approx(1));
      blended += most < .999;
      // In the frame of the link at rest, the vertex is in the box of the rigid leaf.
      const float* const bind = grown.skin.inverse_bind.data() + 16 * leaf.link;
      for (std::size_t c = 0; c < 3; ++c) {
        const double at = double{grown.skin.vertices[3 * v + c]} + double{bind[12 + c]};
        CHECK(std::fabs(at - double{still.box.center[c]}) <= double{still.box.half[c]} + 1e-6);
      }
      CHECK(own > .2);
    }
  }
  CHECK(triangles == scenes::kSkinTriangles);
  CHECK(blended > 1000);
}

TEST_CASE("nobody of the scene is near another, and each grown leaf is there in every frame") {
  for (const SkinLeafKind kind : {SkinLeafKind::kGrown, SkinLeafKind::kRigid}) {
    const scenes::Crowd crowd = crowd_of(50, kind);
    std::vector<scenes::PosedGroup> posed;
    const scenes::ArticulationStorage storage(crowd.groups[0].figure);
    Engine* made = nullptr;
    REQUIRE(create_engine({}, &made) == Status::kOk);
    const oracle::EnginePtr engine(made);
    BatchDesc batch;
    REQUIRE(add_articulation(*engine, storage.desc(), &batch.articulation) == Status::kOk);
    batch.instance_count = 50;
    BatchInput input;
    REQUIRE(add_batch(*engine, batch, &input.batch) == Status::kOk);
    for (const double seconds : {0.0, 0.25, 1.0}) {
      pose_crowd(crowd, seconds, posed);
      input.poses.data = posed[0].poses.data();
      input.origins = posed[0].origins;
      std::vector<std::uint8_t> flags(50);
      input.flags = flags;
      const PairRule rule = {input.batch, input.batch, Pairing::kBetween};
      FrameJob job;
      job.inputs = {&input, 1};
      job.rules = {&rule, 1};
      REQUIRE(run_frame(*engine, job) == Status::kOk);
      CHECK(job.hits_needed == 0);
      CHECK(std::count(flags.begin(), flags.end(), std::uint8_t{kInstanceOk}) == 50);
    }
  }
}

}  // namespace cab::tests
