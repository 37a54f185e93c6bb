// Skinned vertices are where long double puts them, bounds hold their triangles, and every instruction set has the same
// bits.
#include "kernels/surface/skin_leaf.h"

#include "kernels/surface/test_surfaces.h"
#include "layout/arena.h"
#include "layout/articulation.h"
#include "perf/judge/oracle/random_skins.h"
#include "perf/judge/oracle/triangle_judge.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace cab::tests {
namespace {

using oracle::Poses;
using oracle::Random;
using oracle::SkinRegime;
using oracle::SkinRig;

// A leaf of an instance, skinned.
struct Skinned {
  std::vector<float> vertices;
  std::vector<AabbTile> bounds;
  kernel::SkinnedLeaf leaf;

  Skinned(const kernel::KernelTable& kernels, const Articulation& articulation, const Poses& poses,
          std::uint32_t instance, std::size_t index) {
    const SurfaceLeaves& surface = articulation.surface;
    const SurfaceLeaf& of = surface.leaves[index];
    vertices.resize(std::size_t{4} * kLanes * of.block_count);
    bounds.resize(kernel::bounds_tiles(of.patch_count));
    leaf = {vertices.data(), bounds.data(), 0};
    std::vector<const float*> of_bones;
    for (std::uint32_t i = 0; i < of.bone_count; ++i)
      of_bones.push_back(poses.pose(instance, surface.bones[of.bone_begin + i].link));
    std::vector<float> bones(kernel::kBoneFloats * of_bones.size());
    PoseCoding coding;
    coding.format = poses.format;
    coding.scaling = poses.has_scale         ? Scaling::kInMatrices
                     : !poses.scales.empty() ? Scaling::kPerInstance
                                             : Scaling::kNone;
    kernels.skin_leaf({&surface, &of, coding, of_bones.data(),
                       poses.orientations.empty() ? nullptr : poses.orientations.data() + 4 * std::size_t{instance},
                       poses.scales.empty() ? 1 : poses.scales[instance], bones.data(), &leaf});
  }
};

bool same_skin(const Skinned& x, const Skinned& y) {
  return std::memcmp(x.vertices.data(), y.vertices.data(), x.vertices.size() * sizeof(float)) == 0 &&
         std::memcmp(x.bounds.data(), y.bounds.data(), x.bounds.size() * sizeof(AabbTile)) == 0 &&
         x.leaf.size == y.leaf.size;
}

constexpr PoseFormat kFormats[] = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                   PoseFormat::kMatrix4x4Columns};

}  // namespace

TEST_CASE("skinned vertices are within their error, in bounds of their triangles, with the same bits everywhere") {
  Random random(175);
  std::size_t checked = 0;
  double worst = 0;
  const std::uint64_t count = rounds(300);
  for (std::uint64_t round = 0; round < count; ++round) {
    const SkinRig rig = random_skin(random, static_cast<SkinRegime>(round % oracle::kSkinRegimeCount));
    const ArticulationDesc desc = rig.desc();
    Arena arena(default_allocator());
    Articulation articulation;
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
    const Poses poses = random_skin_poses(random, rig, 2, kFormats[round % 3], 3, 0.5, random.log_uniform(0.1, 1e7));
    for (std::uint32_t i = 0; i < 2; ++i) {
      const std::vector<oracle::ExactPose> exact = exact_poses(poses, i);
      for (std::size_t leaf = 0; leaf < rig.leaves.size(); ++leaf) {
        const Skinned skin(*available_kernels().front(), articulation, poses, i, leaf);
        for (const kernel::KernelTable* kernels : available_kernels())
          CHECK(same_skin(Skinned(*kernels, articulation, poses, i, leaf), skin));
        const SurfaceLeaves& surface = articulation.surface;
        const SurfaceLeaf& of = surface.leaves[leaf];
        for (std::uint32_t b = 0; b < of.block_count; ++b)
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            const std::uint32_t vertex = surface.blocks[of.block_begin + b].vertex[lane];
            const oracle::Point truth = skinned_vertex(desc.skin, exact, vertex);
            for (std::size_t c = 0; c < 3; ++c) {
              const auto error =
                  static_cast<double>(std::fabs(oracle::Real{skin.vertices[4 * (kLanes * b + lane) + c]} - truth[c]));
              const double most = static_cast<double>(kSurfaceError) * static_cast<double>(skin.leaf.size);
              CHECK(error <= most);
              worst = std::max(worst, error / most);
              ++checked;
            }
          }
        // Each triangle of the leaf is in one lane, within its bounds and those of its patch.
        std::multiset<std::uint32_t> listed;
        for (std::uint32_t p = 0; p < of.patch_count; ++p) {
          const TrianglePatch& patch = surface.patches[of.patch_begin + p];
          for (std::uint32_t lane = 0; lane < patch.count; ++lane) {
            listed.insert(patch.triangle[lane]);
            for (std::uint32_t k = 0; k < 3; ++k) {
              const std::uint32_t place = patch.corner[k][lane];
              CHECK(surface.blocks[of.block_begin + place / kLanes].vertex[place % kLanes] ==
                    rig.triangles[leaf][3 * patch.triangle[lane] + k]);
              const AabbTile &own = skin.bounds[p], &all = skin.bounds[of.patch_count + p / kLanes];
              for (std::uint32_t c = 0; c < 3; ++c) {
                const float at = skin.vertices[4 * place + c];
                CHECK((own.lo[c][lane] <= at && at <= own.hi[c][lane]));
                CHECK((all.lo[c][p % kLanes] <= own.lo[c][lane] && own.hi[c][lane] <= all.hi[c][p % kLanes]));
              }
            }
          }
        }
        CHECK(listed.size() == rig.triangles[leaf].size() / 3);
        CHECK(std::set<std::uint32_t>(listed.begin(), listed.end()).size() == listed.size());
      }
    }
  }
  CHECK(checked >= least_count(10000, 300));
  CHECK(worst > 0.01);  // an error that nothing comes near would say nothing
}

TEST_CASE("pairs of triangles of two leaves are those of every triangle with every other") {
  Random random(176);
  std::size_t touching = 0, near_box = 0;
  const std::uint64_t count = rounds(20);
  for (std::uint64_t round = 0; round < count; ++round) {
    SkinRig rig;
    rig.parents = {-1};
    rig.triangles.resize(2);
    rig.leaves.resize(2);
    for (std::size_t leaf = 0; leaf < 2; ++leaf) {
      const unsigned triangles = 1 + random.index(600);
      for (unsigned t = 0; t < triangles; ++t) {
        const oracle::Vec3<double> at = random.unit_vector();
        for (std::uint32_t k = 0; k < 3; ++k) {
          rig.triangles[leaf].push_back(static_cast<std::uint32_t>(rig.vertices.size() / 3));
          const oracle::Vec3<double> by = 0.25 * random.unit_vector();
          for (std::size_t c = 0; c < 3; ++c) rig.vertices.push_back(static_cast<float>(at[c] + by[c]));
          rig.links.push_back(0);
          rig.weights.push_back(1);
        }
      }
    }
    for (std::size_t leaf = 0; leaf < 2; ++leaf) rig.leaves[leaf].triangles = rig.triangles[leaf];
    Arena arena(default_allocator());
    Articulation articulation;
    REQUIRE(build_articulation(rig.desc(), arena, &articulation, nullptr) == Status::kOk);
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0};
    const SurfaceLeaves& surface = articulation.surface;
    const auto triangle = [&](std::size_t leaf, std::uint32_t index, float shift) {
      const SurfaceLeaf& of = surface.leaves[leaf];
      const std::uint32_t t = surface.patches[of.patch_begin + index / kLanes].triangle[index % kLanes];
      oracle::Triangle<oracle::Real> out;
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          out.corner[k][c] = oracle::Real{rig.vertices[3 * rig.triangles[leaf][3 * t + k] + c]} + (c == 0 ? shift : 0);
      return out;
    };
    const float shift = static_cast<float>(random.uniform(0, 2.2));
    for (const kernel::KernelTable* kernels : available_kernels()) {
      const Skinned a(*kernels, articulation, poses, 0, 0), b(*kernels, articulation, poses, 0, 1);
      const float error = kSurfaceError * (a.leaf.size + b.leaf.size + shift);
      const kernel::SurfacePair pair = {a.leaf,
                                        b.leaf,
                                        surface.patches.data + surface.leaves[0].patch_begin,
                                        surface.patches.data + surface.leaves[1].patch_begin,
                                        surface.leaves[0].patch_count,
                                        surface.leaves[1].patch_count,
                                        {shift, 0, 0},
                                        error,
                                        0,
                                        error};
      struct Found {
        std::set<std::pair<std::uint32_t, std::uint32_t>> touching, undecided;
      } found;
      CHECK(kernels->test_surfaces(pair, &found, [](void* taker, const kernel::TrianglePairs& pairs) {
        for (std::uint32_t lane = 0; lane < pairs.count; ++lane) {
          Found& out = *static_cast<Found*>(taker);
          if (pairs.touching >> lane & 1) REQUIRE(out.touching.insert({pairs.a[lane], pairs.b[lane]}).second);
          if (pairs.undecided >> lane & 1) REQUIRE(out.undecided.insert({pairs.a[lane], pairs.b[lane]}).second);
        }
        return true;
      }));
      for (std::uint32_t x = 0; x < rig.triangles[0].size() / 3; ++x)
        for (std::uint32_t y = 0; y < rig.triangles[1].size() / 3; ++y) {
          const std::pair<std::uint32_t, std::uint32_t> name(x, y);
          const bool meets = meet(triangle(0, x, 0), triangle(1, y, shift));
          if (meets) CHECK((found.touching.count(name) || found.undecided.count(name)));
          if (found.touching.count(name)) CHECK(meets);
          touching += meets;
        }
      // Triangles near a box are those whose corners' bounds overlap it.
      const float lo[3] = {0, -0.2f, -0.3f}, hi[3] = {0.9f, 0.4f, 2};
      std::vector<std::uint32_t> near(std::size_t{kLanes} * surface.leaves[0].patch_count);
      near.resize(kernels->near_triangles(a.leaf, surface.leaves[0].patch_count, lo, hi, near.data()));
      const std::set<std::uint32_t> listed(near.begin(), near.end());
      for (std::uint32_t x = 0; x < rig.triangles[0].size() / 3; ++x) {
        const auto t = triangle(0, x, 0);
        bool overlaps = true;
        for (std::size_t c = 0; c < 3; ++c)
          overlaps = overlaps && std::min({t.corner[0][c], t.corner[1][c], t.corner[2][c]}) <= oracle::Real{hi[c]} &&
                     std::max({t.corner[0][c], t.corner[1][c], t.corner[2][c]}) >= oracle::Real{lo[c]};
        CHECK(listed.count(x) == overlaps);
        near_box += overlaps;
      }
      CHECK(listed.size() == near.size());
    }
  }
  CHECK(touching >= least_count(1000, 20));
  CHECK(near_box >= least_count(1000, 20));
}

}  // namespace cab::tests
