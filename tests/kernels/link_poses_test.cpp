// Forward kinematics against products of matrices in long double; sine and cosine against those of long double.
#include "kernels/link_poses.h"

#include "kernels/find_kernels.h"
#include "kernels/sine.h"
#include "layout/error_bounds.h"
#include "perf/harness/random_joints.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;
using Body = JointedBody;
using Real = long double;
using Matrix = std::array<std::array<Real, 4>, 3>;

constexpr Real kPi = 3.141592653589793238462643383279502884L;

Matrix identity() { return {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}; }

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 4; ++c) {
      out[r][c] = c == 3 ? a[r][3] : 0;
      for (std::size_t k = 0; k < 3; ++k) out[r][c] += a[r][k] * b[k][c];
    }
  return out;
}

Matrix shift(const double (&v)[3], Real by = 1) {
  Matrix out = identity();
  for (std::size_t r = 0; r < 3; ++r) out[r][3] = by * Real{v[r]};
  return out;
}

// Rodrigues' formula about an axis of any length.
Matrix turn(const std::array<Real, 3>& axis, Real angle) {
  const Real n = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  if (n == 0) return identity();
  const Real x = axis[0] / n, y = axis[1] / n, z = axis[2] / n, c = std::cos(angle), s = std::sin(angle), d = 1 - c;
  return {{{c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0},
           {y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0},
           {z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0}}};
}

Matrix matrix_of(const double (&q)[4]) {
  const Real x = q[0], y = q[1], z = q[2], w = q[3];
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 0},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 0},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), 0}}};
}

std::vector<Matrix> judge(const Body& body, const double* state) {
  std::vector<Matrix> out;
  const JointDesc* joint = body.joints.data();
  for (std::size_t l = 0; l < body.links.size(); ++l) {
    const LinkPlaceDesc& link = body.links[l];
    Matrix m = product(shift(link.translation), matrix_of(link.rotation));
    for (std::uint32_t j = 0; j < link.joint_count; ++j, ++joint) {
      const auto value = [&](std::uint32_t k) {
        return Real{joint->multiplier} * Real{state[joint->variable + k]} + Real{joint->offset};
      };
      std::array<Real, 3> axis = {joint->axis[0], joint->axis[1], joint->axis[2]};
      Real angle = value(0);
      if (joint->kind == JointKind::kBall) {
        axis = {value(0), value(1), value(2)};
        angle = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
      }
      if (joint->kind == JointKind::kPrismatic)
        m = product(m, shift(joint->axis, value(0)));
      else
        m = product(m, product(shift(joint->anchor), product(turn(axis, angle), shift(joint->anchor, -1))));
    }
    const std::int32_t parent = body.parents[l];
    out.push_back(parent < 0 ? m : product(out[static_cast<std::size_t>(parent)], m));
  }
  return out;
}

// The largest difference between what a pose and a matrix make of the axes' ends and the origin.
double difference(const double (&rotation)[4], const double (&translation)[3], const Matrix& right) {
  const Matrix m = matrix_of(rotation);
  Real worst = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    worst = std::max(worst, std::fabs(Real{translation[r]} - right[r][3]));
    for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(m[r][c] - right[r][c]));
  }
  return static_cast<double>(worst);
}

struct Sines {
  double sine, cosine;
};

Sines sines_of(double angle) {
  Sines out;
  kernel::sine_cosine(angle, &out.sine, &out.cosine);
  return out;
}

// Sine and cosine by their series, about the nearest multiple of a quarter turn. Not by std::sin: that of long double
// is worse than kSineError on Windows.
struct LongSines {
  explicit LongSines(Real angle) {
    // A quarter turn in four parts of 40 bits, so that their products with the count of quarters are exact.
    constexpr Real kQuarter[] = {0x1.921fb54442p0L, 0xd18469898cp-80L, 0xc51701b839p-120L, 0xa252049c11p-160L};
    const Real quarters = std::floor(angle / kQuarter[0] + 0.5L);
    Real rest = angle;
    for (const Real part : kQuarter) rest -= quarters * part;
    Real sum[2] = {0, 0}, term = 1;  // of even and of odd powers
    for (int power = 0; power < 30; ++power) {
      sum[power % 2] += power / 2 % 2 ? -term : term;
      term *= rest / (power + 1);
    }
    const auto turn = static_cast<int>(quarters - 4 * std::floor(quarters / 4));
    const Real by_turn[] = {sum[1], sum[0], -sum[1], -sum[0]};
    sine = by_turn[turn];
    cosine = by_turn[(turn + 1) % 4];
  }
  Real sine, cosine;
};

}  // namespace

TEST_CASE("sine and cosine are within kSineError of those of long double, near multiples of a quarter turn too") {
  Random random(1);
  double worst = 0;
  const auto check = [&worst](double angle) {
    const Sines found = sines_of(angle);
    const LongSines right(angle);
    REQUIRE_FALSE((std::isnan(found.sine) || std::isnan(found.cosine)));
    worst = std::max({worst, static_cast<double>(std::fabs(Real{found.sine} - right.sine)),
                      static_cast<double>(std::fabs(Real{found.cosine} - right.cosine))});
  };
  for (std::uint64_t i = 0; i < rounds(400000); ++i) {
    check(random.uniform(-10, 10));
    check(random.uniform(-kernel::kMaxSineAngle, kernel::kMaxSineAngle));
    const auto near = static_cast<double>((std::floor(random.uniform(-3e5, 3e5)) + 0.5L * random.index(2)) * kPi / 2);
    check(near * (1 + random.uniform(-1e-15, 1e-15)));
  }
  CAPTURE(worst);
  CHECK(worst <= kSineError);
  CHECK(worst > kSineError / 16);
  for (const double angle : {0.0, -0.0, 5e-324, 1e-300, kernel::kMaxSineAngle, -kernel::kMaxSineAngle}) check(angle);
  CHECK(worst <= kSineError);
  CHECK(sines_of(0).sine == 0);
  CHECK(sines_of(0).cosine == 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(std::isnan(sines_of(nan).sine));
  CHECK(std::isnan(sines_of(nan).cosine));
}

TEST_CASE("every link of a random body stands where products of matrices put it, in double") {
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= rounds(400); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Body body = random_joints(random, 12);
    std::vector<double> state(body.variable_count);
    for (double& x : state) x = random.chance(0.1) ? 0 : random.uniform(-4, 4);
    std::vector<double> scratch(7 * kLanes * body.links.size() + 8);
    double* const aligned = scratch.data() + (8 - reinterpret_cast<std::uintptr_t>(scratch.data()) / 8 % 8) % 8;
    std::vector<float> poses(7 * body.links.size()), block(kLanes * poses.size());
    std::vector<kernel::RawPoses> links(body.links.size());
    const KinematicsDesc desc = body.desc();
    kernel::find_kernels(Isa::kScalar)
        ->pose_states({desc, state.data(), 1, aligned, block.data(), links.data(), poses.data()});
    const std::vector<Matrix> right = judge(body, state.data());
    for (std::size_t l = 0; l < body.links.size(); ++l) {
      const double* const at = aligned + 7 * l;
      worst = std::max(worst, difference({at[0], at[1], at[2], at[3]}, {at[4], at[5], at[6]}, right[l]));
      for (std::size_t c = 0; c < 7; ++c) {
        CHECK(poses[7 * l + c] == static_cast<float>(at[c]));
        for (const float lane : links[l].raw[c]) CHECK(lane == poses[7 * l + c]);
      }
    }
  }
  CAPTURE(worst);
  CHECK(worst < 2e-14);
  CHECK(worst > 1e-16);
}

}  // namespace cab::tests
