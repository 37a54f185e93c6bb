// Nearly touching pairs. Support features are brought together along an axis, then one half extent closes the gap.
#include "perf/judge/oracle/touching_pairs.h"

#include <cmath>

#include "perf/judge/oracle/float_frame.h"
#include "perf/judge/oracle/overlap_exact.h"

namespace cab::oracle {
namespace {

// Cosine below which a box's axis counts as lying in the contact plane, so that the contact may slide along it.
constexpr double kTangent = 1e-5;

// How often the gap is closed. Each pass leaves the rounding of one half extent.
constexpr int kClosingPasses = 3;

// Rounds a double vector into a float one.
void store_rounded(const Vec3<double>& from, float (&to)[3]) { store(convert<float>(from), to); }

// Random axes, half of the time drifting.
void set_random_frame(Random& random, OracleBox<float>& box) {
  double axis[3][3];
  random.rotation(axis);
  set_frame(axis, box);
  if (random.chance(0.5)) drift_frame(random, box);
}

// Sets three half extents, log-uniform between least and most.
void set_halves(Random& random, double least, double most, OracleBox<float>& box) {
  for (float& half : box.half) half = static_cast<float>(random.log_uniform(least, most));
}

// Sets count of the halves, chosen at random, to zero.
void flatten(Random& random, unsigned count, OracleBox<float>& box) {
  const unsigned first = random.index(3);
  for (unsigned i = 0; i < count; ++i) box.half[(first + i) % 3] = 0.0f;
}

// Gives a box another's frame rotated by an angle in radians about its axis k, which is kept bit for bit.
void set_rotated_frame(const OracleBox<float>& from, std::size_t k, double angle, OracleBox<float>& box) {
  const Vec3<double> side1 = convert<double>(axis_of(from, (k + 1) % 3));
  const Vec3<double> side2 = convert<double>(axis_of(from, (k + 2) % 3));
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  store(axis_of(from, k), box.axis[k]);
  store_rounded(c * side1 + s * side2, box.axis[(k + 1) % 3]);
  store_rounded(c * side2 - s * side1, box.axis[(k + 2) % 3]);
}

// Rotates a frame by an angle in radians about a random direction (Rodrigues).
void tilt_frame(Random& random, double angle, OracleBox<float>& box) {
  const Vec3<double> about = random.unit_vector();
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<double> axis = convert<double>(axis_of(box, k));
    const double along = (1.0 - c) * dot(about, axis);
    store_rounded(c * axis + s * cross(about, axis) + along * about, box.axis[k]);
  }
}

// Halves and frames of both boxes for a regime; centres and origins stay zero.
BoxPair shape_pair(Random& random, TouchRegime regime) {
  BoxPair pair{};
  set_random_frame(random, pair.a);
  set_random_frame(random, pair.b);
  const double size = random.log_uniform(1e-3, 1e3);
  set_halves(random, 0.1 * size, size, pair.a);
  set_halves(random, 0.1 * size, size, pair.b);
  switch (regime) {
    case TouchRegime::kHighAspect: {
      const double aspect = random.log_uniform(1e2, 1e6);
      set_halves(random, size / aspect, size, pair.a);
      set_halves(random, size / aspect, size, pair.b);
      pair.a.half[random.index(3)] = static_cast<float>(size);
      pair.a.half[random.index(3)] = static_cast<float>(size / aspect);
      break;
    }
    case TouchRegime::kPlates:
      flatten(random, 1, pair.a);
      flatten(random, random.index(2), pair.b);
      break;
    case TouchRegime::kLines:
      flatten(random, 2, pair.a);
      flatten(random, random.index(2), pair.b);
      break;
    case TouchRegime::kPoints: flatten(random, 3, pair.a); break;
    case TouchRegime::kTinyHuge: {
      const double tiny = size * random.log_uniform(1e-6, 1e-2);
      set_halves(random, 0.1 * tiny, tiny, random.chance(0.5) ? pair.a : pair.b);
      break;
    }
    case TouchRegime::kParallelEdges:
      set_rotated_frame(pair.a, random.index(3), random.chance(0.5) ? 0.0 : random.uniform(0.0, 3.0), pair.b);
      break;
    case TouchRegime::kNearParallelEdges:
      pair.b = pair.a;
      tilt_frame(random, random.log_uniform(1e-8, 1e-2), pair.b);
      set_halves(random, 0.1 * size, size, pair.b);
      break;
    case TouchRegime::kExtremeScale: {
      const double extreme = random.log_uniform(1e-30, 1e18);
      set_halves(random, 0.1 * extreme, extreme, pair.a);
      set_halves(random, 0.1 * extreme, extreme, pair.b);
      break;
    }
    case TouchRegime::kOrdinary:
    case TouchRegime::kFarCenters:
    case TouchRegime::kFarOrigins:
    case TouchRegime::kOneAxis: break;
  }
  return pair;
}

// Where the boxes stand: A's centre, and the origins, both in metres.
void place_pair(Random& random, TouchRegime regime, BoxPair& pair) {
  const double size = half_sum(convert<double>(pair.a)) + half_sum(convert<double>(pair.b));
  double out = 0.0;
  if (regime == TouchRegime::kFarCenters) out = size * random.log_uniform(10.0, 1e4);
  if (regime == TouchRegime::kFarOrigins) out = random.uniform(0.0, 2.0);
  store_rounded(out * random.unit_vector(), pair.a.center);
  if (regime != TouchRegime::kFarOrigins) return;
  const Vec3<double> origin = random.log_uniform(1e5, 1e7) * random.unit_vector();
  store(origin, pair.origin_a);
  store(origin + random.uniform(0.0, 4.0) * random.unit_vector(), pair.origin_b);
}

// A unit direction along one of the 15 axes, chosen at random; A's first face normal where the axis vanishes.
Vec3<double> contact_direction(Random& random, const BoxPair& pair) {
  const unsigned k = random.index(kSeparatingAxisCount);
  const OracleBox<float>& box = k < 3 ? pair.a : pair.b;
  Vec3<double> one = convert<double>(axis_of(box, (k + 1) % 3));
  Vec3<double> other = convert<double>(axis_of(box, (k + 2) % 3));
  if (k >= 6) {
    one = convert<double>(axis_of(pair.a, (k - 6) / 3));
    other = convert<double>(axis_of(pair.b, (k - 6) % 3));
  }
  const Vec3<double> normal = cross(one, other);
  if (norm(normal) > 1e-12) return random.sign() * normalized(normal);
  return convert<double>(axis_of(pair.a, 0));
}

// A point of the box, relative to its centre, that is farthest along a direction. If a face or an edge is farthest, the
// point is anywhere on it.
Vec3<double> support_point(Random& random, const OracleBox<float>& box, const Vec3<double>& direction) {
  Vec3<double> point{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<double> axis = convert<double>(axis_of(box, k));
    const double along = dot(axis, direction);
    const double slide = random.uniform(-1.0, 1.0);
    const double x = magnitude(along) < kTangent ? slide : (along < 0.0 ? -1.0 : 1.0);
    point = point + (x * static_cast<double>(box.half[k])) * axis;
  }
  return point;
}

// Puts B's centre so that support points of both boxes meet along a direction.
void bring_together(Random& random, const Vec3<double>& direction, BoxPair& pair) {
  const Vec3<double> from_a =
      support_point(random, pair.a, direction) - support_point(random, pair.b, -1.0 * direction);
  const Vec3<double> shift = to_vec3(pair.origin_b) - to_vec3(pair.origin_a);
  store_rounded(convert<double>(center_of(pair.a)) + from_a - shift, pair.b.center);
}

// The vector of axis k, of unit length.
Vec3<double> axis_direction(const BoxPair& pair, std::size_t k) {
  const OracleBox<double> a = convert<double>(pair.a);
  const OracleBox<double> b = convert<double>(pair.b);
  if (k >= 6) return normalized(cross(axis_of(a, (k - 6) / 3), axis_of(b, (k - 6) % 3)));
  const OracleBox<double>& box = k < 3 ? a : b;
  return normalized(cross(axis_of(box, (k + 1) % 3), axis_of(box, (k + 2) % 3)));
}

// Makes the largest gap equal to `wanted`, in metres, by changing the half extent that matters most on its axis.
void close_gap(double wanted, BoxPair& pair) {
  const AxisGaps gaps =
      axis_gaps(convert<double>(pair.a), convert<double>(pair.b), convert<double>(exact_offset(pair)));
  std::size_t widest = 0;
  for (std::size_t k = 1; k < kSeparatingAxisCount; ++k) {
    if (gaps[k] > gaps[widest]) widest = k;
  }
  const Vec3<double> direction = axis_direction(pair, widest);
  const double growth = gaps[widest] - wanted;
  float* half = nullptr;
  double weight = 0.0;
  double most = 0.0;
  for (OracleBox<float>* box : {&pair.a, &pair.b}) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double along = magnitude(dot(convert<double>(axis_of(*box, k)), direction));
      const double share = along * static_cast<double>(box->half[k]);
      if (!(share > most)) continue;
      most = share;
      weight = along;
      half = &box->half[k];
    }
  }
  if (half == nullptr || most < 2.0 * magnitude(growth)) return;
  *half = static_cast<float>(static_cast<double>(*half) + growth / weight);
}

// Segments and points that meet exactly: frames along the coordinate axes and numbers of few bits.
BoxPair exactly_touching_pair(Random& random, bool a_is_point) {
  BoxPair pair{};
  const unsigned along = random.index(3);
  const unsigned along_b = random.index(3);
  for (std::size_t k = 0; k < 3; ++k) {
    pair.a.axis[k][k] = pair.b.axis[k][k] = 1.0f;
    pair.a.center[k] = static_cast<float>(random.index(64)) - 32.0f;
    pair.b.center[k] = pair.a.center[k];
  }
  pair.a.half[along] = a_is_point ? 0.0f : static_cast<float>(1 + random.index(16));
  pair.b.half[along_b] = static_cast<float>(random.index(16));
  const float reach = pair.b.half[along_b];
  pair.b.center[along_b] += random.chance(0.5) ? reach : -reach;
  pair.b.center[along] += random.chance(0.5) ? pair.a.half[along] : -pair.a.half[along];
  return pair;
}

// The half extents of the poses in metres. All differ, so that a mix-up of indices shows.
constexpr float kPoseHalves[2][3] = {{1.0f, 0.875f, 1.125f}, {0.75f, 0.8125f, 0.6875f}};

// The gap between the boxes of the poses, over Sa + Sb.
constexpr double kPoseGap = 0.03;

// The farthest point of a box along a direction, relative to its centre. If a face or an edge is farthest, the point is
// its middle.
Vec3<double> middle_support(const OracleBox<double>& box, const Vec3<double>& direction) {
  Vec3<double> point{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double along = dot(axis_of(box, k), direction);
    if (magnitude(along) < kTangent) continue;
    point = point + (along < 0.0 ? -box.half[k] : box.half[k]) * axis_of(box, k);
  }
  return point;
}

// Gives B a frame whose three face normals have equal angles with a direction, so that a corner points at A.
void aim_corner(Random& random, const Vec3<double>& direction, OracleBox<double>& box) {
  double axis[3][3];
  random.rotation_about(direction, 0, axis);
  const Vec3<double> side1 = to_vec3(axis[1]);
  const Vec3<double> side2 = to_vec3(axis[2]);
  for (std::size_t k = 0; k < 3; ++k) {
    const double turn = 2.0943951023931953 * static_cast<double>(k);
    const Vec3<double> side = std::cos(turn) * side1 + std::sin(turn) * side2;
    store(std::sqrt(1.0 / 3.0) * direction + std::sqrt(2.0 / 3.0) * side, box.axis[k]);
  }
}

// Gives B a frame whose edge j is at a right angle to A's edge i. Both are at right angles to the returned direction.
Vec3<double> cross_edges(const OracleBox<double>& a, std::size_t i, std::size_t j, OracleBox<double>& b) {
  const Vec3<double> edge = axis_of(a, i);
  const Vec3<double> direction = normalized(axis_of(a, (i + 1) % 3) + axis_of(a, (i + 2) % 3));
  store(cross(direction, edge), b.axis[j]);
  store(normalized(direction + edge), b.axis[(j + 1) % 3]);
  store(normalized(edge - direction), b.axis[(j + 2) % 3]);
  return direction;
}

// Gives B a frame and a centre such that axis k in 0..14 alone separates the two, by gap in their unit. A has a frame
// and a centre, both have halves that differ little.
BoxPair pose_about_axis(Random& random, std::size_t k, double gap, OracleBox<double> a, OracleBox<double> b) {
  Vec3<double> direction = axis_of(a, k % 3);
  if (k < 6) {
    aim_corner(random, direction, b);
  } else {
    direction = cross_edges(a, (k - 6) / 3, (k - 6) % 3, b);
  }
  const Vec3<double> offset = middle_support(a, direction) + gap * direction - middle_support(b, -1.0 * direction);
  store(center_of(a) + offset, b.center);
  const bool swapped = k >= 3 && k < 6;
  BoxPair pair{};
  pair.a = convert<float>(swapped ? b : a);
  pair.b = convert<float>(swapped ? a : b);
  return pair;
}

// Two boxes of any size and place that touch where one axis, chosen at random, decides.
BoxPair one_axis_pair(Random& random) {
  const double size = random.log_uniform(1e-3, 1e3);
  OracleBox<double> a{}, b{};
  random.rotation(a.axis);
  for (std::size_t i = 0; i < 3; ++i) {
    a.center[i] = size * random.uniform(-1.0, 1.0);
    a.half[i] = size * static_cast<double>(kPoseHalves[0][i]) * random.uniform(0.95, 1.05);
    b.half[i] = size * static_cast<double>(kPoseHalves[1][i]) * random.uniform(0.95, 1.05);
  }
  return pose_about_axis(random, random.index(kSeparatingAxisCount), 0.0, a, b);
}

}  // namespace

BoxPair separating_axis_pose(std::size_t k) {
  OracleBox<double> a{};
  OracleBox<double> b{};
  Random random(15);
  random.rotation(a.axis);
  store(Vec3<double>{{0.25, -0.5, 1.5}}, a.center);
  for (std::size_t i = 0; i < 3; ++i) {
    a.half[i] = static_cast<double>(kPoseHalves[0][i]);
    b.half[i] = static_cast<double>(kPoseHalves[1][i]);
  }
  Random turn(7);
  return pose_about_axis(turn, k, kPoseGap * (half_sum(a) + half_sum(b)), a, b);
}

Vec3<Quad> exact_offset(const BoxPair& pair) {
  const Vec3<Quad> origins = convert<Quad>(to_vec3(pair.origin_b)) - convert<Quad>(to_vec3(pair.origin_a));
  return origins + (convert<Quad>(center_of(pair.b)) - convert<Quad>(center_of(pair.a)));
}

BoxPair near_touching_pair(Random& random, TouchRegime regime, double gap_ulps) {
  if (regime == TouchRegime::kLines && random.chance(0.2)) { return exactly_touching_pair(random, false); }
  if (regime == TouchRegime::kPoints && random.chance(0.3)) { return exactly_touching_pair(random, true); }
  BoxPair pair{};
  do { pair = shape_pair(random, regime); } while (!(frame_error(pair.a) <= 1 && frame_error(pair.b) <= 1));
  if (regime == TouchRegime::kOneAxis) {
    pair = one_axis_pair(random);
  } else {
    place_pair(random, regime, pair);
    bring_together(random, contact_direction(random, pair), pair);
  }
  for (int pass = 0; pass < kClosingPasses; ++pass) {
    const double size = half_sum(convert<double>(pair.a)) + half_sum(convert<double>(pair.b));
    close_gap(gap_ulps * kFloatRoundoff * size, pair);
  }
  return pair;
}

}  // namespace cab::oracle
