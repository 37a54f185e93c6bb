// Random numbers that are the same on every platform's standard library.
#pragma once

#include <cmath>
#include <cstdint>

#include "perf/oracle/vec3.h"

namespace cab::oracle {

// splitmix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  // 64 uniform bits.
  std::uint64_t next_u64() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  // An integer in 0..count-1, count > 0 and far below 2^32.
  unsigned index(unsigned count) { return static_cast<unsigned>(((next_u64() >> 32) * count) >> 32); }

  // True with the given probability.
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }

  // +1 or -1.
  double sign() { return chance(0.5) ? 1.0 : -1.0; }

  // Uniform in [a, b).
  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(next_u64() >> 11) * 0x1p-53); }

  // Uniform in the logarithm, a and b positive.
  double log_uniform(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }

  // Mean 0, deviation 1 (Box and Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(6.283185307179586 * uniform(0.0, 1.0));
  }

  // Uniform on the sphere.
  Vec3<double> unit_vector() {
    for (;;) {
      const Vec3<double> a{{normal(), normal(), normal()}};
      if (norm(a) > 1e-6) return normalized(a);
    }
  }

  // Three orthonormal right-handed axes, axis[k][component], uniform over the rotations.
  void rotation(double (&axis)[3][3]) { rotation_about(unit_vector(), 0, axis); }

  // Three orthonormal right-handed axes of which axis k is the given unit vector.
  void rotation_about(const Vec3<double>& direction, unsigned k, double (&axis)[3][3]) {
    Vec3<double> side{};
    do { side = cross(direction, unit_vector()); } while (norm(side) < 1e-3);
    side = normalized(side);
    store(direction, axis[k]);
    store(side, axis[(k + 1) % 3]);
    store(cross(direction, side), axis[(k + 2) % 3]);
  }

 private:
  std::uint64_t state_;
};

}  // namespace cab::oracle
