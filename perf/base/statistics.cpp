#include "perf/base/statistics.h"

#include <algorithm>
#include <utility>

namespace cab::perf {

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values[values.size() / 2], values.front(), values.back()};
}

double median(std::vector<double> values) { return spread_of(std::move(values)).median; }

}  // namespace cab::perf
