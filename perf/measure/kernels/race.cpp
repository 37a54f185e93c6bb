#include "perf/measure/kernels/race.h"

#include "perf/base/statistics.h"

#include <chrono>

namespace cab::perf {

void race(std::vector<Contender>& contenders, std::uint32_t rounds, ProgressBar& bar) {
  for (std::uint32_t r = 0; r <= rounds; ++r) {
    for (Contender& contender : contenders) {
      const auto start = std::chrono::steady_clock::now();
      contender.answer = contender.round();
      const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
      if (r > 0) contender.nanoseconds.push_back(took.count() / static_cast<double>(contender.work));
    }
    bar.advance(1);
  }
}

double times_faster(const Contender& a, const Contender& b) { return ratio_of(b.nanoseconds, a.nanoseconds).median; }

}  // namespace cab::perf
