// Links posed on demand have the bits of pose_leaves. Posed boxes of links contain the posed boxes of their leaves.
#include "kernels/pose_link.h"

#include "tests/kernels/isas.h"
#include "tests/layout/random_links.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace cab::tests {
namespace {

constexpr PoseFormat kFormats[] = {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows,
                                   PoseFormat::kMatrix4x4Columns};

// The poses of a tile's instances in one format, and the orientations of the instances.
struct TilePoses {
  PoseFormat format;
  std::uint32_t links;
  std::vector<float> data, rotations;
  Scaling scaling = Scaling::kNone;
  std::vector<float> scales = std::vector<float>(kLanes, 1.0f);

  // Scales all instances by factors up to `most`: as a whole, or each matrix.
  void scale(oracle::Random& random, double most) {
    scaling = format == PoseFormat::kQuaternionTranslation || random.chance(0.5) ? Scaling::kPerInstance
                                                                                 : Scaling::kInMatrices;
    for (float& factor : scales) factor = static_cast<float>(random.log_uniform(1.001e-3, most));
    if (scaling == Scaling::kPerInstance) return;
    for (std::size_t pose = 0; pose < data.size(); pose += floats()) {
      const auto factor = static_cast<float>(random.log_uniform(1.001e-3, most));
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column)
          data[pose + (format == PoseFormat::kMatrix3x4Rows ? 4 * row + column : 4 * column + row)] *= factor;
    }
  }

  std::size_t floats() const { return pose_floats(format); }
  const float* pose(std::uint32_t instance, std::uint32_t link) const {
    return data.data() + (instance * links + link) * floats();
  }
};

// place: the length of all translations, whose directions are random.
TilePoses random_tile(oracle::Random& random, PoseFormat format, std::uint32_t links, double place) {
  TilePoses out;
  out.format = format;
  out.links = links;
  for (std::uint32_t i = 0; i < kLanes; ++i) {
    for (int c = 0; c < 4; ++c) out.rotations.push_back(static_cast<float>(random.normal()));
    for (std::uint32_t link = 0; link < links; ++link) {
      double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      const bool rotated = random.chance(0.7);
      if (rotated) random.rotation(axis);
      const oracle::Vec3<double> at = place * random.uniform(0.5, 1.0) * random.unit_vector();
      const auto put = [&out](double v) { out.data.push_back(static_cast<float>(v)); };
      if (format == PoseFormat::kQuaternionTranslation) {
        for (int c = 0; c < 4; ++c) put(rotated ? random.normal() : c == 3);
        for (std::size_t c = 0; c < 3; ++c) put(at[c]);
      } else if (format == PoseFormat::kMatrix3x4Rows) {
        for (std::size_t r = 0; r < 3; ++r) {
          for (const auto& column : axis) put(column[r]);
          put(at[r]);
        }
      } else {
        for (const auto& column : axis)
          for (std::size_t r = 0; r < 4; ++r) put(r < 3 ? column[r] : 0);
        for (std::size_t r = 0; r < 4; ++r) put(r < 3 ? at[r] : 1);
      }
    }
  }
  return out;
}

struct PosedTileOf {
  std::vector<BoxTile> boxes;
  std::uint8_t flags[kLanes];
};

// A tile of an articulation, or of link boxes with the padding that these need.
PosedTileOf pose(const kernel::KernelTable& kernels, const Articulation& articulation, const TilePoses& poses,
                 bool rotated, float margin, bool link_boxes) {
  PosedTileOf out;
  out.boxes.resize(articulation.leaf_count);
  std::vector<PointTile> joints(articulation.link_count);
  kernel::PoseTile job = {};
  job.articulation = &articulation;
  job.coding = {poses.format, poses.scaling};
  std::copy(poses.scales.begin(), poses.scales.end(), job.scales);
  job.link_stride = poses.floats();
  kernel::point_lanes(poses.data.data(), poses.links * poses.floats(), kLanes, job.poses);
  if (rotated) kernel::point_lanes(poses.rotations.data(), 4, kLanes, job.orientations);
  job.leaves = out.boxes.data();
  job.joints = joints.data();
  job.flags = out.flags;
  std::fill_n(job.margins, kLanes, margin);
  job.pads = link_boxes ? kLinkPads : 1;
  job.range = (link_boxes ? kLinkRange : 1) * kMaxCoordinate;
  kernels.pose_leaves(job);
  return out;
}

// Sixteen floats of a leaf bounds SoA, aligned as kernels require.
struct alignas(64) Line {
  float at[kLanes];
};

// One link's leaves posed on demand.
struct Demanded {
  std::vector<BoxAos> rows;
  std::vector<Line> leaf_bounds;

  float side(std::uint32_t row, std::uint32_t leaf) const {
    return leaf_bounds[row * (leaf_bounds.size() / 6) + leaf / kLanes].at[leaf % kLanes];
  }
};

Demanded demand(const kernel::KernelTable& kernels, const LinkRig& rig, std::uint32_t link, const TilePoses& poses,
                std::uint32_t instance, bool rotated, float margin) {
  const LinkLeaves& leaves = rig.link_bounds.leaves[link];
  Demanded out;
  out.rows.resize(leaf_bounds_width(leaves.leaf_count));
  out.leaf_bounds.resize(leaf_bounds_floats(leaves.leaf_count) / kLanes);
  std::memset(static_cast<void*>(out.rows.data()), 0x5a, out.rows.size() * sizeof(BoxAos));
  kernel::PoseLink job;
  job.at = {{poses.format, poses.scaling},
            poses.pose(instance, leaves.link),
            rotated ? poses.rotations.data() + 4 * instance : nullptr,
            poses.scales[instance]};
  job.local = &rig.link_bounds.tiles[leaves.first_tile];
  job.leaf_count = leaves.leaf_count;
  job.margin = margin;
  job.boxes = out.rows.data();
  job.leaf_bounds = out.leaf_bounds.data()->at;
  kernels.pose_link_leaves(job);
  return out;
}

}  // namespace

TEST_CASE("a link posed on demand has the boxes and bounds of a whole tile, bit for bit, on every instruction set") {
  oracle::Random random(71);
  const kernel::KernelTable& scalar = *kernel::find_kernels(Isa::kScalar);
  std::size_t compared = 0;
  bool counts[51] = {};
  for (int round = 0; round < 60; ++round) {
    CAPTURE(round);
    const LinkRig rig = random_links(random, round % 3 == 0 ? 50 : round % 3 == 1 ? 17 : 1, 1, 5);
    for (const PoseFormat format : kFormats) {
      const bool rotated = random.chance(0.5);
      const float margin = random.chance(0.5) ? 0 : static_cast<float>(random.log_uniform(1e-6, 1));
      TilePoses poses = random_tile(random, format, rig.articulation.link_count, random.log_uniform(1e-2, 1e3));
      if (random.chance(0.5)) poses.scale(random, 999);
      const PosedTileOf all = pose(scalar, rig.articulation, poses, rotated, margin, false);
      std::vector<AabbTile> bounds(rig.articulation.leaf_count);
      scalar.bound_boxes(all.boxes.data(), rig.articulation.leaf_count, bounds.data());
      std::vector<BoxAos> rows(kLanes * rig.articulation.leaf_count);
      scalar.boxes_to_aos(all.boxes.data(), rig.articulation.leaf_count, kLanes, rows.data(),
                          rig.articulation.leaf_count);
      const std::uint32_t instance = random.index(kLanes);
      REQUIRE(all.flags[instance] == kInstanceOk);
      for (const kernel::KernelTable* kernels : available_kernels()) {
        CAPTURE(name_of(*kernels));
        for (std::uint32_t link = 0; link < rig.link_bounds.leaves.size; ++link) {
          const LinkLeaves& leaves = rig.link_bounds.leaves[link];
          const Demanded got = demand(*kernels, rig, link, poses, instance, rotated, margin);
          const std::uint32_t width = leaf_bounds_width(leaves.leaf_count);
          counts[leaves.leaf_count] = true;
          for (std::uint32_t n = 0; n < leaves.leaf_count; ++n) {
            const std::uint32_t leaf = rig.articulation.leaf_order[leaves.first_leaf + n];
            REQUIRE(same_bits(got.rows[n], rows[instance * rig.articulation.leaf_count + leaf]));
            for (std::uint32_t c = 0; c < 3; ++c) {
              REQUIRE(same_bits(got.side(c, n), bounds[leaf].lo[c][instance]));
              REQUIRE(same_bits(got.side(3 + c, n), bounds[leaf].hi[c][instance]));
            }
            ++compared;
          }
          for (std::uint32_t n = leaves.leaf_count; n < width;
               ++n)  // padding lanes: no leaf, and bounds that overlap nothing
            for (std::uint32_t c = 0; c < 3; ++c) {
              REQUIRE(got.side(c, n) == kNoLeafLo);
              REQUIRE(got.side(3 + c, n) == -kNoLeafLo);
            }
        }
      }
    }
  }
  CHECK(compared > 10'000);
  for (const int count : {1, 15, 16, 17}) CHECK(counts[count]);
  CHECK(std::count(counts + 33, counts + 51, true) > 5);
}

TEST_CASE("a posed box of a link contains the posed and padded boxes of its leaves and what is near them") {
  oracle::Random random(72);
  long double worst = -1;
  std::size_t judged = 0;
  const kernel::KernelTable& kernels = *kernel::find_kernels(Isa::kAuto);
  for (int round = 0; round < 600; ++round) {
    CAPTURE(round);
    const double size = random.chance(0.3) ? random.log_uniform(1e-30, 1e16) : 1;
    const LinkRig rig = random_links(random, round % 2 ? 6 : 1, size, random.chance(0.5) || size > 1e12 ? 5 : 1e4);
    const double far = size > 1e11 ? 1 : random.log_uniform(1e-2, 1e6);
    for (const PoseFormat format : kFormats) {
      const bool rotated = random.chance(0.5);
      const auto margin = static_cast<float>(random.chance(0.6) ? 0 : size * random.log_uniform(1e-6, 10));
      TilePoses poses = random_tile(random, format, rig.articulation.link_count, far * size);
      if (random.chance(0.5)) poses.scale(random, size > 1e11 ? 1 : 999);
      const PosedTileOf leaves = pose(kernels, rig.articulation, poses, rotated, margin, false);
      const PosedTileOf links = pose(kernels, rig.link_bounds.links, poses, rotated, margin, true);
      for (std::uint32_t link = 0; link < rig.link_bounds.leaves.size; ++link) {
        const LinkLeaves& of = rig.link_bounds.leaves[link];
        for (std::uint32_t n = 0; n < of.leaf_count; ++n)
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            REQUIRE(leaves.flags[lane] == kInstanceOk);
            REQUIRE(links.flags[lane] == kInstanceOk);
            const auto inner = get(leaves.boxes[rig.articulation.leaf_order[of.first_leaf + n]], lane);
            const long double by =
                sticking_out(get(links.boxes[link], lane), inner, kLeafSlack * oracle::half_sum(inner));
            CHECK(by <= 0);
            worst = std::max(worst, by);
            ++judged;
          }
      }
    }
  }
  MESSAGE(judged << " leaf boxes; the nearest left " << static_cast<double>(-worst) << " of its link's box");
  CHECK(judged > 100'000);
}

TEST_CASE("where the leaves of a link stay in range, so does its posed box by the range of link boxes") {
  oracle::Random random(73);
  const kernel::KernelTable& kernels = *kernel::find_kernels(Isa::kAuto);
  const float most = kMaxCoordinate;
  std::size_t in_range = 0;
  double largest = 0;
  for (int round = 0; round < 3000; ++round) {
    CAPTURE(round);
    // One or two cubes, as far out and as large as a margin permits, in line or at random.
    const auto margin = static_cast<float>(random.chance(0.5) ? 0.5 : random.uniform(0.0, 0.5)) * most;
    const std::int32_t parent = -1;
    std::vector<Leaf> leaves;
    for (int n = 0; n < 2; ++n) {
      Leaf leaf;
      double axis[3][3];
      random.chance(0.5) ? random.rotation(axis) : random.rotation_about({{n ? 1 : 0.6, 0, n ? 0 : 0.8}}, 0, axis);
      for (std::size_t k = 0; k < 3; ++k) {
        const double at = random.chance(0.8) ? 0.999 : random.uniform(0.5, 0.999);
        leaf.box.center[k] = static_cast<float>((n ? 1 : -1) * at) * most;
        leaf.box.half[k] = static_cast<float>(random.chance(0.8) ? 0.999 : 0.5) * (most - margin);
        for (std::size_t c = 0; c < 3; ++c) leaf.box.axis[k][c] = static_cast<float>(axis[k][c]);
      }
      leaves.push_back(leaf);
    }
    ArticulationDesc desc;
    desc.link_parents = {&parent, 1};
    desc.leaves = {leaves.data(), 1 + random.index(2)};
    const LinkRig rig(desc);
    TilePoses poses = random_tile(random, kFormats[round % 3], 1, 1e15);
    const bool rotated = random.chance(0.3);
    const PosedTileOf posed = pose(kernels, rig.articulation, poses, rotated, margin, false);
    const PosedTileOf links = pose(kernels, rig.link_bounds.links, poses, rotated, margin, true);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      if (posed.flags[lane] != kInstanceOk) continue;
      ++in_range;
      CHECK(links.flags[lane] == kInstanceOk);
      const auto box = get(links.boxes[0], lane);
      for (std::size_t k = 0; k < 3; ++k)
        largest = std::max({largest, std::fabs(static_cast<double>(box.center[k])), static_cast<double>(box.half[k])});
    }
  }
  MESSAGE("largest number of a link's box: " << largest / static_cast<double>(most) << " of a leaf's most");
  CHECK(in_range > 1000);
  CHECK(largest > 2 * static_cast<double>(most));
}

}  // namespace cab::tests
