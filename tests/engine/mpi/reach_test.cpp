// How far characters reach: cubes that hold their boxes.
#include "engine/mpi/reach.h"

#include "perf/harness/random_world.h"
#include "perf/judge/oracle/random_skins.h"
#include "tests/rounds.h"

#include <cab/cab.h>

#include <doctest/doctest.h>

#include <algorithm>
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

// How far the leaf boxes of each instance reach from its origin along the world's axes, at most.
std::vector<double> reaches_of(const ArticulationDesc& desc, const Poses& poses) {
  const EnginePtr engine = make_engine();
  ArticulationId articulation;
  require(add_articulation(*engine, desc, &articulation));
  const BatchId batch = add_instances(*engine, articulation, kInstances);
  const std::size_t leaves = desc.leaves.size, nodes = 2 * leaves - 1;
  std::vector<Box> boxes(kInstances * nodes);
  std::vector<std::uint8_t> flags(kInstances);
  BatchInput input = poses.input(batch);
  input.flags = flags;
  require(compute_boxes(*engine, input, {}, boxes));
  std::vector<double> out(kInstances);
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    REQUIRE(flags[i] == kInstanceOk);
    for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
      const Box& box = boxes[i * nodes + leaf];
      for (std::size_t c = 0; c < 3; ++c) {
        double reach = std::fabs(static_cast<double>(box.center[c]));
        for (std::size_t k = 0; k < 3; ++k)
          reach += std::fabs(static_cast<double>(box.axis[k][c])) * static_cast<double>(box.half[k]);
        out[i] = std::max(out[i], reach);
      }
    }
  }
  return out;
}

// A leaf of one triangle on link 0, which link `by` moves. binds: of both links.
SkinRig one_triangle(std::uint32_t by, const std::vector<float>& vertices, const std::vector<float>& binds) {
  SkinRig out;
  out.parents = {-1, 0};
  out.vertices = vertices;
  out.links = {by, by, by};
  out.weights = {1, 1, 1};
  out.inverse_bind = binds;
  out.leaves.resize(1);
  out.triangles = {{0, 1, 2}};
  out.leaves[0].triangles = out.triangles[0];
  return out;
}

void check_cubes(const SkinRig& skin, const Poses& poses) {
  const std::vector<double> reaches = reaches_of(skin.desc(), poses);
  const std::vector<mpi::LinkReach> links = mpi::link_reaches(skin.desc());
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    const mpi::RelativeBounds cube = mpi::reach_of(links, skin.link_count(), poses.input({1}), i);
    REQUIRE(!cube.none());
    CHECK(reaches[i] <= static_cast<double>(cube.hi[0]));
  }
}

}  // namespace

TEST_CASE("the cube of a character's reach holds its leaf boxes, in every format and at every scale") {
  for (std::uint64_t seed = 1; seed <= rounds(50); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Member member = any_sized_member(random);
    const std::vector<double> reaches = reaches_of(member.rig.desc(), member.poses);
    const BatchInput input = member.poses.input({1});
    const std::vector<mpi::LinkReach> links = mpi::link_reaches(member.rig.desc());
    for (std::uint32_t i = 0; i < kInstances; ++i) {
      const mpi::RelativeBounds cube = mpi::reach_of(links, member.rig.link_count(), input, i);
      REQUIRE(!cube.none());
      CHECK(reaches[i] <= static_cast<double>(cube.hi[0]));
    }
  }
}

TEST_CASE("the cube of a character with a skin holds its grown boxes, and is a few times as large") {
  // Of what it holds and a link's length, where links are bound at places of their own and weights change little by
  // little; worst of 600 000: 7.82.
  constexpr double kMostLarger = 10;
  double largest = 0;
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const auto regime = static_cast<SkinRegime>(seed % kSkinRegimeCount);
    const SkinRig skin = random_skin(random, regime);
    const Poses poses = random_skin_poses(random, skin, kInstances, static_cast<PoseFormat>(random.index(3)),
                                          random.uniform(0, 3), random.chance(0.5) ? 0 : random.uniform(0, 1),
                                          random.chance(0.3) ? 0 : random.log_uniform(0.1, 100));
    const std::vector<double> reaches = reaches_of(skin.desc(), poses);
    const BatchInput input = poses.input({1});
    const std::vector<mpi::LinkReach> links = mpi::link_reaches(skin.desc());
    for (std::uint32_t i = 0; i < kInstances; ++i) {
      const mpi::RelativeBounds cube = mpi::reach_of(links, skin.link_count(), input, i);
      REQUIRE(!cube.none());
      CHECK(reaches[i] <= static_cast<double>(cube.hi[0]));
      if (regime != SkinRegime::kSmooth || skin.inverse_bind.empty()) continue;
      const double link = skin.size * (poses.scales.empty() ? 1 : static_cast<double>(poses.scales[i]));
      largest = std::max(largest, static_cast<double>(cube.hi[0]) / (reaches[i] + link));
    }
  }
  MESSAGE("a cube is up to ", largest, " times as large as what it holds");
  CHECK(largest <= kMostLarger);
}

TEST_CASE("cubes hold what a link makes larger, and what is padded much since numbers cancel") {
  Random random(5);
  Poses poses;
  poses.link_count = 2;
  poses.instance_count = kInstances;
  for (std::uint32_t i = 0; i < 2 * kInstances; ++i) {
    double q[4];
    random_turn(random, q);
    for (const double x : q) poses.data.push_back(static_cast<float>(x));
    for (std::size_t c = 0; c < 3; ++c) poses.data.push_back(static_cast<float>(random.uniform(-1, 1)));
  }
  const auto twice = [](std::vector<float> bind) {
    bind.insert(bind.end(), bind.begin(), bind.begin() + 16);
    return bind;
  };
  const std::vector<float> larger = {1,  0, 0, 0, 0, 1,  0, 0, 0, 0, 1,  0, 0, 0, 0, 1,
                                     30, 0, 0, 0, 0, 30, 0, 0, 0, 0, 30, 0, 0, 0, 0, 1};
  check_cubes(one_triangle(1, {-1, 0, 0, 1, 0, 0, 0, 0.1f, 0}, larger), poses);
  // The boxes of a skin have padding for the condition of matrices.
  const std::vector<float> near = {-1, 1, 0, -2, 2, 0.5f, 0, 0, 1};
  const std::vector<float> singular = twice({1, 1, 0, 0, 1, 1 + 0x1p-23f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  const std::vector<double> padded = reaches_of(one_triangle(1, near, singular).desc(), poses);
  CHECK(*std::min_element(padded.begin(), padded.end()) > 10);
  check_cubes(one_triangle(1, near, singular), poses);
  // Sums that depend on their order.
  constexpr float kHuge = 0x1p59f;
  const std::vector<float> far = {kHuge, -kHuge, 0, kHuge, -kHuge, 1e-3f, kHuge, -kHuge, 2e-3f};
  check_cubes(one_triangle(0, far, twice({1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 1, kHuge, 0, 1})), poses);
}

TEST_CASE("a character with a number that is not finite has no bounds, and a margin widens them") {
  Random random(1);
  Member member = any_member(random, kInstances, BatchKind::kCharacters, {2, true, true, {}}, 10);
  const std::vector<mpi::LinkReach> links = mpi::link_reaches(member.rig.desc());
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

TEST_CASE("a skin has no bounds if a link that moves it is not finite, whichever link carries the leaf") {
  const SkinRig skin = one_triangle(1, {0, 0, 0, 1, 0, 0, 0, 1, 0}, {});
  const std::vector<mpi::LinkReach> links = mpi::link_reaches(skin.desc());
  std::vector<float> poses = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  BatchInput input;
  input.poses.data = poses.data();
  CHECK(!mpi::reach_of(links, 2, input, 0).none());
  for (const std::size_t at : {4u, 11u}) {
    poses[at] = std::numeric_limits<float>::quiet_NaN();
    CHECK(mpi::reach_of(links, 2, input, 0).none());
    poses[at] = 0;
  }
}

}  // namespace cab::tests
