// Float frames: rounding and drift.
#include "perf/judge/oracle/float_frame.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace cab::oracle {

double frame_error(const OracleBox<float>& box) {
  // Products of float components are exact in double to far below an ulp of float.
  const OracleBox<double> exact = convert<double>(box);
  const Vec3<double> a0 = axis_of(exact, 0), a1 = axis_of(exact, 1), a2 = axis_of(exact, 2);
  const Vec3<double> e = a2 - cross(a0, a1);
  const double errors[] = {magnitude(dot(a0, a0) - 1) / kSquareLimit, magnitude(dot(a1, a1) - 1) / kSquareLimit,
                           magnitude(dot(a0, a1)) / kCosineLimit,     magnitude(dot(e, a0)) / kCrossLimit,
                           magnitude(dot(e, a1)) / kCrossLimit,       magnitude(dot(e, a2)) / kCrossLengthLimit};
  for (const double error : errors)
    if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
  return *std::max_element(std::begin(errors), std::end(errors));
}

void set_frame(const double (&axis)[3][3], OracleBox<float>& box) {
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[k][c]);
  }
}

void drift_frame(Random& random, OracleBox<float>& box) {
  const OracleBox<double> straight = convert<double>(box);
  do {
    const double amplitude = random.uniform(1.0, 6.0) * kFloatRoundoff;
    OracleBox<double> drifted = straight;
    for (std::size_t k = 0; k < 2; ++k) {
      const double length = 1 + random.uniform(-4.5, 4.5) * kFloatRoundoff;
      for (double& v : drifted.axis[k]) v = length * v + random.uniform(-amplitude, amplitude);
    }
    set_frame(drifted.axis, box);
    Vec3<double> last = cross(convert<double>(axis_of(box, 0)), convert<double>(axis_of(box, 1)));
    for (double& v : last.v) v += random.uniform(-2.0, 2.0) * kFloatRoundoff;
    store(convert<float>(last), box.axis[2]);
  } while (!(frame_error(box) <= 1 && frame_error(box) >= 0.25));
}

}  // namespace cab::oracle
