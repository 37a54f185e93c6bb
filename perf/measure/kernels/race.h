// Contenders of `cab kernels`, which are timed in turns, and the random numbers that make their work.
#pragma once

#include "perf/base/report.h"
#include "scenes/random.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cab::perf {

// Draws of floats. Every machine measures the same boxes.
struct Random : scenes::Random {
  using scenes::Random::Random;
  float uniform(float low, float high) { return static_cast<float>(scenes::Random::uniform(low, high)); }
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
