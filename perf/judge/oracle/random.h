// Random draws for the judges, in addition to those that scenes use.
#pragma once

#include <cmath>

#include "perf/judge/oracle/vec3.h"
#include "scenes/random.h"

namespace cab::oracle {

class Random : public scenes::Random {
 public:
  using scenes::Random::Random;

  // True with the given probability.
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }

  // +1 or -1.
  double sign() { return chance(0.5) ? 1.0 : -1.0; }

  // Uniform in the logarithm, a and b positive.
  double log_uniform(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }

  // Uniform on the sphere, by no formula that scenes use.
  Vec3<double> unit_vector() {
    for (;;) {
      const Vec3<double> a{{normal(), normal(), normal()}};
      if (norm(a) > 1e-6) return normalized(a);
    }
  }

  // Three orthonormal right-handed axes, axis[k][component], uniform over the rotations.
  void rotation(double (&axis)[3][3]) { rotation_about(unit_vector(), 0, axis); }

  // Three orthonormal right-handed axes. Axis k is the given unit vector.
  void rotation_about(const Vec3<double>& direction, unsigned k, double (&axis)[3][3]) {
    Vec3<double> side{};
    do { side = cross(direction, unit_vector()); } while (norm(side) < 1e-3);
    side = normalized(side);
    store(direction, axis[k]);
    store(side, axis[(k + 1) % 3]);
    store(cross(direction, side), axis[(k + 2) % 3]);
  }
};

}  // namespace cab::oracle
