// Float frames: rounding and drift.
#include "perf/oracle/float_frame.h"

namespace cab::oracle {

void set_frame(const double (&axis)[3][3], OracleBox<float>& box) {
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t c = 0; c < 3; ++c) box.axis[k][c] = static_cast<float>(axis[k][c]);
  }
}

void drift_frame(Random& random, OracleBox<float>& box) {
  const OracleBox<float> straight = box;
  do {
    const double amplitude = random.uniform(2.0, 8.0) * kFloatRoundoff;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double noise = random.uniform(-amplitude, amplitude);
        box.axis[k][c] = static_cast<float>(straight.axis[k][c] + noise);
      }
    }
  } while (
      !(orthonormality_error(box) <= kOrthonormalityLimit && orthonormality_error(box) >= kOrthonormalityLimit / 4));
}

}  // namespace cab::oracle
