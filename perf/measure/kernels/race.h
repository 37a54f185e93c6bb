// Contenders of `cab kernels`, which are timed in turns, and the random numbers that make their work.
#pragma once

#include "perf/base/report.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cab::perf {

// splitmix64, so that every machine measures the same boxes.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  float uniform(float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(static_cast<double>(next() >> 11) * 0x1p-53);
  }

 private:
  std::uint64_t state_;
};

// Code to time: one round of `work` operations. answer is the result of the round. It keeps the compiler from leaving
// work out, and lets contenders be compared.
struct Contender {
  std::string name;
  std::uint64_t work;
  std::function<std::uint64_t()> round;
  std::vector<double> nanoseconds = {};  // per operation, of each round
  std::uint64_t answer = 0;
};

// Runs every contender once per round, in turns, after a round that is not counted.
void race(std::vector<Contender>& contenders, std::uint32_t rounds, ProgressBar& bar);

// The median over rounds of b's time over a's.
double times_faster(const Contender& a, const Contender& b);

}  // namespace cab::perf
