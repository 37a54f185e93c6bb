// Random draws for scenes. They are the same with every standard library.
#pragma once

#include "scenes/vec3d.h"

#include <cmath>
#include <cstdint>

namespace cab::scenes {

// splitmix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  // The stream of random numbers of one object among many. The streams of different objects are independent, so the
  // draws of an object do not depend on the number of objects.
  static Random of(std::uint64_t seed, std::uint64_t index) {
    return Random(Random(Random(seed).next_u64() + index).next_u64());
  }

  // 64 uniform bits.
  std::uint64_t next_u64() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  // An integer in 0 .. count - 1, count > 0 and far below 2^32.
  std::uint32_t index(std::uint32_t count) {
    return static_cast<std::uint32_t>(((next_u64() >> 32) * std::uint64_t{count}) >> 32);
  }

  // Uniform in [a, b).
  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(next_u64() >> 11) * 0x1p-53); }

  // An angle, uniform in [0, 2 pi).
  double angle() { return uniform(0, 6.283185307179586); }

  // Normal with mean 0 and deviation 1 (Box and Muller 1958, the cosine of the pair).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0, 1)));
    return radius * std::cos(angle());
  }

  // Uniform on the sphere: heights on it are uniform (Archimedes).
  Vec3 unit_vector() {
    const double z = uniform(-1, 1), radius = std::sqrt(1 - z * z), turn = angle();
    return {radius * std::cos(turn), radius * std::sin(turn), z};
  }

 private:
  std::uint64_t state_;
};

}  // namespace cab::scenes
