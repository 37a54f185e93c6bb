// The kernels of leaves between two moments, on every instruction set: no leaf is missed that a ray meets.
#include "kernels/past_leaves.h"

#include "kernels/between_moments.h"
#include "tests/kernels/isas.h"
#include "tests/layout/random_links.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cab::tests {
namespace {

using oracle::Random;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What sixteen instances have at one moment.
struct Moment {
  std::vector<float> poses, orientations;
  alignas(64) float scales[kLanes];
};

Moment any_moment(Random& random, std::uint32_t links, double size, bool is_scaled) {
  Moment out;
  for (std::uint32_t i = 0; i < kLanes; ++i) {
    out.scales[i] = is_scaled ? static_cast<float>(random.uniform(0.5, 2)) : 1;
    for (int c = 0; c < 4; ++c) out.orientations.push_back(static_cast<float>(random.normal()));
    for (std::uint32_t link = 0; link < links; ++link)
      for (int f = 0; f < 7; ++f)
        out.poses.push_back(static_cast<float>(f < 4 ? random.normal() : size * random.uniform(-2, 2)));
  }
  return out;
}

// A moment a little later.
Moment next_moment(Random& random, const Moment& moment, double size, double step) {
  Moment out = moment;
  for (float& x : out.orientations) x += static_cast<float>(step * random.normal());
  for (std::size_t f = 0; f < out.poses.size(); ++f)
    out.poses[f] += static_cast<float>((f % 7 < 4 ? 1 : size) * step * random.normal());
  return out;
}

// Sixteen instances between two moments, or at the first of them.
struct Between {
  const Articulation& articulation;
  const Moment &from, &to;
  Scaling scaling;
  kernel::LaterPoses later;
  alignas(64) float scales[kLanes];

  Between(const Articulation& of, const Moment& a, const Moment& b, Scaling scaled, const float (&part)[kLanes])
      : articulation(of), from(a), to(b), scaling(scaled) {
    const std::size_t floats = 7 * std::size_t{of.link_count};
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      later.poses[lane] = to.poses.data() + lane * floats;
      later.orientations[lane] = to.orientations.data() + 4 * lane;
      later.part[lane] = part[lane];
      scales[lane] = (1 - part[lane]) * from.scales[lane] + part[lane] * to.scales[lane];
    }
  }

  // The leaf boxes by pose_leaves.
  std::vector<BoxTile> pose(const kernel::KernelTable& kernels, const Moment& first, bool is_between) const {
    std::vector<BoxTile> out(articulation.leaf_count);
    std::vector<PointTile> joints(articulation.link_count);
    std::uint8_t flags[kLanes];
    kernel::PoseTile job = {};
    job.articulation = &articulation;
    job.coding = {PoseFormat::kQuaternionTranslation, scaling};
    job.link_stride = 7;
    kernel::point_lanes(first.poses.data(), articulation.link_count * std::size_t{7}, kLanes, job.poses);
    kernel::point_lanes(first.orientations.data(), 4, kLanes, job.orientations);
    std::copy_n(is_between ? scales : first.scales, kLanes, job.scales);
    job.leaves = out.data();
    job.joints = joints.data();
    job.flags = flags;
    job.later = is_between ? &later : nullptr;
    kernels.pose_leaves(job);
    for (const std::uint8_t flag : flags) REQUIRE(flag == kInstanceOk);
    return out;
  }

  kernel::BulgeTile bulge_tile(const std::vector<float>& reach) const {
    kernel::BulgeTile out;
    out.articulation = &articulation;
    out.reach = reach.data();
    const std::size_t floats = 7 * std::size_t{articulation.link_count};
    kernel::point_lanes(from.poses.data(), floats, kLanes, out.from);
    kernel::point_lanes(to.poses.data(), floats, kLanes, out.to);
    kernel::point_lanes(from.orientations.data(), 4, kLanes, out.from_orientation);
    kernel::point_lanes(to.orientations.data(), 4, kLanes, out.to_orientation);
    std::copy_n(from.scales, kLanes, out.from_scale);
    std::copy_n(to.scales, kLanes, out.to_scale);
    return out;
  }
};

// The centres of one instance's leaf boxes.
struct Centers {
  CenterGrid grid;
  std::vector<std::uint32_t> cells;

  Centers(const std::vector<BoxTile>& boxes, std::uint32_t lane) : cells(kLanes * tile_count(leaves_of(boxes)), ~0u) {
    write_centers({boxes.data(), boxes.size()}, lane, grid, cells.data());
  }
  static std::uint32_t leaves_of(const std::vector<BoxTile>& boxes) { return static_cast<std::uint32_t>(boxes.size()); }
};

double length(const float (&v)[3]) {
  return std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

}  // namespace

TEST_CASE("a ray comes near every leaf that it meets at a moment and between two, on every instruction set") {
  Random random(97);
  std::size_t met = 0, left_out = 0, posed = 0;
  for (std::uint64_t round = rounds(300); round > 0; --round) {
    const double size = random.log_uniform(1e-3, 1e3);
    const LinkRig rig = random_links(random, 7, size, 3);
    const Articulation& articulation = rig.articulation;
    const std::uint32_t leaves = articulation.leaf_count;
    const Scaling scaling = random.chance(0.5) ? Scaling::kPerInstance : Scaling::kNone;
    const Moment from = any_moment(random, articulation.link_count, size, scaling == Scaling::kPerInstance);
    Moment to = next_moment(random, from, size, random.log_uniform(1e-3, 1));
    if (scaling == Scaling::kPerInstance)
      for (float& x : to.scales) x = static_cast<float>(random.uniform(0.5, 2));
    float part[kLanes];
    for (float& x : part) x = random.chance(0.2) ? 0 : static_cast<float>(random.uniform(0, 1));
    const Between between(articulation, from, to, scaling, part);
    std::vector<float> reach(articulation.link_count), radius(leaves + kLanes);
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
      const Box& box = articulation.leaf_box[leaf];
      const double half = length(box.half), away = length(box.center) + half;
      float& of_link = reach[articulation.leaf_link[leaf]];
      of_link = std::max(of_link, static_cast<float>(away * 1.000001));
      radius[leaf] = static_cast<float>((half + 2 * kHistoryPad * away) * 1.000001);
    }
    const kernel::KernelTable& scalar = *available_kernels().front();
    const std::vector<BoxTile> at_from = between.pose(scalar, from, false), at_to = between.pose(scalar, to, false),
                               at_part = between.pose(scalar, from, true);
    kernel::BulgeTile bulge = between.bulge_tile(reach);
    scalar.bound_bulge(bulge);
    for (const kernel::KernelTable* const table : available_kernels()) {
      CAPTURE(name_of(*table));
      kernel::BulgeTile other = between.bulge_tile(reach);
      table->bound_bulge(other);
      CHECK(std::memcmp(other.bulge, bulge.bulge, sizeof(bulge.bulge)) == 0);
    }
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const Centers first(at_from, lane), second(at_to, lane);
      // A ray towards some place at a leaf, often its edge.
      const BoxTile& aim = at_part[random.index(leaves)];
      double point[3];
      for (int c = 0; c < 3; ++c) {
        point[c] = static_cast<double>(aim.center[c][lane]);
        for (int k = 0; k < 3; ++k)
          point[c] += (random.chance(0.5) ? 1 : random.uniform(0, 1)) * random.uniform(-1.01, 1.01) *
                      static_cast<double>(aim.half[k][lane]) * static_cast<double>(aim.axis[k][c][lane]);
      }
      const auto along = random.unit_vector();
      const double away = random.chance(0.1) ? 0 : size * random.uniform(0, 10);
      kernel::NearLeaves near = {{},
                                 first.grid,
                                 second.grid,
                                 first.cells.data(),
                                 second.cells.data(),
                                 radius.data(),
                                 leaves,
                                 part[lane],
                                 between.scales[lane],
                                 part[lane] > 0 ? bulge.bulge[lane] : 0};
      double all = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        near.ray.direction[c] = static_cast<float>(along[c]);
        near.ray.at[c] = static_cast<float>(point[c] - away * along[c]);
        all += std::fabs(static_cast<double>(near.ray.at[c]));
      }
      near.ray.radius = random.chance(0.5) ? 0 : static_cast<float>(size * random.log_uniform(1e-3, 1));
      near.ray.rounding = static_cast<float>(1.00001 * kQueryBoxPad * (all + static_cast<double>(near.ray.radius)));
      near.ray.end = random.chance(0.3) ? kInfinity : static_cast<float>(away * random.uniform(0, 2));
      std::vector<std::uint16_t> found(leaves), same(leaves);
      found.resize(scalar.near_leaves(near, found.data()));
      for (const kernel::KernelTable* const table : available_kernels()) {
        CAPTURE(name_of(*table));
        same.resize(leaves);
        same.resize(table->near_leaves(near, same.data()));
        CHECK(same == found);
      }
      left_out += leaves - found.size();
      // Every leaf as a lane of its own.
      for (std::uint32_t begin = 0; begin < leaves; begin += kLanes) {
        kernel::PastLeaves tile = {};
        const std::uint32_t count = std::min(kLanes, leaves - begin);
        tile.coding = {PoseFormat::kQuaternionTranslation, scaling};
        tile.is_between = true;
        tile.pads = 1;
        for (std::uint32_t i = 0; i < kLanes; ++i) {
          const std::uint32_t leaf = begin + std::min(i, count - 1), link = articulation.leaf_link[leaf];
          const std::size_t at = 7 * (lane * std::size_t{articulation.link_count} + link);
          tile.poses[i] = from.poses.data() + at;
          tile.later.poses[i] = to.poses.data() + at;
          tile.boxes[i] = articulation.leaf_box[leaf].center;
          tile.orientations[i] = from.orientations.data() + 4 * std::size_t{lane};
          tile.later.orientations[i] = to.orientations.data() + 4 * std::size_t{lane};
          tile.later.part[i] = part[lane];
          tile.scales[i] = between.scales[lane];
          for (int c = 0; c < 3; ++c) tile.at[c][i] = near.ray.at[c], tile.direction[c][i] = near.ray.direction[c];
          tile.radius[i] = near.ray.radius;
          tile.rounding[i] = near.ray.rounding;
          tile.end[i] = tile.end_below[i] = near.ray.end;
        }
        kernel::PastLeaves wanted = tile;
        scalar.meet_past_leaves(wanted);
        for (const kernel::KernelTable* const table : available_kernels()) {
          CAPTURE(name_of(*table));
          kernel::PastLeaves out = tile;
          table->meet_past_leaves(out);
          CHECK(std::memcmp(&out, &wanted, sizeof(out)) == 0);
        }
        CHECK(wanted.live == (1u << kLanes) - 1);
        for (std::uint32_t i = 0; i < count; ++i) {
          const std::uint32_t leaf = begin + i;
          ++posed;
          for (std::size_t row = 0; row < sizeof(BoxTile) / sizeof(float) / kLanes; ++row)
            CHECK(std::memcmp(reinterpret_cast<const float*>(&wanted.posed) + row * kLanes + i,
                              reinterpret_cast<const float*>(&at_part[leaf]) + row * kLanes + lane,
                              sizeof(float)) == 0);
          // What ray_boxes meets with the reach of the box, and what ray_in_boxes surely meets.
          float entry[kLanes];
          kernel::BoxRay alone = near.ray;
          float middle = 0, half = 0;
          for (int c = 0; c < 3; ++c) {
            middle = std::max(middle, std::fabs(at_part[leaf].center[c][lane]));
            half += at_part[leaf].half[c][lane];
          }
          alone.rounding += static_cast<float>(1.01 * kQueryBoxPad * static_cast<double>(middle + half));
          const bool is_surely_met = scalar.ray_in_boxes(at_part[leaf], alone, entry) >> lane & 1;
          if (is_surely_met) {
            ++met;
            CHECK(std::count(found.begin(), found.end(), leaf) == 1);
            CHECK((wanted.met >> i & 1) == 1);
            CHECK(wanted.surely[i] <= entry[lane]);
            CHECK(wanted.entry[i] <= wanted.surely[i]);
          }
          if (wanted.surely[i] < kInfinity) CHECK((wanted.met >> i & 1) == 1);
        }
      }
    }
  }
  CHECK(met >= least_count(500, 300));
  CHECK(left_out >= posed / 4);
}

}  // namespace cab::tests
