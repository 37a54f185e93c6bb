// The covariance merge against an independent eigen-solver, and the variant of CAB in the paper's footnote against its
// description.
#include "kernels/refit_tree.h"
#include "perf/judge/oracle/containment.h"
#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/merge_regimes.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 99;
constexpr std::size_t kCovariance = static_cast<std::size_t>(Refit::kCovariance);
constexpr std::size_t kCabSum = static_cast<std::size_t>(Refit::kCabSum);

// Two leaves and their parent in every lane.
struct Tile {
  BoxTile nodes[3];
  PointTile joint;
};

Tile random_tile(oracle::Random& random, oracle::MergeRegime regime, bool has_joint,
                 oracle::MergeCase (&cases)[kLanes]) {
  Tile tile{};
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    do cases[lane] = oracle::make_merge_case(random, regime);
    while (cases[lane].has_joint != has_joint);
    put(tile.nodes[0], lane, cases[lane].child1);
    put(tile.nodes[1], lane, cases[lane].child2);
    for (std::size_t c = 0; c < 3; ++c) tile.joint.at[c][lane] = cases[lane].joint[c];
  }
  return tile;
}

void refit(const kernel::KernelTable& kernels, std::size_t rule, std::size_t extents, bool has_joint, Tile& tile) {
  const MergeProgram program = pair_program(has_joint);
  kernels.refit_boxes[rule][extents]({&program, &tile.joint, tile.nodes});
}

// The covariance of the sixteen corners, summed corner by corner.
Eigen::Matrix3d corner_covariance(const oracle::MergeCase& one) {
  std::vector<Eigen::Vector3d> corners;
  for (const auto* box : {&one.child1, &one.child2})
    for (unsigned i = 0; i < 8; ++i) {
      const auto corner = oracle::corner(oracle::convert<double>(*box), i);
      corners.emplace_back(corner[0], corner[1], corner[2]);
    }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& corner : corners) mean += corner / 16;
  Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
  for (const auto& corner : corners) out += (corner - mean) * (corner - mean).transpose() / 16;
  return out;
}

// How far from diagonal a covariance is in the axes of a box: the largest off-diagonal entry over the largest
// eigenvalue.
double off_diagonal(const Eigen::Matrix3d& covariance, const oracle::OracleBox<float>& box) {
  Eigen::Matrix3d axes;
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) axes(c, k) = static_cast<double>(box.axis[k][c]);
  const Eigen::Matrix3d rotated = axes.transpose() * covariance * axes;
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()[2];
  return std::max({std::fabs(rotated(0, 1)), std::fabs(rotated(0, 2)), std::fabs(rotated(1, 2))}) / largest;
}

// Whether each child is longer than the other is thin. Otherwise merges copy a frame.
bool both_matter(const oracle::MergeCase& one) {
  const auto longest = [](const oracle::OracleBox<float>& box) { return *std::max_element(box.half, box.half + 3); };
  const auto least = [](const oracle::OracleBox<float>& box) { return *std::min_element(box.half, box.half + 3); };
  return longest(one.child1) > least(one.child2) && longest(one.child2) > least(one.child1);
}

}  // namespace

TEST_CASE("the covariance merge takes the principal axes of the sixteen corners") {
  constexpr double kTolerance = 2e-6;  // worst measured: 6e-7
  double worst = 0;
  for (const auto regime : {oracle::MergeRegime::kLimbs, oracle::MergeRegime::kStraight, oracle::MergeRegime::kFolded,
                            oracle::MergeRegime::kHighAspect}) {
    oracle::Random random(kSeed + static_cast<unsigned>(regime));
    for (int round = 0; round < 300; ++round) {
      oracle::MergeCase cases[kLanes];
      Tile tile = random_tile(random, regime, true, cases);
      refit(*kernel::find_kernels(Isa::kAuto), kCovariance, 0, true, tile);
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        if (both_matter(cases[lane]))
          worst = std::max(worst, off_diagonal(corner_covariance(cases[lane]), get(tile.nodes[2], lane)));
    }
  }
  MESSAGE("largest off-diagonal entry over the largest eigenvalue: " << worst);
  CAPTURE(kSeed);
  CHECK(worst < kTolerance);
}

TEST_CASE(
    "every oriented rule contains its children, has axes within their limits and is the same on every instruction "
    "set") {
  for (std::size_t rule = 0; rule < std::extent_v<decltype(kernel::KernelTable::refit_boxes)>; ++rule) {
    for (unsigned regime = 0; regime < oracle::kMergeRegimeCount; ++regime) {
      oracle::Random random(kSeed + 50 + regime);
      std::size_t outside = 0, crooked = 0, differing = 0;
      for (std::uint64_t round = 0; round < rounds(120); ++round) {
        const bool has_joint = round % 3 != 0;
        const std::size_t extents = round % 2;
        oracle::MergeCase cases[kLanes];
        const Tile tile = random_tile(random, static_cast<oracle::MergeRegime>(regime), has_joint, cases);
        Tile expected = tile;
        refit(*kernel::find_kernels(Isa::kScalar), rule, extents, has_joint, expected);
        for (const kernel::KernelTable* kernels : available_kernels()) {
          Tile got = tile;
          refit(*kernels, rule, extents, has_joint, got);
          differing += !same_bits(got.nodes[2], expected.nodes[2]);
        }
        for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
          const auto parent = get(expected.nodes[2], lane);
          outside += !oracle::judge_containment(parent, cases[lane].child1).inside;
          outside += !oracle::judge_containment(parent, cases[lane].child2).inside;
          crooked += !(oracle::frame_error(parent) <= 1);
        }
      }
      CAPTURE(rule);
      CAPTURE(regime);
      CAPTURE(kSeed);
      CHECK(outside == 0);
      CHECK(crooked == 0);
      CHECK(differing == 0);
    }
  }
}

TEST_CASE(
    "the footnote's variant lies along the sum of the major axes where their ends are closest, and is CAB elsewhere") {
  oracle::Random random(kSeed + 200);
  std::size_t sums = 0;
  for (int round = 0; round < 200; ++round) {
    oracle::MergeCase cases[kLanes];
    const Tile tile = random_tile(random, oracle::MergeRegime::kLimbs, true, cases);
    Tile cab = tile, sum = tile;
    refit(*kernel::find_kernels(Isa::kAuto), 0, 0, true, cab);
    refit(*kernel::find_kernels(Isa::kAuto), kCabSum, 0, true, sum);
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const auto expected = get(cab.nodes[2], lane), got = get(sum.nodes[2], lane);
      Eigen::Vector3d a[2];
      bool clear = true;  // no decision of the merge is close
      for (std::size_t i = 0; i < 2; ++i) {
        const auto& box = i == 0 ? cases[lane].child1 : cases[lane].child2;
        const std::size_t longest = static_cast<std::size_t>(std::max_element(box.half, box.half + 3) - box.half);
        Eigen::Vector3d outward;
        for (int c = 0; c < 3; ++c) {
          a[i][c] = static_cast<double>(box.half[longest]) * static_cast<double>(box.axis[longest][c]);
          outward[c] = static_cast<double>(box.center[c]) - static_cast<double>(cases[lane].joint[c]);
        }
        float halves[3] = {box.half[0], box.half[1], box.half[2]};
        std::sort(halves, halves + 3);
        const auto& other = i == 0 ? cases[lane].child2 : cases[lane].child1;
        clear = clear && halves[2] > 1.001f * *std::min_element(other.half, other.half + 3);
        clear = clear && halves[2] > 1.001f * halves[1] &&
                std::fabs(a[i].dot(outward)) > 1e-3 * a[i].norm() * outward.norm();
        if (a[i].dot(outward) < 0) a[i] = -a[i];
      }
      const double end = (a[0] - a[1]).norm(), shorter = std::min(a[0].norm(), a[1].norm());
      if (!clear || std::fabs(end - shorter) < 1e-4 * shorter ||
          a[0].cross(a[1]).norm() < 0.01 * a[0].norm() * a[1].norm())
        continue;
      if (end > shorter) {
        CHECK(same_bits(got, expected));
        continue;
      }
      ++sums;
      const Eigen::Vector3d along = (a[0] + a[1]).normalized();
      for (int c = 0; c < 3; ++c) CHECK(static_cast<double>(got.axis[0][c]) == doctest::Approx(along[c]).epsilon(1e-5));
    }
  }
  CHECK(sums > 100);
}

}  // namespace cab::tests
