// Boxes of a skin's leaves hold its vertices in every pose, on every instruction set with the same bits.
#include "kernels/grow_leaves.h"

#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/verify/posed_skin.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace cab::tests {
namespace {

using oracle::Poses;
using oracle::Random;
using oracle::SkinRegime;
using oracle::SkinRig;
using perf::pose_skin;
using perf::PosedSkin;

constexpr std::uint64_t kSeed = 40;

struct BuiltSkin {
  explicit BuiltSkin(const SkinRig& rig) : arena(default_allocator()) {
    REQUIRE(build_articulation(rig.desc(), arena, &articulation, nullptr) == Status::kOk);
  }
  Arena arena;
  Articulation articulation;
};

// How the vertices of a leaf lie in its posed box.
struct Fit {
  std::size_t outside = 0;
  double excess = -HUGE_VAL;             // of the vertex that is nearest to the outside, in the box's half extents
  oracle::Real area = 0, true_area = 0;  // of the box, and of the box with these axes about the vertices
};

oracle::Real area_of(const oracle::Point& half) { return half[0] * half[1] + half[1] * half[2] + half[2] * half[0]; }

Fit judge(const SkinRig& rig, const Poses& poses, std::uint32_t instance, std::size_t leaf, const BoxTile& tile) {
  const ArticulationDesc desc = rig.desc();
  const std::vector<oracle::ExactPose> exact = exact_poses(poses, instance);
  const auto box = oracle::get(tile, instance);
  Fit out;
  oracle::Point lo{}, hi{};
  for (std::size_t v = 0; v < rig.triangles[leaf].size(); ++v) {
    const oracle::Point p = skinned_vertex(desc.skin, exact, rig.triangles[leaf][v]);
    out.outside += !judge_containment(box, vertex_box(desc.skin, exact, rig.triangles[leaf][v])).inside;
    for (std::size_t k = 0; k < 3; ++k) {
      const oracle::Real y = dot(p - convert<oracle::Real>(oracle::to_vec3(box.center)),
                                 oracle::convert<oracle::Real>(oracle::to_vec3(box.axis[k])));
      if (box.half[k] > 0) out.excess = std::max(out.excess, static_cast<double>(std::fabs(y) / box.half[k]));
      lo[k] = v == 0 ? y : std::min(lo[k], y);
      hi[k] = v == 0 ? y : std::max(hi[k], y);
    }
  }
  out.area = area_of({{box.half[0], box.half[1], box.half[2]}});
  out.true_area = area_of(oracle::Real{0.5} * (hi - lo));
  return out;
}

constexpr PoseFormat kFormats[] = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                   PoseFormat::kMatrix4x4Columns};

}  // namespace

TEST_CASE("boxes of a skin hold its vertices however its links stand, with the same bits on every instruction set") {
  Random random(kSeed);
  std::size_t checked = 0, tight = 0, grown = 0;
  const std::uint64_t count = rounds(1500);
  for (std::uint64_t round = 0; round < count; ++round) {
    const auto regime = static_cast<SkinRegime>(round % oracle::kSkinRegimeCount);
    const SkinRig rig = random_skin(random, regime);
    const BuiltSkin built(rig);
    const double angles[] = {0.1, 1, 3.14159265}, shifts[] = {0, 0.1, 10}, away[] = {0, 1, 1e4, 1e7};
    const Poses poses = random_skin_poses(random, rig, kLanes, kFormats[random.index(3)], angles[random.index(3)],
                                          shifts[random.index(3)], away[random.index(4)]);
    float margins[kLanes] = {};
    if (random.chance(0.2))
      for (float& m : margins) m = static_cast<float>(0.1 * rig.size);
    const std::vector<const kernel::KernelTable*> tables = available_kernels();
    const PosedSkin posed = pose_skin(*tables[0], built.articulation, poses, margins);
    for (const kernel::KernelTable* table : tables) {
      const PosedSkin other = pose_skin(*table, built.articulation, poses, margins);
      INFO(name_of(*table));
      REQUIRE(std::memcmp(posed.leaves.data(), other.leaves.data(), posed.leaves.size() * sizeof(BoxTile)) == 0);
      REQUIRE(std::memcmp(posed.flags, other.flags, sizeof posed.flags) == 0);
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      REQUIRE(posed.flags[lane] == kInstanceOk);
      for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
        const Fit fit = judge(rig, poses, lane, leaf, posed.leaves[leaf]);
        CAPTURE(round);
        CAPTURE(leaf);
        REQUIRE(fit.outside == 0);
        checked += rig.triangles[leaf].size();
        tight += fit.excess > 0.99;
        ++grown;
      }
    }
  }
  MESSAGE(checked << " vertices in " << grown << " boxes, none outside; " << tight << " boxes touched at 1 %");
  CHECK(10 * tight >= grown);
}

TEST_CASE("few instances have the same boxes as in a full tile, on every instruction set") {
  Random random(kSeed + 7);
  std::size_t compared = 0;
  const std::uint64_t count = rounds(300);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinRig rig = random_skin(random, static_cast<SkinRegime>(round % oracle::kSkinRegimeCount));
    const BuiltSkin built(rig);
    const Poses poses = random_skin_poses(random, rig, kLanes, kFormats[round % 3], 3, 0.3, 5);
    for (const kernel::KernelTable* table : available_kernels()) {
      const PosedSkin full = pose_skin(*table, built.articulation, poses);
      for (const std::uint32_t few : {1u, 2u, 5u, 6u}) {
        const PosedSkin part = pose_skin(*table, built.articulation, poses, {}, few);
        for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf)
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            const auto box = oracle::get(part.leaves[leaf], lane),
                       same = oracle::get(full.leaves[leaf], std::min(lane, few - 1));
            REQUIRE(same_bits(box, same));
            ++compared;
          }
      }
    }
  }
  CHECK(compared >= least_count(10000, 300));
}

TEST_CASE("few instances with leaves as lanes have the boxes and the flags of lanes of instances") {
  Random random(kSeed + 8);
  std::size_t compared = 0, bad = 0, far = 0, rigid = 0;
  const std::uint64_t count = rounds(300);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinRig rig = random_skin(random, static_cast<SkinRegime>(round % oracle::kSkinRegimeCount));
    const BuiltSkin built(rig);
    const Articulation& articulation = built.articulation;
    if (articulation.skin.empty()) continue;
    Poses poses = random_skin_poses(random, rig, kLanes, kFormats[round % 3], 3, 0.3, 5);
    float margins[kLanes] = {};
    for (float& m : margins) m = static_cast<float>(0.1 * random.uniform(0, rig.size));
    if (random.chance(0.2)) poses.pose(random.index(3), articulation.skin.relatives[0])[2] = std::nanf("");
    // A range that is less than how far a box of the second instance is.
    const PosedSkin near = pose_skin(*kernel::find_kernels(Isa::kAuto), articulation, poses, margins);
    const float some = std::fabs(near.leaves[articulation.leaf_count - 1].center[0][1]);
    const float range = random.chance(0.3) ? 0.999f * some : kMaxCoordinate;
    for (const kernel::KernelTable* table : available_kernels())
      for (const std::uint32_t few : {1u, 2u, 5u}) {
        const PosedSkin expected = pose_skin(*table, articulation, poses, margins, few, false, range),
                        got = pose_skin(*table, articulation, poses, margins, few, true, range);
        CAPTURE(name_of(*table));
        for (std::uint32_t i = 0; i < few; ++i) {
          REQUIRE(got.flags[i] == expected.flags[i]);
          far += got.flags[i] != kInstanceOk && range < kMaxCoordinate;
          bad += got.flags[i] != kInstanceOk && range == kMaxCoordinate;
          const std::uint32_t tiles = tile_count(articulation.leaf_count);
          for (std::uint32_t n = 0; n < tiles * kLanes; ++n) {
            const std::uint32_t leaf = std::min(n, articulation.leaf_count - 1);
            REQUIRE(same_bits(oracle::get(got.leaves[i * tiles + n / kLanes], n % kLanes),
                              oracle::get(expected.leaves[leaf], i)));
            rigid += articulation.skin.influence_begin[leaf] == articulation.skin.influence_begin[leaf + 1];
            ++compared;
          }
        }
      }
  }
  MESSAGE(compared << " boxes, " << rigid << " that do not grow; " << bad << " bad poses, " << far << " out of range");
  CHECK(compared >= least_count(50000, 300));
  CHECK(rigid > 0);
  CHECK(bad > 0);
  CHECK(far > 0);
}

TEST_CASE("boxes of a bent limb are little larger than those about its skinned vertices") {
  Random random(kSeed + 1);
  oracle::Real area = 0, true_area = 0;
  for (int round = 0; round < 200; ++round) {
    const SkinRig rig = random_skin(random, SkinRegime::kSmooth);
    const BuiltSkin built(rig);
    const Poses poses = random_skin_poses(random, rig, kLanes, PoseFormat::kMatrix3x4Rows, 0.7, 0.02, 1);
    const PosedSkin posed = pose_skin(*kernel::find_kernels(Isa::kAuto), built.articulation, poses);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
        const Fit fit = judge(rig, poses, lane, leaf, posed.leaves[leaf]);
        area += fit.area / static_cast<oracle::Real>(rig.size * rig.size);
        true_area += fit.true_area / static_cast<oracle::Real>(rig.size * rig.size);
      }
  }
  MESSAGE("surface over that of the true boxes: " << static_cast<double>(area / true_area));
  CHECK(area < 3 * true_area);
}

TEST_CASE("a leaf whose vertices one link moves has the bits of a rigid leaf with its box") {
  Random random(kSeed + 2);
  for (int round = 0; round < 100; ++round) {
    SkinRig rig = random_skin(random, SkinRegime::kRigid);
    const BuiltSkin skinned(rig);
    CHECK(skinned.articulation.skin.empty());
    for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
      rig.leaves[leaf].box = skinned.articulation.leaf_box[leaf];
      rig.leaves[leaf].triangles = {};
    }
    const BuiltSkin rigid(rig);
    const Poses poses = random_skin_poses(random, rig, kLanes, PoseFormat::kQuaternionTranslation, 3, 1, 1);
    const kernel::KernelTable& kernels = *kernel::find_kernels(Isa::kAuto);
    const PosedSkin a = pose_skin(kernels, skinned.articulation, poses),
                    b = pose_skin(kernels, rigid.articulation, poses);
    REQUIRE(std::memcmp(a.leaves.data(), b.leaves.data(), a.leaves.size() * sizeof(BoxTile)) == 0);
  }
}

TEST_CASE("a bad pose of one link masks its instance alone, whatever the link moves") {
  Random random(kSeed + 3);
  for (int round = 0; round < 100; ++round) {
    const SkinRig rig = random_skin(random, SkinRegime::kMany);
    const BuiltSkin built(rig);
    Poses poses = random_skin_poses(random, rig, kLanes, PoseFormat::kQuaternionTranslation, 1, 0.1, 1);
    const PosedSkin good = pose_skin(*kernel::find_kernels(Isa::kAuto), built.articulation, poses);
    const std::uint16_t link =
        built.articulation.skin.relatives[random.index(static_cast<unsigned>(built.articulation.skin.relatives.size))];
    const std::uint32_t bad = random.index(kLanes);
    poses.pose(bad, link)[random.index(7)] = std::nanf("");
    std::vector<PosedSkin> all;
    for (const kernel::KernelTable* table : available_kernels())
      all.push_back(pose_skin(*table, built.articulation, poses));
    for (const PosedSkin& posed : all) {
      CHECK(std::memcmp(posed.leaves.data(), all[0].leaves.data(), posed.leaves.size() * sizeof(BoxTile)) == 0);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        CHECK(posed.flags[lane] == (lane == bad ? kInstanceNotFinite : kInstanceOk));
        for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
          const auto box = oracle::get(posed.leaves[leaf], lane);
          if (lane == bad)
            CHECK(box.half[0] + box.half[1] + box.half[2] == 0);
          else
            CHECK(same_bits(box, oracle::get(good.leaves[leaf], lane)));
        }
      }
    }
  }
}

}  // namespace cab::tests
